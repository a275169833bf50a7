// The page of the panel: which robot it looks at, the messages of the panel, and when it draws.

import {Controls} from './controls.js';
import {readColours} from './drawing.js';
import {Holder} from './holder.js';
import {Link} from './link.js';
import {FRAMES, RobotMap} from './map.js';
import {
  $, announce, log, say, setPressed, setText, showBanner, startTheme, toggleHelp,
} from './page.js';
import {Robots, Strip, showStatus} from './status.js';

const link = new Link({
  hello, connection, picture: see, trail,
  robots: (message) => robots.show(message.robots),
  log: ({all, lines}) => {
    if (all) log.clear();
    log.add(lines);
  },
  note: ({text, warning}) => say(text, warning),
});
const holder = new Holder(link, say);
const map = new RobotMap($('map'));
const strips = [new Strip($('strip-distance'), false), new Strip($('strip-angle'), true)];
const robots = new Robots($('robots'), $('class-map'), (name) => {
  location.hash = encodeURIComponent(name);
});

/** The robot that the page looks at (null: the list, or none yet), its last picture, and whether
 *  this panel lets pages control it. */
const seen = {robot: null, picture: null, control: false};
let names = [];                // of all robots
let drawing = false;

// -- drawing: at most once a frame, and only when something is new

function redraw() {
  if (drawing) return;
  drawing = true;
  requestAnimationFrame(() => {
    drawing = false;
    draw();
  });
}

function draw() {
  if (seen.picture) showStatus(seen.picture);
  controls.show();
  setText($('title'), seen.robot || (names.length > 1 ? 'Robots' : 'Robot panel'));
  for (const frame of FRAMES) {
    setPressed('fixed-' + frame, map.fixed === frame);
    $('fixed-' + frame).dataset.key = map.fixed === frame ? '' : 'v';
  }
  map.draw();
  setPressed('fit', map.view.auto);
  for (const strip of strips) strip.draw();
}

// -- messages of the panel

function hello(message) {
  names = message.robots.map((robot) => robot.name);
  seen.control = message.control;
  map.radius = message.radius;
  document.body.dataset.control = message.control ? 'yes' : 'no';
  log.clear();
  robots.names(names);
  look();
}

function connection(connected) {
  if (!connected) holder.silence();
  showBanner(connected);
  redraw();
}

function see(picture) {
  if (picture.robot !== seen.robot) return;
  seen.picture = picture;
  const isReset = map.see(picture);
  for (const strip of strips) strip.add(picture, isReset);
  holder.picture(picture);
  announce(picture.state);
  redraw();
}

function trail(message) {
  if (message.robot !== seen.robot) return;
  map.replaceTrails(message);
  redraw();
}

// -- which robot

/** Look at the robot that the address names, or at the only one; else at the list. */
function look() {
  const asked = decodeURIComponent(location.hash.slice(1));
  const name = names.includes(asked) && asked !== '' ? asked : names.length === 1 ? names[0] : null;
  if (name !== seen.robot) forget();
  seen.robot = name;
  document.body.dataset.view = name === null ? 'list' : 'robot';
  $('robot-view').hidden = name === null;
  $('list-view').hidden = name !== null;
  $('back').hidden = names.length < 2 || name === null;
  link.send({type: 'look', robot: name});
  document.title = name || 'Robot panel';
  redraw();
}

function forget() {
  holder.letGo();
  seen.picture = null;
  map.forget();
  for (const strip of strips) strip.clear();
}

addEventListener('hashchange', () => { if (names.length) look(); });

// -- the buttons that control nothing

const changeMap = (change) => () => {
  change();
  redraw();
};
const buttons = {
  back: () => { location.hash = ''; }, 'help-open': toggleHelp, 'help-close': toggleHelp,
  'zoom-in': changeMap(() => map.view.zoom(1.25)), 'zoom-out': changeMap(() => map.view.zoom(0.8)),
  fit: changeMap(() => map.fit()), 'log-filter': log.filter,
};
for (const frame of FRAMES) buttons['fixed-' + frame] = changeMap(() => map.fix(frame));
for (const [id, action] of Object.entries(buttons)) $(id).addEventListener('click', action);

const controls = new Controls({link, holder, map, seen, redraw});

document.addEventListener('visibilitychange', () => {
  if (document.hidden) controls.hide(); else redraw();
});
addEventListener('pagehide', () => controls.hide());
new ResizeObserver(redraw).observe($('map-box'));
startTheme($('theme'), () => {
  readColours();
  redraw();
});
showBanner(link.connected);
redraw();

// For tests, and for the browser's console.
window.panel = {
  get latest() { return seen.picture; },
  /** Client coordinates of a point in the frame local; null while that frame is unknown. */
  pixel(x, y) {
    const at = map.pixelOfLocal(x, y);
    const box = $('map').getBoundingClientRect();
    return at && [box.left + at[0], box.top + at[1]];
  },
};
