// The numbers, words and controls of the robot that the page looks at, and the list of all robots.

import {Labels, circle, colours, drawGrid, heading, sharp} from './drawing.js';
import {$, make, number, setReason, setText} from './page.js';
import {View, degrees, wrap} from './view.js';

const LONG = 60;         // letters
const LATE = 0.5;        // [s] an older message of a sensor is marked

const SHAPES = {
  driving: '\u25b6', reached: '\u2714', waiting: '\u25cf', stopped: '\u25a0', 'gave up': '\u2716',
  '': '\u25cb',
};
const ABSENT = {
  goal: 'no node takes goals', reset: 'no node takes resets', control: 'no node waits for control',
  turn: 'no node turns the robot', pad: 'the node gamepad does not run',
  mouse: 'no node hears the mouse',
};

const PAD = {
  ready: 'ready', connecting: 'connecting: hold still',
  'held back': 'move_to_goal has control: B takes it', 'no node': ABSENT.pad,
  '': 'grip a stick to drive',
};

export function showStatus(p) {
  setText($('state'), p.state || 'state unknown');
  $('state').title = p.state;
  // The bar cuts a long reason off: it is shown in full here.
  $('reason').hidden = (p.state || '').length <= LONG;
  setText($('reason'), p.state || '');
  setText($('phase'), SHAPES[p.phase] ?? SHAPES['']);
  $('state-box').dataset.phase = p.phase || 'none';
  setText($('distance'), p.to_go ? number(p.to_go[0], 3, ' m') : number(null));
  setText($('angle'), p.to_go ? number(p.to_go[1], 1, '\u00b0') : number(null));
  setText($('brief'), p.to_go ? `${$('distance').textContent}  ${$('angle').textContent}` : '');
  setText($('local-pose'), poseText(p.local));
  setText($('odom-pose'), poseText(p.odom));
  setText($('goal-pose'), poseText(p.goal));
  setText($('truth-error'), errorText(p));
  setText($('heading'), number(p.heading_deg, 1, '\u00b0'));
  setText($('command'), p.command
    ? `${number(p.command[0], 2)} m/s ${number(p.command[1], 2)} rad/s` : number(null));
  setText($('holder'), p.holder || 'unknown');
  setText($('driver'), p.driver || 'nobody');
  showAges(p.ages || {});
}

function poseText(pose) {
  if (!pose) return number(null);
  const yaw = number(degrees(pose[2]), 1, '\u00b0');
  return `${number(pose[0], 3)} ${number(pose[1], 3)} ${yaw}`;
}

function errorText(p) {
  if (!p.truth || !p.odom) return number(null);
  const off = Math.hypot(p.truth[0] - p.odom[0], p.truth[1] - p.odom[1]);
  const turned = degrees(wrap(p.truth[2] - p.odom[2]));
  return `${number(off * 1000, 1)} mm ${number(turned, 2, '\u00b0')}`;
}

function showAges(ages) {
  const box = $('ages');
  for (const [name, age] of Object.entries(ages)) {
    let chip = box.querySelector(`[data-name="${CSS.escape(name)}"]`);
    if (!chip) {
      chip = make('span', '');
      chip.dataset.name = name;
      box.append(chip);
    }
    const late = age !== null && age > LATE;
    chip.className = age === null ? 'never' : late ? 'late' : 'fresh';
    const silent = `${late ? '\u25b2 ' : ''}silent for ${(age || 0).toFixed(age < 10 ? 1 : 0)} s`;
    setText(chip, name + ' ' + (age === null ? 'never heard' : age ? silent : 'fresh'));
  }
}

// -- the controls

