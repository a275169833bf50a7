// A person drives by sticks, buttons and the mouse pad on the screen, by the keyboard, or by a real
// gamepad. Each finger can hold another element of the page at the same time.

import {clamp} from './pad.js';

const REST_ZONE = 0.04;    // a stick on the screen is at rest if its deflection is smaller
const ARROW_DEFLECTION = 0.5;    // the deflection of the arrow keys
const ARROWS = {
  ArrowUp: [ARROW_DEFLECTION, 0], ArrowDown: [-ARROW_DEFLECTION, 0],
  ArrowLeft: [0, ARROW_DEFLECTION], ArrowRight: [0, -ARROW_DEFLECTION],
};
/** {axis of a stick: its direction on the screen} */
const STICKS = {
  forward: {place: 'clientY', side: 'height', translate: 'translateY'},
  left: {place: 'clientX', side: 'width', translate: 'translateX'},
};
/** The buttons of the pad on the screen, and their keys. */
export const PAD_BUTTONS = ['a', 'b', 'y'];
const TYPING = 'input, textarea, select';
const TOUCH_ZONE = 0.12;    // a stick of a gamepad is touched if its deflection is larger
const BUTTONS = {a: 0, b: 1, y: 3, hold: 5};    // numbers in the layout "standard" of gamepads
const DRIVING_BUTTONS = ['a', 'y'];    // B is a stop, which works at any time
const POLL_PERIOD = 25;    // [ms]

/** A stick that moves along one axis, 'forward' or 'left'. The deflection is 0 where the pointer
 *  takes hold. Returns a function that lets the stick go. */
export function makeStick(element, axis, pad) {
  const knob = element.querySelector('.knob');
  const {place, side, translate} = STICKS[axis];
  let middle = 0;    // the pointer's coordinate at deflection 0
  const travel = () => (
    (element.getBoundingClientRect()[side] - knob.getBoundingClientRect()[side]) / 2);
  const show = (value) => {
    knob.style.transform = `${translate}(${Math.round(-value * travel())}px)`;
  };
  const takeHold = (event) => {
    middle = event[place];
    pad.hold(element.id);
  };
  const move = (event) => {
    const pushed = clamp((middle - event[place]) / travel());
    const value = Math.abs(pushed) < REST_ZONE ? 0 : pushed;
    show(value);
    pad.move(element.id, {[axis]: value});
  };
  return onHold(element, takeHold, move, () => {
    show(0);
    pad.release(element.id);
  });
}

/** A square with the mouse's position (x, y), each from -1 to 1, x right, y up. Returns a function
 *  that lets the mouse go. */
export function makeMousePad(element, pad) {
  const dot = element.querySelector('.dot');
  const show = (x, y) => {
    dot.style.left = 50 + 50 * x + '%';
    dot.style.top = 50 - 50 * y + '%';
  };
  const hold = (event) => {
    const box = element.getBoundingClientRect();
    const x = clamp((event.clientX - box.left) / box.width * 2 - 1);
    const y = clamp(1 - (event.clientY - box.top) / box.height * 2);
    show(x, y);
    pad.holdMouse(x, y);
  };
  return onHold(element, hold, hold, () => {
    show(0, 0);
    pad.releaseMouse();
  });
}

/** Calls act() when a pointer or Enter presses a button. The event 'click' alone would be too late,
 *  since it comes when the person lifts the finger. */
export function onPress(button, act) {
  button.addEventListener('pointerdown', act);
  button.addEventListener('click', (event) => { if (event.detail === 0) act(); });
}

/** Calls takeHold(), move() and letGo() when a pointer presses the element, moves, and lets go.
 *  Returns a function that lets the element go. After its call the pointer must press again. */
function onHold(element, takeHold, move, letGo) {
  let pointer = null;
  element.addEventListener('pointerdown', (event) => {
    if (pointer !== null || event.button !== 0) return;
    pointer = event.pointerId;
    element.setPointerCapture(pointer);
    element.classList.add('held');
    takeHold(event);
  });
  element.addEventListener('pointermove', (event) => {
    if (event.pointerId === pointer) move(event);
  });
  const end = (event) => {
    if (event.pointerId !== pointer) return;
    pointer = null;
    element.classList.remove('held');
    letGo();
  };
  for (const type of ['pointerup', 'pointercancel', 'lostpointercapture']) {
    element.addEventListener(type, end);
  }
  element.addEventListener('contextmenu', (event) => event.preventDefault());
  return () => { if (pointer !== null) end({pointerId: pointer}); };
}

// -- the keyboard

/** The keys of the pad. A pressed arrow key is a stick at half deflection. The keys A, B, Y are the
 *  buttons. Space and Escape stop the robot. */
