// The log lines of all nodes, newest at the bottom, bounded.

const MOST = 300;
const MARKS = {info: '', warn: '\u25b2 ', error: '\u2716 '};

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
    while (list.childElementCount > MOST) list.firstElementChild.remove();
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
