// A number over the last 60 seconds.

import {colours, nice, sharp, stroke} from './drawing.js';

const SPAN = 60;           // [s]
const MOST = 2400;         // points kept
const GAP = 1;             // [s] a longer silence breaks the curve
const ANGLES = [10, 20, 45, 90, 180];               // [degrees] scales of a strip about an angle
const LEAST = 0.1;         // [m] the scale shows at least this
const LEFT = 40, RIGHT = 6, TOP = 6, BOTTOM = 16;   // [px] around the curve

export class Strip {
  /** `isAngle`: the scale is about 0 [degrees]; else it begins there [m]. */
  constructor(canvas, isAngle) {
    this._canvas = canvas;
    this._isAngle = isAngle;
    this.points = [];              // [time, value or null, is it a reset?]
  }

  clear() { this.points = []; }

  add(time, value, isReset) {
    const last = this.points[this.points.length - 1];
    if (last && time < last[0]) this.clear();        // the clock was set back, or another node's
    if (last && time - last[0] > GAP) this.points.push([time, null, false]);
    this.points.push([time, value, isReset]);
    while (this.points[0][0] < time - SPAN || this.points.length > MOST) this.points.shift();
  }

  draw() {
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
    let most = this._isAngle ? ANGLES[0] : LEAST;
    for (const [, value] of this.points) most = Math.max(most, Math.abs(value));
    return this._isAngle && ANGLES.find((angle) => angle >= most) || nice(most);
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
      // An angle that passes 180 degrees jumps: that is no line across the strip.
      if (this._isAngle && before !== null && Math.abs(value - before) > 180) joined = false;
      if (joined) c.lineTo(x(time), y(value)); else c.moveTo(x(time), y(value));
      joined = true;
      before = value;
    }
    c.stroke();
  }
}
