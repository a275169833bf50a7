// Draws the timeline of a recorded run: the map, the curves, the state and the log at one moment.
//
// Times are seconds since the recording's start. Poses are [x m, y m, yaw rad]. Tracks have degrees.

import {Track, curve, element, lastBefore, stepsOf} from './curves.js';
import {degrees, digits, nice, radians, wrap} from './drawing.js';
import {MapInput, RobotMap} from './map.js';

const LEFT = 46;                                // [px] the margin left of a curve in timeline.css
const RIGHT = 8;                                // [px] the margin right of a curve
const MIN_SHOWN_TIME = 0.5;                     // [s] the text of a mark is shown at least so long
// Each kind of marks has its own row. The rows are in this order from the top.
const KINDS = ['drive', 'turn', 'hand', 'reset', 'start', 'stop', 'lost'];
const ROW_HEIGHT = 8;                           // [px] of the marks of one kind
const MAX_FIGURES = 12;
const MAX_LEVELS = 8;       // a variable with more different texts has no figure
// [track, caption, options of the curve]. `command` is the index of the speed in a row of commands.
const CURVES = [
  ['heading', 'heading by the IMU [\u00b0]', {minRange: 10, isAngle: true}],
  ['distance', 'distance to the goal [m]', {minRange: 0.1, hasZero: true}],
  ['angle', "angle off the goal's heading [\u00b0]", {minRange: 10, isAngle: true}],
  ['speed', 'forward [m/s]', {minRange: 0.1, command: 1}],
  ['rate', 'turning [rad/s]', {minRange: 0.4, command: 2}],
];
const $ = (id) => document.getElementById(id);

/** Returns the place of a click in a plot: 0 at the left end, 1 at the right end. */
function shareOfPlot(event) {
  const {left, width} = event.currentTarget.getBoundingClientRect();
  return Math.max(0, Math.min(1, (event.clientX - left - LEFT) / (width - LEFT - RIGHT)));
}

class Timeline {
  constructor(run) {
    this.run = run;
    this.now = 0;
    this.isPlaying = false;
    for (const name of ['odom', 'local', 'truth', 'frame', ...CURVES.map((row) => row[0])]) {
      this[name] = new Track(run[name]);
    }
    [this._commandTimes, this._goalTimes, this._lineTimes] = [run.commands, run.goals, run.log]
      .map((rows) => rows.map((row) => row[0]));
    this._addCurves();
    this._addMarks();
    this._addLog();
    this._addVariables();
    const known = {state: run.goals, error: run.distance.time, command: run.commands, mark: run.marks};
    for (const [name, rows] of Object.entries(known)) {
      $(`now-${name}`).parentElement.hidden = !rows.length;
    }
    this.map = new RobotMap($('run-map'));
    this.map.radius = run.radius;
    new MapInput(this.map, () => this.show());
    this._connectControls();
    this._showAll();
    const first = this.local.time[0] ?? this.odom.time[0] ?? 0;
    this.go(location.hash.startsWith('#t=') ? timeOf(location) : first);
  }

  _addCurves() {
    for (const [name, caption, options] of CURVES) {
      const lines = {measured: this[name].points()};
      if (options.command) lines.commanded = this._commandSteps(options.command);
      const figure = curve(name, caption, lines, this.run.duration, options);
      if (figure) $('times').before(figure);
    }
  }

  /** Returns the points of a commanded speed. A command is in force until the next command. */
  _commandSteps(column) {
    const {commands, duration} = this.run;
    return commands.flatMap((command, i) => {
      const speed = command[column], end = commands[i + 1]?.[0] ?? duration;
      return speed === null ? [null] : [[command[0], speed], [end, speed]];
    });
  }

  _addMarks() {
    const {marks, duration} = this.run;
    const kinds = KINDS.filter((kind) => marks.some((mark) => mark.kind === kind));
    for (const {kind, begin, end, text} of marks) {
      const href = `#t=${begin}`, top = ROW_HEIGHT * kinds.indexOf(kind);
      const style = `top:${top}px;--x:${begin / duration};--w:${(end - begin) / duration}`;
      $('marks').append(element('a', {class: kind, title: text, style, href, tabindex: -1}));
      $('mark-list').append(element('a', {href}, `${begin.toFixed(1)} s\u2002${text}`));
    }
    $('marks').style.height = `${ROW_HEIGHT * kinds.length}px`;
    $('mark-list').closest('section').hidden = !marks.length;
  }

  _addLog() {
    this._lines = this.run.log.map(([time, level, text]) => element('li', {'data-level': level},
      element('a', {href: `#t=${time}`}, `${time.toFixed(2)} s\u2002${text}`)));
    for (const line of this._lines) $('run-log').append(line);
    $('run-log').closest('section').hidden = !this._lines.length;
  }

  _addVariables() {
    const {run} = this;
    $('inside').hidden = !run.variables.length;
    $('inside-nodes').textContent = run.nodes.join(', ');
    for (const [name, times, texts] of run.variables) {
      const figures = $('variables'), {points, levels} = stepsOf(times, texts);
      const changes = new Set(points.filter(Boolean).map((point) => point[1])).size > 1;
      const isLegible = !levels || levels.length <= MAX_LEVELS;
      if (changes && isLegible && figures.childElementCount < MAX_FIGURES) {
        figures.append(curve(`variable-${name}`, name, {variable: points}, run.duration, {levels}));
      }
    }
    this._variables = run.variables.map(([name, times, texts]) => {
      const value = element('b', {});
      $('now-variables').append(element('span', {}, `${name} `, value), ' ');
      return {times, texts, value};
    });
  }

