// A real gamepad, by the browser's Gamepad API.

const OFF_MIDDLE = 0.12;      // a stick further from its middle than this is touched
const BUTTONS = {a: 0, b: 1, y: 3};
const DRIVING = ['a', 'y'];   // B is a stop, and counts at any time
const HOLD = 5;

export class RealGamepad {
  /** `driving()`: may it drive now? `show(text)`: words about the gamepad. */
  constructor(wheel, driving, show) {
    this._wheel = wheel;
    this._driving = driving;
    this._show = show;
    this._timer = 0;
    // False: sticks and buttons must all be let go once before anything but B counts.
    this._armed = false;
    this._was = {};
    addEventListener('gamepadconnected', () => this._look());
    addEventListener('gamepaddisconnected', () => this._look());
  }

  /** Nothing but B counts until everything was let go once. */
  disarm() {
    this._armed = false;
    this._was = {};
  }

  _look() {
    const pads = [...navigator.getGamepads()].filter(Boolean);
    const usable = pads.find((pad) => pad.mapping === 'standard');
    clearInterval(this._timer);
    this.disarm();
    this._b = false;
    this._wheel.release('gamepad');
    if (usable) {
      this._index = usable.index;
      this._timer = setInterval(() => this._poll(), 25);
      this._show('Gamepad: ' + usable.id);
    } else {
      this._show(pads.length ? `Gamepad "${pads[0].id}" is not used: its mapping is not "standard".` : '');
    }
  }

  _poll() {
    const pad = navigator.getGamepads()[this._index];
    if (!pad || !pad.connected) { this._look(); return; }
    const now = read(pad);
    if (now.b !== this._b) {
      this._b = now.b;
      if (now.b) this._wheel.press('b'); else this._wheel.lift('b');
    }
    const still = Math.abs(now.forward) < OFF_MIDDLE && Math.abs(now.left) < OFF_MIDDLE;
    const rest = still && !now.hold && !now.a && !now.b && !now.y;
    if (document.hidden || !this._driving()) this.disarm();
    else if (!this._armed) this._armed = rest;
    else this._tell(now, still);
  }

  _tell(now, still) {
    const touched = !still || now.hold;
    if (touched && !this._wheel.has('gamepad')) this._wheel.grip('gamepad', now.hold);
    if (touched) this._wheel.move('gamepad', now.forward, now.left, now.hold);
    else this._wheel.release('gamepad');
    for (const name of DRIVING) {
      if (now[name] && !this._was[name]) this._wheel.press(name);
      if (!now[name] && this._was[name]) this._wheel.lift(name);
    }
    this._was = now;
  }
}

function read(pad) {
  const state = {forward: -(pad.axes[1] || 0), left: -(pad.axes[2] || 0)};
  for (const [name, index] of Object.entries(BUTTONS)) state[name] = Boolean(pad.buttons[index]?.pressed);
  state.hold = Boolean(pad.buttons[HOLD]?.pressed);
  return state;
}
