// What the robot drove: points of one frame, bounded in number.

const MOST = 2000;        // points kept; beyond it every other one is dropped
const STEP = 0.004;       // [m] a nearer point adds nothing to the picture
const JUMP = 0.5;         // [m] between two pictures: the robot was put elsewhere, or restarted

export class Trail {
  constructor() {
    this.points = [];     // [x, y], or null where the line is broken
  }

  replace(points) {
    this.points = points.slice();
    this._bound();
  }

  add(pose) {
    const last = this.points[this.points.length - 1];
    const far = last ? Math.hypot(pose[0] - last[0], pose[1] - last[1]) : 0;
    if (last && far < STEP) return;
    if (far > JUMP) this.lift();
    this.points.push([pose[0], pose[1]]);
    this._bound();
  }

  /** The next point is not joined to the last one, e.g. after a reset of the frame. */
  lift() {
    if (this.points.length && this.points[this.points.length - 1]) this.points.push(null);
  }

  _bound() {
    while (this.points.length > MOST) {
      // Breaks stay, so that thinning never joins two pieces.
      let keep = false;
      this.points = this.points.filter((point) => { keep = !keep; return point === null || keep; });
    }
  }
}
