// The page of the panel: it joins the socket, the map, the numbers and the controls.

import {readColours} from './drawing.js';
import {Holder} from './holder.js';
import {
  Keys, PAD_BUTTONS, RealGamepad, SHORTCUTS, mousePad, padButton, stick,
} from './inputs.js';
import {Link} from './link.js';
import {FRAMES, RobotMap, Trail} from './map.js';
import {
  $, LogBox, announce, fill, make, say, setText, startTheme, typedRequest, typedYaw,
} from './page.js';
import {Robots, showControls, showStatus} from './status.js';
import {Strip} from './strips.js';
import {MapInput} from './view.js';

const STRIPS_EVERY = 200;       // [ms]

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
const trails = {odom: new Trail(), local: new Trail()};
map.trails = trails;
const strips = {
  distance: new Strip($('strip-distance'), false), angle: new Strip($('strip-angle'), true),
};
const log = new LogBox($('log'), $('log-filter'));
const robots = new Robots($('robots'), $('class-map'), (name) => { location.hash = encodeURIComponent(name); });
const input = new MapInput(map, {redraw, placed, toolChanged, yawOf: typedYaw});

let known = {robots: [], control: false};    // the last hello
let robot = null;              // name of the robot that is looked at; null: the list, or none yet
let latest = null;             // the last picture of that robot
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
  if (latest) showStatus(latest);
  showControls(latest, link.connected, holder);
  setText($('title'), robot || (known.robots.length > 1 ? 'Robots' : 'Robot panel'));
  for (const frame of FRAMES) {
    $('fixed-' + frame).setAttribute('aria-pressed', String(map.fixed === frame));
  }
  map.draw();
  $('fit').setAttribute('aria-pressed', String(map.view.auto));
  drawStrips();
}

let stripsAt = -Infinity;

/** The strips move by few pixels a second: they need not be drawn at each picture. */
function drawStrips() {
  if (performance.now() - stripsAt < STRIPS_EVERY) return;
  stripsAt = performance.now();
  strips.distance.draw();
  strips.angle.draw();
}

async function request(message) {
  const answer = await link.ask(message);
  say(answer.text || (answer.ok ? 'done' : 'refused'), !answer.ok);
  return answer;
}

// -- messages of the panel

function hello(message) {
  known = message;
  map.radius = message.radius;
  document.body.dataset.control = message.control ? 'yes' : 'no';
  log.clear();
  robots.names(message.robots);
  look();
}

function connection(connected) {
  if (!connected) holder.silence();
  showBanner();
  redraw();
}

function see(picture) {
  if (picture.robot !== robot) return;
  const isReset = latest !== null && latest.epoch !== picture.epoch;
  latest = map.picture = picture;
  if (isReset) trails.local.lift();
  for (const frame of FRAMES) if (picture[frame]) trails[frame].add(picture[frame]);
  const [distance, angle] = picture.to_go || [null, null];
  strips.distance.add(picture.now, distance, isReset);
  strips.angle.add(picture.now, angle, isReset);
  holder.picture(picture);
  announce(picture.state || '');
  redraw();
}

function trail(message) {
  if (message.robot !== robot) return;
  for (const frame of FRAMES) trails[frame].replace(message[frame]);
  redraw();
}

function showBanner() {
  document.body.dataset.connected = link.connected ? 'yes' : 'no';
  // Written anew, so that a screen reader tells it.
  $('banner').textContent = link.connected ? '' : 'not connected: nothing can be stopped from here';
}

// -- which robot

/** Look at the robot that the address names, or at the only one; else at the list. */
function look() {
  const names = known.robots.map((item) => item.name);
  const asked = decodeURIComponent(location.hash.slice(1));
  const name = names.includes(asked) && asked !== '' ? asked : names.length === 1 ? names[0] : null;
  if (name !== robot) forget();
  robot = name;
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
  latest = map.picture = null;
  for (const frame of FRAMES) trails[frame].replace([]);
  strips.distance.clear();
  strips.angle.clear();
  map.view.auto = true;
}

addEventListener('hashchange', () => { if (known.robots.length) look(); });
$('back').addEventListener('click', toList);

function toList() {
  if (known.robots.length > 1) location.hash = '';
}

// -- requests of a person

/** False on a page that only shows, and in the list: it has nothing to stop. */
function stop() {
  if (!known.control || robot === null) return false;
  input.cancel();
  say('STOP: waiting for the answer');
  holder.stop().then((answer) => {
    if (link.connected) {
      say(answer.ok ? answer.text : `STOP is not confirmed: ${answer.text}`, !answer.ok);
      return;
    }
    say('not connected: nothing can be stopped from here', true);
    const banner = $('banner');
    banner.classList.remove('flash');
    void banner.offsetWidth;            // starts the animation anew
    banner.classList.add('flash');
  });
  redraw();
  return true;
}

/** As stop(): only the list, and a page that only shows, keep it from being sent. */
function take() {
  if (!known.control || robot === null) return;
  holder.took();
  request({type: 'take'});
}

/** A pose was dragged on the map: it is sent, and stays in the fields. */
function placed(kind, pose) {
  fill(kind, pose);
  sendTyped(kind);
}

