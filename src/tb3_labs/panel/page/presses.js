// The presses of one button. Each is shown in at least one message as down, then as up.

const WAITS = 1500;       // [ms] a press that could not be shown for so long no longer counts

export class Presses {
  constructor() {
    this.drop();
    this.down = false;
  }

  /** `pressed`: the time of the press, on the panel's clock [s]. */
  press(pressed) {
    this.down = true;
    this.pressed = pressed;
    this._waiting = true;
    this._since = performance.now();
  }

  lift() {
    this.down = false;
  }

  /** Forget everything; a button that is still down must be pressed anew. */
  drop() {
    this._waiting = this._shown = this._held = false;
    this._since = 0;
  }

  /** A press that was not shown yet no longer counts. */
  forgetWaiting() {
    this._waiting = false;
  }

  /** What the next message says. `allowed`: may a new press be shown now? */
  next(allowed) {
    if (this._waiting && performance.now() - this._since > WAITS) this._waiting = false;
    if (this._shown) {
      this._shown = this._held && this.down && !this._waiting;
    } else if (this._waiting && allowed) {
      this._waiting = false;
      this._shown = this._held = true;
    }
    return this._shown;
  }
}