export class Keys {
  /** `stop()` returns false if this page may not stop. */
  constructor(pad, stop) {
    Object.assign(this, {_pad: pad, _stop: stop});
    this._arrows = new Set();
    this._spaceStops = false;      // did the latest press of the space key stop the robot?
    // In the capture phase this listener gets the stop key before every element of the page.
    addEventListener('keydown', (event) => this._onKeyDown(event), true);
    addEventListener('keyup', (event) => this._onKeyUp(event), true);
    // A window without the focus gets no event when a key goes up.
    addEventListener('blur', () => this.release());
  }

  /** Let the arrow keys go. If a key is still down, the person must press the key again. */
  release() {
    this._arrows.clear();
    this._pad.release('keys');
  }

  _onKeyDown(event) {
    if (event.key === ' ' || event.key === 'Escape') { this._pressStopKey(event); return; }
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.(TYPING)) return;
    if (event.key in ARROWS) { this._pressArrow(event); return; }
    const key = event.key.toLowerCase();
    if (!event.repeat && PAD_BUTTONS.includes(key)) this._pad.press(key);
  }

  _pressStopKey(event) {
    if (!event.repeat) this._spaceStops = this._stop() && event.key === ' ';
    // The space key must neither press the focused button nor scroll the page.
    if (this._spaceStops) event.preventDefault();
  }

  _pressArrow(event) {
    if (!this._pad.isEnabled) return;
    event.preventDefault();
    if (event.repeat) return;          // after a stop, a key that is still down repeats
    this._arrows.add(event.key);
    if (!this._pad.isHeld('keys')) this._pad.hold('keys');
    this._moveKeys();
  }

  _onKeyUp(event) {
    if (event.key === ' ' && this._spaceStops) event.preventDefault();
    if (!this._arrows.delete(event.key)) return;
    if (this._arrows.size) this._moveKeys(); else this._pad.release('keys');
  }

  _moveKeys() {
    let forward = 0, left = 0;
    for (const key of this._arrows) {
      const [up, aside] = ARROWS[key];
      forward += up;
      left += aside;
    }
    this._pad.move('keys', {forward, left});
  }
}

// -- a real gamepad

export class RealGamepad {
  /** `show(text)` shows a text about the gamepad. */
  constructor(pad, show) {
    this._pad = pad;
    this._show = show;
    this._timer = 0;
    this._isArmed = false;      // If false, only B is sent. See disarm().
    this._lastState = {};
    addEventListener('gamepadconnected', () => this._findGamepad());
    addEventListener('gamepaddisconnected', () => this._findGamepad());
  }

  /** Send only B until the person has let go of all sticks and buttons. */
  disarm() {
    this._isArmed = false;
    this._lastState = {};
  }

  _findGamepad() {
    const pads = [...navigator.getGamepads()].filter(Boolean);
    const usablePad = pads.find((pad) => pad.mapping === 'standard');
    clearInterval(this._timer);
    this.disarm();
    this._isBPressed = false;
    this._pad.release('gamepad');
    if (usablePad) {
      this._index = usablePad.index;
      this._timer = setInterval(() => this._poll(), POLL_PERIOD);
      this._show('Gamepad: ' + usablePad.id);
    } else {
      this._show(pads.length
        ? `Gamepad "${pads[0].id}" is not used: its mapping is not "standard".` : '');
    }
  }

  _poll() {
    const pad = navigator.getGamepads()[this._index];
    if (!pad || !pad.connected) { this._findGamepad(); return; }
    const now = stateOf(pad);
    if (now.b !== this._isBPressed) {
      this._isBPressed = now.b;
      if (now.b) this._pad.press('b');
    }
    const isStill = Math.abs(now.forward) < TOUCH_ZONE && Math.abs(now.left) < TOUCH_ZONE;
    const isPressed = Object.keys(BUTTONS).some((name) => now[name]);
    if (document.hidden || !this._pad.isEnabled) this.disarm();
    else if (!this._isArmed) this._isArmed = isStill && !isPressed;
    else this._drive(now, isStill);
  }

  _drive(now, isStill) {
    const isTouched = !isStill || now.hold;
    if (isTouched && !this._pad.isHeld('gamepad')) this._pad.hold('gamepad', now.hold);
    if (isTouched) this._pad.move('gamepad', now, now.hold);
    else this._pad.release('gamepad');
    for (const name of DRIVING_BUTTONS) {
      if (now[name] && !this._lastState[name]) this._pad.press(name);
    }
    this._lastState = now;
  }
}

function stateOf(pad) {
  const state = {forward: -(pad.axes[1] || 0), left: -(pad.axes[2] || 0)};
  for (const [name, index] of Object.entries(BUTTONS)) {
    state[name] = Boolean(pad.buttons[index]?.pressed);
  }
  return state;
}
