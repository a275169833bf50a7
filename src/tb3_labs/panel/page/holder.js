// This page as the holder of the robot: it asks to hold it, and sends a joy 20 times a second.
//
// The panel (holder.py) decides which page holds the robot, and which message counts. This file
// decides only what this page sends. A grip drives once the node `gamepad` is ready: it must see
// the sticks at rest first, so a grip sends zeros until then. A grip that waited for too long must
// be let go and gripped again: the robot must not start at a moment that nobody expects.

import {timeNow} from './link.js';

const PERIOD = 50;          // [ms] between two messages
const READY_WITHIN = 1000;  // [ms] after a grip the pad must be ready
const BUTTONS_AFTER = 450;  // [ms] a press counts once the node has heard the pad for this long
const IDLE = 30000;         // [ms] without a touch: another page may hold the robot
const STOPPED_WITHIN = 1000;  // [ms] a stop without an answer for this long is not confirmed
const SETTLE = 700;         // [ms] a picture may be older than the answer to a request
const WAITS = 1500;         // [ms] a press that waited for this long is dropped

/** The presses of one button. Each is shown in at least one message as down, then as up. */
class Presses {
  constructor() {
    this.down = false;
    this.drop();
  }

  /** `pressed`: the time of the press, on the panel's clock [s]. */
  press(pressed) {
    this.down = true;
    this.pressed = pressed;
    this._waitsSince = performance.now();
  }

  /** Forget everything; a button that is still down must be pressed anew. */
  drop() {
    this._waitsSince = -Infinity;
    this._shown = false;
  }

  /** Is it down in the next message? `allowed`: may a new press be shown now? */
  next(allowed) {
    const waits = performance.now() - this._waitsSince < WAITS;
    if (this._shown) {
      this._shown = this.down && !waits;
    } else if (waits && allowed) {
      this.drop();
      this._shown = true;
    }
    return this._shown;
  }
}

export class Holder {
  constructor(link, say) {
    this._link = link;
    this._say = say;
    this.phase = 'idle';           // idle, asking, held
    this._asked = 0;               // counts requests, so that no late answer is taken for another
    this._grips = new Map();       // name -> {at, forward, left, hold, open, spent}
    this._mouse = null;
    this._padUsed = false;
    this._heardSince = Infinity;   // the node hears the pad since then
    this._takes = 0;               // counts how often control was taken from move_to_goal
    this._granted = -Infinity;     // this page gave control at this time; -Infinity: it did not
    this._since = 0;               // it holds the robot since then
    this._touched = 0;
    this._picture = null;
    this._timer = 0;
    this.buttons = {a: new Presses(), b: new Presses(), y: new Presses()};
  }

  get hasGranted() { return this._granted > -Infinity; }

  // -- acts of a person

  grip(name, hold = true) {
    const at = performance.now();
    this._grips.set(name, {at, forward: 0, left: 0, hold, open: false, spent: false});
    this._padUsed = true;
    this._touch();
  }

  move(name, forward, left, hold = true) {
    const grip = this._grips.get(name);
    if (!grip) return;
    Object.assign(grip, {forward, left, hold});
    this._touched = performance.now();
  }

  release(name) {
    if (this._grips.delete(name)) this._send();
  }

  has(name) { return this._grips.has(name); }

  press(button) {
    // B counts at once, also while another page holds the robot, or none.
    if (button === 'b') {
      this.ontake();
      if (this.phase !== 'held') return;
    }
    this.buttons[button].press(this._link.pressed);
    this._padUsed = true;
    this._touch();
  }

  lift(button) {
    const presses = this.buttons[button];
    if (!presses.down) return;
    presses.down = false;
    this._send();
  }

  holdMouse(x, y) {
    const isNew = this._mouse === null;
    this._mouse = [x, y];
    if (isNew) this._touch();
    this._touched = performance.now();
  }

  releaseMouse() {
    if (this._mouse === null) return;
    this._mouse = null;
    this._send();
  }

  get holdsMouse() { return this._mouse !== null; }

  /** Give control to move_to_goal. This page then renews it. */
  async give() {
    const takes = this._takes;
    const answer = await this._ask('give');
    this._say(answer.text, !answer.ok);
    const isTaken = takes !== this._takes;    // meanwhile
    if (answer.ok && answer.isCurrent && !isTaken) this._granted = performance.now();
  }

  /** A person takes control from move_to_goal: no earlier request may give it. */
  took() {
    this._takes += 1;
    this.buttons.a.drop();
    this._endGrant();
  }

  /** Everything to zero, and nothing that is held counts until it is gripped anew. */
  stop() {
    const answer = this._link.ask({type: 'stop'}, STOPPED_WITHIN);
    this._drop();
    this.took();
    if (this.phase === 'asking') this.silence();
    this._send();
    return answer;
  }

  /** Another page may hold the robot. */
  letGo() {
    if (this.phase === 'held') this._link.send({type: 'let go'});
    this.silence();
  }

