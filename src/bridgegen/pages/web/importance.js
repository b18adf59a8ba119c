// Which parameters decide: by how much failures differ from other rows in each, and how often each part of its range is critical.

import { binRange, percent, withUnit } from "./bins.js";
import { $, NARROW, element } from "./common.js";
import { columns, data } from "./data.js";
import { filters } from "./filters.js";
import { number } from "./numbers.js";
import { addSection } from "./sections.js";

const SHOWN = 8;

// A column for each bin: its height is the share that is critical, its colour how many were evaluated.
function slice(parameter) {
  const { edges, evaluated, critical, integer } = parameter, most = Math.max(...evaluated), half = integer ? 1e-6 : 0;
  return element("div", { class: "slice" }, ...evaluated.map((n, k) => {
    if (n <= 0) return element("i", {});
    const text = `${binRange(parameter, k)}: ${number(critical[k])} of ${number(n)} evaluations critical (${percent(critical[k], n)}${NARROW}%)`;
    const bin = element("button", { type: "button", title: `${text}; click to see these alone`, "aria-label": `${parameter.name} ${text}`, style: `--height: ${(critical[k] / n).toFixed(3)}; --known: ${Math.sqrt(n / most).toFixed(2)}` });
    bin.addEventListener("click", () => filters.set(parameter.name, edges[k] - half, edges[k + 1] + half));
    return bin;
  }));
}

function influenceRow({ name, distance, end }) {
  const parameter = data.coverage.parameters.find((one) => one.name === name), bar = element("i", { "aria-hidden": "true" });
  bar.style.width = `${100 * distance}%`;
  const ends = [0, parameter.evaluated.length - 1].map((k) => element("small", {}, binRange(parameter, k)));
  return element("tr", {}, element("th", { scope: "row", title: columns.get(name)?.description ?? "" }, withUnit(parameter)),
    element("td", { class: "share" }, bar, element("b", {}, distance.toFixed(2))),
    element("td", {}, slice(parameter), element("div", { class: "ends", "aria-hidden": "true" }, ...ends)), element("td", { class: "muted small" }, end && `${end}: widen the range?`));
}

// Of two sections' data: what matters, and the bins.
function drawImportance(_, host) {
  const known = new Set(data.coverage?.parameters.map(({ name }) => name)), found = (data.triage?.influences ?? []).filter(({ name }) => known.has(name)), names = new Set(found.map(({ name }) => name));
  host.hidden = !found.length;
  const listed = (some) => [...some].join(", "), less = listed(found.slice(SHOWN).map(({ name }) => name)), none = listed([...known].filter((name) => !names.has(name)));
  $("importance-body").replaceChildren(...found.slice(0, SHOWN).map(influenceRow));
  $("importance-rest").textContent = [less && `Less: ${less}.`, none && `No effect of its own is shown of ${none}.`].filter(Boolean).join(" ");
}

addSection({ id: "importance", key: "rows", draw: drawImportance });
