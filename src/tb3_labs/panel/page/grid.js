// The grid in metres beneath the map, and the legend of its lines.

import {nice} from './canvas.js';
import {colours} from './colours.js';
import {stroke} from './shapes.js';

/** A grid over the view `v`; `words`: which frame the numbers belong to. */
export function drawGrid(c, v, words) {
  const step = nice(70 / v.scale);
  const [x0, y1] = v.point(0, 0), [x1, y0] = v.point(v.width, v.height);
  c.lineWidth = 1;
  c.font = '11px system-ui, sans-serif';
  c.fillStyle = colours.faint;
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const text = (value) => (Math.abs(value) < step / 2 ? '0' : value.toFixed(digits));
  for (let i = Math.ceil(x0 / step); i <= x1 / step; i += 1) {
    const px = Math.round(v.pixel(i * step, 0)[0]) + 0.5;
    stroke(c, i === 0 ? colours.grid_strong : colours.grid, [[px, 0], [px, v.height]]);
    c.textAlign = 'center';
    if (px > 40) c.fillText(text(i * step), px, v.height - 4);
  }
  for (let i = Math.ceil(y0 / step); i <= y1 / step; i += 1) {
    const py = Math.round(v.pixel(0, i * step)[1]) + 0.5;
    stroke(c, i === 0 ? colours.grid_strong : colours.grid, [[0, py], [v.width, py]]);
    c.textAlign = 'left';
    if (py > 60 && py < v.height - 24) c.fillText(text(i * step), 4, py - 3);
  }
  c.textAlign = 'right';
  c.fillText(words, v.width - 6, v.height - 18);
}

/** What the lines mean, in the lower left corner. */
export function drawLegend(c, labels, height) {
  const lines = [['odom', [], 2.5, 'path in odom'], ['local', [7, 5], 2, 'path in local']];
  c.font = '12px system-ui, sans-serif';
  c.textAlign = 'left';
  lines.forEach(([frame, dash, width, text], i) => {
    const y = height - 44 + 16 * i;
    c.lineWidth = width;
    c.setLineDash(dash);
    stroke(c, colours[frame], [[44, y - 4], [74, y - 4]]);
    c.setLineDash([]);
    c.fillStyle = colours.faint;
    c.fillText(text, 80, y);
  });
  labels.keep([40, height - 58, 160, height]);
}
