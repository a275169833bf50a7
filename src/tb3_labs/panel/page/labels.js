// Names beside points of the map, so that none covers another.

const GAP = 6;

export class Labels {
  constructor(context, width, height) {
    this._context = context;
    this._width = width;
    this._height = height;
    this._names = [];         // labels that wait for their place
    this._taken = [];         // rectangles [x0, y0, x1, y1] that hold something already
  }

  /** Keep labels away from a place. */
  avoid(x, y, radius) {
    this._taken.push([x - radius, y - radius, x + radius, y + radius]);
  }

  /** Keep labels out of a rectangle [x0, y0, x1, y1]. */
  keep(box) { this._taken.push(box); }

  /** A text for the point (x, y). It is written by `write`, once it is known what to avoid. */
  add(text, x, y, colour, {size = 13, away = 10} = {}) {
    this._names.push({text, x, y, colour, size, away});
  }

  /** Write all texts. */
  write() {
    for (const name of this._names) this._place(name);
  }

  /** Write a text in the first free place around its point. */
  _place({text, x, y, colour, size, away}) {
    const c = this._context;
    c.font = `600 ${size}px system-ui, sans-serif`;
    const w = c.measureText(text).width, h = size;
    for (let ring = 0; ring < 4; ring += 1) {
      const d = away + ring * (h + GAP);
      const places = [[d, -d], [d, d + h], [-d - w, -d], [-d - w, d + h], [-w / 2, d + h], [-w / 2, -d], [d, h / 2], [-d - w, h / 2]];
      for (const [dx, dy] of places) {
        const box = [x + dx - 3, y + dy - h, x + dx + w + 3, y + dy + 4];
        if (!this._free(box)) continue;
        this._taken.push(box);
        this._write(text, x + dx, y + dy, colour, ring > 0 ? [x, y, box] : null);
        return;
      }
    }
  }

  _free(box) {
    if (box[0] < 2 || box[1] < 2 || box[2] > this._width - 2 || box[3] > this._height - 2) return false;
    return !this._taken.some((t) => box[0] < t[2] && box[2] > t[0] && box[1] < t[3] && box[3] > t[1]);
  }

  _write(text, x, y, colour, far) {
    const c = this._context;
    if (far) {
      // A name that is far from its point gets a thin line to it.
      const [px, py, box] = far;
      c.strokeStyle = colour;
      c.lineWidth = 1;
      c.beginPath();
      c.moveTo(px, py);
      c.lineTo(Math.max(box[0], Math.min(box[2], px)), Math.max(box[1], Math.min(box[3], py)));
      c.stroke();
    }
    c.textAlign = 'left';
    c.textBaseline = 'alphabetic';
    c.lineJoin = 'round';
    c.lineWidth = 4;
    c.strokeStyle = this.paper;
    c.strokeText(text, x, y);
    c.fillStyle = colour;
    c.fillText(text, x, y);
  }
}
