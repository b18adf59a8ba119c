// Bins of coverage: their texts, their cells, moving between them.

import { NARROW, element } from "./common.js";
import { data } from "./data.js";
import { number, turned, unitText, worded } from "./numbers.js";

const IMPOSSIBLE = -1; // rows in a bin that is not feasible
export const MOST_TEXTS = 14; // bins side by side that have room for their counts
export const share = (part, whole) => (part === whole ? 1 : part / Math.max(1, whole));

// Whole per cent; 0 and 100 only where they are exact.
export function percent(part, whole) {
  if (!whole) return "–";
  const exact = part === 0 || part === whole;
  return `${exact ? 100 * share(part, whole) : Math.min(99, Math.max(1, Math.round((100 * part) / whole)))}`;
}

function brief(value) {
  return String(Number(value.toPrecision(4))).replace("-", "−");
}

export function withUnit(parameter) {
  const unit = unitText(parameter.unit);
  return unit ? `${parameter.name} [${unit}]` : parameter.name;
}

function binName(parameter, k) {
  return worded(k, parameter) ?? brief(parameter.edges[k] + 0.5);
}

function edgeText(parameter, k) {
  return brief(turned(parameter.edges[k], parameter));
}

export function binRange(parameter, k) {
  const { edges, integer } = parameter, unit = unitText(parameter.unit);
  const range = integer ? binName(parameter, k) : `${edgeText(parameter, k)} to ${edgeText(parameter, k + 1)}`;
  return unit ? `${range}${NARROW}${unit}` : range;
}

function binState(evaluated, critical) {
  if (evaluated === IMPOSSIBLE) return "out";
  return evaluated === 0 ? "none" : critical ? "hit" : "seen";
}

function binText(evaluated, critical) {
  if (evaluated === IMPOSSIBLE) return data.coverage.sample ? "not reachable under the constraints (by the sample)" : "not evaluated; not known whether reachable";
  if (evaluated === 0) return "not evaluated";
  const count = `${number(evaluated)} evaluated`;
  return critical ? `${count}, ${number(critical)} of them critical (${percent(critical, evaluated)}${NARROW}%)` : `${count}, none critical`;
}

// How deep the colour of a count is: the square root keeps small ones apart.
export function depth(count, most) {
  return Math.sqrt(Math.max(0, count) / Math.max(1, most));
}

function thousands(count) {
  return count < 10000 ? `${count}` : `${Math.round(count / 1000)}k`;
}

// A bin, or a pair of bins: its state shows in pattern, border, text and colour, an amount in [0, 1] in the colour's depth.
export function binCell(evaluated, critical, label, row, column, amount) {
  const text = evaluated === IMPOSSIBLE ? [] : [element("span", {}, thousands(evaluated))];
  if (critical) text.push(element("b", {}, `◆${NARROW}${thousands(critical)}`));
  return element("div", {
    class: `bin ${binState(evaluated, critical)}`, role: "img", "aria-label": `${label}: ${binText(evaluated, critical)}`,
    tabindex: "-1", "data-row": row, "data-column": column, style: `--share: ${amount.toFixed(3)}`,
  }, ...text);
}

// Values at the edges of the bins, or below the whole numbers; not more than there is room for.
export function binTicks(parameter, className) {
  const { edges, integer } = parameter, n = edges.length - 1;
  const marks = integer ? edges.slice(0, n).map((_, k) => [(k + 0.5) / n, binName(parameter, k)]) : edges.map((_, k) => [k / n, edgeText(parameter, k)]);
  const each = Math.ceil(marks.length / 11);
  const shown = marks.filter((_, k) => k % each === 0).map(([at, text]) => {
    const place = integer || (at > 0 && at < 1) ? "" : at ? "last" : "first";
    return element("span", { class: place, style: `--at: ${(100 * at).toFixed(2)}%` }, text);
  });
  return element("div", { class: `ticks ${className}`, "aria-hidden": "true" }, ...shown);
}

// Arrow keys lead from cell to cell; one of the cells at a time is reached by the tab key.
export function arrowKeys(host) {
  const cells = () => [...host.querySelectorAll("[data-row]")];
  const place = (cell) => [Number(cell.dataset.row), Number(cell.dataset.column)];
  const enter = (cell) => {
    host.querySelectorAll('[data-row][tabindex="0"]').forEach((other) => { other.tabIndex = -1; });
    cell.tabIndex = 0;
  };
  host.addEventListener("focusin", (event) => { if (event.target.dataset.row) enter(event.target); });
  host.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0], Home: [0, -Infinity], End: [0, Infinity] }[event.key];
    if (!step || !event.target.dataset.row || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    const [row, column] = place(event.target);
    const wanted = column + step[1], away = (cell) => Math.abs(place(cell)[1] - Math.min(1e6, Math.max(-1e6, wanted)));
    const there = cells().filter((cell) => place(cell)[0] === row + step[0]);
    there.sort((a, b) => away(a) - away(b))[0]?.focus();
  });
  if (cells().length) enter(cells()[0]);
}
