// Where other simulators had everybody, over the scenario in the player.

import { palette } from "./colours.js";
import { boxCentre, boxCorners, colourOf, isPlaced } from "./geometry.js";
import { unpackSeries } from "./series.js";
import { elsewhere } from "./verdicts.js";

// Where other simulators had those who were off, of a scenario in the player.
export function ghostsOf(kept) {
  kept.ghosts ??= elsewhere.flatMap((one) => (one.at.get(kept.evaluation)?.tracks ?? []).map((track) => {
    const series = (name) => unpackSeries(track[name], track.n, 1).map((value) => (value === null ? null : value / one.scale[name]));
    const e = kept.entities.findIndex((entity) => entity.name === track.entity);
    return { simulator: one.simulator, label: one.label, parted: one.parted_at, entity: e, x: series("x"), y: series("y"), h: series("h") };
  })).filter(({ entity }) => entity >= 0);
  return kept.ghosts;
}

// Those that are somewhere now, and how far from where they are here [m].
export function ghostsAt(kept, state) {
  const k = state.index, f = state.time / kept.time_step - k;
  const mix = (row) => (f < 1e-9 || (row[k + 1] ?? null) === null ? row[k] ?? null : row[k] === null ? null : row[k] + f * (row[k + 1] - row[k]));
  return ghostsOf(kept).map((ghost) => {
    const { x: hereX, y: hereY } = state.entities[ghost.entity];
    const [x, y, h] = [mix(ghost.x), mix(ghost.y), mix(ghost.h)];
    const off = x === null || hereX === null ? null : Math.hypot(x - hereX, y - hereY);
    return { simulator: ghost.simulator, parted: ghost.parted, entity: ghost.entity, x, y, h, off };
  }).filter(isPlaced);
}

const GHOST_DASHES = [[6, 4], [2, 3], [10, 3, 2, 3]];

// Outlines where other simulators have them, each simulator in its own dashes, and lines to where they are here.
export function drawElsewhere(c, kept, state, scale) {
  for (const ghost of ghostsAt(kept, state)) {
    const body = kept.entities[ghost.entity], here = state.entities[ghost.entity];
    const dashes = GHOST_DASHES[elsewhere.findIndex((one) => one.simulator === ghost.simulator) % GHOST_DASHES.length];
    const stroke = (colour, pixels, dashed) => {
      c.strokeStyle = colour;
      c.lineWidth = pixels / scale;
      c.setLineDash(dashed.map((length) => length / scale));
      c.stroke();
    };
    const outline = () => {
      c.beginPath();
      boxCorners(body, ghost.x, ghost.y, ghost.h).forEach((p, i) => c[i ? "lineTo" : "moveTo"](...p));
      c.closePath();
    };
    outline();
    stroke(palette.label, 4, []);
    stroke(colourOf(kept, ghost.entity), 2.5, dashes);
    if (ghost.off === null || ghost.off <= ghost.parted) continue;
    c.beginPath();
    c.moveTo(...boxCentre(body, here.x, here.y, here.h));
    c.lineTo(...boxCentre(body, ghost.x, ghost.y, ghost.h));
    stroke(colourOf(kept, ghost.entity), 1.5, dashes);
  }
  c.setLineDash([]);
}

// Of an entity, in words: "1.2 m elsewhere in esmini".
export function elsewhereWords(kept, state, e) {
  const off = ghostsAt(kept, state).filter((ghost) => ghost.entity === e && ghost.off > ghost.parted);
  return off.map((ghost) => `${ghost.off.toFixed(1)} m elsewhere in ${ghost.simulator}`).join(", ");
}
