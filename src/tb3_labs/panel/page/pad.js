// The pad of the page. While a person holds sticks, buttons or the mouse, the page sends ten messages
// a second.
//
// The node `gamepad` decides what sticks and A do. The panel (dead_man.py) decides which page
// drives. After the person took hold, the page sends sticks at rest until the node `gamepad` is
// ready. If the robot is stopped, or the pad is not ready for a while, the person must let go and
// take hold again. Otherwise the robot could start at an unexpected moment.

const SEND_PERIOD = 100;    // [ms] between two messages
const READY_TIMEOUT = 1000;    // [ms] a hold ends if the pad is not ready for this time
const BUTTON_DELAY = 450;    // [ms] from the start of a hold to the first A, Y or hold button sent
const GRANT_TIMEOUT = 700;    // [ms] for this time after a press of A, has_control may be false
const STOP_TIMEOUT = 2500;    // [ms] without an answer for this time, a stop is not confirmed

export const clamp = (value) => Math.max(-1, Math.min(1, value));

export class Pad {
  /** `say(text, warning)` shows a message. The creator sets two functions: `onstop` is called when
   *  B is pressed, and `ondrop` is called when the person must take hold again. */
  constructor(link, say) {
    this._link = link;
    this._say = say;
    this._heldSticks = new Map();    // {name: {forward, left, holdButton}}
    this._mouse = null;
    this._presses = [];          // presses of A and Y that are not in a message yet
    this._pressedButton = undefined;    // the button that is pressed in the latest message
    this._controlGivenAt = -Infinity;    // time of the press of A that gave control
    this._picture = null;
    this._timer = 0;             // 0 while the person holds nothing
    this.isEnabled = false;      // does the panel let pages drive?
  }

  /** A hint for the person. */
  get hint() {
    if (this._mouse) return 'driving';
    if (this._hasGivenControl) {
      return 'move_to_goal drives while this page stays open and in sight';
    }
    return this._timer ? this._picture.pad : 'grip to drive';
  }

  /** Has a press of A on this page given control to move_to_goal? */
  get _hasGivenControl() { return this._controlGivenAt > -Infinity; }

  // -- acts of a person

  hold(name, holdButton = true) {
    this._heldSticks.set(name, {forward: 0, left: 0, holdButton});
    this._sendsPad = true;
    this._readyAt = performance.now();    // the pad must be ready within READY_TIMEOUT
    this._begin();
  }

  move(name, {forward = 0, left = 0}, holdButton = true) {
    const held = this._heldSticks.get(name);
    if (held) Object.assign(held, {forward, left, holdButton});
  }

  release(name) {
    if (this._heldSticks.delete(name)) this._send();
  }

  isHeld(name) { return this._heldSticks.has(name); }

  press(button) {
    if (button === 'b') { this.onstop(); return; }
    this._presses.push(button);
    this._sendsPad = true;
    this._begin();
  }

  holdMouse(x, y) {
    this._mouse = [x, y];
    this._begin();
  }

  releaseMouse() {
    if (!this._mouse) return;
    this._mouse = null;
    this._send();
  }

  /** Stop the robot. The returned promise gives {ok, text}. */
  stop() {
    const answer = this._link.ask({type: 'stop'}, STOP_TIMEOUT);
    this.drop();
    return answer;
  }

  /** Let go of everything, so that the person must take hold again. Returns true if anything was
   *  held. */
  drop() {
    const wasHeld = this._timer !== 0;
    this._heldSticks.clear();
    this._mouse = null;
    this._presses = [];
    this._controlGivenAt = -Infinity;
    this._end();
    this.ondrop();
    return wasHeld;
  }

  // -- pictures of the panel

  see(picture) {
    this._picture = picture;
    if (!this._timer) return;
    const now = performance.now();
    if (picture.stops !== this._stops) { this.refuse('The robot was stopped'); return; }
    if (picture.pad === 'ready') this._readyAt = now;
    if (this._heldSticks.size && now - this._readyAt > READY_TIMEOUT) {
      this.refuse(picture.pad);
      return;
    }
    const hasWaited = now - this._controlGivenAt > GRANT_TIMEOUT;
    if (picture.has_control === false && hasWaited) this._controlGivenAt = -Infinity;
  }

  /** Let go of everything, and show the reason to the person. */
  refuse(reason) {
    if (this.drop()) this._say(`${reason}: let go, and grip again.`, true);
  }

  // -- sending

  _begin() {
    if (!this.isEnabled || !this._picture || !this._link.isConnected) { this.drop(); return; }
    if (!this._timer) {
      this._stops = this._link.stops;
      this._heldSince = performance.now();
      this._isReady = false;         // was the node gamepad ready at the latest message?
      this._isFirst = true;          // is the next message the first message of this hold?
      this._timer = setInterval(() => this._send(), SEND_PERIOD);
      this._send();
    }
  }

  _end() {
    this._sendsPad = false;
    this._pressedButton = undefined;
    if (!this._timer) return;
    clearInterval(this._timer);
    this._timer = 0;
    this._link.send({type: 'joy', t: this._link.time, pad: null, mouse: null});
  }

  _send() {
    const hasPress = this._presses.length || this._pressedButton;
    const isHeld = this._heldSticks.size || this._mouse || hasPress;
    if (!isHeld && !this._hasGivenControl) this._end();
    if (!this._timer) return;
    const pad = this._sendsPad ? this._takePad() : null;
    this._link.send({type: 'joy', t: this._link.time, stops: this._stops, pad,
                     mouse: this._mouse, first: this._isFirst});
    this._isFirst = false;
  }

  /** Returns the pad of the next message. Removes the next press from the presses that wait. */
  _takePad() {
    const isHeard = performance.now() - this._heldSince >= BUTTON_DELAY;
    const pad = {forward: 0, left: 0, a: false, y: false, hold: false};
    for (const {forward, left, holdButton} of this._heldSticks.values()) {
      // gamepad ignores a hold button that is down in the first messages of a pad.
      if (holdButton && isHeard) pad.hold = true;
      if (this._isReady) { pad.forward += forward; pad.left += left; }
    }
    pad.forward = clamp(pad.forward);
    pad.left = clamp(pad.left);
    // Each press makes two messages. In the first message the button is down, in the second up.
    const mustBeUp = this._pressedButton || !isHeard;
    this._pressedButton = mustBeUp ? undefined : this._presses.shift();
    if (this._pressedButton) pad[this._pressedButton] = true;
    if (this._pressedButton === 'a') this._controlGivenAt = performance.now();
    this._isReady = this._picture.pad === 'ready';    // the next message has the sticks
    return pad;
  }
}
