// Draws lines, figures, a grid and names on a canvas. Names do not overlap. A View is the visible
// part of the plane.
//
// Sizes are in pixels. Angles are counter-clockwise. Poses are [x m, y m, yaw rad].

const NAMES = ['paper', 'grid', 'grid-strong', 'ink', 'faint', 'odom', 'local', 'goal', 'truth', 'bad'];
const GAP = 6;                      // [px] between two rows of names
const MIN_SCALE = 4, MAX_SCALE = 5000;    // [px/m]
const NARROWEST = 0.8;              // [m] View.fit() shows at least this width

export const colours = {};

export function readColours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of NAMES) {
    colours[name.replace('-', '_')] = style.getPropertyValue('--' + name).trim();
  }
}

/** Clears a canvas. Returns its size and its context, in which one unit is one CSS pixel. Returns
 *  null while the canvas has no size. */
export function sharp(canvas) {
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width || !height) return null;
  const ratio = Math.min(window.devicePixelRatio || 1, 2);
  const w = Math.round(width * ratio), h = Math.round(height * ratio);
  if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
  const context = canvas.getContext('2d');
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return {context, width, height};
}

/** Returns the pose of c in a. The arguments are the poses of b in a, and of c in b. */
export function compose(a, b) {
  const c = Math.cos(a[2]), s = Math.sin(a[2]);
  return [a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], wrap(a[2] + b[2])];
}

export function inverse(a) {
  const c = Math.cos(a[2]), s = Math.sin(a[2]);
  return [-c * a[0] - s * a[1], s * a[0] - c * a[1], -a[2]];
}

export function wrap(angle) {
  return Math.atan2(Math.sin(angle), Math.cos(angle));
}

export const degrees = (rad) => rad * 180 / Math.PI;
export const radians = (deg) => deg * Math.PI / 180;

/** The middle of the map, and pixels per metre. */
export class View {
  constructor() {
    this.x = 0;
    this.y = 0;
    this.scale = 100;
    this.auto = true;       // does the view follow the robot? false after a zoom or pan
    this.width = 0;
    this.height = 0;
  }

  /** Returns the pixel of a point in the fixed frame. */
  pixel(x, y) {
    const {width, height, scale} = this;
    return [width / 2 + (x - this.x) * scale, height / 2 - (y - this.y) * scale];
  }

  /** Returns the point in the fixed frame at a pixel. */
  point(px, py) {
    const {width, height, scale} = this;
    return [this.x + (px - width / 2) / scale, this.y - (py - height / 2) / scale];
  }

  /** Zoom. The point at the pixel (px, py) stays there. */
  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const [x, y] = this.point(px, py);
    this.scale = Math.max(MIN_SCALE, Math.min(MAX_SCALE, this.scale * factor));
    this.x = x - (px - this.width / 2) / this.scale;
    this.y = y + (py - this.height / 2) / this.scale;
    this.auto = false;
  }

  pan(dx, dy) {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
    this.auto = false;
  }

  /** Show all of the points [[x, y], ...]. */
  fit(points) {
    const box = bounds(points);
    if (!box || !this.width) return;
    const [x0, y0, x1, y1] = box;
    // The buttons lie on the upper edge. A small canvas has no room for wide margins.
    const side = Math.min(64, this.width * 0.15), top = Math.min(96, this.height * 0.3);
    const bottom = Math.min(64, this.height * 0.2);
    const across = this.width - 2 * side, up = this.height - top - bottom;
    const scale = Math.min(
      across / Math.max(x1 - x0, NARROWEST), up / Math.max(y1 - y0, NARROWEST));
    this.scale = Math.max(MIN_SCALE, Math.min(MAX_SCALE, scale));
    this.x = (x0 + x1) / 2;
    this.y = (y0 + y1) / 2 + (top - bottom) / 2 / this.scale;
  }

  /** While `auto` is true, fit the points again if any is outside, or if all of them look small. */
  follow(points) {
    const box = bounds(points);
    if (!this.auto || !box || !this.width) return;
    const [x0, y1] = this.pixel(box[0], box[1]), [x1, y0] = this.pixel(box[2], box[3]);
    const outside = x0 < 24 || y0 < 56 || x1 > this.width - 24 || y1 > this.height - 30;
    const isWide = Math.max(box[2] - box[0], box[3] - box[1]) > NARROWEST;
    const small = x1 - x0 < this.width * 0.4 && y1 - y0 < this.height * 0.4;
    if (outside || (small && isWide)) this.fit(points);
  }
}

/** Returns [least x, least y, most x, most y], or null without points. */
function bounds(points) {
  if (!points.length) return null;
  const x = points.map((point) => point[0]), y = points.map((point) => point[1]);
  return [Math.min(...x), Math.min(...y), Math.max(...x), Math.max(...y)];
}

/** Returns 1, 2 or 5 times a power of ten, at least `value`. */
export function nice(value) {
  const power = Math.pow(10, Math.floor(Math.log10(value)));
  return power * [1, 2, 5, 10].find((step) => step * power >= value * 0.999999);
}

/** Returns the number of digits after the point of multiples of a `nice` step. */
export function digits(step) { return Math.max(0, -Math.floor(Math.log10(step) + 1e-9)); }

/** Draw a line through points [x, y]. The line is broken where a point is null. */
export function stroke(c, colour, points) {
  c.strokeStyle = colour;
  trace(c, points);
  c.stroke();
}

function trace(c, points) {
  c.beginPath();
  points.forEach((point, i) => {
    if (point) c[points[i - 1] ? 'lineTo' : 'moveTo'](point[0], point[1]);
  });
}

