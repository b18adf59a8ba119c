// The Pareto front of a search for many objectives: the evaluations that no other one dominates.

import { palette } from "./colours.js";
import { $ } from "./common.js";
import { rows } from "./data.js";
import { filters } from "./filters.js";
import { number, titled } from "./numbers.js";
import { plain } from "./plots.js";

const objectives = () => rows.columns.filter((column) => column.group === "objective").map((column) => column.name);

// Objectives, or the metrics that they are made of, on both axes: there the front is one.
function showsObjectives(nameX, nameY) {
  const names = objectives();
  return names.includes(nameX) && names.includes(nameY);
}

// In the order in which a line leads along two objectives; of more it would not be a line.
function frontRows(x, y) {
  const there = rows.front.filter((i) => filters.passes(i) && x[i] !== null && y[i] !== null);
  return there.sort((a, b) => x[a] - x[b] || y[b] - y[a]);
}

export function frontTrace(nameX, nameY, x, y) {
  const part = frontRows(x, y), line = objectives().length === 2 && showsObjectives(nameX, nameY);
  return {
    type: "scatter", mode: line ? "lines+markers" : "markers", name: `Pareto front (${number(part.length)})`,
    x: part.map((i) => x[i]), y: part.map((i) => y[i]), customdata: part.map((i) => rows.evaluation[i] + 1),
    line: { color: palette.accent, width: 1.5, shape: "hv" },
    marker: { color: palette.accent, size: 9, symbol: "square-open", line: { width: 2 } },
    hovertemplate: `${plain(titled(nameX))} %{x}<br>${plain(titled(nameY))} %{y}<br>evaluation %{customdata}, not dominated<extra></extra>`,
  };
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
