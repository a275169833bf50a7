// Lines and figures on a canvas; all sizes in pixels, angles counter-clockwise.

export function stroke(c, colour, points) {
  c.strokeStyle = colour;
  c.beginPath();
  points.forEach(([x, y], i) => (i ? c.lineTo(x, y) : c.moveTo(x, y)));
  c.stroke();
}

export function circle(c, x, y, radius, colour) {
  c.strokeStyle = colour;
  c.beginPath();
  c.arc(x, y, radius, 0, 2 * Math.PI);
  c.stroke();
}

export function square(c, x, y, half, colour) {
  c.fillStyle = colour;
  c.fillRect(x - half, y - half, 2 * half, 2 * half);
}

export function diamond(c, x, y, half, colour, inside) {
  c.beginPath();
  c.moveTo(x, y - half);
  c.lineTo(x + half, y);
  c.lineTo(x, y + half);
  c.lineTo(x - half, y);
  c.closePath();
  c.fillStyle = inside;
  c.fill();
  c.lineWidth = 2;
  c.strokeStyle = colour;
  c.stroke();
}

/** The x axis ends in a full arrow, the y axis in an open one. */
export function arrowHead(c, x, y, angle, colour, full) {
  const tip = [x + 7 * Math.cos(angle), y - 7 * Math.sin(angle)];
  const wings = [2.5, -2.5].map((turn) => [tip[0] + 12 * Math.cos(angle + turn), tip[1] - 12 * Math.sin(angle + turn)]);
  c.beginPath();
  c.moveTo(...wings[0]);
  c.lineTo(...tip);
  c.lineTo(...wings[1]);
  c.fillStyle = colour;
  c.strokeStyle = colour;
  c.lineWidth = 2.5;
  if (full) c.fill(); else c.stroke();
}

/** An arrow head of the robot that shows where it looks. */
export function heading(c, x, y, yaw, size, colour, rim) {
  const at = (angle, r) => [x + r * Math.cos(yaw + angle), y - r * Math.sin(yaw + angle)];
  c.beginPath();
  c.moveTo(...at(0, size));
  c.lineTo(...at(2.5, size * 0.75));
  c.lineTo(...at(Math.PI, size * 0.25));
  c.lineTo(...at(-2.5, size * 0.75));
  c.closePath();
  c.fillStyle = colour;
  c.fill();
  c.strokeStyle = rim;
  c.lineWidth = 1;
  c.stroke();
}
