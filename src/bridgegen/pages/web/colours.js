// The colours of what is drawn, as the style has them now.

export let palette = {};
readPalette();
document.addEventListener("theme", readPalette);

function readPalette() {
  const style = getComputedStyle(document.documentElement);
  const names = ["bg", "card", "ink", "muted", "line", "soft", "accent", "critical", "plain", "band", "grid", "ground",
    "asphalt", "asphalt-2", "marking", "stop", "ego", "other-1", "other-2", "other-3", "label", "hit", "cone",
    "seen", "displaced", "missed", "fog", "rain", "sky"];
  palette = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

// The ego is always the same colour and drawn solid; the others differ by colour and by dashes.
export function entityColour(e) {
  return e === 0 ? palette.ego : palette[`other-${((e - 1) % 3) + 1}`];
}

export const DASHES = [[], [7, 4], [2, 3], [9, 3, 2, 3]];
