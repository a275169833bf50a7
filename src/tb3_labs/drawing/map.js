// The map shows frames, robot, trails, goal and true pose to scale. Pointers move and zoom the map.

import {
  View, arrow, circle, cleared, colours, compose, drawGrid, heading, inverse, polygon, stroke,
  writeName,
} from './drawing.js';

export const FRAMES = ['odom', 'local'];
const AXIS = 0.35;           // [m] length of a frame's axes
const AXIS_PIXELS = [34, 90];   // [px] an axis is at least and at most so long on the screen
const MIN_SIZE = 13;       // [px] radius of the robot
const MAX_POINTS = 3000;    // a longer trail loses its oldest point
const STEP = 0.004;          // [m] a point that is nearer to the last point is not added to a trail
const JUMP = 0.5;            // [m] if a step is longer, the robot was put elsewhere

function addTo(trail, [x, y]) {
  const last = trail[trail.length - 1];
  const far = last ? Math.hypot(x - last[0], y - last[1]) : 0;
  if (last && far < STEP) return;
  if (far > JUMP) trail.push(null);
  trail.push([x, y]);
  if (trail.length > MAX_POINTS) trail.shift();
}

export class RobotMap {
  constructor(canvas) {
    this.canvas = canvas;
    this.view = new View();
    this.fixed = 'odom';
    this.radius = 0.105;
    this.picture = null;
    /** {frame: [[x, y], ...]}. A null breaks the trail. A live page has no trail in local. */
    this.trails = {odom: [], local: []};
    this.draft = null;         // {pose, words} while a person drags a pose in local
    this._wasSeen = false;     // did the last drawing have a robot?
  }

  /** Show this picture from now on. */
  see(picture) {
    this.picture = picture;
    if (picture.odom) addTo(this.trails.odom, picture.odom);
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
    if (!this.picture) return [];
    const {odom, local, goal, truth} = this.picture;
    const points = [this.shown('odom', odom), this.shown('local', local),
                    this.shown('local', goal), this.shown('odom', truth)];
    for (const frame of FRAMES) {
      const trail = withTrails ? this.trails[frame].filter(Boolean) : [];
      for (const [x, y] of [[0, 0], [AXIS, 0], [0, AXIS], ...trail]) {
        points.push(this.shown(frame, [x, y, 0]));
      }
    }
    return points.filter(Boolean);
  }

  draw() {
    const sheet = cleared(this.canvas);
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
    // Each name lies on another side of its point, so names do not overlap where points coincide.
    this._paths(c);
    for (const frame of FRAMES) this._frame(c, frame);
    this._truth(c);
    this._target(c, this.picture.goal, 'goal');
    this._robot(c);
    if (this.draft) this._target(c, this.draft.pose, this.draft.words);
  }

  _paths(c) {
    for (const frame of FRAMES) {
      const points = this.trails[frame];
      // The parts before the last break are faint. They may belong to an older frame local.
      const lastPartBegin = points.lastIndexOf(null) + 1;
      c.lineWidth = frame === 'odom' ? 2.5 : 2;
      c.setLineDash(frame === 'odom' ? [] : [7, 5]);
      c.lineJoin = 'round';
      c.globalAlpha = 0.4;
      this._path(c, frame, points.slice(0, lastPartBegin));
      c.globalAlpha = 1;
      this._path(c, frame, points.slice(lastPartBegin));
      c.setLineDash([]);
    }
  }

  _path(c, frame, points) {
    stroke(c, colours[frame], points.map((point) => point && this.drawn(frame, [...point, 0])));
  }

  _frame(c, name) {
    const at = this.drawn(name, [0, 0, 0]);
    if (!at) return;
    const [px, py, yaw] = at;
    const isOdom = name === 'odom';
    const colour = colours[name];
    // The axes of local are longer and thinner, so that all axes are visible if both frames coincide.
    const factor = isOdom ? 1 : 1.35;
    const [least, most] = AXIS_PIXELS;
    const length = factor * Math.max(least, Math.min(most, AXIS * this.view.scale));
    for (const [axis, angle] of [['x', yaw], ['y', yaw + Math.PI / 2]]) {
      c.lineWidth = isOdom ? 4 : 2;
      c.setLineDash(isOdom ? [] : [6, 3]);
      arrow(c, px, py, angle, length, colour, axis === 'x');
      // the name lies beside the tip of odom's axis, and beyond the tip of local's axis
      const end = isOdom ? length : length + 17;
      const aside = isOdom ? 13 : 0;
      writeName(c, axis, px + end * Math.cos(angle) + aside * Math.sin(angle),
                py - end * Math.sin(angle) + aside * Math.cos(angle), colour, {});
    }
    // The origin is a square for odom, and a diamond for local.
    const [far, near] = isOdom ? [4, 4] : [7, 0];
    const marker = [[px + near, py - far], [px + far, py + near], [px - near, py + far],
                    [px - far, py - near]];
    const fill = isOdom ? colour : colours.paper;
    polygon(c, marker, fill, colour, 2);
    const across = isOdom ? -1 : 1;
    writeName(c, name, px, py, colour, {across, down: 1, away: 10});
  }

