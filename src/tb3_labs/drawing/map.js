// The map shows frames, robot, trails, goal and true pose to scale. Pointers move and zoom the map.

import {
  Labels, View, arrow, circle, colours, compose, disc, drawGrid, heading, inverse, polygon, sharp,
  stroke,
} from './drawing.js';

export const FRAMES = ['odom', 'local'];
const AXIS = 0.35;           // [m] length of a frame's axes, within AXIS_PIXELS
const AXIS_PIXELS = [34, 90];
const MIN_SIZE = 13;       // [px] radius of the robot
const MAX_POINTS = 2000;    // a trail with more points loses every other point
const STEP = 0.004;          // [m] a nearer point is not added to a trail
const JUMP = 0.5;            // [m] after a longer step the robot was put elsewhere

/** The points of one frame through which the robot drove. */
class Trail {
  constructor() {
    this.points = [];     // [x, y], or null where the line is broken
  }

  add(pose) {
    const last = this.points[this.points.length - 1];
    const far = last ? Math.hypot(pose[0] - last[0], pose[1] - last[1]) : 0;
    if (last && far < STEP) return;
    if (far > JUMP) this.points.push(null);
    this.points.push([pose[0], pose[1]]);
    // Breaks stay, so that thinning never joins two pieces.
    let keep = false;
    if (this.points.length > MAX_POINTS) {
      this.points = this.points.filter((point) => { keep = !keep; return point === null || keep; });
    }
  }
}

export class RobotMap {
  constructor(canvas) {
    this.canvas = canvas;
    this.view = new View();
    this.fixed = 'odom';
    this.radius = 0.105;
    this.picture = null;
    this._trails = {odom: new Trail(), local: new Trail()};
    this.draft = null;         // {pose, words} of a pose in local that a person drags
    this._wasSeen = false;     // was there a robot in the last drawing?
  }

  /** Show this picture from now on. */
  see(picture) {
    this.picture = picture;
    if (picture.odom) this._trails.odom.add(picture.odom);
  }

  /** Show other trails. `points` is {odom, local} with a list of [x, y] for each frame. A live
   *  page has no trail in local. */
  replaceTrails(points) {
    for (const frame of FRAMES) this._trails[frame].points = [...(points[frame] || [])];
  }

  /** From now on `frame` is the fixed frame. The middle of the map stays where it is. */
  fix(frame) {
    if (frame === this.fixed) return;
    const middle = this._converted(frame, this.fixed, [this.view.x, this.view.y, 0]);
    this.fixed = frame;
    if (middle) [this.view.x, this.view.y] = middle;
    if (this.view.auto || !middle) this.fit();
  }

  /** Returns a pose of the frame `from` in the frame `to`, or null while local is unknown. */
  _converted(to, from, pose) {
    if (!pose) return null;
    if (to === from) return pose;
    const frame = this.picture?.frame;
    if (!frame) return null;
    return compose(to === 'odom' ? frame : inverse(frame), pose);
  }

  shown(frame, pose) { return this._converted(this.fixed, frame, pose); }

  /** Returns the point in local at a pixel, or null while local is unknown. */
  localAt(px, py) {
    const point = this.view.point(px, py);
    return this._converted('local', this.fixed, [point[0], point[1], 0]);
  }

  /** Returns the place [x px, y px, yaw] of a pose on the canvas, or null if it is unknown. */
  drawn(frame, pose) {
    const shown = this.shown(frame, pose);
    return shown && [...this.view.pixel(shown[0], shown[1]), shown[2]];
  }

  fit() {
    this.view.fit(this._points(true));
    this.view.auto = true;
  }

  _points(withTrails) {
    const p = this.picture;
    if (!p) return [];
    const points = [this.shown('odom', p.odom), this.shown('local', p.local),
                    this.shown('local', p.goal), this.shown('odom', p.truth)];
    for (const frame of FRAMES) {
      const trail = withTrails ? this._trails[frame].points.filter(Boolean) : [];
      for (const [x, y] of [[0, 0], [AXIS, 0], [0, AXIS], ...trail]) {
        points.push(this.shown(frame, [x, y, 0]));
      }
    }
    return points.filter(Boolean);
  }

