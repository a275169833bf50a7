// Which part of the plane the map shows: the point in its middle, and pixels per metre.

const LEAST = 4, MOST = 5000;       // [px/m]
const NARROWEST = 0.8;              // [m] to fit means to show at least this much

export class View {
  constructor() {
    this.x = 0;
    this.y = 0;
    this.scale = 100;
    this.auto = true;       // follows what is to be seen, until a person zooms or pans
    this.width = 0;
    this.height = 0;
  }

  /** Pixel on the canvas of a point in the fixed frame. */
  pixel(x, y) {
    return [this.width / 2 + (x - this.x) * this.scale, this.height / 2 - (y - this.y) * this.scale];
  }

  /** Point in the fixed frame at a pixel on the canvas. */
  point(px, py) {
    return [this.x + (px - this.width / 2) / this.scale, this.y - (py - this.height / 2) / this.scale];
  }

  /** The point under the pixel stays there. */
  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const [x, y] = this.point(px, py);
    this.scale = Math.max(LEAST, Math.min(MOST, this.scale * factor));
    this.x = x - (px - this.width / 2) / this.scale;
    this.y = y + (py - this.height / 2) / this.scale;
    this.auto = false;
  }

  pan(dx, dy) {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
    this.auto = false;
  }

  /** Show all of the points [[x, y], ...]. */
  fit(points) {
    const box = bounds(points);
    if (!box || !this.width) return;
    const [x0, y0, x1, y1] = box;
    // The buttons lie on the upper edge; a small canvas has no room for wide margins.
    const side = Math.min(64, this.width * 0.15), top = Math.min(96, this.height * 0.3), bottom = Math.min(64, this.height * 0.2);
    const across = this.width - 2 * side, up = this.height - top - bottom;
    const scale = Math.min(across / Math.max(x1 - x0, NARROWEST), up / Math.max(y1 - y0, NARROWEST));
    this.scale = Math.max(LEAST, Math.min(MOST, scale));
    this.x = (x0 + x1) / 2;
    this.y = (y0 + y1) / 2 + (top - bottom) / 2 / this.scale;
  }

  /** In automatic mode: fit again where something is outside, or all of it is small. */
  follow(points) {
    const box = bounds(points);
    if (!this.auto || !box || !this.width) return;
    const [x0, y1] = this.pixel(box[0], box[1]), [x1, y0] = this.pixel(box[2], box[3]);
    const outside = x0 < 24 || y0 < 56 || x1 > this.width - 24 || y1 > this.height - 30;
    const isWide = Math.max(box[2] - box[0], box[3] - box[1]) > NARROWEST;
    const small = x1 - x0 < this.width * 0.4 && y1 - y0 < this.height * 0.4;
    if (outside || (small && isWide)) this.fit(points);
  }
}

function bounds(points) {
  let box = null;
  for (const point of points) {
    if (!point) continue;
    if (!box) box = [point[0], point[1], point[0], point[1]];
    box = [Math.min(box[0], point[0]), Math.min(box[1], point[1]), Math.max(box[2], point[0]), Math.max(box[3], point[1])];
  }
  return box;
}
