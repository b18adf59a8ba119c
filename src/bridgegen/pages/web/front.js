// The Pareto front of a search for many objectives: the evaluations that no other one dominates.

import { palette } from "./colours.js";
import { $ } from "./common.js";
import { rows } from "./data.js";

const objectives = () => rows.columns.filter((column) => column.group === "objective").map((column) => column.name);

// Objectives, or the metrics that they are made of, on both axes: there the front is one.
function showsObjectives(nameX, nameY) {
  const names = objectives();
  return names.includes(nameX) && names.includes(nameY);
}

// Of the rows that are drawn, in the order in which a line leads along two objectives; of more it would not be a line.
export function frontSeries(nameX, nameY, seen, { x, y }) {
  if (!rows.front.length) return [];
  const drawn = new Set(seen), items = rows.front.filter((i) => drawn.has(i)).sort((a, b) => x[a] - x[b] || y[b] - y[a]);
  const line = objectives().length === 2 && showsObjectives(nameX, nameY) ? palette.accent : null;
  return [{ name: "front", text: "Pareto front", items, line, marker: { shape: "square", radius: 4.5, colour: palette.accent, open: true } }];
}

// A button that puts two objectives on the axes; the next two when they are there.
export function connectFront(draw) {
  const names = objectives(), button = $("show-front");
  button.hidden = names.length < 2;
  $("front-note").hidden = names.length < 2;
  const pairs = names.flatMap((a, i) => names.slice(i + 1).map((b) => [a, b]));
  button.addEventListener("click", () => {
    const now = pairs.findIndex(([a, b]) => a === $("axis-x").value && b === $("axis-y").value);
    [$("axis-x").value, $("axis-y").value] = pairs[(now + 1) % pairs.length];
    draw();
  });
}
