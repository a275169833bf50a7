// Which controls make sense now, and why the others do not.

import {$, setReason, setText} from './page.js';

const ABSENT = {goal: 'no node takes goals', reset: 'no node takes resets', control: 'no node waits for control',
                turn: 'no node turns the robot', pad: 'the node gamepad does not run', mouse: 'no node hears the mouse'};

const PAD = {ready: 'ready', connecting: 'connecting: hold still', 'held back': 'move_to_goal has control: B takes it',
             'no node': ABSENT.pad, '': 'grip a stick to drive'};

export function showControls(picture, connected, wheel) {
  const can = picture?.can || {};
  const absent = (what) => (!connected ? 'not connected' : !picture ? 'no data yet' : can[what] ? '' : ABSENT[what]);
  const other = picture?.page === 'other' ? 'another page drives' : '';
  const give = absent('control') || other || (picture.has_control === true ? 'move_to_goal has it already' : '');
  const turn = absent('turn') || (picture.has_control === true ? 'move_to_goal has control: take it first' : '');
  setReason($('give'), give);
  for (const id of ['turn-left', 'turn-about', 'turn-right']) setReason($(id), turn);
  const drag = picture && !picture.frame ? 'the frame local is not known yet' : '';
  setReason($('goal'), absent('goal'));
  setReason($('reset'), absent('reset'));
  setReason($('tool-goal'), absent('goal') || drag);
  setReason($('tool-reset'), absent('reset') || drag);
  const pad = absent('pad') || other, mouse = absent('mouse') || other;
  // A stop is never disabled: neither "take" nor B.
  for (const id of ['button-a', 'button-y']) setReason($(id), pad);
  inert($('stick-left'), pad);
  inert($('stick-right'), pad);
  inert($('mouse-pad'), mouse);
  // Without a connection the banner says it once for all.
  const words = connected && picture ? join : () => '';
  const keep = wheel.gave ? 'move_to_goal drives while this page stays open and in sight' : '';
  setText($('drive-hint'), words(keep, picture?.has_control === true ? '' : named('give', give), named('turns', turn)));
  setText($('poses-hint'), words(named('goal', absent('goal')), named('reset', absent('reset')), named('drag', drag)));
  setText($('hand-hint'), $('pad').hidden ? mouse || (wheel.holdsMouse ? 'driving' : 'hold to drive') : pad || padWords(picture, wheel));
}

function padWords(picture, wheel) {
  if (wheel.spent) return picture.pad === 'held back' ? PAD['held back'] : 'let go, and grip again';
  if (wheel.phase === 'asking') return 'asking for the wheel';
  return PAD[picture.pad] ?? picture.pad;
}

function inert(element, reason) {
  element.setAttribute('aria-disabled', String(Boolean(reason)));
  if (element.title !== reason) element.title = reason;
}

const named = (name, reason) => (reason ? `${name}: ${reason}` : '');
const join = (...texts) => [...new Set(texts.filter(Boolean))].join(' \u00b7 ');
