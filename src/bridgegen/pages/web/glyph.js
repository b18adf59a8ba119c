// A conflict as a small picture: both bodies where they meet, the ego upwards, where each came from, and what touches what.

import { palette } from "./colours.js";
import { element } from "./common.js";
import { boxCentre } from "./geometry.js";
import { unpack } from "./unpack.js";

// Zones of a body by number, see bridgegen.conflict.types: edges are stretches, corners are points; shares of half length and width.
export const ZONES = {
  1: [[1, 1], [1, -1]], 2: [[1, 1]], 3: [[1, 1], [-1, 1]], 4: [[-1, 1]],
  5: [[-1, 1], [-1, -1]], 6: [[-1, -1]], 7: [[1, -1], [-1, -1]], 8: [[1, -1]],
};
const GLYPH_SIDE = 56; // pixels
const GLYPH_SPAN = 16; // m, from edge to edge
const GLYPH_PAST = 1.5; // s, of each path

/** A canvas; null of a scenario that has no conflict with another body. */
export function glyph(packed) {
  const kept = unpack(packed), found = kept.conflict, e = found?.partner_number, own = found?.vehicle_number ?? 0;
  if (e === undefined || e === own) return null;
  const k = Math.min(found.instant, kept.n_steps - 1), dense = window.devicePixelRatio || 1;
  const canvas = element("canvas", { class: "glyph", width: GLYPH_SIDE * dense, height: GLYPH_SIDE * dense, "aria-hidden": "true" });
  const draw = () => {
    const c = canvas.getContext("2d"), scale = (GLYPH_SIDE * dense) / GLYPH_SPAN;
    const at = (i) => boxCentre(kept.entities[i], kept.x[i][k], kept.y[i][k], kept.h[i][k]);
    const [[ax, ay], [bx, by]] = [at(own), at(e)];
    c.setTransform(1, 0, 0, 1, 0, 0);
    c.clearRect(0, 0, canvas.width, canvas.height);
    c.translate(canvas.width / 2, canvas.height / 2);
    c.scale(scale, -scale);
    c.rotate(Math.PI / 2 - kept.h[own][k]);
    c.translate(-(ax + bx) / 2, -(ay + by) / 2);
    for (const [i, colour] of [[e, palette["other-1"]], [own, palette.ego]]) {
      const { length, width } = kept.entities[i];
      c.strokeStyle = c.fillStyle = colour;
      c.lineWidth = 0.5;
      c.beginPath();
      for (let j = Math.max(0, k - Math.round(GLYPH_PAST / kept.time_step)); j <= k; j++) {
        if (kept.x[i][j] !== null) c.lineTo(...boxCentre(kept.entities[i], kept.x[i][j], kept.y[i][j], kept.h[i][j]));
      }
      c.stroke();
      c.save();
      c.translate(...at(i));
      c.rotate(kept.h[i][k]);
      c.fillRect(-length / 2, -width / 2, length, width);
      c.fillStyle = palette.card; // the windscreen says which end is the front
      if (length > 2) c.fillRect(length * 0.15, -width * 0.36, length * 0.12, width * 0.72);
      c.restore();
    }
    const zone = ZONES[found.zones[0]];
    if (!zone) return;
    const { length, width } = kept.entities[own], mean = (j) => zone.reduce((sum, point) => sum + point[j], 0) / zone.length;
    c.translate(ax, ay);
    c.rotate(kept.h[own][k]);
    c.fillStyle = palette.hit;
    c.beginPath();
    c.arc((mean(0) * length) / 2, (mean(1) * width) / 2, 0.7, 0, 2 * Math.PI);
    c.fill();
  };
  draw();
  document.addEventListener("theme", draw);
  return canvas;
}
