// The sticks, the buttons and the mouse pad on the screen. Each pointer holds its own element, so
// that several fingers work at once.

const NEAR = 0.04;        // a stick nearer to its middle than this is at rest

/** A stick that moves along one axis, 'forward' or 'left'. It counts from where it was gripped. */
export class Stick {
  constructor(element, axis, wheel) {
    this._element = element;
    this._knob = element.querySelector('.knob');
    this._axis = axis;
    this._wheel = wheel;
    this.abandon = onHold(element, (event) => this._grip(event), (event) => this._move(event), () => this._let());
  }

  _grip(event) {
    this._from = [event.clientX, event.clientY];
    this._element.classList.add('held');
    this._wheel.grip(this._element.id);
  }

  _move(event) {
    const travel = this._travel();
    const up = this._axis === 'forward';
    let value = (up ? this._from[1] - event.clientY : this._from[0] - event.clientX) / travel;
    value = Math.max(-1, Math.min(1, value));
    if (Math.abs(value) < NEAR) value = 0;
    this._show(value);
    this._wheel.move(this._element.id, up ? value : 0, up ? 0 : value);
  }

  _let() {
    this._element.classList.remove('held');
    this._show(0);
    this._wheel.release(this._element.id);
  }

  _travel() {
    const box = this._element.getBoundingClientRect();
    const knob = this._knob.getBoundingClientRect();
    return this._axis === 'forward' ? (box.height - knob.height) / 2 : (box.width - knob.width) / 2;
  }

  _show(value) {
    const shift = Math.round(-value * this._travel());
    this._knob.style.transform = this._axis === 'forward' ? `translateY(${shift}px)` : `translateX(${shift}px)`;
  }
}

/** A square whose middle is (0, 0); x right, y up, each from -1 to 1. */
export class MousePad {
  constructor(element, wheel) {
    this._element = element;
    this._dot = element.querySelector('.dot');
    this._wheel = wheel;
    this.abandon = onHold(element, (event) => this._hold(event), (event) => this._hold(event), () => this._let());
  }

  _hold(event) {
    const box = this._element.getBoundingClientRect();
    const clamp = (value) => Math.max(-1, Math.min(1, value));
    const x = clamp((event.clientX - box.left) / box.width * 2 - 1);
    const y = clamp(1 - (event.clientY - box.top) / box.height * 2);
    this._show(x, y);
    this._wheel.holdMouse(x, y);
    this._element.classList.add('held');
  }

  _let() {
    this._element.classList.remove('held');
    this._show(0, 0);
    this._wheel.releaseMouse();
  }

  _show(x, y) {
    this._dot.style.left = 50 + 50 * x + '%';
    this._dot.style.top = 50 - 50 * y + '%';
  }
}

/** A button of the pad: down while it is pressed. Enter presses it for a moment. */
export function padButton(element, name, wheel) {
  onHold(element, () => wheel.press(name), () => {}, () => wheel.lift(name));
  element.addEventListener('click', (event) => {
    if (event.detail !== 0) return;      // a pointer's click was told already
    wheel.press(name);
    wheel.lift(name);
  });
}

/** Calls back when a pointer grips the element, moves, and lets go in any way.
 *  Returns a function that ends the hold: the pointer must then press anew. */
function onHold(element, grip, move, letGo) {
  let pointer = null;
  element.addEventListener('pointerdown', (event) => {
    if (pointer !== null || event.button !== 0 || element.disabled) return;
    if (element.getAttribute('aria-disabled') === 'true') return;
    pointer = event.pointerId;
    element.setPointerCapture(pointer);
    grip(event);
  });
  element.addEventListener('pointermove', (event) => { if (event.pointerId === pointer) move(event); });
  const end = (event) => {
    if (event.pointerId !== pointer) return;
    pointer = null;
    letGo(event);
  };
  for (const type of ['pointerup', 'pointercancel', 'lostpointercapture']) element.addEventListener(type, end);
  element.addEventListener('contextmenu', (event) => event.preventDefault());
  return () => { if (pointer !== null) end({pointerId: pointer}); };
}
