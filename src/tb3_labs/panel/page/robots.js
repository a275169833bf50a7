// The list of robots: a card for each one.

import {setText} from './page.js';

export class Robots {
  constructor(list, choose) {
    this._list = list;
    this._choose = choose;
    this._cards = new Map();
  }

  /** Cards for these names; those that stay keep the keyboard's focus. */
  names(robots) {
    const names = robots.map((robot) => robot.name);
    if (names.length === this._cards.size && names.every((name) => this._cards.has(name))) return;
    this._cards.clear();
    this._list.replaceChildren(...names.map((name) => this._card(name)));
  }

  show(robots) {
    this.names(robots);
    for (const robot of robots) fill(this._cards.get(robot.name), robot);
  }

  _card(name) {
    const item = document.createElement('li');
    const button = document.createElement('button');
    button.type = 'button';
    button.id = 'robot-' + name;
    button.className = 'robot-card';
    for (const part of ['name', 'distance', 'state', 'holder', 'age']) {
      const span = document.createElement('span');
      span.className = part;
      button.append(span);
    }
    button.querySelector('.name').textContent = name || 'robot';
    button.addEventListener('click', () => this._choose(name));
    item.append(button);
    this._cards.set(name, button);
    return item;
  }
}

function fill(card, robot) {
  const late = robot.age === null || robot.age > 1;
  card.dataset.phase = late ? 'silent' : robot.phase || 'none';
  setText(card.querySelector('.state'), robot.state || 'state unknown');
  setText(card.querySelector('.distance'), robot.distance === null || robot.distance === undefined ? '' : robot.distance.toFixed(2) + ' m');
  setText(card.querySelector('.holder'), robot.holder || '');
  setText(card.querySelector('.age'), (late ? '\u25b2 ' : '') + ageText(robot.age));
}

function ageText(age) {
  if (!age) return age === null ? 'never heard' : 'data fresh';
  return `silent for ${age.toFixed(1)} s`;
}
