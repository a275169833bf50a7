// This page as a pad: what a person holds on it is sent ten times a second.
//
// The node `gamepad` decides what the sticks and A do; the panel (dead_man.py) decides which page
// drives. A grip begins with sticks at rest, until that node is ready. If the robot is stopped, or
// the pad is not ready for a while, everything must be let go and gripped again: the robot must not
// start at an unexpected moment.

const SEND_PERIOD = 100;    // [ms] between two messages
const READY_WITHIN = 1000;    // [ms] a grip of a pad that is not ready for this long is dropped
const HEARD_TIME = 450;    // [ms] A and Y are shown once the node has heard the pad for this long
const SETTLE_TIME = 700;    // [ms] after A, has_control may still be false
const STOPPED_WITHIN = 2500;  // [ms] a stop without an answer for this long is not confirmed

export const clamp = (value) => Math.max(-1, Math.min(1, value));

export class Pad {
  /** Set `onstop` (B is pressed) and `ondrop` (all that is held is ignored from now on). */
  constructor(link, say) {
    this._link = link;
    this._say = say;
    this._grips = new Map();     // name -> {forward, left, hold}
    this._mouse = null;
    this._presses = [];          // of A and Y, which were not shown yet
    this._down = null;           // the button that the last message showed as pressed
    this._gaveAt = -Infinity;    // A gave control then; -Infinity: this page gives none
    this._picture = null;
    this._timer = 0;             // 0: nothing is held
  }

  /** Does move_to_goal drive by this page's A? */
  get gives() { return this._gaveAt > -Infinity; }

  get isHeld() { return this._timer !== 0; }

  get holdsMouse() { return this._mouse !== null; }

  // -- acts of a person

  grip(name, hold = true) {
    this._grips.set(name, {forward: 0, left: 0, hold});
    this._isPad = true;
    this._readyAt = performance.now();    // if it is not, it has a second
    this._begin();
  }

  move(name, forward, left, hold = true) {
    const grip = this._grips.get(name);
    if (grip) Object.assign(grip, {forward, left, hold});
  }

  release(name) {
    if (this._grips.delete(name)) this._send();
  }

  has(name) { return this._grips.has(name); }

  press(button) {
    if (button === 'b') { this.onstop(); return; }
    this._presses.push(button);
    this._isPad = true;
    this._begin();
  }

  holdMouse(x, y) {
    this._mouse = [x, y];
    this._begin();
  }

  releaseMouse() {
    if (!this.holdsMouse) return;
    this._mouse = null;
    this._send();
  }

  /** Stop the robot; the promise gives {ok, text}. */
  stop() {
    const answer = this._link.ask({type: 'stop'}, STOPPED_WITHIN);
    this.drop();
    return answer;
  }

  /** Let go of everything: it must be gripped again. Returns whether anything was held. */
  drop() {
    const held = this._timer !== 0;
    this._grips.clear();
    this._mouse = null;
    this._presses = [];
    this._gaveAt = -Infinity;
    this._end();
    this.ondrop();
    return held;
  }

  // -- pictures of the panel

  see(picture) {
    this._picture = picture;
    if (!this._timer) return;
    const now = performance.now();
    if (picture.stops !== this._stops) { this.refuse('The robot was stopped'); return; }
    if (picture.pad === 'ready') this._readyAt = now;
    if (this._grips.size && now - this._readyAt > READY_WITHIN) { this.refuse(picture.pad); return; }
    if (picture.has_control === false && now - this._gaveAt > SETTLE_TIME) this._gaveAt = -Infinity;
  }

  /** What is held is ignored, for this reason. */
  refuse(reason) {
    if (this.drop()) this._say(`${reason}: let go, and grip again.`, true);
  }

  // -- sending

  _begin() {
    if (!this._picture) { this.drop(); return; }
    if (!this._timer) {
      this._stops = this._link.stops;
      this._since = performance.now();
      this._isOpen = false;          // do the sticks count yet?
      this._isFirst = true;          // the next message is the first one of this grip
      this._timer = setInterval(() => this._send(), SEND_PERIOD);
      this._send();
    }
  }

  _end() {
    if (!this._timer) return;
    clearInterval(this._timer);
    this._timer = 0;
    this._isPad = false;
    this._down = null;
    this._link.send({type: 'joy', t: this._link.time, pad: null, mouse: null});
  }

  _send() {
    const isHeld = this._grips.size || this.holdsMouse || this._presses.length || this._down;
    if (!isHeld && !this.gives) this._end();
    if (!this._timer || this._link.crowded) return;
    const pad = this._isPad ? this._state() : null;
    this._link.send({type: 'joy', t: this._link.time, stops: this._stops, pad,
                     mouse: this._mouse, first: this._isFirst});
    this._isFirst = false;
  }

  _state() {
    const isHeard = performance.now() - this._since >= HEARD_TIME;
    const pad = {forward: 0, left: 0, a: false, y: false, hold: false};
    for (const grip of this._grips.values()) {
      // The hold button comes later: it is ignored if it is down when the pad is first heard.
      pad.hold = pad.hold || (grip.hold && isHeard);
      if (this._isOpen) { pad.forward += grip.forward; pad.left += grip.left; }
    }
    pad.forward = clamp(pad.forward);
    pad.left = clamp(pad.left);
    // Each press is shown in one message as down, in the next one as up.
    this._down = !this._down && isHeard ? this._presses.shift() ?? null : null;
    if (this._down) pad[this._down] = true;
    if (this._down === 'a') this._gaveAt = performance.now();
    this._isOpen = this._picture.pad === 'ready';    // from the second message on
    return pad;
  }
}
