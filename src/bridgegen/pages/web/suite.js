// The page of a suite: the result in words, pass criteria, scenarios with their variations and playbacks.

import { $, element } from "./common.js";
import { hook } from "./hook.js";
import { changes } from "./suite_changes.js";
import { showClauses } from "./suite_clauses.js";
import { showCriteria } from "./suite_criteria.js";
import { showSearches } from "./suite_searches.js";
import { showMaps } from "./suite_maps.js";
import { motions } from "./suite_motions.js";
import { table } from "./suite_table.js";
import { bar, suite } from "./suite_words.js";

function showResult() {
  $("facts").append(...suite.facts.map((fact) => element("li", {}, fact)));
  suite.headlines.forEach((headline, e) => {
    const count = (v) => suite.entries.filter(({ results }) => results[e]?.v === v).length;
    $("result").append(element("p", { class: "headline" }, `${headline}.`), bar(["p", "f", "n", "u", "y"].map(count)), ...suite.outcomes[e].map((text) => element("p", { class: "outcome" }, `${text}.`)));
  });
  for (const text of [suite.changes, suite.differences]) {
    if (text) $("result").append(element("p", { class: "differences" }, text));
  }
}

// What the page's address names is a change, or a scenario; of two drivers the first change opens by itself.
async function go() {
  if (!(await changes.go())) await table.go();
}

showResult();
showClauses();
showCriteria();
showMaps();
showSearches();
table.fill();
changes.fill().then(go);
addEventListener("hashchange", go);
hook.open = (name) => table.show(suite.entries.findIndex((one) => one.name === name));
hook.shown = () => table.order.map((k) => suite.entries[k].name);
document.addEventListener("theme", () => motions.player?.redraw());
