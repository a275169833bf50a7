// Poses in the plane: [x m, y m, yaw rad]. parent_T_child takes points of the child to the parent.

export function compose(a, b) {
  const c = Math.cos(a[2]), s = Math.sin(a[2]);
  return [a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], wrap(a[2] + b[2])];
}

export function inverse(a) {
  const c = Math.cos(a[2]), s = Math.sin(a[2]);
  return [-c * a[0] - s * a[1], s * a[0] - c * a[1], -a[2]];
}

export function wrap(angle) {
  return Math.atan2(Math.sin(angle), Math.cos(angle));
}

export const degrees = (rad) => rad * 180 / Math.PI;
export const radians = (deg) => deg * Math.PI / 180;

/** [x, y, yaw in degrees] of a pose. */
export const inDegrees = (pose) => [pose[0], pose[1], degrees(pose[2])];
