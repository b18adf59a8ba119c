// What the search algorithm learnt: its tables, as they come.

import { element } from "./common.js";
import { number } from "./numbers.js";
import { addSection } from "./sections.js";

const LEAD = "Kept with the run. Where a rule gives shares of what is left to a parameter, constraints narrow its interval from scenario to scenario.";

function fillNotes(tables, host) {
  host.append(element("p", { class: "muted" }, LEAD));
  for (const { title, columns: names, rows: body, left_out } of tables) {
    const heads = names.map((name) => element("th", { scope: "col" }, name));
    const lines = body.map((row) => element("tr", {}, ...row.map((text) => element("td", {}, text))));
    const table = element("table", {}, element("caption", { class: "hidden" }, title), element("thead", {}, element("tr", {}, ...heads)), element("tbody", {}, ...lines));
    const wide = element("div", { class: "wide", tabindex: "0", role: "group", "aria-label": `${title}, scrollable` }, table);
    const card = element("div", { class: "card note-table" }, element("h3", {}, title), wide);
    if (left_out) card.append(element("p", { class: "muted" }, `${number(left_out)} more are kept with the run.`));
    host.append(card);
  }
}

addSection({ id: "notes", key: "notes", title: "What the algorithm learnt", draw: fillNotes });
