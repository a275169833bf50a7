// The numbers and words about the robot that the page looks at.

import {degrees, wrap} from './se2.js';
import {$, number, setHidden, setText} from './page.js';

const LONG = 60;         // letters
const LATE = 0.5;        // [s] an older message of a sensor is marked

const SHAPES = {driving: '\u25b6', reached: '\u2714', waiting: '\u25cf', stopped: '\u25a0', 'gave up': '\u2716', '': '\u25cb'};

export function showStatus(p) {
  setText($('state'), p.state || 'state unknown');
  $('state').title = p.state;
  // The bar cuts a long reason off: it is shown in full here.
  setHidden($('reason'), (p.state || '').length <= LONG);
  setText($('reason'), p.state || '');
  setText($('phase'), SHAPES[p.phase] ?? SHAPES['']);
  $('state-box').dataset.phase = p.phase || 'none';
  setText($('distance'), p.to_go ? number(p.to_go[0], 3, ' m') : number(null));
  setText($('angle'), p.to_go ? number(p.to_go[1], 1, '\u00b0') : number(null));
  setText($('local-pose'), poseText(p.local));
  setText($('odom-pose'), poseText(p.odom));
  setText($('goal-pose'), poseText(p.goal));
  setText($('truth-error'), errorText(p));
  setText($('heading'), number(p.heading_deg, 1, '\u00b0'));
  setText($('command'), p.command ? `${number(p.command[0], 2)} m/s ${number(p.command[1], 2)} rad/s` : number(null));
  setText($('holder'), p.holder || 'unknown');
  setText($('driver'), p.driver || 'nobody');
  showAges(p.ages || {});
}

function poseText(pose) {
  return pose ? `${number(pose[0], 3)} ${number(pose[1], 3)} ${number(degrees(pose[2]), 1, '\u00b0')}` : number(null);
}

/** The difference between the true pose and odometry. */
function errorText(p) {
  if (!p.truth || !p.odom) return number(null);
  const off = Math.hypot(p.truth[0] - p.odom[0], p.truth[1] - p.odom[1]);
  return `${number(off * 1000, 1)} mm ${number(degrees(wrap(p.truth[2] - p.odom[2])), 2, '\u00b0')}`;
}

function showAges(ages) {
  const box = $('ages');
  for (const [name, age] of Object.entries(ages)) {
    let chip = box.querySelector(`[data-name="${CSS.escape(name)}"]`);
    if (!chip) {
      chip = document.createElement('span');
      chip.dataset.name = name;
      box.append(chip);
    }
    const late = age !== null && age > LATE;
    chip.className = age === null ? 'never' : late ? 'late' : 'fresh';
    const silent = (late ? '\u25b2 silent for ' : 'silent for ') + (age || 0).toFixed(age < 10 ? 1 : 0) + ' s';
    setText(chip, name + ' ' + (age === null ? 'never heard' : age ? silent : 'fresh'));
  }
}
