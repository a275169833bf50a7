// The timeline of a recorded run: the map, the curves, the state and the log at one moment.
//
// Times are seconds since the recording's start. Poses are [x m, y m, yaw rad], tracks in degrees.

import {colours, digits, nice, readColours, sharp, stroke} from './drawing.js';
import {RobotMap} from './map.js';
import {MapInput, degrees, radians, wrap} from './view.js';

const SMALL_STEP = 0.1, STEP = 1;               // [s] by the keys
const LEFT = 46, RIGHT = 8, TOP = 5, BOTTOM = 5;     // [px] around a curve
const TIME_ROW = 16;                            // [px] numbers of time below the last curve
const SHOWN = 0.5;                              // [s] a mark's words are shown at least
const MARK_ROW = 8;                             // [px] of the line for each kind of mark
const KINDS = {                                 // of marks, and their colours
  drive: 'odom', turn: 'local', hand: 'faint', reset: 'ink', start: 'goal', stop: 'bad',
  lost: 'bad', apart: 'truth',
};
const $ = (id) => document.getElementById(id);

/** Index of the last of `times`, which rise, at or before a time; -1: none. */
function lastBefore(times, time) {
  let low = 0, high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle + 1; else high = middle;
  }
  return low - 1;
}

/** Where a canvas of times was clicked: 0 at its left end, 1 at its right end. */
function share(event) {
  const width = event.target.clientWidth - LEFT - RIGHT;
  return Math.max(0, Math.min(1, (event.offsetX - LEFT) / width));
}

/** Numbers over time, straight between two of them; unknown before the first one. */
class Track {
  constructor({time, columns, breaks}) {
    Object.assign(this, {time, columns, breaks: new Set(breaks)});
  }

  before(time) { return lastBefore(this.time, time); }

  /** The numbers at a time; in a break those before it; null before the first. */
  at(time) {
    const i = this.before(time);
    if (i < 0) return null;
    const j = i + 1;
    if (j >= this.time.length || this.breaks.has(j)) return this.columns.map((c) => c[i]);
    const part = (time - this.time[i]) / (this.time[j] - this.time[i] || 1);
    return this.columns.map((c) => c[i] + part * (c[j] - c[i]));
  }

  pose(time) {
    const numbers = this.at(time);
    return numbers && [numbers[0], numbers[1], radians(numbers[2])];
  }

  /** The way until a time: [x, y], or null where it is broken. */
  way(time) {
    const points = [], last = this.before(time);
    for (let i = 0; i <= last; i += 1) {
      if (this.breaks.has(i)) points.push(null);
      points.push([this.columns[0][i], this.columns[1][i]]);
    }
    const now = this.at(time);
    if (now) points.push([now[0], now[1]]);
    return points;
  }
}

/** Curves over time with a cursor: `lines` of {track or steps, column, colour, dash}. The scale
 *  shows at least the range `least`, and begins at `low` if that is given. */
class Curves {
  constructor(canvas, lines, {isAngle = false, low = null, least}) {
    Object.assign(this, {canvas, lines, isAngle, low, least});
  }

  /** Draw the stretch [begin, end] with the cursor at `now`. */
  draw(begin, end, now, labelled) {
    const sheet = sharp(this.canvas);
    if (!sheet) return;
    const {context: c, width, height} = sheet;
    const x = (time) => LEFT + (time - begin) / (end - begin) * (width - LEFT - RIGHT);
    const bottom = height - (labelled ? TIME_ROW : 0);
    this._paint(c, width, bottom, begin, end, x);
    if (labelled) this._times(c, width, height, begin, end, x);
    c.lineWidth = 1.5;
    stroke(c, colours.goal, [[x(now), 0], [x(now), bottom]]);
  }

  _points({track, column, steps}, begin, end) {
    const points = [];
    if (steps) {
      steps.forEach((row, i) => {
        const next = i + 1 < steps.length ? steps[i + 1][0] : end;
        if (next < begin || row[0] > end) return;
        if (row[column] === null) points.push(null);
        else points.push([row[0], row[column]], [next, row[column]]);
      });
      return points;
    }
    const first = Math.max(0, track.before(begin)), last = track.before(end) + 1;
    for (let i = first; i <= last && i < track.time.length; i += 1) {
      if (track.breaks.has(i)) points.push(null);
      points.push([track.time[i], track.columns[column][i]]);
    }
    return points;
  }