  /** Send nothing any more: the panel takes that for a loss, and stops the robot. Returns whether
   *  this page drove. */
  silence() {
    const drove = this.phase !== 'idle';
    clearInterval(this._timer);
    this.phase = 'idle';
    this._asked += 1;
    this._padUsed = false;
    this._heardSince = Infinity;
    this._granted = -Infinity;
    this._picture = null;
    this._drop();
    return drove;
  }

  // -- pictures of the panel

  picture(picture) {
    this._picture = picture;
    const now = performance.now();
    // the answer follows
    if (this.phase === 'asking' && picture.page === 'this') this._hold();
    if (this.phase !== 'held') return;
    if (picture.page !== 'this' && now - this._since > SETTLE) {
      const wasHeld = this._grips.size > 0 || this._mouse !== null;
      this.silence();
      if (wasHeld) this._say('This page no longer drives: let go, and grip again.', true);
      return;
    }
    const isOld = now - this._granted > SETTLE;
    if (this.hasGranted && picture.has_control === false && isOld) this._endGrant();
  }

  // -- asking, holding, sending

  /** This page no longer renews the control of move_to_goal. */
  _endGrant() {
    this._granted = -Infinity;
    this._touched = performance.now();
  }

  _touch() {
    this._touched = performance.now();
    if (this.phase === 'idle') this._begin();
    else this._send();
  }

  async _begin() {
    const answer = await this._ask('begin');
    if (!answer.ok && answer.isCurrent) this._say(`This page may not drive: ${answer.text}`, true);
  }

  /** Send a request of this `type`, which makes this page the holder. Returns its answer with
   *  `isCurrent`: the page was not stopped or hidden meanwhile. */
  async _ask(type) {
    if (this.phase !== 'held') {
      this.phase = 'asking';
      this._picture = null;        // the pad's state in older pictures no longer holds
      this._asked += 1;
    }
    const asked = this._asked;
    const answer = await this._link.ask({type});
    const isCurrent = asked === this._asked;
    if (isCurrent && this.phase === 'asking') {
      if (answer.ok) this._hold(); else this.silence();
    }
    return {...answer, isCurrent};
  }

  _hold() {
    if (document.hidden) { this.silence(); return; }
    clearInterval(this._timer);
    this.phase = 'held';
    this._since = performance.now();
    this._timer = setInterval(() => this._tick(), PERIOD);
    this._send();
  }

  _drop() {
    this._grips.clear();
    this._mouse = null;
    for (const presses of Object.values(this.buttons)) presses.drop();
    this.ondrop?.();
  }

  _tick() {
    const busy = this._grips.size > 0 || this._mouse !== null || this.hasGranted;
    if (!busy && performance.now() - this._touched > IDLE) this.letGo();
    else this._send();
  }

  _send() {
    // A hidden page has slow timers: it would be lost at any time, so it never drives.
    if (this.phase !== 'held' || document.hidden || this._link.crowded) return;
    const pad = this._padUsed ? this._pad() : null;
    const pressed = pad?.a ? this.buttons.a.pressed : null;
    this._link.send({type: 'joy', t: timeNow(), pad, mouse: this._mouse, pressed});
  }

  _pad() {
    const now = performance.now();
    if (this._heardSince === Infinity) this._heardSince = now;
    const heard = now - this._heardSince >= BUTTONS_AFTER;
    const pad = {forward: 0, left: 0, a: false, b: false, y: false, hold: false};
    for (const grip of this._grips.values()) {
      this._judge(grip, now);
      if (grip.spent) continue;
      // If a button must be held, the node waits for its press: a new pad must not have pressed it.
      pad.hold = pad.hold || (grip.hold && heard);
      if (grip.open) { pad.forward += grip.forward; pad.left += grip.left; }
    }
    pad.forward = Math.max(-1, Math.min(1, pad.forward));
    pad.left = Math.max(-1, Math.min(1, pad.left));
    pad.b = this.buttons.b.next(true);
    pad.a = this.buttons.a.next(heard);
    pad.y = this.buttons.y.next(heard);
    if (pad.a && !this.hasGranted) this._granted = now;
    if (pad.b) this._endGrant();
    return pad;
  }

  /** May this grip drive? A grip that was not ready in time, or lost that, never drives again. */
  _judge(grip, now) {
    if (grip.spent) return;
    const ready = this._picture?.pad === 'ready' && this._picture.page === 'this';
    if (grip.open ? !ready : now - grip.at > READY_WITHIN) {
      grip.spent = true;
      grip.open = false;
      if (this._picture?.pad !== 'held back') this._say('Let go, and grip again.', true);
    } else if (ready) {
      grip.open = true;
    }
  }

  /** Must something be let go and gripped again? */
  get spent() {
    return [...this._grips.values()].some((grip) => grip.spent);
  }
}
