// The controls of the page. A control sends a request of the person to the panel.
//
// The panel decides whether a request is carried out. If a request would be refused now, the page
// disables the control, and the control's title shows the reason. STOP and B are never disabled.

import {Keys, PAD_BUTTONS, RealGamepad, mousePad, padButton, stick} from './inputs.js';
import {MapInput} from './map.js';
import {$, say, setPressed, setReason, setText} from './page.js';

const ABSENT_TEXTS = {
  goal: 'no node hears move_base_simple/goal', reset: 'no node offers reset_pose or set_pose',
  turn: 'no node hears turn (the handout\'s node reads its keyboard)',
  pad: 'no node hears joy: start a gamepad.py',
  mouse: 'no node hears mouse_info: start a turtlebot_controller.py',
};

/** id of a button -> turn [degrees] */
const TURNS = new Map([['turn-left', 90], ['turn-about', 180], ['turn-right', -90]]);
const HANDS = ['pad', 'mouse'];      // the two ways to drive by hand
/** {key of _reasons(): the ids of the elements that a reason disables} */
const CONTROLS = {
  turn: [...TURNS.keys()], goal: ['goal'], reset: ['reset'], mouse: ['mouse-pad'],
  pad: ['button-a', 'button-y', 'stick-left', 'stick-right'],
};

export class Controls {
  /** `state` is {control, picture} of the page. `redraw()` draws the page again. */
  constructor({link, pad, map, state, redraw}) {
    Object.assign(this, {_link: link, _pad: pad, _state: state, _redraw: redraw});
    new MapInput(map, redraw);
    // may keys and a real gamepad drive now?
    const driving = () => this._state.control && !this._reasons().pad;
    this._letGo = [stick($('stick-left'), 'forward', pad),
                   stick($('stick-right'), 'left', pad), mousePad($('mouse-pad'), pad)];
    for (const name of PAD_BUTTONS) padButton($('button-' + name), name, pad);
    this._keys = new Keys(pad, {driving, stop: () => this._stop()});
    this._gamepad = new RealGamepad(pad, driving, (text) => setText($('gamepad-hint'), text));
    pad.onstop = () => this._stop();
    pad.ondrop = () => this._dropped();
    this._connect();
  }

  /** Disable the controls that cannot be used now, and show the reasons. */
  show() {
    const reasons = this._reasons();
    for (const [kind, ids] of Object.entries(CONTROLS)) {
      for (const id of ids) setReason($(id), reasons[kind]);
    }
    setText($('drive-hint'), reasons.turn);
    setText($('poses-hint'), reasons.goal || reasons.reset);
    setText($('hand-hint'), $('pad').hidden ? reasons.mouse || this._mouseHint()
      : reasons.pad || this._padHint());
  }

  _mouseHint() { return this._pad.holdsMouse ? 'driving' : 'hold to drive'; }

  _padHint() {
    if (this._pad.hasGivenControl) {
      return 'move_to_goal drives while this page stays open and in sight';
    }
    return this._pad.isHeld ? this._state.picture?.pad : 'grip a stick to drive';
  }

  /** End a drive, because nobody sees a hidden page, and the timers of a hidden page are slow. */
  hide() {
    if (!this._pad.drop()) return;
    say('The page was hidden: it drives again when something is gripped anew.', true);
  }

  /** Returns {kind of control: the reason why it cannot be used now, or ''}. */
  _reasons() {
    const {picture} = this._state, can = picture?.can || {};
    const noPicture = picture ? '' : 'no data yet';
    const unknown = this._link.connected ? noPicture : 'not connected';
    const absent = (kind) => unknown || (can[kind] ? '' : ABSENT_TEXTS[kind]);
    const hasControl = picture?.has_control === true;
    const other = picture?.page === 'other' ? 'another page drives' : '';
    return {
      turn: absent('turn') || (hasControl ? 'move_to_goal has control: B takes it' : ''),
      goal: absent('goal'), reset: absent('reset'),
      pad: absent('pad') || other, mouse: absent('mouse') || other,
    };
  }

  // -- requests of a person

  async _request(message) {
    const answer = await this._link.ask(message);
    say(answer.text || (answer.ok ? 'done' : 'refused'), !answer.ok);
  }

  _sendTyped(kind) {
    const [x, y, yaw_deg] = ['x', 'y', 'yaw'].map((part) => numberIn(`${kind}-${part}`));
    this._request({type: kind, x, y, yaw_deg});
  }

  /** Stop the robot, after STOP or B. Returns false if this panel only shows the robot. */
  _stop() {
    if (!this._state.control) return false;
    say('STOP: waiting for the answer');
    this._pad.stop().then(({ok, text}) => {
      say(ok ? text : `STOP is not confirmed: ${text}`, !ok);
    });
    this._redraw();
    return true;
  }

  /** Show all sticks at rest. The person must grip again. */
  _dropped() {
    for (const letGo of this._letGo) letGo();
    this._keys.release();
    this._gamepad.disarm();
  }

  // -- the page's elements

  _connect() {
    // A stop must not wait until the person lifts the finger.
    $('stop').addEventListener('pointerdown', () => this._stop());
    $('stop').addEventListener('click', (event) => { if (event.detail === 0) this._stop(); });
    for (const [id, angle] of TURNS) {
      onClick(id, () => this._request({type: 'turn', degrees: angle}));
    }
    for (const name of HANDS) onClick('tab-' + name, () => this._showHand(name));
    for (const kind of ['goal', 'reset']) {
      $(kind + '-form').addEventListener('submit', (event) => {
        event.preventDefault();
        this._sendTyped(kind);
      });
    }
  }

  _showHand(hand) {
    for (const letGo of this._letGo) letGo();
    for (const name of HANDS) {
      $(name).hidden = hand !== name;
      setPressed('tab-' + name, hand === name);
    }
    this._redraw();
  }
}

const onClick = (id, action) => $(id).addEventListener('click', action);

// -- the fields of the goal and of the reset: x and y [m], yaw [degrees], in the frame local

/** The number in a field, with a point or a comma. No number gives NaN, which the panel refuses. */
function numberIn(id) {
  const text = $(id).value.trim().replace(',', '.');
  return text === '' ? NaN : Number(text);
}
