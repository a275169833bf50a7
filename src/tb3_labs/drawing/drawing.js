// Draws lines, figures, a grid and names on a canvas. A View is the visible part of the plane.
//
// Sizes are in pixels. Angles are counter-clockwise. Poses are [x m, y m, yaw rad].

const NAMES = ['paper', 'grid', 'grid-strong', 'ink', 'faint', 'odom', 'local', 'goal', 'truth'];
const MIN_SCALE = 4, MAX_SCALE = 5000;    // [px/m]
const NARROWEST = 0.8;              // View.fit() shows at least this width and height [m]

const style = getComputedStyle(document.documentElement);
/** {name: colour} of the colours in colours.css. */
export const colours = Object.fromEntries(
  NAMES.map((name) => [name, style.getPropertyValue('--' + name).trim()]));

/** Clears a canvas. Returns its size and its context. One unit of the context is one CSS pixel.
 *  Returns null while the canvas has no size. */
export function cleared(canvas) {
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width || !height) return null;
  const ratio = Math.min(window.devicePixelRatio || 1, 2);
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const context = canvas.getContext('2d');
  context.scale(ratio, ratio);
  return {context, width, height};
}

/** Returns the pose A_T_C. The arguments are the poses A_T_B and B_T_C. */
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

/** A view has the middle (x, y) of the map, and its `scale` [px/m]. */
export class View {
  constructor() {
    this.x = 0;
    this.y = 0;
    this.scale = 100;
    this.auto = true;       // the view follows the robot until a person zooms or pans
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

  /** Zoom. The point at the pixel (px, py) keeps its place. */
  zoom(factor, px, py) {
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

  /** While `auto` is true, show all of the points again if one of them is outside. */
  follow(points) {
    const box = bounds(points);
    if (!this.auto || !box || !this.width) return;
    const [x0, y1] = this.pixel(box[0], box[1]), [x1, y0] = this.pixel(box[2], box[3]);
    const isOutside = x0 < 24 || y0 < 56 || x1 > this.width - 24 || y1 > this.height - 30;
    if (isOutside) this.fit(points);
  }
}

/** Returns [least x, least y, most x, most y], or null without points. */
function bounds(points) {
  if (!points.length) return null;
  const x = points.map((point) => point[0]), y = points.map((point) => point[1]);
  return [Math.min(...x), Math.min(...y), Math.max(...x), Math.max(...y)];
}

/** Returns the smallest number, not below `value`, that is 1, 2 or 5 times a power of ten. */
export function nice(value) {
  const power = Math.pow(10, Math.floor(Math.log10(value)));
  return power * [1, 2, 5, 10].find((step) => step * power >= value * 0.999999);
}

/** Returns the number of digits that multiples of a `nice` step have after the point. */
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
    if (point && points[i - 1]) c.lineTo(point[0], point[1]);
    else if (point) c.moveTo(point[0], point[1]);
  });
}

export function polygon(c, points, colour, rim, width) {
  trace(c, points);
  c.closePath();
  c.fillStyle = colour;
  c.fill();
  c.strokeStyle = rim;
  c.lineWidth = width;
  c.stroke();
}

/** Draw a circle. Its area is filled with this `opacity`. */
export function circle(c, x, y, radius, colour, opacity = 0) {
  c.beginPath();
  c.arc(x, y, radius, 0, 2 * Math.PI);
  c.strokeStyle = colour;
  c.stroke();
  c.fillStyle = colour;
  c.globalAlpha = opacity;
  c.fill();
  c.globalAlpha = 1;
}

/** Draw an arrow with a full or open head. `length` does not include the head. */
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
}

export function heading(c, x, y, yaw, size, colour, rim) {
  const at = (angle, r) => [x + r * Math.cos(yaw + angle), y - r * Math.sin(yaw + angle)];
  const points = [
    at(0, size), at(2.5, size * 0.75), at(Math.PI, size * 0.25), at(-2.5, size * 0.75)];
  polygon(c, points, colour, rim, 1);
}

/** Draw a grid over the view `v`. The text `words` tells in which frame the numbers are. */
export function drawGrid(c, v, words) {
  const step = nice(70 / v.scale);
  const [x0, y1] = v.point(0, 0), [x1, y0] = v.point(v.width, v.height);
  c.lineWidth = 1;
  c.font = '11px system-ui, sans-serif';
  c.fillStyle = colours.faint;
  const text = (i) => (i === 0 ? '0' : (i * step).toFixed(digits(step)));
  const colour = (i) => (i === 0 ? colours['grid-strong'] : colours.grid);
  for (let i = Math.ceil(x0 / step); i <= x1 / step; i += 1) {
    const px = Math.round(v.pixel(i * step, 0)[0]) + 0.5;
    stroke(c, colour(i), [[px, 0], [px, v.height]]);
    c.textAlign = 'center';
    if (px > 40) c.fillText(text(i), px, v.height - 4);
  }
  for (let i = Math.ceil(y0 / step); i <= y1 / step; i += 1) {
    const py = Math.round(v.pixel(0, i * step)[1]) + 0.5;
    stroke(c, colour(i), [[0, py], [v.width, py]]);
    c.textAlign = 'left';
    if (py > 60 && py < v.height - 24) c.fillText(text(i), 4, py - 3);
  }
  c.textAlign = 'right';
  c.fillText(words, v.width - 6, v.height - 18);
}

const ALIGNS = {'-1': 'right', 0: 'center', 1: 'left'};
const BASELINES = {'-1': 'bottom', 0: 'middle', 1: 'top'};

/** Write a name beside the point (x, y), `away` pixels from it. `across` is -1 for left, 1 for
 *  right, and 0 for the middle. `down` is -1 for above, 1 for below, and 0 for the middle. */
export function writeName(c, name, x, y, colour, {across = 0, down = 0, away = 0}) {
  const at = [x + across * away, y + down * away];
  c.font = '600 13px system-ui, sans-serif';
  c.textAlign = ALIGNS[across];
  c.textBaseline = BASELINES[down];
  c.lineJoin = 'round';
  c.lineWidth = 4;
  c.strokeStyle = colours.paper;
  c.strokeText(name, ...at);
  c.fillStyle = colour;
  c.fillText(name, ...at);
}
