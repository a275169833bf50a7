// The elements of the page: their texts, messages to the person, the log, the fields, the theme.

import {degrees} from './view.js';

const STAYS = 6000;          // [ms] a message stays for so long, and longer with its length
const STAYS_A_LETTER = 40;   // [ms]
const MOST_LINES = 300;      // of the log
const MARKS = {info: '', warn: '\u25b2 ', error: '\u2716 '};
const THEMES = ['auto', 'light', 'dark'];

export const $ = (id) => document.getElementById(id);

/** Write a text only where it changes: less work, and no needless word of a screen reader. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function setHidden(element, hidden) {
  if (element.hidden !== hidden) element.hidden = hidden;
}

/** A control that makes no sense now is disabled, and says why. */
export function setReason(button, reason) {
  if (!('plainTitle' in button.dataset)) button.dataset.plainTitle = button.title;
  button.disabled = Boolean(reason);
  const title = reason || button.dataset.plainTitle;
  if (button.title !== title) button.title = title;
}

/** A number with so many digits; a dash if it is unknown. -0.0 is shown as 0.0. */
export function number(value, digits, unit = '') {
  if (value === null || value === undefined || !Number.isFinite(value)) return '\u2013';
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? text.replace('-', '') : text) + unit;
}

// -- messages

let messageTimer = 0;

/** Show a text for some seconds. */
export function say(text, warning = false) {
  const box = $('message');
  box.textContent = text;
  box.className = warning ? 'warning shown' : 'shown';
  clearTimeout(messageTimer);
  const stays = STAYS + STAYS_A_LETTER * text.length;
  messageTimer = setTimeout(() => box.classList.remove('shown'), stays);
}

let announced = '';

/** Tell a screen reader the state, but not each change of a number in it. */
export function announce(state) {
  const words = state.replace(/[\d.]+/g, '');
  if (words === announced) return;
  announced = words;
  $('live').textContent = state;
}

// -- the log

/** The log lines of all nodes, newest at the bottom, bounded. */
export class LogBox {
  constructor(list, filter) {
    this._list = list;
    filter.addEventListener('click', () => {
      const only = filter.getAttribute('aria-pressed') !== 'true';
      filter.setAttribute('aria-pressed', String(only));
      list.classList.toggle('warnings-only', only);
      list.scrollTop = list.scrollHeight;
    });
  }

  clear() { this._list.replaceChildren(); }

  add(lines) {
    const list = this._list;
    // A reader who scrolled back stays where he is.
    const atEnd = list.scrollHeight - list.scrollTop - list.clientHeight < 30;
    list.append(...lines.map(entry));
    while (list.childElementCount > MOST_LINES) list.firstElementChild.remove();
    if (atEnd) list.scrollTop = list.scrollHeight;
  }
}

function entry(line) {
  const item = document.createElement('li');
  item.className = line.level;
  const time = document.createElement('time');
  time.textContent = line.time;
  const node = document.createElement('b');
  node.textContent = (MARKS[line.level] || '') + line.node;
  item.append(time, ' ', node, ' ', line.text);
  return item;
}

// -- the fields of the goal and of the reset: x and y [m], yaw [degrees], in the frame local

/** The heading that is typed for 'goal' or 'reset' [degrees]; 0 if there is none. */
export function typedYaw(kind) {
  return read(kind + '-yaw') || 0;
}

/** Write a pose into the fields of 'goal' or 'reset'. */
export function fill(kind, pose) {
  const [x, y, yaw] = pose;
  $(kind + '-x').value = x.toFixed(3);
  $(kind + '-y').value = y.toFixed(3);
  $(kind + '-yaw').value = degrees(yaw).toFixed(1);
}

/** The request that the fields describe, or null if a field holds no number. */
export function typedRequest(kind) {
  const [x, y, yaw_deg] = ['x', 'y', 'yaw'].map((part) => {
    const value = read(`${kind}-${part}`);
    $(`${kind}-${part}`).setAttribute('aria-invalid', String(!Number.isFinite(value)));
    return value;
  });
  if ([x, y, yaw_deg].every(Number.isFinite)) return {type: kind, x, y, yaw_deg};
  say('x, y and yaw must be numbers', true);
  return null;
}

/** The number in a field, with a point or a comma; NaN if there is none. */
function read(id) {
  const text = $(id).value.trim().replace(',', '.');
  return text === '' ? NaN : Number(text);
}

// -- the theme

/** Let the button change the theme: light, dark, or as the system has it; `changed()` is called at
 *  first and after each change. */
export function startTheme(button, changed) {
  let theme = stored() || 'auto';
  const apply = () => {
    document.documentElement.dataset.theme = theme;
    button.firstElementChild.textContent = {auto: '\u25d0', light: '\u2600', dark: '\u263e'}[theme];
    button.lastElementChild.textContent = theme;
    button.setAttribute('aria-label', 'Theme: ' + theme);
    changed();
  };
  button.addEventListener('click', () => {
    theme = THEMES[(THEMES.indexOf(theme) + 1) % THEMES.length];
    keep(theme);
    apply();
  });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', apply);
  apply();
}

// A browser that keeps nothing (private mode) must not break the page.
function stored() {
  try {
    return THEMES.find((theme) => theme === localStorage.getItem('panel-theme'));
  } catch (error) {
    return null;
  }
}

function keep(theme) {
  try { localStorage.setItem('panel-theme', theme); } catch (error) { /* not kept */ }
}
