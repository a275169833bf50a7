// The controls of the page. A control sends a request of the person to the panel.
//
// The panel may refuse a request. Then the page shows the reason.

import {degrees, radians} from './drawing.js';
import {Keys, PAD_BUTTONS, RealGamepad, makeMousePad, makeStick, onPress} from './inputs.js';
import {MapInput} from './map.js';
import {$, onClick, say, setPressed, setText} from './page.js';

const MIN_DRAG_LENGTH = 14;    // [px] a shorter drag does not set the heading
/** {id of a button: turn [degrees]} */
const TURNS = new Map([['turn-left', 90], ['turn-about', 180], ['turn-right', -90]]);
const HANDS = ['pad', 'mouse'];      // the two inputs of a person who drives

export class Controls {
  /** `redraw()` draws the page again. */
  constructor({link, pad, map, redraw}) {
    Object.assign(this, {_link: link, _pad: pad, _redraw: redraw});
    this._mapInput = new PoseInput(map, {
      // a dragged pose is sent, and written into the fields
      redraw, placed: (kind, pose) => { fill(kind, pose); this._sendTyped(kind); },
    });
    this._letGoFunctions = [
      makeStick($('stick-left'), 'forward', pad), makeStick($('stick-right'), 'left', pad),
      makeMousePad($('mouse-pad'), pad)];
    for (const name of PAD_BUTTONS) onPress($('button-' + name), () => pad.press(name));
    this._keys = new Keys(pad, () => this._stop());
    this._gamepad = new RealGamepad(pad, (text) => setText($('gamepad-hint'), text));
    pad.onstop = () => this._stop();
    pad.ondrop = () => this._dropped();
    this._connect();
  }

  /** End a drive, because nobody sees a hidden page, and the timers of a hidden page are slow. */
  hide() {
    this._mapInput.cancel();
    if (!this._pad.drop()) return;
    say('The page was hidden: it drives again when something is gripped anew.', true);
  }

  // -- requests of a person

  async _request(message) {
    const answer = await this._link.ask(message);
    say(answer.text, !answer.ok);
  }

  _sendTyped(kind) {
    const [x, y, yaw_deg] = ['x', 'y', 'yaw'].map((part) => numberIn(`${kind}-${part}`));
    this._request({type: kind, x, y, yaw_deg});
  }

  /** Stop the robot after a press of STOP or B. Returns false if the panel only shows the robot. */
  _stop() {
    if (!this._pad.isEnabled) return false;
    this._mapInput.cancel();
    say('STOP: waiting for the answer');
    this._pad.stop().then(({ok, text}) => {
      const outcome = ok ? text : `STOP is not confirmed: ${text}`;
      say(outcome, !ok);
    });
    this._redraw();
    return true;
  }

  /** Show all sticks at rest. To drive, the person must take hold of a stick again. */
  _dropped() {
    for (const letGo of this._letGoFunctions) letGo();
    this._keys.release();
    this._gamepad.disarm();
  }

  // -- the page's elements

  _connect() {
    onPress($('stop'), () => this._stop());
    for (const [id, angle] of TURNS) {
      onClick(id, () => this._request({type: 'turn', degrees: angle}));
    }
    for (const name of HANDS) onClick('tab-' + name, () => this._showHand(name));
    for (const kind of ['goal', 'reset']) {
      onClick('tool-' + kind, () => this._mapInput.choose(kind));
      $(kind + '-form').addEventListener('submit', (event) => {
        event.preventDefault();
        this._sendTyped(kind);
      });
    }
  }

  _showHand(hand) {
    for (const letGo of this._letGoFunctions) letGo();
    for (const name of HANDS) {
      $(name).hidden = hand !== name;
      setPressed('tab-' + name, hand === name);
    }
    this._redraw();
  }
}

/** Reads a pose in local from a drag on the map while a tool is chosen. See also MapInput. */
class PoseInput extends MapInput {
  /** `placed(kind, pose)` is called with a dragged pose. */
  constructor(map, {redraw, placed}) {
    super(map, redraw);
    this._placed = placed;
    this._tool = null;                // null, 'goal' or 'reset'
    this._start = null;               // {pixel, point} at the start of a drag with a tool
  }

  choose(tool) {
    this._tool = this._tool === tool ? null : tool;
    this.cancel();
    showTool(this._tool);
  }

  /** End a drag without sending anything. */
  cancel() {
    this._start = null;
    this.map.draft = null;
    this.redraw();
  }

  down(event) {
    super.down(event);
    if (this.pointers.size > 1) { this.cancel(); return; }     // two fingers zoom
    if (!this._tool || event.button !== 0) return;
    const pixel = [event.offsetX, event.offsetY];
    const point = this.map.localAt(...pixel);
    if (!point) return;
    this._start = {pixel, point};
    this._show(pixel);
  }

  move(event) {
    if (this._start) this._show([event.offsetX, event.offsetY]); else super.move(event);
  }

  up(event) {
    if (!super.up(event) || !this._start) return;
    const {draft} = this.map, kind = this._tool;
    this.cancel();
    if (event.type !== 'pointerup' || !draft) return;
    this._tool = null;
    showTool(null);
    this._placed(kind, draft.pose);
  }

  /** Show the pose of the drag so far. After a short drag, the field gives the heading. */
  _show(endPixel) {
    const {pixel, point: [x, y]} = this._start;
    const end = this.map.localAt(...endPixel);
    if (!end) return;
    let yaw = radians(numberIn(this._tool + '-yaw') || 0);
    if (Math.hypot(endPixel[0] - pixel[0], endPixel[1] - pixel[1]) >= MIN_DRAG_LENGTH) {
      yaw = Math.atan2(end[1] - y, end[0] - x);
    }
    const name = this._tool === 'goal' ? 'goal' : 'robot is at';
    const words = `${name} ${x.toFixed(2)} ${y.toFixed(2)} ${degrees(yaw).toFixed(0)}\u00b0`;
    this.map.draft = {pose: [x, y, yaw], words};
    this.redraw();
  }
}

function showTool(tool) {
  for (const name of ['goal', 'reset']) setPressed('tool-' + name, tool === name);
  $('map').classList.toggle('placing', tool !== null);
  if (tool === 'goal') say('Goal: press at the place, drag to the heading.');
  if (tool === 'reset') say('Reset: press where the robot is, drag to its heading.');
}

// -- the fields of the goal and of the reset: x and y [m], yaw [degrees], in the frame local

function fill(kind, pose) {
  const [x, y, yaw] = pose;
  $(kind + '-x').value = x.toFixed(3);
  $(kind + '-y').value = y.toFixed(3);
  $(kind + '-yaw').value = degrees(yaw).toFixed(1);
}

/** Returns the number in a field, with a point or a comma. Without a number, returns NaN, which the
 *  panel refuses. */
function numberIn(id) {
  const text = $(id).value.trim().replace(',', '.');
  return text === '' ? NaN : Number(text);
}