  /** Fit the map to the whole path, so that the map does not move while the run plays. */
  _showAll() {
    const {now} = this;
    this.go(this.run.duration);
    this.map.fit();
    this.map.view.auto = false;
    this.go(now);
  }

  _connectControls() {
    $('play').addEventListener('click', () => this.play(!this.isPlaying));
    $('before').addEventListener('click', () => this.jump(-1));
    $('after').addEventListener('click', () => this.jump(1));
    $('time').max = this.run.duration;
    $('time').addEventListener('input', () => this.go(Number($('time').value)));
    $('span').addEventListener('change', () => this.show());
    $('frame').addEventListener('change', () => {
      this.map.fix($('frame').value);
      this._showAll();
    });
    // Links may stand below this script. A link to the shown moment does not change the hash.
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
        if (event.target.tagName !== 'A') this.go(begin + shareOfPlot(event) * (end - begin));
      });
    }
  }

  play(isPlaying) {
    if (isPlaying && this.now >= this.run.duration) this.now = 0;
    this.isPlaying = isPlaying;
    $('play').textContent = isPlaying ? '\u275a\u275a Pause' : '\u25b6 Play';
    this._last = null;
    if (isPlaying) requestAnimationFrame((clock) => this._animate(clock));
  }

  _animate(clock) {
    if (!this.isPlaying) return;
    const passed = this._last === null ? 0 : (clock - this._last) / 1000;
    this._last = clock;
    this.now = Math.min(this.run.duration, this.now + passed * Number($('rate').value));
    this.show();
    if (this.now >= this.run.duration) this.play(false);
    else requestAnimationFrame((next) => this._animate(next));
  }

  go(time) {
    this.now = Math.max(0, Math.min(this.run.duration, time));
    this.show();
  }

  /** Go to the mark before or after this moment. */
  jump(direction) {
    const times = this.run.marks.map((mark) => mark.begin);
    const next = direction > 0 ? times.find((time) => time > this.now + 0.01)
      : times.reverse().find((time) => time < this.now - 0.01);
    this.go(next ?? (direction > 0 ? this.run.duration : 0));
  }

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
    map.trails = {odom: this.odom.pathUntil(now), local: this.local.pathUntil(now)};
    map.draw();
    this._showCurves();
    $('time').value = now;
    $('time').setAttribute('aria-valuetext', `${now.toFixed(1)} seconds`);
    $('clock').textContent = `${now.toFixed(2)} s of ${run.duration.toFixed(1)} s`;
    this._showNumbers(goal);
    this._showLog();
  }

  _showCurves() {
    const [begin, end] = this._stretch(), step = nice((end - begin) / 6), times = [];
    for (let i = Math.ceil(begin / step); i * step <= end; i += 1) {
      times.push(element('span', {style: `--x:${(i * step - begin) / (end - begin)}`},
                         `${(i * step).toFixed(digits(step))} s`));
    }
    $('times').replaceChildren(...times);
    for (const {viewBox} of document.querySelectorAll('#timeline .plot svg')) {
      Object.assign(viewBox.baseVal, {x: begin, width: end - begin});
    }
    const {style} = $('timeline');
    style.setProperty('--now', (this.now - begin) / (end - begin));
    style.setProperty('--at', this.now / this.run.duration);
  }

  _showNumbers(goal) {
    const {now, run} = this;
    const local = this.local.at(now), pose = local || this.odom.at(now);
    const [heading] = this.heading.at(now) || [], [distance] = this.distance.at(now) || [];
    const [, forward, turning] = run.commands[lastBefore(this._commandTimes, now)] || [];
    const currentMarks = run.marks.filter(
      ({begin, end}) => begin <= now && now <= Math.max(end, begin + MIN_SHOWN_TIME));
    const setText = (id, isKnown, text) => { $(id).textContent = isKnown ? text() : '\u2013'; };
    setText('now-state', goal, () => goal[1]);
    setText('now-pose', pose, () => `${pose[0].toFixed(3)} m, ${pose[1].toFixed(3)} m, `
      + `${wrapped(pose[2])} in ${local ? 'local' : 'odom'}`);
    setText('now-heading', heading !== undefined, () => wrapped(heading));
    setText('now-error', distance !== undefined,
            () => `${distance.toFixed(3)} m, ${wrapped(this.angle.at(now)[0])}`);
    setText('now-command', typeof forward === 'number',
            () => `${forward.toFixed(2)} m/s, ${turning.toFixed(2)} rad/s`);
    for (const {times, texts, value} of this._variables) {
      value.textContent = texts[lastBefore(times, now)] ?? '\u2013';
    }
    setText('now-mark', currentMarks.length,
            () => currentMarks.map((mark) => mark.text).join('; '));
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

/** Returns the time in a link to a moment, or in the page's own address. */
function timeOf({hash}) { return Number(hash.slice(3)) || 0; }

/** Returns the text of an angle [degrees], wrapped to +-180. */
function wrapped(angle) { return `${degrees(wrap(radians(angle))).toFixed(1)}\u00b0`; }

$('timeline').hidden = false;
new Timeline(JSON.parse($('run-data').textContent));
