// Clauses of a regulation: what each ego makes of them.

import { $, element } from "./common.js";
import { table } from "./suite_table.js";
import { CLASSES, PASSES, bar, button, suite } from "./suite_words.js";

export function showClauses() {
  const { clauses, egos } = suite;
  $("clauses").hidden = !clauses.length;
  if (!clauses.length) return;
  const heads = ["clause", ...egos].map((title) => element("th", { scope: "col" }, title));
  $("clause-table").tHead.append(element("tr", {}, ...heads));
  $("clause-table").tBodies[0].append(...clauses.map((one) => element("tr", {},
    element("th", { scope: "row" }, element("strong", {}, one.id), element("span", {}, one.text), ...one.entries.map(scenario)),
    ...egos.map((ego, e) => element("td", { "data-title": ego }, ...cell(one.of[e]))))));
}

function cell(of) {
  if (!of) return ["–"];
  return [element("span", { class: of.v === "p" ? "" : CLASSES[of.v] }, of.v === "u" ? `${PASSES.u}: ${of.words}` : of.words), bar(of.rows)];
}

function scenario(name) {
  const at = suite.entries.findIndex((one) => one.name === name);
  return button(name, () => table.show(at), { title: "Show this scenario" });
}
