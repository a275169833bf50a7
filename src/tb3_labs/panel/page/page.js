// Small helpers for the elements of the page.

export const $ = (id) => document.getElementById(id);

/** Write a text only where it changes: less work, and no needless word of a screen reader. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function setHidden(element, hidden) {
  if (element.hidden !== hidden) element.hidden = hidden;
}

/** A control that makes no sense now is disabled, and says why. */
export function setReason(button, reason) {
  if (!('plainTitle' in button.dataset)) button.dataset.plainTitle = button.title;
  button.disabled = Boolean(reason);
  const title = reason || button.dataset.plainTitle;
  if (button.title !== title) button.title = title;
}

/** A number with so many digits; a dash where it is unknown. -0.0 is shown as 0.0. */
export function number(value, digits, unit = '') {
  if (value === null || value === undefined || !Number.isFinite(value)) return '\u2013';
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? text.replace('-', '') : text) + unit;
}
