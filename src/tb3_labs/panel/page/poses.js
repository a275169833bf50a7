// The fields of the goal and of the reset: x and y [m], yaw [degrees], in the frame local.

import {inDegrees} from './se2.js';
import {say} from './messages.js';
import {$} from './page.js';

/** The heading that is typed for 'goal' or 'reset' [degrees]; 0 if there is none. */
export function typedYaw(kind) {
  return read(kind + '-yaw') || 0;
}

/** Write a pose into the fields of 'goal' or 'reset'. */
export function fill(kind, pose) {
  const [x, y, yaw] = inDegrees(pose);
  $(kind + '-x').value = x.toFixed(3);
  $(kind + '-y').value = y.toFixed(3);
  $(kind + '-yaw').value = yaw.toFixed(1);
}

/** The request that the fields describe, or null where a field holds no number. */
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

/** The number in a field, with a point or a comma; NaN where there is none. */
function read(id) {
  const text = $(id).value.trim().replace(',', '.');
  return text === '' ? NaN : Number(text);
}
