// The elements of the page: their texts, messages to the person, the log, the help, the theme.

const STAYS = 6000;          // [ms] least time for which a message stays; a long one stays longer
const STAYS_A_LETTER = 40;   // [ms]
const MOST_LINES = 300;      // of the log
const MARKS = {info: '', warn: '\u25b2 ', error: '\u2716 '};

export const $ = (id) => document.getElementById(id);

/** Write a text only if it changes: a screen reader does not repeat it, and it costs less. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function setPressed(id, pressed) {
  $(id).setAttribute('aria-pressed', String(pressed));
}

export function make(tag, className, text = '') {
  const element = document.createElement(tag);
  element.className = className;
  element.textContent = text;
  return element;
}

/** A control that makes no sense now is disabled, and says why. */
export function setReason(element, reason) {
  element.dataset.plainTitle ??= element.title;
  element.title = reason || element.dataset.plainTitle;
  element.disabled = Boolean(reason);
  element.setAttribute('aria-disabled', String(Boolean(reason)));
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
  if (words !== announced) $('live').textContent = state;
  announced = words;
}

export function showBanner(connected) {
  document.body.dataset.connected = connected ? 'yes' : 'no';
  // Written anew, so that a screen reader tells it.
  $('banner').textContent = connected ? '' : 'not connected: nothing can be stopped from here';
}

// -- the log

/** The log lines of all nodes, newest at the bottom, bounded. */
export const log = {
  clear() { $('log').replaceChildren(); },

  add(lines) {
    const list = $('log');
    // A reader who scrolled back stays where he is.
    const atEnd = list.scrollHeight - list.scrollTop - list.clientHeight < 30;
    list.append(...lines.map(entry));
    while (list.childElementCount > MOST_LINES) list.firstElementChild.remove();
    if (atEnd) list.scrollTop = list.scrollHeight;
  },

  /** Show all lines, or warnings and errors alone. */
  filter() {
    const only = $('log').classList.toggle('warnings-only');
    setPressed('log-filter', only);
    $('log').scrollTop = $('log').scrollHeight;
  },
};

function entry(line) {
  const item = make('li', line.level);
  const node = make('b', '', (MARKS[line.level] || '') + line.node);
  item.append(make('time', '', line.time), ' ', node, ' ', line.text);
  return item;
}

/** The list of keys is not modal: STOP must stay within reach. */
export function toggleHelp() {
  if ($('help').open) $('help').close(); else $('help').show();
}

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