/** Draw a filled figure with a rim of this width. */
export function polygon(c, points, colour, rim, width) {
  trace(c, points);
  c.closePath();
  c.fillStyle = colour;
  c.fill();
  c.strokeStyle = rim;
  c.lineWidth = width;
  c.stroke();
}

export function circle(c, x, y, radius, colour) {
  c.strokeStyle = colour;
  c.beginPath();
  c.arc(x, y, radius, 0, 2 * Math.PI);
  c.stroke();
}

export function disc(c, x, y, radius, colour, opacity) {
  c.globalAlpha = opacity;
  c.fillStyle = colour;
  c.beginPath();
  c.arc(x, y, radius, 0, 2 * Math.PI);
  c.fill();
  c.globalAlpha = 1;
}

/** Draw an arrow of this length with a full or open head. Returns the end without the head. */
export function arrow(c, x, y, angle, length, colour, full) {
  const end = [x + length * Math.cos(angle), y - length * Math.sin(angle)];
  const tip = [end[0] + 7 * Math.cos(angle), end[1] - 7 * Math.sin(angle)];
  const [left, right] = [2.5, -2.5].map((turn) => [
    tip[0] + 12 * Math.cos(angle + turn), tip[1] - 12 * Math.sin(angle + turn)]);
  stroke(c, colour, [[x, y], end]);
  c.setLineDash([]);
  c.fillStyle = colour;
  c.lineWidth = 2.5;
  trace(c, [left, tip, right]);
  if (full) c.fill(); else c.stroke();
  return end;
}

export function heading(c, x, y, yaw, size, colour, rim) {
  const at = (angle, r) => [x + r * Math.cos(yaw + angle), y - r * Math.sin(yaw + angle)];
  const points = [
    at(0, size), at(2.5, size * 0.75), at(Math.PI, size * 0.25), at(-2.5, size * 0.75)];
  polygon(c, points, colour, rim, 1);
}

/** Draw a grid over the view `v`. The text `words` names the frame of the numbers. */
export function drawGrid(c, v, words) {
  const step = nice(70 / v.scale);
  const [x0, y1] = v.point(0, 0), [x1, y0] = v.point(v.width, v.height);
  c.lineWidth = 1;
  c.font = '11px system-ui, sans-serif';
  c.fillStyle = colours.faint;
  const text = (value) => (Math.abs(value) < step / 2 ? '0' : value.toFixed(digits(step)));
  for (let i = Math.ceil(x0 / step); i <= x1 / step; i += 1) {
    const px = Math.round(v.pixel(i * step, 0)[0]) + 0.5;
    stroke(c, i === 0 ? colours.grid_strong : colours.grid, [[px, 0], [px, v.height]]);
    c.textAlign = 'center';
    if (px > 40) c.fillText(text(i * step), px, v.height - 4);
  }
  for (let i = Math.ceil(y0 / step); i <= y1 / step; i += 1) {
    const py = Math.round(v.pixel(0, i * step)[1]) + 0.5;
    stroke(c, i === 0 ? colours.grid_strong : colours.grid, [[0, py], [v.width, py]]);
    c.textAlign = 'left';
    if (py > 60 && py < v.height - 24) c.fillText(text(i * step), 4, py - 3);
  }
  c.textAlign = 'right';
  c.fillText(words, v.width - 6, v.height - 18);
}

/** Names beside points of the map. */
export class Labels {
  constructor(context, width, height) {
    this._context = context;
    this._width = width;
    this._height = height;
    this._names = [];         // labels that wait for their place
    this._taken = [];         // rectangles [x0, y0, x1, y1] in which no label may lie
  }

  avoid(x, y, radius) {
    this._taken.push([x - radius, y - radius, x + radius, y + radius]);
  }

  /** Keep labels out of a rectangle [x0, y0, x1, y1]. */
  keep(box) { this._taken.push(box); }

  /** Add a text for the point (x, y). write() writes it when all places to avoid are known. */
  add(text, x, y, colour, {size = 13, away = 10} = {}) {
    this._names.push({text, x, y, colour, size, away});
  }

  write() {
    for (const name of this._names) this._place(name);
  }

  /** Write a text in the first free place around its point. */
  _place({text, x, y, colour, size, away}) {
    const c = this._context;
    c.font = `600 ${size}px system-ui, sans-serif`;
    const w = c.measureText(text).width, h = size;
    for (let ring = 0; ring < 4; ring += 1) {
      const d = away + ring * (h + GAP);
      const places = [[d, -d], [d, d + h], [-d - w, -d], [-d - w, d + h],
                      [-w / 2, d + h], [-w / 2, -d], [d, h / 2], [-d - w, h / 2]];
      for (const [dx, dy] of places) {
        const box = [x + dx - 3, y + dy - h, x + dx + w + 3, y + dy + 4];
        if (!this._free(box)) continue;
        this._taken.push(box);
        this._write(text, x + dx, y + dy, colour);
        return;
      }
    }
  }

  _free(box) {
    const [x0, y0, x1, y1] = box;
    if (x0 < 2 || y0 < 2 || x1 > this._width - 2 || y1 > this._height - 2) return false;
    return !this._taken.some((t) => x0 < t[2] && x1 > t[0] && y0 < t[3] && y1 > t[1]);
  }

  _write(text, x, y, colour) {
    const c = this._context;
    c.textAlign = 'left';
    c.textBaseline = 'alphabetic';
    c.lineJoin = 'round';
    c.lineWidth = 4;
    c.strokeStyle = colours.paper;
    c.strokeText(text, x, y);
    c.fillStyle = colour;
    c.fillText(text, x, y);
  }
}
