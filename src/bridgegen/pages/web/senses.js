// What the ego's sensors made of the others, over the truth: distinguished by shape, not by colour alone.

import { palette } from "./colours.js";
import { boxCentre, isPlaced } from "./geometry.js";
import { detectionAt, phantomsAt } from "./unpack.js";

// Seen: four corners about the detected box. Displaced: that box dashed, and a line from where the body is.
// Missed: the body itself is hatched and ringed.
export function drawDetections(c, kept, state, scale) {
  state.entities.forEach((s, e) => {
    const found = e > 0 && isPlaced(s) ? detectionAt(kept, e, state.index) : null;
    if (!found) return;
    if (found.status === "missed") drawMissed(c, kept.entities[e], s, scale);
    else drawFound(c, found, scale);
  });
  for (const found of phantomsAt(kept, state.index)) drawFound(c, found, scale);
}

/** @type {(c: CanvasRenderingContext2D, found: any, scale: number) => void} */
function drawFound(c, { status, x, y, h, length, width, truth }, scale) {
  const least = 7 / scale, a = Math.max(length / 2, least), b = Math.max(width / 2, least);
  const displaced = status === "displaced";
  c.save();
  for (const [colour, pixels] of [["rgba(8, 16, 26, 0.75)", 4], [displaced ? palette.displaced : palette.seen, 2]]) {
    c.strokeStyle = c.fillStyle = colour;
    c.lineWidth = pixels / scale;
    c.setLineDash(displaced ? [5 / scale, 3 / scale] : []);
    c.save();
    c.translate(x, y);
    c.rotate(h);
    c.beginPath();
    if (displaced) c.rect(-a, -b, 2 * a, 2 * b);
    else {
      const p = Math.min(0.3 * a, 0.9), q = Math.min(0.45 * b, 0.9);
      for (const [u, v] of [[1, 1], [1, -1], [-1, -1], [-1, 1]]) {
        c.moveTo(u * (a - p), v * b);
        c.lineTo(u * a, v * b);
        c.lineTo(u * a, v * (b - q));
      }
    }
    c.stroke();
    c.restore();
    if (!displaced || !truth) continue;
    c.setLineDash([]);
    c.beginPath();
    c.moveTo(truth[0], truth[1]);
    c.lineTo(x, y);
    c.stroke();
    c.beginPath();
    c.arc(x, y, (pixels + 1) / scale, 0, 2 * Math.PI);
    c.fill();
  }
  c.restore();
}

function drawMissed(c, entity, s, scale) {
  const a = Math.max(entity.length / 2, 5 / scale), b = Math.max(entity.width / 2, 5 / scale);
  c.save();
  c.translate(...boxCentre(entity, s.x, s.y, s.h));
  c.rotate(s.h);
  c.beginPath();
  c.rect(-a, -b, 2 * a, 2 * b);
  c.save();
  c.clip();
  const gap = 6 / scale;
  c.beginPath();
  for (let u = -a - 2 * b; u < a; u += gap) {
    c.moveTo(u, -b);
    c.lineTo(u + 2 * b, b);
  }
  c.lineWidth = 2.2 / scale;
  c.strokeStyle = "rgba(8, 16, 26, 0.8)";
  c.stroke();
  c.restore();
  const r = Math.hypot(a, b) + 3 / scale;
  for (const [colour, pixels] of [["rgba(8, 16, 26, 0.75)", 4], [palette.missed, 2]]) {
    c.strokeStyle = colour;
    c.lineWidth = pixels / scale;
    c.beginPath();
    c.arc(0, 0, r, 0, 2 * Math.PI);
    c.moveTo(-r * Math.SQRT1_2, -r * Math.SQRT1_2);
    c.lineTo(r * Math.SQRT1_2, r * Math.SQRT1_2);
    c.stroke();
  }
  c.restore();
}

// The boxes on the screen [pixels] of what was detected elsewhere than it is; no label should hide them.
export function detectedBoxes(kept, state, view) {
  return state.entities.flatMap((_, e) => {
    const found = e > 0 ? detectionAt(kept, e, state.index) : null;
    if (found?.status !== "displaced") return [];
    const [x, y] = view.toScreen([found.x, found.y]), r = (Math.hypot(found.length, found.width) / 2) * view.scale;
    return [[x - r, y - r, x + r, y + r]];
  });
}