  /** Draw a target in local as a cross of constant size, with its heading. */
  _target(c, target, name) {
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
    arrow(c, px, py, yaw, 40, colour, true);
    const away = Math.max(14, 0.72 * this._robotSize() + 3);    // outside of a robot at the goal
    writeName(c, name, px, py, colour, {across: 1, down: -1, away});
  }

  _truth(c) {
    const at = this.drawn('odom', this.picture.truth);
    if (!at) return;
    const [px, py, yaw] = at;
    const size = this._robotSize();
    const nose = 1.4 * size;
    c.lineWidth = 2;
    c.setLineDash([3, 3]);
    circle(c, px, py, size, colours.truth);
    stroke(c, colours.truth,
           [[px, py], [px + nose * Math.cos(yaw), py - nose * Math.sin(yaw)]]);
    c.setLineDash([]);
    writeName(c, 'true', px, py, colours.truth, {down: 1, away: size + 12});
  }

  _robot(c) {
    const at = this.drawn('odom', this.picture.odom) || this.drawn('local', this.picture.local);
    if (!at) return;
    const [px, py, yaw] = at;
    const size = this._robotSize();
    c.lineWidth = 2;
    circle(c, px, py, size, colours.ink, 0.25);
    heading(c, px, py, yaw, size * 0.85, colours.ink, colours.paper);
    writeName(c, 'robot', px, py, colours.ink, {across: -1, down: -1, away: size * 0.72 + 3});
  }

  /** The radius of the robot [px], which is visible at any scale. */
  _robotSize() { return Math.max(this.radius * this.view.scale, MIN_SIZE); }
}

/** Pans a map by pointers, and zooms the map by a wheel or two fingers. */
export class MapInput {
  constructor(map, redraw) {
    Object.assign(this, {map, redraw});
    this.pointers = new Map();        // {id: [x, y] on the canvas}
    const canvas = map.canvas;
    canvas.addEventListener('pointerdown', (event) => this.down(event));
    canvas.addEventListener('pointermove', (event) => {
      if (this.pointers.has(event.pointerId)) this.move(event);
    });
    for (const type of ['pointerup', 'pointercancel', 'lostpointercapture']) {
      canvas.addEventListener(type, (event) => this.up(event));
    }
    canvas.addEventListener('wheel', (event) => this._wheel(event), {passive: false});
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  }

  down({pointerId, offsetX, offsetY}) {
    this.map.canvas.setPointerCapture(pointerId);
    this.pointers.set(pointerId, [offsetX, offsetY]);
  }

  move({pointerId, offsetX, offsetY}) {
    const {view} = this.map;
    const [oldX, oldY] = this.pointers.get(pointerId);
    const [, other] = [...this.pointers].find(([id]) => id !== pointerId) || [];
    if (other) {
      const [otherX, otherY] = other;
      const span = (x, y) => Math.max(10, Math.hypot(x - otherX, y - otherY));
      view.pan((offsetX - oldX) / 2, (offsetY - oldY) / 2);
      view.zoom(span(offsetX, offsetY) / span(oldX, oldY),
                (offsetX + otherX) / 2, (offsetY + otherY) / 2);
    } else {
      view.pan(offsetX - oldX, offsetY - oldY);
    }
    this.pointers.set(pointerId, [offsetX, offsetY]);
    this.redraw();
  }

  /** Returns whether the pointer was down. */
  up({pointerId}) { return this.pointers.delete(pointerId); }

  _wheel(event) {
    event.preventDefault();
    const turned = Math.max(-120, Math.min(120, event.deltaY));
    this.map.view.zoom(Math.exp(-0.002 * turned), event.offsetX, event.offsetY);
    this.redraw();
  }
}