export function showControls(picture, connected, holder) {
  const can = picture?.can || {};
  const unknown = !connected ? 'not connected' : !picture ? 'no data yet' : '';
  const absent = (kind) => unknown || (can[kind] ? '' : ABSENT[kind]);
  const hasControl = picture?.has_control === true;
  const other = picture?.page === 'other' ? 'another page drives' : '';
  const give = absent('control') || other || (hasControl ? 'move_to_goal has it already' : '');
  const turn = absent('turn') || (hasControl ? 'move_to_goal has control: take it first' : '');
  setReason($('give'), give);
  for (const id of ['turn-left', 'turn-about', 'turn-right']) setReason($(id), turn);
  const drag = picture && !picture.frame ? 'the frame local is not known yet' : '';
  setReason($('goal'), absent('goal'));
  setReason($('reset'), absent('reset'));
  setReason($('tool-goal'), absent('goal') || drag);
  setReason($('tool-reset'), absent('reset') || drag);
  const pad = absent('pad') || other, mouse = absent('mouse') || other;
  // A stop is never disabled: neither "take" nor B.
  for (const id of ['button-a', 'button-y']) setReason($(id), pad);
  inert($('stick-left'), pad);
  inert($('stick-right'), pad);
  inert($('mouse-pad'), mouse);
  // Without a connection the banner says it once for all.
  const words = connected && picture ? join : () => '';
  const keep = holder.hasGranted
    ? 'move_to_goal drives while this page stays open and in sight' : '';
  setText($('drive-hint'), words(
    keep, hasControl ? '' : named('give', give), named('turns', turn)));
  setText($('poses-hint'), words(
    named('goal', absent('goal')), named('reset', absent('reset')), named('drag', drag)));
  const mouseWords = mouse || (holder.holdsMouse ? 'driving' : 'hold to drive');
  setText($('hand-hint'), $('pad').hidden ? mouseWords : pad || padWords(picture, holder));
}

function padWords(picture, holder) {
  if (holder.spent && picture.pad !== 'held back') return 'let go, and grip again';
  if (holder.spent) return PAD['held back'];
  if (holder.phase === 'asking') return 'asking whether this page may drive';
  return PAD[picture.pad] ?? picture.pad;
}

function inert(element, reason) {
  element.setAttribute('aria-disabled', String(Boolean(reason)));
  if (element.title !== reason) element.title = reason;
}

const named = (name, reason) => (reason ? `${name}: ${reason}` : '');
const join = (...texts) => [...new Set(texts.filter(Boolean))].join(' \u00b7 ');

// -- the list

export class Robots {
  constructor(list, canvas, choose) {
    this._list = list;
    this._canvas = canvas;
    this._choose = choose;
    this._cards = new Map();
    this._view = new View();
  }

  /** Cards for these names; those that stay keep the keyboard's focus. */
  names(robots) {
    const names = robots.map((robot) => robot.name);
    if (names.length === this._cards.size && names.every((name) => this._cards.has(name))) return;
    this._cards.clear();
    this._list.replaceChildren(...names.map((name) => this._card(name)));
  }

  show(robots) {
    for (const robot of robots) fill(this._cards.get(robot.name), robot);
    this._draw(robots.filter((robot) => robot.local));
  }

  /** One map of all robots, each in its own frame local: how far they are in the same task. */
  _draw(robots) {
    const sheet = sharp(this._canvas);
    if (!sheet) return;
    const {context: c, width, height} = sheet;
    Object.assign(this._view, {width, height});
    const poses = robots.flatMap(({local, goal}) => [local, goal || local]);
    this._view.follow([[0, 0], ...poses]);
    drawGrid(c, this._view, '[m], each robot in its own frame local');
    const labels = new Labels(c, width, height);
    for (const {goal} of robots) {
      if (goal) circle(c, ...this._view.pixel(goal[0], goal[1]), 13, colours.goal);
    }
    for (const {name, local} of robots) {
      const [px, py] = this._view.pixel(local[0], local[1]);
      heading(c, px, py, local[2], 13, colours.ink, colours.paper);
      labels.avoid(px, py, 9);
      labels.add(name, px, py, colours.ink, {size: 15});
    }
    labels.write();
  }

  _card(name) {
    const item = make('li', ''), button = make('button', 'robot-card');
    button.type = 'button';
    button.id = 'robot-' + name;
    button.append(make('span', 'name', name || 'robot'));
    for (const part of ['distance', 'state', 'holder', 'age']) button.append(make('span', part));
    button.addEventListener('click', () => this._choose(name));
    item.append(button);
    this._cards.set(name, button);
    return item;
  }
}

function fill(card, robot) {
  const late = robot.age === null || robot.age > 1;
  card.dataset.phase = late ? 'silent' : robot.phase || 'none';
  setText(card.querySelector('.state'), robot.state || 'state unknown');
  const distance = robot.distance === null ? '' : robot.distance.toFixed(2) + ' m';
  setText(card.querySelector('.distance'), distance);
  setText(card.querySelector('.holder'), robot.holder || '');
  setText(card.querySelector('.age'), (late ? '\u25b2 ' : '') + ageText(robot.age));
}

function ageText(age) {
  if (!age) return age === null ? 'never heard' : 'data fresh';
  return `silent for ${age.toFixed(1)} s`;
}
