// Pass criteria against verdicts: how many scenarios and variations violate each.

import { $, element } from "./common.js";
import { table } from "./suite_table.js";
import { bar, button, counted, suite } from "./suite_words.js";

export function showCriteria() {
  const { criteria, egos } = suite;
  $("criteria").hidden = !criteria.length;
  if (!criteria.length) return;
  const heads = ["requirement", "severity", ...egos].map((title) => element("th", { scope: "col" }, title));
  $("matrix").tHead.append(element("tr", {}, ...heads));
  $("matrix").tBodies[0].append(...criteria.map((one, i) => element("tr", {},
    element("th", { scope: "row" }, button(one.id, () => choose(i), { title: "Show the scenarios that violate it" }), one.text ? element("span", {}, one.text) : "", element("code", {}, one.formula)),
    element("td", { "data-title": "severity" }, element("span", { class: `severity ${one.severity}` }, one.severity)),
    ...one.of.map((counts, e) => element("td", { "data-title": egos[e] }, ...countCell(counts))))));
}

function countCell({ entries: [violating, met, none], rows: [violated, kept, lost] }) {
  const all = violating + met, rows = violated + kept;
  const words = violating ? `${counted(violating)} of ${counted(all)} scenario${all === 1 ? " violates" : "s violate"} it` : all ? `met in ${all === 1 ? "the only scenario" : `all ${counted(all)}`}` : "not evaluated";
  const more = [rows > all ? `${violated ? `${counted(violated)} of ` : ""}${counted(rows)} variations` : "", none ? `${counted(none)} not judged` : ""].filter(Boolean).join("; ");
  return [element("span", { class: violating ? "failed" : "" }, words), bar([kept, violated, lost]), more ? element("small", {}, more) : ""];
}

function choose(i) {
  table.filter({ violated: `${i}` });
  $("entries").scrollIntoView();
}
