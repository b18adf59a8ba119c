// What other simulators made of the scenarios, by row of the page: a column of the table.

import { element } from "./common.js";
import { data, rows } from "./data.js";

export let elsewhere = []; // by simulator, as in the data, with its scenarios by evaluation and its verdicts by row of the page
export const VERDICTS = { 1: ["✓", "confirmed"], 0: ["✗", "not confirmed"], "-1": ["?", "not run"] };

function takeElsewhere() {
  elsewhere = data.confirmations.map((one) => {
    const at = new Map(one.scenarios.map((scenario) => [scenario.evaluation, scenario]));
    return { ...one, column: `in ${one.simulator}`, at, values: rows.evaluation.map((evaluation) => verdictOf(at.get(evaluation))) };
  });
}

takeElsewhere();
document.addEventListener("grown", takeElsewhere);

// A key of VERDICTS; null if it was not run there.
export function verdictOf(scenario) {
  if (!scenario) return null;
  return scenario.confirmed === null ? -1 : Number(scenario.confirmed);
}

export function elsewhereBy(column) {
  return elsewhere.find((one) => one.column === column);
}

// Of the table: what became of a row in a simulator.
export function verdictCell(value) {
  if (value === null) return element("td", {}, "–");
  const [sign, words] = VERDICTS[value];
  return element("td", { class: `verdict-${value}`, title: words }, element("span", { role: "img", "aria-label": words }, sign));
}