  draw() {
    const sheet = sharp(this.canvas);
    if (!sheet) return;
    const {context: c, width, height} = sheet;
    Object.assign(this.view, {width, height});
    if (this.view.auto && !this._wasSeen && this.picture) this.fit();
    this._wasSeen = this.picture !== null;
    if (!this.draft) this.view.follow(this._points(false));
    const isUnknown = this.picture && !this.picture.frame;
    const unknown = isUnknown ? ' \u00b7 the frame local is not known yet' : '';
    drawGrid(c, this.view, `[m] in ${this.fixed}${unknown}`);
    if (!this.picture) return;
    const labels = new Labels(c, width, height);
    labels.keep([0, 0, Math.min(width, 330), 48]);    // the toolbar lies on the map
    this._paths(c);
    this._frames(c, labels);
    this._ghost(c, labels, this.picture.truth, 'true', colours.truth);
    this._target(c, labels, this.picture.goal, 'goal');
    this._robot(c, labels);
    if (this.draft) this._target(c, labels, this.draft.pose, this.draft.words);
    labels.write();
  }

  _paths(c) {
    for (const frame of FRAMES) {
      const points = this._trails[frame].points;
      // The part that was driven in an older frame local is faint, since that frame lay elsewhere.
      const since = points.lastIndexOf(null) + 1;
      c.lineWidth = frame === 'odom' ? 2.5 : 2;
      c.setLineDash(frame === 'odom' ? [] : [7, 5]);
      c.lineJoin = 'round';
      c.globalAlpha = 0.4;
      this._path(c, frame, points.slice(0, since));
      c.globalAlpha = 1;
      this._path(c, frame, points.slice(since));
      c.setLineDash([]);
    }
  }

  _path(c, frame, points) {
    stroke(c, colours[frame], points.map((point) => point && this.drawn(frame, [...point, 0])));
  }

  _frames(c, labels) {
    const origins = FRAMES.map((name) => [name, this.drawn(name, [0, 0, 0])])
      .filter((origin) => origin[1]);
    for (const [, [px, py]] of origins) labels.avoid(px, py, 6);
    for (const [name, at] of origins) this._frame(c, labels, name, at);
  }

  _frame(c, labels, name, [px, py, yaw]) {
    const colour = colours[name];
    // The axes of local are longer and thinner, so that both are visible where frames coincide.
    const factor = name === 'local' ? 1.35 : 1;
    const [least, most] = AXIS_PIXELS;
    const length = factor * Math.max(least, Math.min(most, AXIS * this.view.scale));
    const ends = [['x', yaw], ['y', yaw + Math.PI / 2]].map(([axis, angle]) => {
      c.lineWidth = name === 'odom' ? 4 : 2;
      c.setLineDash(name === 'odom' ? [] : [6, 3]);
      const [ex, ey] = arrow(c, px, py, angle, length, colour, axis === 'x');
      for (const part of [0.2, 0.4, 0.6, 0.8]) {
        labels.avoid(px + part * (ex - px), py + part * (ey - py), 4);
      }
      return [axis, ex, ey];
    });
    for (const [axis, ex, ey] of ends) labels.add(axis, ex, ey, colour, {size: 12, away: 9});
    // a square for odom, a diamond for local
    const [far, near] = name === 'odom' ? [4, 4] : [7, 0];
    const marker = [[px + near, py - far], [px + far, py + near], [px - near, py + far],
                    [px - far, py - near]];
    polygon(c, marker, name === 'odom' ? colour : colours.paper, colour, 2);
    labels.add(name, px, py, colour, {away: 12});
  }

