// Where another simulator, or another driver of the ego, had everybody, over the scenario in the player.

import { palette } from "./colours.js";
import { data } from "./data.js";
import { boxCentre, boxCorners, colourOf, isPlaced } from "./geometry.js";
import { unpackSeries } from "./series.js";
import { elsewhere } from "./verdicts.js";

const APART_WITH = 0.5; // from here on a line leads to where they are with another driver [m]

// Where other simulators had those who were off, and where they are with other drivers, of a scenario in the player.
export function ghostsOf(kept) {
  kept.ghosts ??= [...inSimulators(kept), ...withDrivers(kept)].filter(({ entity }) => entity >= 0);
  return kept.ghosts;
}

function inSimulators(kept) {
  return elsewhere.flatMap((one, number) => (one.at.get(kept.evaluation)?.tracks ?? []).map((track) => {
    const series = (name) => unpackSeries(track[name], track.n, 1).map((value) => (value === null ? null : value / one.scale[name]));
    const e = kept.entities.findIndex((entity) => entity.name === track.entity);
    return { number, means: `where ${one.label} has them`, where: `in ${one.simulator}`, simulator: one.simulator, parted: one.parted_at, entity: e, x: series("x"), y: series("y"), h: series("h") };
  }));
}

function withDrivers(kept) {
  return (kept.beside ?? []).flatMap((one, k) => one.entities.map((entity, i) => {
    const series = (name) => unpackSeries(one[name][i], kept.n_steps, data.scale[name]);
    return { number: elsewhere.length + k, means: `with the driver ${one.label}`, where: `with ${one.label}`, simulator: "", parted: APART_WITH, entity, x: series("x"), y: series("y"), h: series("h") };
  }));
}

// Those that are somewhere now, and how far from where they are here [m].
export function ghostsAt(kept, state) {
  const k = state.index, f = state.time / kept.time_step - k;
  const mix = (row) => (f < 1e-9 || (row[k + 1] ?? null) === null ? row[k] ?? null : row[k] === null ? null : row[k] + f * (row[k + 1] - row[k]));
  return ghostsOf(kept).map((ghost) => {
    const { x: hereX, y: hereY } = state.entities[ghost.entity];
    const [x, y, h] = [mix(ghost.x), mix(ghost.y), mix(ghost.h)];
    const off = x === null || hereX === null ? null : Math.hypot(x - hereX, y - hereY);
    return { number: ghost.number, where: ghost.where, simulator: ghost.simulator, parted: ghost.parted, entity: ghost.entity, x, y, h, off };
  }).filter(isPlaced);
}

const GHOST_DASHES = [[6, 4], [2, 3], [10, 3, 2, 3]];

// Outlines where they are there, each simulator and driver in its own dashes, and lines to where they are here.
export function drawElsewhere(c, kept, state, scale) {
  for (const ghost of ghostsAt(kept, state)) {
    const body = kept.entities[ghost.entity], here = state.entities[ghost.entity];
    const dashes = GHOST_DASHES[ghost.number % GHOST_DASHES.length];
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

// Of an entity, in words: "1.2 m elsewhere in esmini", "3.4 m elsewhere with un-r157".
export function elsewhereWords(kept, state, e) {
  const off = ghostsAt(kept, state).filter((ghost) => ghost.entity === e && ghost.off > ghost.parted);
  return off.map((ghost) => `${ghost.off.toFixed(1)} m elsewhere ${ghost.where}`).join(", ");
}
