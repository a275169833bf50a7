// What both kinds of drawing share: a canvas as sharp as the screen.

/** The context of a canvas, scaled so that one unit is one CSS pixel; null while it has no size. */
export function sharp(canvas) {
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width || !height) return null;
  const ratio = Math.min(window.devicePixelRatio || 1, 2);
  const w = Math.round(width * ratio), h = Math.round(height * ratio);
  if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
  const context = canvas.getContext('2d');
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return {context, width, height};
}

/** 1, 2 or 5 times a power of ten, not smaller than `value`. */
export function nice(value) {
  const power = Math.pow(10, Math.floor(Math.log10(value)));
  return power * [1, 2, 5, 10].find((step) => step * power >= value * 0.999999);
}