function sendTyped(kind) {
  const message = typedRequest(kind);
  if (message) request(message);
}

function toolChanged(tool) {
  $('tool-goal').setAttribute('aria-pressed', String(tool === 'goal'));
  $('tool-reset').setAttribute('aria-pressed', String(tool === 'reset'));
  $('map').classList.toggle('placing', tool !== null);
  if (tool === 'goal') say('Goal: press at the place, drag to the heading.');
  if (tool === 'reset') say('Reset: press where the robot is, drag to its heading.');
}

function zoom(factor) {
  map.view.zoom(factor);
  redraw();
}

function fix(frame) {
  map.fix(frame);
  redraw();
}

/** Show or close the list of keys. It is not modal: STOP must stay within reach. */
function help() {
  if ($('help').open) { closeHelp(); return; }
  $('help').show();
  $('help-close').focus();
}

function closeHelp() {
  if (!$('help').open) return;
  $('help').close();
  $('help-open').focus();
}

function showHand(what) {
  for (const abandon of held) abandon();
  for (const name of ['pad', 'mouse']) {
    $(name).hidden = what !== name;
    $('tab-' + name).setAttribute('aria-pressed', String(what === name));
  }
  redraw();
}

// -- the page's elements

const onClick = (id, action) => $(id).addEventListener('click', action);

// A stop must not wait until the finger is lifted.
$('stop').addEventListener('pointerdown', stop);
$('stop').addEventListener('click', (event) => { if (event.detail === 0) stop(); });
onClick('give', () => holder.give());
onClick('take', take);
for (const [name, degrees] of [['left', 90], ['about', 180], ['right', -90]]) {
  onClick('turn-' + name, () => request({type: 'turn', degrees}));
}
for (const name of ['pad', 'mouse']) onClick('tab-' + name, () => showHand(name));
for (const kind of ['goal', 'reset']) {
  onClick('tool-' + kind, () => input.choose(kind));
  $(kind + '-form').addEventListener('submit', (event) => {
    event.preventDefault();
    sendTyped(kind);
  });
}

for (const frame of FRAMES) onClick('fixed-' + frame, () => fix(frame));
onClick('zoom-in', () => zoom(1.25));
onClick('zoom-out', () => zoom(0.8));
onClick('fit', () => { map.fit(); redraw(); });
onClick('help-open', help);
onClick('help-close', closeHelp);
for (const [keys, what, isControl] of SHORTCUTS) {
  const shown = isControl ? 'control' : '';
  $('keys').append(make('dt', shown, keys), make('dd', shown, what));
}
new ResizeObserver(redraw).observe($('map-box'));

/** What a key does for a button; a button that makes no sense now tells why. */
const click = (id) => () => {
  if (!known.control || robot === null) return;
  if ($(id).disabled) say($(id).title, true); else $(id).click();
};

/** May keys and a real gamepad drive now? */
function mayDrive() {
  if (!known.control || robot === null || !link.connected) return false;
  return Boolean(latest?.can.pad) && latest.page !== 'other';
}

/** What a key does for the map. */
const view = (action) => () => { if (robot !== null) action(); };
const keys = new Keys(holder, {
  stop,
  escape: closeHelp,
  driving: mayDrive,
  actions: {
    1: click('turn-left'), 2: click('turn-about'), 3: click('turn-right'),
    g: click('tool-goal'), r: click('tool-reset'),
    v: view(() => fix(map.fixed === 'odom' ? 'local' : 'odom')),
    '+': view(() => zoom(1.25)), '=': view(() => zoom(1.25)), '-': view(() => zoom(0.8)),
    f: view(() => $('fit').click()), w: view(() => $('log-filter').click()),
    t: () => $('theme').click(), u: toList, '?': help,
  },
});

startTheme($('theme'), () => {
  readColours();
  redraw();
});
const held = [stick($('stick-left'), 'forward', holder), stick($('stick-right'), 'left', holder),
              mousePad($('mouse-pad'), holder)];
for (const name of PAD_BUTTONS) padButton($('button-' + name), name, holder);
const gamepad = new RealGamepad(holder, mayDrive, (text) => setText($('gamepad-hint'), text));

holder.ontake = take;

// Anything that was held counts no more until it is gripped anew.
holder.ondrop = () => {
  for (const abandon of held) abandon();
  keys.forget();
  gamepad.disarm();
};

// A hidden page must not drive: its timers are slow, and nobody looks at it.
const hide = () => {
  input.cancel();
  if (!holder.silence()) return;
  say('The page was hidden: it drives again when something is gripped anew.', true);
};
document.addEventListener('visibilitychange', () => (document.hidden ? hide() : redraw()));
addEventListener('pagehide', hide);

showBanner();
redraw();

// For tests, and for the browser's console.
window.panel = {
  get latest() { return latest; },
  /** Client coordinates of a point in the frame local; null while that frame is unknown. */
  pixel(x, y) {
    const at = map.pixelOfLocal(x, y);
    const box = $('map').getBoundingClientRect();
    return at && [box.left + at[0], box.top + at[1]];
  },
};
