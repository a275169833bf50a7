// Writes the robot's numbers and texts, messages to the person, and the log into the page.

import {degrees, wrap} from './drawing.js';

const MESSAGE_TIME = 9000;    // [ms] a message is shown for this time
const MAX_LINES = 300;    // most lines of the log
const LATE_AGE = 0.5;    // [s] a sensor is silent if its latest message is older

export const $ = (id) => document.getElementById(id);
export const onClick = (id, action) => $(id).addEventListener('click', action);

/** Write a text only if it changes, so that a screen reader does not repeat the same text. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function setPressed(id, isPressed) {
  $(id).setAttribute('aria-pressed', String(isPressed));
}

function make(tag, className, text = '') {
  const element = document.createElement(tag);
  element.className = className;
  element.textContent = text;
  return element;
}

/** Returns a number as text, with `digits` after the point. An unknown number is shown as a dash,
 *  and -0.0 as 0.0. */
function number(value, digits, unit = '') {
  if (!Number.isFinite(value)) return '\u2013';
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? text.replace('-', '') : text) + unit;
}

// -- messages

let messageTimer = 0;

export function say(text, isWarning = false) {
  const box = $('message');
  box.textContent = text;
  box.className = isWarning ? 'warning shown' : 'shown';
  clearTimeout(messageTimer);
  messageTimer = setTimeout(() => box.classList.remove('shown'), MESSAGE_TIME);
}

export function showBanner(isConnected) {
  document.body.dataset.connected = isConnected ? 'yes' : 'no';
  // The text is written each time, so that a screen reader reads it.
  $('banner').textContent = isConnected ? '' : 'not connected: nothing can be stopped from here';
}

// -- the log

/** The latest log lines of all nodes, the newest line at the bottom. */
export const log = {
  clear() { $('log').replaceChildren(); },

  add(lines) {
    const list = $('log');
    // If the person has scrolled back, the log does not scroll.
    const isAtEnd = list.scrollHeight - list.scrollTop - list.clientHeight < 30;
    list.append(...lines.map(entry));
    while (list.childElementCount > MAX_LINES) list.firstElementChild.remove();
    if (isAtEnd) list.scrollTop = list.scrollHeight;
  },
};

function entry(line) {
  const item = make('li', line.level);
  item.append(make('time', '', line.time), ' ', make('b', '', line.node), ' ', line.text);
  return item;
}

// -- the numbers and texts of the robot

export function showStatus(p) {
  setText($('state'), p.state || (p.driver ? p.driver + ' drives' : 'state unknown'));
  $('state-box').dataset.phase = p.phase || 'none';
  setText($('distance'), number(p.distance, 3, ' m'));
  setText($('angle'), number(p.angle, 1, '\u00b0'));
  setText($('local-pose'), poseText(p.local));
  setText($('odom-pose'), poseText(p.odom));
  setText($('goal-pose'), poseText(p.goal));
  setText($('truth-error'), errorText(p));
  setText($('heading'), number(p.heading_deg, 1, '\u00b0'));
  const [linear, angular] = p.command || [];
  setText($('command'), `${number(linear, 2)} m/s ${number(angular, 2)} rad/s`);
  const mayDrive = p.has_control ? 'nobody, but move_to_goal has control' : 'nobody';
  setText($('driver'), p.driver || mayDrive);
  showAges(p.ages);
  showInside(p.inside);
}

function poseText(pose) {
  if (!pose) return number(null);
  const [x, y, yaw] = pose;
  return `${number(x, 3)} ${number(y, 3)} ${number(degrees(yaw), 1, '\u00b0')}`;
}

function errorText(p) {
  if (!p.truth || !p.odom) return number(null);
  const off = Math.hypot(p.truth[0] - p.odom[0], p.truth[1] - p.odom[1]);
  const turned = degrees(wrap(p.truth[2] - p.odom[2]));
  return `${number(off * 1000, 1)} mm ${number(turned, 2, '\u00b0')}`;
}

// -- the variables of nodes

let shownNodes = '[]';

/** Show the variables of nodes, which watch.py publishes. If no variable has changed, the page is
 *  not changed, so that selected text stays selected. */
function showInside(nodes) {
  const box = $('inside');
  const text = JSON.stringify(nodes);
  if (text === shownNodes) return;
  shownNodes = text;
  box.hidden = !nodes.length;
  document.body.dataset.inside = nodes.length ? 'yes' : 'no';
  box.replaceChildren(...nodes.flatMap(({node, values}) => {
    const list = make('dl', 'variables');
    for (const [name, value] of values) {
      const row = make('div', '');
      row.append(make('dt', '', name), make('dd', '', shortened(value)));
      list.append(row);
    }
    return [make('h2', '', 'inside ' + node), list];
  }));
}

/** Returns a number with three digits after the point. Other texts are not changed. */
function shortened(text) {
  return /^-?\d+\.\d+(e-?\d+)?$/.test(text) ? String(Number(Number(text).toFixed(3))) : text;
}

/** Show the age of each sensor. */
function showAges(ages) {
  $('ages').replaceChildren(...Object.entries(ages).map(([name, age]) => {
    if (age === null) return make('span', 'never', `${name} never heard`);
    if (age <= LATE_AGE) return make('span', 'fresh', `${name} fresh`);
    return make('span', 'late', `${name} \u25b2 silent for ${age.toFixed(1)} s`);
  }));
}
