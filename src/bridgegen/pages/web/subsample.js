// The rows that are drawn where all would be too many.

import { rows } from "./data.js";
import { filters } from "./filters.js";

// At most `most` of the rows that pass, evenly chosen; half of the places are the critical ones'
// if there are as many.
export function subsample(most) {
  const every = (list, n) => (list.length <= n ? list : Array.from({ length: n }, (_, i) => list[Math.floor((i * list.length) / n)]));
  const hit = [], other = [];
  rows.critical.forEach((critical, i) => { if (filters.passes(i)) (critical ? hit : other).push(i); });
  const room = Math.max(most - other.length, Math.ceil(most / 2));
  const hits = every(hit, room);
  return { hits, others: every(other, most - hits.length) };
}
