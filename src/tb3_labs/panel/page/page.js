// The elements of the page: their texts, messages to the person, the log, the help, the theme.

const STAYS = 6000;          // [ms] a message stays for so long, and longer with its length
const STAYS_A_LETTER = 40;   // [ms]
const MOST_LINES = 300;      // of the log
const MARKS = {info: '', warn: '\u25b2 ', error: '\u2716 '};

export const $ = (id) => document.getElementById(id);

/** Write a text only where it changes: less work, and no needless word of a screen reader. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function make(tag, className, text = '') {
  const element = document.createElement(tag);
  element.className = className;
  element.textContent = text;
  return element;
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

export function showBanner(connected) {
  document.body.dataset.connected = connected ? 'yes' : 'no';
  // Written anew, so that a screen reader tells it.
  $('banner').textContent = connected ? '' : 'not connected: nothing can be stopped from here';
}

export function flashBanner() {
  const banner = $('banner');
  banner.classList.remove('flash');
  void banner.offsetWidth;            // starts the animation anew
  banner.classList.add('flash');
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
  const item = make('li', line.level);
  const node = make('b', '', (MARKS[line.level] || '') + line.node);
  item.append(make('time', '', line.time), ' ', node, ' ', line.text);
  return item;
}

// -- the list of keys

/** It is not modal: STOP must stay within reach. */
export const help = {
  toggle() {
    if ($('help').open) { help.close(); return; }
    $('help').show();
    $('help-close').focus();
  },

  close() {
    if (!$('help').open) return;
    $('help').close();
    $('help-open').focus();
  },
};

// -- the theme

/** The system's theme, until the button shows the other one; `changed()` is called at first and
 *  after each change. */
export function startTheme(button, changed) {
  const dark = matchMedia('(prefers-color-scheme: dark)');
  const page = document.documentElement.dataset;
  const show = (theme) => {
    page.theme = theme;
    changed();
  };
  const follow = () => show(dark.matches ? 'dark' : 'light');
  button.addEventListener('click', () => show(page.theme === 'dark' ? 'light' : 'dark'));
  dark.addEventListener('change', follow);
  follow();
}
