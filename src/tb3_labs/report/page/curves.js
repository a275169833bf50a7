// A track is numbers over time. A curve is an SVG picture of numbers over time. Its x is the time in
// seconds. Its y is the negated number, because y points down in SVG. To show another stretch of
// time, the timeline only changes the view of the picture.

import {nice, radians} from './drawing.js';

const MAX_INTERVALS = 4;    // a curve has at most this number of intervals between grid lines
const MAX_DRAWN = 1e300;    // the difference of larger numbers could be infinite
const ANGLE_STEPS = [1, 2, 5, 10, 30, 45, 90, 180, 360, 720, 1440, 3600, 7200];     // [deg]

/** Returns the index of the last of `times` that is at `time` or before; -1 if all are later. */
export function lastBefore(times, time) {
  let low = 0, high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle + 1; else high = middle;
  }
  return low - 1;
}

/** Numbers over time. The numbers between two times are interpolated. `breaks` are the indices of
 *  the points that no line joins to the previous point. */
export class Track {
  constructor({time, columns, breaks}) {
    Object.assign(this, {time, columns, breaks: new Set(breaks)});
  }

  /** Returns the numbers at a time. In a break, returns the last numbers before the break.
   *  Before the first point, returns null. */
  at(time) {
    const i = lastBefore(this.time, time);
    if (i < 0) return null;
    const j = i + 1;
    if (j >= this.time.length || this.breaks.has(j)) return this.columns.map((c) => c[i]);
    const share = (time - this.time[i]) / (this.time[j] - this.time[i] || 1);
    return this.columns.map((c) => c[i] + share * (c[j] - c[i]));
  }

  pose(time) {
    const numbers = this.at(time);
    return numbers && [numbers[0], numbers[1], radians(numbers[2])];
  }

  /** Returns the points [time, number] of the first column, with a null for each break. */
  points() {
    return this.time.flatMap((time, i) => {
      const point = [time, this.columns[0][i]];
      return this.breaks.has(i) ? [null, point] : [point];
    });
  }

  /** Returns the points [x, y] of the path until a time, with a null for each break. */
  pathUntil(time) {
    const points = [], last = lastBefore(this.time, time);
    for (let i = 0; i <= last; i += 1) {
      if (this.breaks.has(i)) points.push(null);
      points.push([this.columns[0][i], this.columns[1][i]]);
    }
    const now = this.at(time);
    if (now) points.push([now[0], now[1]]);
    return points;
  }
}

/** Returns a new element with these attributes. The `content` is texts and elements. */
export function element(tag, attributes, ...content) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...content);
  return made;
}

/** Returns the SVG path through points [time, value]. The path is broken where a point is null. */
function path(points) {
  return points.map((point, i) => point && `${points[i - 1] ? 'L' : 'M'}${point[0]} ${-point[1]}`)
    .join('');
}

/** Returns the points of a variable whose text changes at these times, with a null while there is no
 *  text. If at most half of the texts are numbers, a point has the index of its text in `levels`.
 *  In `levels`, False is before True, and a state is before all earlier states. */
export function stepsOf(times, texts) {
  const isNumber = (text) => text !== '' && Math.abs(Number(text)) < MAX_DRAWN;
  const known = texts.filter((text) => text !== null);
  let levels = null;
  if (2 * known.filter(isNumber).length <= known.length) {
    levels = [...new Set(known)].reverse();
    if (['True', 'False'].includes(known[0])) levels.sort();
  }
  const points = texts.flatMap((text, i) => {
    if (text === null || !(levels || isNumber(text))) return [null];
    const value = levels ? levels.indexOf(text) : Number(text);
    return [[times[i], value], [times[i + 1], value]];
  });
  return {points, levels};
}

/** Returns a figure of `lines`, which are {CSS class: points}, or null if there are no points. The
 *  scale has at least the range `minRange`. It shows the texts `levels` in place of 0, 1, 2, ... */
export function curve(name, caption, lines, duration, options) {
  const {minRange = 0, hasZero = false, isAngle = false, levels = null} = options;
  const kinds = Object.keys(lines);
  const values = Object.values(lines).flat().filter(Boolean).map((point) => point[1]);
  if (!values.length) return null;
  if (hasZero) values.push(0);
  const lowest = values.reduce((a, b) => Math.min(a, b));
  const highest = values.reduce((a, b) => Math.max(a, b));
  const height = highest - lowest;
  const margin = Math.max(0.06 * height, (minRange - height) / 2) || 1;     // 1 around a constant
  const low = lowest - margin, high = highest + margin, range = high - low;
  let step = nice(range / MAX_INTERVALS);
  if (isAngle) step = ANGLE_STEPS.find((angle) => range <= MAX_INTERVALS * angle) ?? step;
  if (levels) step = 1;
  const numbers = [];
  let grid = '';
  for (let k = Math.ceil(low / step); k * step <= high; k += 1) {
    const text = levels ? levels[k] : String(Number((k * step).toPrecision(6)));
    const style = `top:${100 * (high - k * step) / range}%`;
    numbers.push(element('i', {class: levels ? 'level' : '', style}, text));
    grid += `M0 ${-k * step}H${duration}`;
  }
  const paths = kinds.map((kind) => `<path class="${kind}" d="${path(lines[kind])}"/>`);
  const plot = element('div', {class: 'plot', id: `curve-${name}`});
  plot.innerHTML = `<svg viewBox="0 ${-high} ${duration} ${range}" preserveAspectRatio="none">`
    + `<path class="grid" d="${grid}"/>${paths.join('')}</svg><div class="now"></div>`;
  plot.append(...numbers);
  const title = element('figcaption', {}, caption);
  if (kinds.length > 1) kinds.forEach((kind) => title.append(' ', element('b', {class: kind}, kind)));
  return element('figure', {}, title, plot);
}