  _paint(c, width, height, begin, end, x) {
    const all = this.lines.map((line) => this._points(line, begin, end));
    const values = all.flat().filter(Boolean).map((point) => point[1]);
    let [low, high] = values.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)],
                                    [this.low ?? Infinity, -Infinity]);
    if (low > high) [low, high] = [0, 0];
    const margin = Math.max(0.06 * (high - low), (this.least - (high - low)) / 2);
    [low, high] = [this.low === null ? low - margin : low, high + margin];
    const y = (value) => TOP + (high - value) / (high - low) * (height - TOP - BOTTOM);
    this._axis(c, width, low, high, y);
    c.save();
    c.beginPath();
    c.rect(LEFT, 0, width - LEFT - RIGHT, height);
    c.clip();
    c.lineWidth = 1.8;
    this.lines.forEach(({colour, dash}, i) => {
      c.setLineDash(dash || []);
      stroke(c, colours[colour], all[i].map((point) => point && [x(point[0]), y(point[1])]));
    });
    c.restore();
  }

  _axis(c, width, low, high, y) {
    const angles = [10, 30, 45, 90, 180, 360, 720].find((step) => (high - low) / step <= 3);
    const step = this.isAngle && high - low > 20 && angles || nice((high - low) / 4);
    c.font = '11px system-ui, sans-serif';
    c.fillStyle = colours.faint;
    c.textAlign = 'right';
    c.textBaseline = 'middle';
    c.lineWidth = 1;
    for (let i = Math.ceil(low / step); i * step <= high; i += 1) {
      const py = Math.round(y(i * step)) + 0.5;
      stroke(c, i === 0 ? colours.grid_strong : colours.grid, [[LEFT, py], [width - RIGHT, py]]);
      c.fillText((i * step).toFixed(digits(step)), LEFT - 4, py);
    }
    c.textBaseline = 'alphabetic';
  }

  _times(c, width, height, begin, end, x) {
    const step = nice((end - begin) * 70 / width);
    c.fillStyle = colours.faint;
    c.textAlign = 'center';
    for (let i = Math.ceil(begin / step); i * step <= end; i += 1) {
      const px = Math.min(width - 14, Math.max(LEFT, x(i * step)));
      c.fillText(`${(i * step).toFixed(digits(step))} s`, px, height - 4);
    }
  }
}

/** The whole run as a line: its marks, and the cursor; a click goes there. */
class MarkLine {
  constructor(canvas, marks, duration, go) {
    Object.assign(this, {canvas, marks, duration});
    this.kinds = Object.keys(KINDS).filter((kind) => marks.some((mark) => mark.kind === kind));
    canvas.style.height = `${Math.max(1, this.kinds.length) * MARK_ROW + 6}px`;
    canvas.addEventListener('click', (event) => {
      const near = this._near(event.offsetX, event.offsetY);
      go(near ? near.begin : this.duration * share(event));
    });
    canvas.addEventListener('pointermove', (event) => {
      canvas.title = this._near(event.offsetX, event.offsetY)?.text || '';
    });
  }

  _x(time) { return LEFT + time / this.duration * (this.canvas.clientWidth - LEFT - RIGHT); }

  _near(px, py) {
    const row = Math.floor((py - 3) / MARK_ROW);
    const away = (mark) => Math.max(this._x(mark.begin) - px, px - this._x(mark.end), 0)
      + 2 * Math.abs(this.kinds.indexOf(mark.kind) - row);
    const near = [...this.marks].sort((a, b) => away(a) - away(b))[0];
    return near && away(near) < 8 ? near : null;
  }

  draw(now) {
    const sheet = sharp(this.canvas);
    if (!sheet) return;
    const {context: c, height} = sheet;
    for (const mark of this.marks) {
      const y = 3 + this.kinds.indexOf(mark.kind) * MARK_ROW;
      c.fillStyle = colours[KINDS[mark.kind]];
      c.fillRect(this._x(mark.begin) - 1, y, Math.max(3, this._x(mark.end) - this._x(mark.begin)),
                 MARK_ROW - 2);
    }
    c.lineWidth = 2;
    stroke(c, colours.goal, [[this._x(now), 0], [this._x(now), height]]);
  }
}

