// What a person does on the map: pan, zoom, pinch, and drag a goal or a reset.

import {radians} from './se2.js';

const HEADING_FROM = 14;      // [px] a shorter drag gives no heading

export class MapInput {
  /** `redraw()` draws anew; `placed(kind, pose)` is told a dragged pose in local. */
  constructor(map, {redraw, placed, yawOf, toolChanged}) {
    Object.assign(this, {map, redraw, placed, yawOf, toolChanged});
    this.tool = null;                 // null, 'goal' or 'reset'
    this._pointers = new Map();       // id -> [x, y] on the canvas
    this._start = null;               // {pixel, point}: where a drag of the tool began
    const canvas = map.canvas;
    canvas.addEventListener('pointerdown', (event) => this._down(event));
    canvas.addEventListener('pointermove', (event) => this._move(event));
    canvas.addEventListener('pointerup', (event) => this._up(event, true));
    for (const type of ['pointercancel', 'lostpointercapture']) canvas.addEventListener(type, (event) => this._up(event, false));
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
    const yaw = far ? Math.atan2(end[1] - point[1], end[0] - point[0]) : radians(this.yawOf(this.tool));
    this.map.draft = {kind: this.tool, pose: [point[0], point[1], yaw]};
    this.redraw();
  }

  _wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : 1;
    this.map.view.zoom(Math.exp(-Math.max(-120, Math.min(120, event.deltaY * lines)) * 0.002), ...this._at(event));
    this.redraw();
  }
}
