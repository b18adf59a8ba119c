// Oriented boxes: corners, and the nearest points of two of them.

import { entityColour } from "./colours.js";

/** @returns {[number, number]} */
export function boxCentre(entity, x, y, h) {
  return [x + entity.center_ahead * Math.cos(h), y + entity.center_ahead * Math.sin(h)];
}

export function boxCorners(entity, x, y, h) {
  const [cx, cy] = boxCentre(entity, x, y, h);
  const ux = Math.cos(h), uy = Math.sin(h), a = entity.length / 2, b = entity.width / 2;
  return [[a, b], [-a, b], [-a, -b], [a, -b]].map(([p, q]) => [cx + p * ux - q * uy, cy + p * uy + q * ux]);
}

function nearestOnEdge(p, a, b) {
  const dx = b[0] - a[0], dy = b[1] - a[1];
  const t = Math.min(1, Math.max(0, ((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / (dx * dx + dy * dy)));
  return [a[0] + t * dx, a[1] + t * dy];
}

// Of two convex shapes that do not touch, one of the nearest points is always a corner.
function nearestPoints(first, second) {
  let best = { from: first[0], to: second[0], distance: Infinity };
  const search = (corners, other, swap) => {
    for (const p of corners) {
      for (let i = 0; i < 4; i++) {
        const q = nearestOnEdge(p, other[i], other[(i + 1) % 4]);
        const distance = Math.hypot(p[0] - q[0], p[1] - q[1]);
        if (distance < best.distance) best = swap ? { from: q, to: p, distance } : { from: p, to: q, distance };
      }
    }
  };
  search(first, second, false);
  search(second, first, true);
  return best;
}

// The state at a fractional step: straight between the recorded instants, exact on them.
export function stateAt(kept, position) {
  const last = kept.n_steps - 1;
  const k = Math.min(last, Math.max(0, Math.floor(position + 1e-9)));
  const f = k === last ? 0 : Math.max(0, position - k);
  const mix = (row) => (f < 1e-9 ? row[k] : row[k] === null || row[k + 1] === null ? null : row[k] + f * (row[k + 1] - row[k]));
  return {
    index: k,
    time: (k + (f < 1e-9 ? 0 : f)) * kept.time_step,
    distance: mix(kept.distance),
    ttc: kept.ttc && mix(kept.ttc),
    a: kept.a && kept.a.map((row) => row[k]),
    entities: kept.entities.map((entity, e) => ({
      name: entity.name, x: mix(kept.x[e]), y: mix(kept.y[e]), h: mix(kept.h[e]), v: mix(kept.v[e]),
    })),
  };
}

// The bodies that are named and have a curve: the ego, all that move, and who is nearest at the end.
// Of a row of cones or of parked cars the others are scenery.
export function playersOf(kept) {
  if (kept.players) return kept.players;
  kept.players = kept.entities.map((_, e) => (e === 0 || kept.v[e].some((v) => v > 0.05) ? e : -1)).filter((e) => e >= 0);
  if (kept.closest !== null) {
    const state = stateAt(kept, kept.closest), near = nearestTo(kept, state);
    if (near && !kept.players.includes(near.entity)) kept.players.push(near.entity);
  }
  return kept.players;
}

// The ego is always the same colour; those that are named count on from it, whatever stands about besides.
export function colourOf(kept, e) {
  const place = playersOf(kept).indexOf(e);
  return entityColour(place < 0 ? 3 : place);
}

// The entity nearest to the ego, and the two nearest points of their boxes.
export function nearestTo(kept, state) {
  const [ego, ...others] = state.entities;
  if (!isPlaced(ego)) return null;
  const corners = boxCorners(kept.entities[0], ego.x, ego.y, ego.h);
  let best = null;
  others.forEach((s, i) => {
    if (!isPlaced(s)) return;
    const found = nearestPoints(corners, boxCorners(kept.entities[i + 1], s.x, s.y, s.h));
    if (!best || found.distance < best.distance) best = { ...found, entity: i + 1 };
  });
  return best;
}

export const isPlaced = (state) => state.x !== null && state.y !== null && state.h !== null;