class Timeline {
  constructor(run) {
    this.run = run;
    this.now = 0;
    this.playing = false;
    for (const name of ['odom', 'local', 'truth', 'asked', 'mistaken', 'frame', 'heading', 'rate',
                        'speed', 'distance', 'angle']) {
      this[name] = new Track(run[name]);
    }
    [this._commandTimes, this._goalTimes, this._logTimes] = [run.commands, run.goals, run.log]
      .map((rows) => rows.map((row) => row[0]));
    this.map = new RobotMap($('run-map'));
    this.map.radius = run.radius;
    const redraw = () => this.show();
    new MapInput(this.map, {redraw, placed() {}, yawOf: () => 0, toolChanged() {}});
    const commands = (column) => ({steps: run.commands, column, colour: 'local', dash: [5, 3]});
    const again = (column) => (run.again
      ? [{steps: run.again.commands, column, colour: 'truth', dash: [2, 3]}] : []);
    this.again = run.again && new Track(run.again.local);
    for (const name of document.querySelectorAll('#timeline .again')) name.hidden = !run.again;
    const measured = (track) => ({track, column: 0, colour: 'odom'});
    this.curves = [
      new Curves($('curve-heading'), [measured(this.heading)], {isAngle: true, least: 10}),
      new Curves($('curve-distance'), [measured(this.distance)], {low: 0, least: 0.1}),
      new Curves($('curve-angle'), [measured(this.angle)], {isAngle: true, least: 10}),
      new Curves($('curve-linear'), [measured(this.speed), commands(1), ...again(1)], {least: 0.1}),
      new Curves($('curve-angular'), [measured(this.rate), commands(2), ...again(2)], {least: 0.4}),
    ].filter(({canvas, lines}) => {
      const isKnown = lines.some(({track, steps}) => (steps || track.time).length);
      canvas.closest('figure').hidden = !isKnown;
      return isKnown;
    });
    for (const name of document.querySelectorAll('.heading-of')) name.textContent = run.heading_of;
    this.line = new MarkLine($('marks'), run.marks, run.duration, (time) => this.go(time));
    this._controls();
    this._fillLog();
    this._fillMarks();
    this._showAll();
    const {hash} = location;
    const first = this.local.time[0] ?? this.odom.time[0] ?? 0;
    this.go(hash.startsWith('#t=') ? Number(hash.slice(3)) || 0 : first);
  }

  /** The map shows the whole way, and so stands still while the run plays. */
  _showAll() {
    const {now} = this;
    this.go(this.run.duration);
    this.map.fit();
    this.map.view.auto = false;
    this.go(now);
  }

  _controls() {
    $('play').addEventListener('click', () => this.play(!this.playing));
    $('before').addEventListener('click', () => this.jump(-1));
    $('after').addEventListener('click', () => this.jump(1));
    $('time').max = this.run.duration;
    $('time').addEventListener('input', () => this.go(Number($('time').value)));
    $('span').addEventListener('change', () => this.show());
    $('frame').addEventListener('change', () => {
      this.map.fix($('frame').value);
      this._showAll();
    });
    // links and hints may follow this script; a link to the moment that is shown changes no hash
    document.addEventListener('click', (event) => {
      const link = event.target.closest('a[href^="#t="]');
      if (!link) return;
      event.preventDefault();
      this.go(Number(link.hash.slice(3)) || 0);
      $('timeline').scrollIntoView();
      $('timeline').focus();
    });
    document.addEventListener('toggle', () => this.show(), true);
    $('fit').addEventListener('click', () => this._showAll());
    addEventListener('resize', () => this.show());
    for (const {canvas} of this.curves) {
      canvas.addEventListener('click', (event) => {
        const [begin, end] = this._stretch();
        this.go(begin + share(event) * (end - begin));
      });
    }
    addEventListener('keydown', (event) => {
      const area = $('timeline').getBoundingClientRect();
      const isSeen = area.top < innerHeight / 2 && area.bottom > innerHeight / 2;
      if ($('timeline').contains(event.target) || (event.target === document.body && isSeen)) {
        this._key(event);
      }
    });
  }

