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
function numberText(value, digits, unit = '') {
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
    list.append(...lines.map(makeEntry));
    while (list.childElementCount > MAX_LINES) list.firstElementChild.remove();
    if (isAtEnd) list.scrollTop = list.scrollHeight;
  },
};

function makeEntry(line) {
  const item = make('li', line.level);
  item.append(make('time', '', line.time), ' ', make('b', '', line.node), ' ', line.text);
  return item;
}

// -- the numbers and texts of the robot

export function showStatus(picture) {
  const driverText = picture.driver ? picture.driver + ' drives' : 'state unknown';
  setText($('state'), picture.state || driverText);
  $('state-box').dataset.phase = picture.phase || 'none';
  setText($('distance'), numberText(picture.distance, 3, ' m'));
  setText($('angle'), numberText(picture.angle, 1, '\u00b0'));
  setText($('local-pose'), poseText(picture.local));
  setText($('odom-pose'), poseText(picture.odom));
  setText($('goal-pose'), poseText(picture.goal));
  setText($('truth-error'), errorText(picture));
  setText($('heading'), numberText(picture.heading_deg, 1, '\u00b0'));
  const [linear, angular] = picture.command || [];
  setText($('command'), `${numberText(linear, 2)} m/s ${numberText(angular, 2)} rad/s`);
  const mayDrive = picture.has_control ? 'nobody, but move_to_goal has control' : 'nobody';
  setText($('driver'), picture.driver || mayDrive);
  showAges(picture.ages);
  showInside(picture.inside);
}

function poseText(pose) {
  if (!pose) return numberText(null);
  const [x, y, yaw] = pose;
  return `${numberText(x, 3)} ${numberText(y, 3)} ${numberText(degrees(yaw), 1, '\u00b0')}`;
}

function errorText(picture) {
  if (!picture.truth || !picture.odom) return numberText(null);
  const off = Math.hypot(picture.truth[0] - picture.odom[0], picture.truth[1] - picture.odom[1]);
  const turned = degrees(wrap(picture.truth[2] - picture.odom[2]));
  return `${numberText(off * 1000, 1)} mm ${numberText(turned, 2, '\u00b0')}`;
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
