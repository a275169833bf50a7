// The timeline of a recorded run: the map, the curves, the state and the log at one moment.
//
// Times are seconds since the recording's start. Poses are [x m, y m, yaw rad], tracks in degrees.

import {degrees, digits, nice, radians, wrap} from './drawing.js';
import {MapInput, RobotMap} from './map.js';

const LEFT = 46, RIGHT = 8;                     // [px] beside a curve, as the style has it
const SHOWN = 0.5;                              // [s] a mark's words are shown at least
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

/** Where a plot of times was clicked: 0 at its left end, 1 at its right end. */
function share(event) {
  const {left, width} = event.currentTarget.getBoundingClientRect();
  return Math.max(0, Math.min(1, (event.clientX - left - LEFT) / (width - LEFT - RIGHT)));
}

/** Numbers over time, straight between two of them; unknown before the first one. */
class Track {
  constructor({time, columns, breaks}) {
    Object.assign(this, {time, columns, breaks: new Set(breaks)});
  }

  before(time) { return lastBefore(this.time, time); }

  /** The numbers at a time; in a break the last ones before it; null before the first. */
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

class Timeline {
  constructor(run) {
    this.run = run;
    this.now = 0;
    this.playing = false;
    for (const name of ['odom', 'local', 'truth', 'frame', 'heading', 'distance', 'angle']) {
      this[name] = new Track(run[name]);
    }
    [this._commandTimes, this._goalTimes] = [run.commands, run.goals]
      .map((rows) => rows.map((row) => row[0]));
    this._lines = [...$('run-log').children];
    this._lineTimes = this._lines.map((line) => timeOf(line.firstChild));
    for (const list of ['mark-list', 'run-log']) {
      $(list).closest('section').hidden = !$(list).childElementCount;
    }
    const known = {state: run.goals, error: run.distance.time, command: run.commands, mark: run.marks};
    for (const [name, rows] of Object.entries(known)) {
      $(`now-${name}`).parentElement.hidden = !rows.length;
    }
    $('inside').hidden = !run.variables.length;
    this._variables = run.variables.map(([name, times, texts]) => {
      const word = document.createElement('span'), value = document.createElement('b');
      word.append(`${name} `, value);
      $('now-variables').append(word, ' ');
      return {times, texts, value};
    });
    this.map = new RobotMap($('run-map'));
    this.map.radius = run.radius;
    new MapInput(this.map, () => this.show());
    this._controls();
    this._showAll();
    const first = this.local.time[0] ?? this.odom.time[0] ?? 0;
    this.go(location.hash.startsWith('#t=') ? timeOf(location) : first);
  }

  /** The map shows the whole path, so it does not move while the run plays. */
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
      this.go(timeOf(link));
      if ($('timeline').contains(link)) return;
      $('timeline').scrollIntoView();
      $('timeline').focus();
    });
    document.addEventListener('toggle', () => this.show(), true);
    addEventListener('resize', () => this.show());
    for (const plot of document.querySelectorAll('#timeline .plot')) {
      plot.addEventListener('click', (event) => {
        const [begin, end] = plot.id === 'marks' ? [0, this.run.duration] : this._stretch();
        if (event.target.tagName !== 'A') this.go(begin + share(event) * (end - begin));
      });
    }
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
      frame: this.frame.pose(now), goal: goal?.[2] || null,
    };
    map.trails = {odom: this.odom.way(now), local: this.local.way(now)};
    map.draw();
    this._showCurves();
    $('time').value = now;
    $('time').setAttribute('aria-valuetext', `${now.toFixed(1)} seconds`);
    $('clock').textContent = `${now.toFixed(2)} s of ${run.duration.toFixed(1)} s`;
    this._words(goal);
    this._showLog();
  }

  /** The curves of the stretch, the times below them, and this moment in them and in the marks. */
  _showCurves() {
    const [begin, end] = this._stretch(), step = nice((end - begin) / 6), times = [];
    for (let i = Math.ceil(begin / step); i * step <= end; i += 1) {
      const word = document.createElement('span');
      word.textContent = `${(i * step).toFixed(digits(step))} s`;
      word.style.setProperty('--x', (i * step - begin) / (end - begin));
      times.push(word);
    }
    $('times').replaceChildren(...times);
    for (const {viewBox} of document.querySelectorAll('#timeline .plot svg')) {
      Object.assign(viewBox.baseVal, {x: begin, width: end - begin});
    }
    const {style} = $('timeline');
    style.setProperty('--now', (this.now - begin) / (end - begin));
    style.setProperty('--at', this.now / this.run.duration);
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
    for (const {times, texts, value} of this._variables) {
      value.textContent = texts[lastBefore(times, now)] ?? '\u2013';
    }
    say('now-mark', here.length, () => here.map((mark) => mark.text).join('; '));
  }

  _showLog() {
    const list = $('run-log'), last = lastBefore(this._lineTimes, this.now);
    if (!this._lines.length || last === this._shownLine) return;
    this._shownLine = last;
    this._lines.forEach((line, i) => line.classList.toggle('later', i > last));
    const row = this._lines[Math.max(0, last)];
    list.scrollTop = row.offsetTop - list.offsetTop - list.clientHeight / 2;
  }
}

/** The time of a link to a moment, or of the page's own address. */
function timeOf({hash}) { return Number(hash.slice(3)) || 0; }

/** The text of an angle [degrees], wrapped to +-180. */
function wrapped(angle) { return `${degrees(wrap(radians(angle))).toFixed(1)}\u00b0`; }

$('timeline').hidden = false;
new Timeline(JSON.parse($('run-data').textContent));
