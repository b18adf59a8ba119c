// The result in sentences and figures, and how to run it again.

import { $, copy, element } from "./common.js";
import { data, rows } from "./data.js";
import { number, shareText } from "./numbers.js";

// How many rows have traffic that could not happen, and why.
function fillImplausible() {
  const { count, reasons } = data.implausible;
  $("implausible").hidden = !count;
  if (!count) return;
  const share = shareText(count / Math.max(1, rows.n));
  $("implausible").textContent = `Left out as implausible: ${number(count)} of ${number(rows.n)} (${share}): ${reasons.map(([text, n]) => `${text} (${number(n)})`).join("; ")}.`;
}

function fillTable(body, rows) {
  body.replaceChildren(...rows.map(([name, value]) => element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, value))));
}

function fillSummary() {
  const s = data.summary; // another object once a served page has taken in what is new
  $("title").textContent = s.title;
  $("facts").replaceChildren(...s.facts.map((fact) => element("li", {}, fact)));
  for (const page of s.beside) $("facts").append(element("li", {}, element("a", { href: page }, page.split(".")[0])));
  if (!s.finished && !data.live) $("facts").append(element("li", { class: "warn" }, "not finished"));
  $("description").textContent = s.description;
  $("critical-means").textContent = `Critical means ${s.critical_rule}.`;
  $("description").hidden = !s.description;
  $("figures").replaceChildren(...s.table.map(([name, value]) => element("div", {}, element("span", { class: "name" }, name), element("b", {}, value))));
  fillImplausible();
  const failed = data.rows.n_failed;
  fillTable($("settings"), failed ? [...s.provenance, ["Failed evaluations", `${failed}, counted but not drawn`]] : s.provenance);
  $("command").textContent = s.command;
}

function connectSummary() {
  $("copy-sentences").addEventListener("click", (event) => copy(data.summary.sentences.join(" "), event.currentTarget));
  $("copy-command").addEventListener("click", (event) => copy(data.summary.command, event.currentTarget));
}

fillSummary();
connectSummary();
document.addEventListener("grown", fillSummary);
