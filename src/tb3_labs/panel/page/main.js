// The main program of the page receives the messages of the panel, and draws the page.

import {Controls} from './controls.js';
import {Link} from './link.js';
import {FRAMES, RobotMap} from './map.js';
import {Pad} from './pad.js';
import {$, log, onClick, say, setPressed, setText, showBanner, showStatus} from './page.js';

const link = new Link({
  hello, connection, picture: see,
  log: ({lines}) => log.add(lines),
  refused: ({text}) => { pad.drop(); say(text, true); },
});
const pad = new Pad(link, say);
const map = new RobotMap($('map'));

let lastPicture = null;
let isDrawDue = false;

// -- drawing: the page is drawn only after a change, at most one time in each frame of the browser

function redraw() {
  if (isDrawDue) return;
  isDrawDue = true;
  requestAnimationFrame(() => {
    isDrawDue = false;
    draw();
  });
}

function draw() {
  if (lastPicture) showStatus(lastPicture);
  setText($('hand-hint'), pad.hint);
  for (const frame of FRAMES) setPressed('fixed-' + frame, map.fixed === frame);
  map.draw();
  setPressed('fit', map.view.auto);
}

// -- messages of the panel

function hello({control, radius, robot}) {
  pad.isEnabled = control;
  map.radius = radius;
  document.body.dataset.control = control ? 'yes' : 'no';
  setText($('title'), robot || 'Robot panel');
  document.title = robot || 'Robot panel';
  log.clear();
  redraw();
}

function connection(isConnected) {
  if (!isConnected) pad.drop();
  showBanner(isConnected);
  redraw();
}

function see(picture) {
  lastPicture = picture;
  map.see(picture);
  pad.see(picture);
  redraw();
}

// -- the buttons that change only the map

function changeMap(change) {
  change();
  redraw();
}

onClick('fit', () => changeMap(() => map.fit()));
for (const frame of FRAMES) onClick('fixed-' + frame, () => changeMap(() => map.fix(frame)));

const controls = new Controls({link, pad, map, redraw});

document.addEventListener('visibilitychange', () => {
  if (document.hidden) controls.hide(); else redraw();
});
addEventListener('pagehide', () => controls.hide());
new ResizeObserver(redraw).observe($('map-box'));
showBanner(link.isConnected);
redraw();

// For tests, and for a person at the browser's console.
window.panel = {
  get latest() { return lastPicture; },
  /** Returns the client coordinates of a point in local; null if the frame local is unknown. */
  pixel(x, y) {
    const pixel = map.drawn('local', [x, y, 0]);
    const box = $('map').getBoundingClientRect();
    return pixel && [box.left + pixel[0], box.top + pixel[1]];
  },
};
