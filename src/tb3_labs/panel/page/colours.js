// The colours of the page for the canvases, and the choice light, dark, or as the system has it.

const NAMES = ['paper', 'grid', 'grid-strong', 'ink', 'faint', 'odom', 'local', 'goal', 'truth', 'robot', 'stopped'];
const THEMES = ['auto', 'light', 'dark'];

export const colours = {};

/** Read the colours anew from the style sheet. */
function read(changed) {
  const style = getComputedStyle(document.documentElement);
  for (const name of NAMES) colours[name.replace('-', '_')] = style.getPropertyValue('--' + name).trim();
  changed();
}

/** Let the button change the theme; `changed` is called whenever the colours are others. */
export function startColours(button, changed) {
  let theme = stored() || 'auto';
  const apply = () => {
    document.documentElement.dataset.theme = theme;
    button.firstElementChild.textContent = {auto: '\u25d0', light: '\u2600', dark: '\u263e'}[theme];
    button.lastElementChild.textContent = theme;
    button.setAttribute('aria-label', 'Theme: ' + theme);
    read(changed);
  };
  button.addEventListener('click', () => {
    theme = THEMES[(THEMES.indexOf(theme) + 1) % THEMES.length];
    keep(theme);
    apply();
  });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', apply);
  apply();
}

// A browser that keeps nothing (private mode) must not break the page.
function stored() {
  try { return THEMES.find((theme) => theme === localStorage.getItem('panel-theme')); } catch (error) { return null; }
}

function keep(theme) {
  try { localStorage.setItem('panel-theme', theme); } catch (error) { /* not kept */ }
}