  /** Draw a target in local as a cross of constant size, with its heading. */
  _target(c, labels, target, text) {
    const at = this.drawn('local', target);
    if (!at) return;
    const [px, py, yaw] = at;
    const colour = colours.goal;
    c.lineWidth = 2;
    circle(c, px, py, 13, colour);
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      stroke(c, colour, [[px + 9 * dx, py + 9 * dy], [px + 17 * dx, py + 17 * dy]]);
    }
    c.lineWidth = 3;
    const [ex, ey] = arrow(c, px, py, yaw, 40, colour, true);
    labels.avoid(px, py, 13);
    labels.avoid((px + ex) / 2, (py + ey) / 2, 8);
    labels.avoid(ex, ey, 8);
    labels.add(text, px, py, colour, {away: 18});
  }

  /** Draw the rim of a robot. */
  _ghost(c, labels, place, name, colour) {
    const at = this.drawn('odom', place);
    if (!at) return;
    const [px, py, yaw] = at;
    const size = Math.max(this.radius * this.view.scale, MIN_SIZE);
    c.lineWidth = 2;
    c.setLineDash([3, 3]);
    circle(c, px, py, size, colour);
    const nose = 1.4 * size;
    stroke(c, colour, [[px, py], [px + nose * Math.cos(yaw), py - nose * Math.sin(yaw)]]);
    c.setLineDash([]);
    labels.avoid(px, py, size * 0.72);
    labels.add(name, px, py, colour, {size: 12, away: size * 0.72 + 8});
  }

  _robot(c, labels) {
    const at = this.drawn('odom', this.picture.odom) || this.drawn('local', this.picture.local);
    if (!at) return;
    const [px, py, yaw] = at;
    const size = Math.max(this.radius * this.view.scale, MIN_SIZE);    // seen on any map
    c.lineWidth = 2;
    disc(c, px, py, size, colours.ink, 0.25);
    circle(c, px, py, size, colours.ink);
    heading(c, px, py, yaw, size * 0.85, colours.ink, colours.paper);
    labels.avoid(px, py, size);
    labels.add('robot', px, py, colours.ink, {away: size * 0.72 + 5});
  }
}

/** Pointers that pan a map, and zoom it with a wheel or two fingers. */
export class MapInput {
  /** `redraw()` draws the map again. */
  constructor(map, redraw) {
    Object.assign(this, {map, redraw});
    this.pointers = new Map();        // id -> [x, y] on the canvas
    const canvas = map.canvas;
    canvas.addEventListener('pointerdown', (event) => this.down(event, this.at(event)));
    canvas.addEventListener('pointermove', (event) => {
      if (this.pointers.has(event.pointerId)) this.move(event, this.at(event));
    });
    for (const type of ['pointerup', 'pointercancel', 'lostpointercapture']) {
      canvas.addEventListener(type, (event) => this.up(event));
    }
    canvas.addEventListener('wheel', (event) => this._wheel(event), {passive: false});
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  }

  /** The place of a pointer on the canvas. */
  at(event) {
    const box = this.map.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  down(event, at) {
    this.map.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, at);
  }

  move({pointerId}, at) {
    const {view} = this.map, before = this.pointers.get(pointerId);
    const other = [...this.pointers].find(([id]) => id !== pointerId)?.[1];
    const [dx, dy] = [at[0] - before[0], at[1] - before[1]];
    if (other) {
      const span = ([x, y]) => Math.max(10, Math.hypot(x - other[0], y - other[1]));
      view.pan(dx / 2, dy / 2);
      view.zoom(span(at) / span(before), (at[0] + other[0]) / 2, (at[1] + other[1]) / 2);
    } else {
      view.pan(dx, dy);
    }
    this.pointers.set(pointerId, at);
    this.redraw();
  }

  /** Returns whether the pointer was down. */
  up({pointerId}) { return this.pointers.delete(pointerId); }

  _wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : 1;
    const turned = Math.max(-120, Math.min(120, event.deltaY * lines));
    this.map.view.zoom(Math.exp(-0.002 * turned), ...this.at(event));
    this.redraw();
  }
}
