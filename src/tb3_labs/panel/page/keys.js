// The keyboard: shortcuts, and the arrows as sticks at half deflection while they are held.

const HALF = 0.5;
const ARROWS = {ArrowUp: [HALF, 0], ArrowDown: [-HALF, 0], ArrowLeft: [0, HALF], ArrowRight: [0, -HALF]};
const TYPING = 'input, textarea, select';

export class Keys {
  /** `actions`: key -> function; `stop()`: false where there is nothing to stop; `driving()`: may the arrows drive now? */
  constructor(wheel, {actions, buttons, stop, escape, driving, pan}) {
    Object.assign(this, {_wheel: wheel, _actions: actions, _buttons: buttons, _stop: stop, _escape: escape, _driving: driving, _pan: pan});
    this._arrows = new Set();
    this._spaceStops = false;      // was the space key, when it went down, a stop?
    // In the capture phase: nothing on the page can keep the stop key for itself.
    addEventListener('keydown', (event) => this._down(event), true);
    addEventListener('keyup', (event) => this._up(event), true);
    // A window without the focus hears of no key that is let go.
    addEventListener('blur', () => this.release());
  }

  /** The arrows are let go; a key that is still down must be pressed anew. */
  release() {
    this._arrows.clear();
    this._wheel.release('keys');
    // A button that is held by a key counts as let go as well.
    for (const name of Object.values(this._buttons)) this._wheel.lift(name);
  }

  /** Forget the arrows without telling the wheel, which has dropped them already. */
  forget() { this._arrows.clear(); }

  _down(event) {
    if (event.key === ' ' || event.key === 'Escape') { this._stopKey(event); return; }
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.(TYPING)) return;
    if (event.key in ARROWS) { this._arrow(event); return; }
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (event.repeat && key !== '+' && key !== '-') return;
    if (key === 'b' || (key in this._buttons && this._driving())) {
      this._wheel.press(this._buttons[key]);
      return;
    }
    const action = this._actions[key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  _stopKey(event) {
    if (event.key === 'Escape') this._escape();
    if (event.repeat ? this._spaceStops : this._stop()) {
      // The space key must not press the button that has the focus, nor scroll.
      if (event.key === ' ') event.preventDefault();
      this._spaceStops = event.key === ' ';
    } else {
      this._spaceStops = false;
    }
  }

  _arrow(event) {
    if (event.shiftKey) {
      const [up, left] = ARROWS[event.key];
      this._pan(left * 120, up * 120);
      event.preventDefault();
      return;
    }
    if (!this._driving()) return;
    event.preventDefault();
    if (event.repeat) return;          // after a stop a key that is still down counts no more
    this._arrows.add(event.key);
    if (!this._wheel.has('keys')) this._wheel.grip('keys');
    this._move();
  }

  _up(event) {
    if (event.key === ' ' && this._spaceStops) event.preventDefault();
    const button = this._buttons[event.key?.toLowerCase()];
    if (button) this._wheel.lift(button);
    if (!this._arrows.delete(event.key)) return;
    if (this._arrows.size) this._move(); else this._wheel.release('keys');
  }

  _move() {
    let forward = 0, left = 0;
    for (const key of this._arrows) { forward += ARROWS[key][0]; left += ARROWS[key][1]; }
    this._wheel.move('keys', forward, left);
  }
}

/** The table of the help: [keys, what they do, is it a control?]. */
export const SHORTCUTS = [
  ['Space, Escape', 'STOP', true],
  ['arrows', 'drive, at half speed, while held', true],
  ['A', 'pad: move_to_goal drives', true],
  ['B', 'pad: take the robot back', true],
  ['Y', 'pad: here is the origin', true],
  ['1, 2, 3', 'turn by 90, 180, \u221290 degrees', true],
  ['G', 'drag a goal on the map', true],
  ['R', 'drag on the map where the robot is', true],
  ['V', 'the other frame stands still', false],
  ['+, \u2212', 'zoom', false],
  ['F', 'show everything', false],
  ['Shift + arrows', 'move the map', false],
  ['W', 'only warnings in the log', false],
  ['T', 'light, dark, or as the system', false],
  ['U', 'back to the list of robots', false],
  ['?', 'this list', false],
];