  _key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || event.target.tagName === 'SELECT') return;
    const isButton = event.target.tagName === 'BUTTON';
    const step = event.shiftKey ? SMALL_STEP : STEP;
    const deeds = {
      ArrowLeft: () => this.go(this.now - step), ArrowRight: () => this.go(this.now + step),
      PageUp: () => this.jump(-1), PageDown: () => this.jump(1),
      Home: () => this.go(0), End: () => this.go(this.run.duration),
    };
    if (!isButton) deeds[' '] = () => this.play(!this.playing);
    if (!deeds[event.key]) return;
    event.preventDefault();
    deeds[event.key]();
  }

  play(playing) {
    if (playing && this.now >= this.run.duration) this.now = 0;
    this.playing = playing;
    $('play').textContent = playing ? '\u275a\u275a Pause' : '\u25b6 Play';
    this._last = null;
    if (playing) requestAnimationFrame((at) => this._frame(at));
  }

  _frame(at) {
    if (!this.playing) return;
    const passed = this._last === null ? 0 : (at - this._last) / 1000;
    this._last = at;
    this.now = Math.min(this.run.duration, this.now + passed * Number($('rate').value));
    this.show();
    if (this.now >= this.run.duration) this.play(false);
    else requestAnimationFrame((next) => this._frame(next));
  }

  go(time) {
    this.now = Math.max(0, Math.min(this.run.duration, time));
    this.show();
  }

  /** To the mark before or after this moment. */
  jump(way) {
    const times = this.run.marks.map((mark) => mark.begin);
    const next = way > 0 ? times.find((time) => time > this.now + 0.01)
      : times.reverse().find((time) => time < this.now - 0.01);
    this.go(next ?? (way > 0 ? this.run.duration : 0));
  }

  /** The stretch of time that the curves show. */
  _stretch() {
    const {duration} = this.run, span = Number($('span').value) || duration;
    const begin = Math.max(0, Math.min(this.now - span / 2, duration - span));
    return [begin, Math.min(duration, begin + span)];
  }

  show() {
    const {run, now, map} = this;
    const goal = run.goals[lastBefore(this._goalTimes, now)];
    map.picture = {
      odom: this.odom.pose(now), local: this.local.pose(now), truth: this.truth.pose(now),
      frame: this.frame.pose(now), again: this.again?.pose(now), goal: goal?.[2] || null,
      asked: this.asked.pose(now), mistaken: $('mistake')?.open ? this.mistaken.pose(now) : null,
      tolerance: 0,
    };
    map.replaceTrails({odom: this.odom.way(now), local: this.local.way(now)});
    map.draw();
    const stretch = this._stretch();
    this.curves.forEach((curve, i) => curve.draw(...stretch, now, i === this.curves.length - 1));
    this.line.draw(now);
    $('time').value = now;
    $('time').setAttribute('aria-valuetext', `${now.toFixed(1)} seconds`);
    $('clock').textContent = `${now.toFixed(2)} s of ${run.duration.toFixed(1)} s`;
    this._words(goal);
    this._showLog();
  }

  _words(goal) {
    const {now, run} = this;
    const local = this.local.at(now), pose = local || this.odom.at(now);
    const [heading] = this.heading.at(now) || [], [far] = this.distance.at(now) || [];
    const [, forward, turning] = run.commands[lastBefore(this._commandTimes, now)] || [];
    const here = run.marks.filter(
      ({begin, end}) => begin <= now && now <= Math.max(end, begin + SHOWN));
    const say = (id, isKnown, words) => { $(id).textContent = isKnown ? words() : '\u2013'; };
    say('now-state', goal, () => goal[1]);
    say('now-pose', pose, () => `${pose[0].toFixed(3)} m, ${pose[1].toFixed(3)} m, `
      + `${wrapped(pose[2])} in ${local ? 'local' : 'odom'}`);
    say('now-heading', heading !== undefined, () => wrapped(heading));
    say('now-error', far !== undefined,
        () => `${far.toFixed(3)} m, ${wrapped(this.angle.at(now)[0])}`);
    say('now-command', typeof forward === 'number',
        () => `${forward.toFixed(2)} m/s, ${turning.toFixed(2)} rad/s`);
    say('now-mark', here.length, () => here.map((mark) => mark.text).join('; '));
  }

  _fillLog() {
    for (const [time, level, text] of this.run.log) {
      const row = document.createElement('li');
      row.dataset.level = level;
      row.textContent = `${time.toFixed(2)} s  ${text}`;
      row.addEventListener('click', () => this.go(time));
      $('run-log').append(row);
    }
    $('run-log').closest('section').hidden = !this.run.log.length;
  }

  _showLog() {
    const list = $('run-log'), rows = list.children;
    const last = lastBefore(this._logTimes, this.now);
    if (!rows.length || last === this._shownLine) return;
    this._shownLine = last;
    [...rows].forEach((row, i) => row.classList.toggle('later', i > last));
    const row = rows[Math.max(0, last)];
    list.scrollTop = row.offsetTop - list.offsetTop - list.clientHeight / 2;
  }

  /** The marks as words too: a list of buttons, for keys and for screen readers. */
  _fillMarks() {
    for (const mark of this.run.marks) {
      const row = document.createElement('button');
      row.textContent = `${mark.begin.toFixed(1)} s  ${mark.text}`;
      row.addEventListener('click', () => this.go(mark.begin));
      $('mark-list').append(row);
    }
    $('mark-list').closest('section').hidden = !this.run.marks.length;
  }
}

/** An angle [degrees] in words, wrapped to +-180. */
function wrapped(angle) { return `${degrees(wrap(radians(angle))).toFixed(1)}\u00b0`; }

readColours();
$('timeline').hidden = false;
new Timeline(JSON.parse($('run-data').textContent));
