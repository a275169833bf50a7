// Words for the person: a message for some seconds, and the state for screen readers.

import {$} from './page.js';

const STAYS = 6000;        // [ms] a message stays for so long, and longer with its length
const STAYS_A_LETTER = 40; // [ms]

let messageTimer = 0;

/** Show a text for some seconds. */
export function say(text, warning = false) {
  const box = $('message');
  box.textContent = text;
  box.className = warning ? 'warning shown' : 'shown';
  clearTimeout(messageTimer);
  messageTimer = setTimeout(() => box.classList.remove('shown'), STAYS + STAYS_A_LETTER * text.length);
}

let announced = '';

/** Tell a screen reader the state, but not each change of a number in it. */
export function announce(state) {
  const words = state.replace(/[\d.]+/g, '');
  if (words === announced) return;
  announced = words;
  $('live').textContent = state;
}
