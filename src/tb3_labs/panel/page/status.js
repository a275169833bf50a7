// The numbers and words of the page: of its robot now, of the last 60 seconds, and of all robots.

import {
  Labels, View, circle, colours, degrees, drawGrid, heading, nice, sharp, stroke, wrap,
} from './drawing.js';
import {$, make, number, setText} from './page.js';

const LONG = 60;         // letters
const LATE = 0.5;        // [s] an older message of a sensor is marked

const SHAPES = {
  driving: '\u25b6', reached: '\u2714', waiting: '\u25cf', stopped: '\u25a0', 'gave up': '\u2716',
  '': '\u25cb',
};
export function showStatus(p) {
  setText($('state'), p.state || 'state unknown');
  $('state').title = p.state;
  // The bar cuts a long reason off: it is shown in full here.
  $('reason').hidden = p.state.length <= LONG;
  setText($('reason'), p.state);
  setText($('phase'), SHAPES[p.phase]);
  $('state-box').dataset.phase = p.phase || 'none';
  setText($('distance'), number(p.distance, 3, ' m'));
  setText($('angle'), number(p.angle, 1, '\u00b0'));
  setText($('brief'), `${$('distance').textContent}  ${$('angle').textContent}`);
  setText($('local-pose'), poseText(p.local));
  setText($('odom-pose'), poseText(p.odom));
  setText($('goal-pose'), poseText(p.goal));
  setText($('truth-error'), errorText(p));
  setText($('heading'), number(p.heading_deg, 1, '\u00b0'));
  setText($('command'), p.command
    ? `${number(p.command[0], 2)} m/s ${number(p.command[1], 2)} rad/s` : number(null));
  setText($('holder'), p.holder);
  setText($('driver'), p.driver || 'nobody');
  showAges(p.ages);
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
  for (const [i, [name, age]] of Object.entries(ages).entries()) {
    if (i === box.childElementCount) box.append(make('span', ''));
    const chip = box.children[i];
    const late = age !== null && age > LATE;
    chip.className = age === null ? 'never' : late ? 'late' : 'fresh';
    const silent = `${late ? '\u25b2 ' : ''}silent for ${(age || 0).toFixed(age < 10 ? 1 : 0)} s`;
    setText(chip, name + ' ' + (age === null ? 'never heard' : age ? silent : 'fresh'));
  }
}

// -- the last 60 seconds

const SPAN = 60;           // [s]
const GAP = 1;             // [s] a longer silence breaks the curve
const LEAST = {angle: 10, distance: 0.1};           // [degrees], [m] the scale shows at least this
const LEFT = 40, RIGHT = 6, TOP = 6, BOTTOM = 16;   // [px] around the curve
const EVERY = 200;         // [ms] a strip moves by few pixels a second

/** One number over the last 60 seconds. */
export class Strip {
  /** The angle off the final heading [degrees] has 0 in the middle of its scale; the distance to go
   *  [m] has 0 at the lower end. */
  constructor(canvas, isAngle) {
    this._canvas = canvas;
    this._isAngle = isAngle;
    this._drawnAt = -Infinity;
    this.points = [];              // [time, value or null, is it a reset?]
  }

  clear() { this.points = []; }

  add(picture, isReset) {
    const time = picture.now, value = this._isAngle ? picture.angle : picture.distance;
    const last = this.points[this.points.length - 1];
    if (last && time < last[0]) this.clear();        // of a panel on another computer
    if (last && time - last[0] > GAP) this.points.push([time, null, false]);
    this.points.push([time, value, isReset]);
    while (this.points[0][0] < time - SPAN) this.points.shift();
  }

  draw() {
    if (performance.now() - this._drawnAt < EVERY) return;
    this._drawnAt = performance.now();
    const sheet = sharp(this._canvas);
    if (!sheet) return;
    const {context: c, width, height} = sheet;
    const end = this.points.length ? this.points[this.points.length - 1][0] : 0;
    const top = this._top(), bottom = this._isAngle ? -top : 0;
    const x = (time) => width - RIGHT - (end - time) / SPAN * (width - LEFT - RIGHT);
    const y = (value) => TOP + (top - value) / (top - bottom) * (height - TOP - BOTTOM);
    c.font = '11px system-ui, sans-serif';
    this._axes(c, width, height, top, bottom, x, y, end);
    this._resets(c, height, x);
    this._curve(c, x, y);
  }

  _top() {
    const least = this._isAngle ? LEAST.angle : LEAST.distance;
    return nice(Math.max(least, ...this.points.map(([, value]) => Math.abs(value))));
  }

  _axes(c, width, height, top, bottom, x, y, end) {
    const digits = this._isAngle ? 0 : top < 1 ? 2 : 1;
    c.fillStyle = colours.faint;
    c.lineWidth = 1;
    c.textAlign = 'right';
    c.textBaseline = 'middle';
    for (const value of this._isAngle ? [top, 0, bottom] : [top, top / 2, 0]) {
      const py = Math.round(y(value)) + 0.5;
      stroke(c, colours.grid_strong, [[LEFT, py], [width - RIGHT, py]]);
      c.fillText(value.toFixed(value === 0 ? 0 : digits), LEFT - 4, y(value));
    }
    c.textBaseline = 'alphabetic';
    for (let back = 0; back <= SPAN; back += 15) {
      const px = Math.round(x(end - back)) + 0.5;
      stroke(c, colours.grid_strong, [[px, height - BOTTOM], [px, height - BOTTOM + 3]]);
      c.textAlign = back === 0 ? 'right' : back === SPAN ? 'left' : 'center';
      c.fillText(back === 0 ? 'now' : `-${back} s`, px, height - 3);
    }
  }

  _resets(c, height, x) {
    c.setLineDash([2, 3]);
    for (const [time, , isReset] of this.points) {
      if (isReset) stroke(c, colours.ink, [[x(time), TOP], [x(time), height - BOTTOM]]);
    }
    c.setLineDash([]);
  }

  _curve(c, x, y) {
    c.strokeStyle = colours.local;
    c.lineWidth = 2;
    c.lineJoin = 'round';
    c.beginPath();
    let joined = false, before = null;
    for (const [time, value] of this.points) {
      if (value === null) { joined = false; continue; }
      // An angle that passes 180 degrees jumps: no line joins the two values.
      if (this._isAngle && before !== null && Math.abs(value - before) > 180) joined = false;
      if (joined) c.lineTo(x(time), y(value)); else c.moveTo(x(time), y(value));
      joined = true;
      before = value;
    }
    c.stroke();
  }
}

// -- the list

const SILENT = 1;        // [s] an older message of the odometry is marked

export class Robots {
  constructor(list, canvas, choose) {
    this._list = list;
    this._canvas = canvas;
    this._choose = choose;
    this._cards = new Map();
    this._view = new View();
  }

  /** Cards for these names. */
  names(names) {
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
  const age = robot.ages.odom, late = age === null || age > SILENT;
  const silent = age === null ? '\u25b2 never heard' : `\u25b2 silent for ${age.toFixed(1)} s`;
  card.dataset.phase = late ? 'silent' : robot.phase || 'none';
  setText(card.querySelector('.state'), robot.state || 'state unknown');
  setText(card.querySelector('.distance'), number(robot.distance, 2, ' m'));
  setText(card.querySelector('.holder'), robot.holder);
  setText(card.querySelector('.age'), late ? silent : 'data fresh');
}
