// Did it happen? In which share of the evaluations each event began, and each participant came near the ego.

import { NARROW, element } from "./common.js";
import { data } from "./data.js";
import { number } from "./numbers.js";
import { addSection } from "./sections.js";

function happeningRow({ name, rows, of }) {
  const share = `${((100 * rows) / of).toFixed(0)}${NARROW}%`;
  const bar = element("i", { "aria-hidden": "true" });
  bar.style.width = `${(100 * rows) / of}%`;
  return element("tr", {}, element("th", { scope: "row" }, name), element("td", { class: "share" }, bar),
    element("td", { class: "number", title: `${number(rows)} of ${number(of)} evaluations` }, share));
}

function fillHappening({ lead, groups }, host) {
  const head = (text) => element("tr", {}, element("th", { scope: "rowgroup", colspan: 3 }, text));
  const bodies = groups.map(({ title, shares }) => element("tbody", {}, head(title), ...shares.map(happeningRow)));
  const caption = element("caption", { class: "hidden" }, "Share of the evaluations in which each happened");
  const card = element("div", { class: "card happening" }, ...lead.map((text) => element("p", {}, text)), element("table", {}, caption, ...bodies));
  host.querySelector(".card")?.remove();
  host.append(card);
}

function drawHappening(found, host) {
  fillHappening(found, host);
  document.addEventListener("grown", () => fillHappening(data.happening, host));
}

addSection({ id: "happening", key: "happening", title: "Did it happen?", draw: drawHappening });
