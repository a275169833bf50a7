// The part of the plane that the map shows, and the pointers on it: pan, zoom, drag a pose.
//
// Poses are [x m, y m, yaw rad]; parent_T_child takes points of the child to the parent.

const LEAST = 4, MOST = 5000;       // [px/m]
const NARROWEST = 0.8;              // [m] to fit means to show at least this much
const HEADING_FROM = 14;      // [px] a shorter drag gives no heading

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

/** The middle of the map, and pixels per metre. */
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
    const {width, height, scale} = this;
    return [width / 2 + (x - this.x) * scale, height / 2 - (y - this.y) * scale];
  }

  /** Point in the fixed frame at a pixel on the canvas. */
  point(px, py) {
    const {width, height, scale} = this;
    return [this.x + (px - width / 2) / scale, this.y - (py - height / 2) / scale];
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
    const side = Math.min(64, this.width * 0.15), top = Math.min(96, this.height * 0.3);
    const bottom = Math.min(64, this.height * 0.2);
    const across = this.width - 2 * side, up = this.height - top - bottom;
    const scale = Math.min(
      across / Math.max(x1 - x0, NARROWEST), up / Math.max(y1 - y0, NARROWEST));
    this.scale = Math.max(LEAST, Math.min(MOST, scale));
    this.x = (x0 + x1) / 2;
    this.y = (y0 + y1) / 2 + (top - bottom) / 2 / this.scale;
  }

  /** In automatic mode: fit again if something is outside, or all of it is small. */
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

/** [least x, least y, most x, most y]; null without points. */
function bounds(points) {
  if (!points.length) return null;
  const x = points.map((point) => point[0]), y = points.map((point) => point[1]);
  return [Math.min(...x), Math.min(...y), Math.max(...x), Math.max(...y)];
}

export class MapInput {
  /** `redraw()` draws anew; `placed(kind, pose)` gets a dragged pose in local; `yawOf(kind)`:
   *  the heading that is typed [degrees]; `toolChanged(tool)`: another tool is chosen. */
  constructor(map, {redraw, placed, yawOf, toolChanged}) {
    Object.assign(this, {map, redraw, placed, yawOf, toolChanged});
    this.tool = null;                 // null, 'goal' or 'reset'
    this._pointers = new Map();       // id -> [x, y] on the canvas
    this._start = null;               // {pixel, point}: where a drag of the tool began
    const canvas = map.canvas;
    canvas.addEventListener('pointerdown', (event) => this._down(event));
    canvas.addEventListener('pointermove', (event) => this._move(event));
    canvas.addEventListener('pointerup', (event) => this._up(event, true));
    for (const type of ['pointercancel', 'lostpointercapture']) {
      canvas.addEventListener(type, (event) => this._up(event, false));
    }
    canvas.addEventListener('wheel', (event) => this._wheel(event), {passive: false});
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  }

  choose(tool) {
    this.tool = this.tool === tool ? null : tool;
    this.cancel();
    this.toolChanged(this.tool);
  }

  /** End a drag without sending anything. */
  cancel() {
    this._start = null;
    this.map.draft = null;
    this.redraw();
  }

  _at(event) {
    const box = this.map.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  _down(event) {
    this.map.canvas.setPointerCapture(event.pointerId);
    const at = this._at(event);
    this._pointers.set(event.pointerId, at);
    if (this._pointers.size > 1) { this.cancel(); return; }     // two fingers zoom
    if (!this.tool || event.button !== 0) return;
    const point = this.map.localAt(...at);
    if (!point) return;
    this._start = {pixel: at, point};
    this._show(at);
  }

  _move(event) {
    const before = this._pointers.get(event.pointerId);
    if (!before) return;
    const at = this._at(event);
    if (this._start) this._show(at);
    else if (this._pointers.size === 2) this._pinch(event.pointerId, before, at);
    else if (this._pointers.size === 1) this.map.view.pan(at[0] - before[0], at[1] - before[1]);
    this._pointers.set(event.pointerId, at);
    this.redraw();
  }

  _up(event, isDone) {
    if (!this._pointers.delete(event.pointerId) || !this._start) return;
    const draft = this.map.draft;
    this.cancel();
    if (!isDone || !draft) return;
    this.tool = null;
    this.toolChanged(null);
    this.placed(draft.kind, draft.pose);
  }

  _pinch(id, before, at) {
    const other = [...this._pointers].find(([key]) => key !== id)[1];
    const span = (point) => Math.max(10, Math.hypot(point[0] - other[0], point[1] - other[1]));
    this.map.view.pan((at[0] - before[0]) / 2, (at[1] - before[1]) / 2);
    this.map.view.zoom(span(at) / span(before), (at[0] + other[0]) / 2, (at[1] + other[1]) / 2);
  }

  /** The draft from the press to here. A short drag takes the heading that is typed. */
  _show(at) {
    const {pixel, point} = this._start;
    const end = this.map.localAt(...at);
    if (!end) return;
    const far = Math.hypot(at[0] - pixel[0], at[1] - pixel[1]) >= HEADING_FROM;
    const yaw = far ? Math.atan2(end[1] - point[1], end[0] - point[0])
      : radians(this.yawOf(this.tool));
    this.map.draft = {kind: this.tool, pose: [point[0], point[1], yaw]};
    this.redraw();
  }

  _wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : 1;
    const turned = Math.max(-120, Math.min(120, event.deltaY * lines));
    this.map.view.zoom(Math.exp(-0.002 * turned), ...this._at(event));
    this.redraw();
  }
}
