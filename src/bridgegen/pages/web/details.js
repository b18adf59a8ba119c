// The chosen scenario: its figures, its files, what it is made of.

import { CAUSE_HELP } from "./causes.js";
import { $, copy, element } from "./common.js";
import { conflictLines } from "./conflict.js";
import { criterionOf, marginText } from "./criteria_rows.js";
import { columns, data } from "./data.js";
import { fileLink } from "./downloads.js";
import { number, quantity, turned, worded } from "./numbers.js";
import { Picture } from "./picture.js";

// How the scenario meets the pass criteria.
function criteriaLines(metrics) {
  const found = (data.criteria?.list ?? []).filter(({ quantity: name }) => typeof metrics[name] === "number");
  if (!found.length) return [];
  return [element("h3", {}, "Its pass criteria"), ...found.map(({ id, text, formula, quantity: name, unit }) => {
    const margin = metrics[name], verdict = margin < 0 ? "violated" : "met";
    return element("div", { title: text ? `${text}\n${formula}` : formula }, element("span", { class: "name" }, id), element("b", { class: margin < 0 ? "hit" : "" }, `${verdict}, ${marginText(margin, unit)}`));
  })];
}

// One crash as one file: a served page has it made, a page on disk says how.
function sent(name) {
  if (data.alone || !/^\d+$/.test(name)) return [];
  const title = "This crash alone, with its player and its files, as one page";
  if (data.live) return [element("a", { class: "send", href: `send/${name}.html`, download: `${data.summary.facts[0].replace(/\W+/g, "-")}-${name}.html`, title }, "Send this crash")];
  const button = element("button", { type: "button", class: "quiet send", title: `Copies the command that writes it. ${title}` }, "Send this crash: copy command");
  button.addEventListener("click", () => copy(`${data.summary.view.replace(" open ", " export ")} --flavour page --scenario ${name}`, button));
  return [button];
}

export function fillDetails(kept) {
  const line = (name, value, column) => {
    const text = element("b", {}, worded(value, column) ?? quantity(turned(value, column), column?.unit ?? ""));
    const box = element("div", { title: column?.description ?? "" }, element("span", { class: "name" }, name), text);
    const { low, high } = column ?? {};
    if (typeof low === "number" && high > low && value !== null) {
      const mark = element("i");
      mark.style.left = `${(100 * Math.min(1, Math.max(0, (value - low) / (high - low)))).toFixed(1)}%`;
      box.append(element("span", { class: "range", title: column.words ? column.words.join(", ") : `range ${number(low)} to ${quantity(turned(high, column), column.unit)}` }, mark));
    }
    return box;
  };
  const lines = (values) => Object.entries(values).map(([name, value]) => line(name, value, columns.get(name)));
  const heading = kept.minimal ? `Scenario ${kept.name}, simplest form of evaluation ${number(kept.evaluation + 1)}` : kept.evaluation < 0 ? `Scenario ${kept.name}, a fresh random draw` : `${kept.files.length ? `Scenario ${kept.name}, evaluation` : "Evaluation"} ${number(kept.evaluation + 1)}`;
  const name = element("h3", {}, heading);
  const cause = kept.cause ? [element("div", { title: `Quick label, of one replay: ${CAUSE_HELP[data.causes.labels.indexOf(kept.cause)]}` }, element("span", { class: "name" }, "cause (quick label)"), element("b", {}, kept.cause))] : [];
  const metrics = kept.conflict || data.criteria ? [element("h3", {}, "Its metrics")] : [];
  const others = Object.fromEntries(Object.entries(kept.metrics).filter(([one]) => !criterionOf(one)));
  $("measures").replaceChildren(name, ...cause, ...criteriaLines(kept.metrics), ...conflictLines(kept.conflict), ...metrics, ...lines(others));
  const parts = [element("h3", {}, "Its parameters"), ...lines(kept.parameters)];
  if (kept.files.length) {
    const links = kept.files.map(fileLink);
    parts.push(element("h3", {}, "Its files"), element("div", { class: "files" }, ...links), ...sent(kept.name));
  }
  $("details").replaceChildren(...parts);
}

// What the chosen scenario is made of.
export const showPicture = (() => {
  let picture = null;
  return (kept) => {
    $("made-of").hidden = kept.picture === null;
    if (kept.picture === null) return;
    const pictures = kept.pictures ?? data.pictures;
    picture ??= new Picture($("layers"), pictures);
    Object.assign(picture, { layers: pictures.layers, columns: pictures.columns });
    picture.show(pictures.pictures[kept.picture]);
    $("made-of-title").textContent = `What scenario ${kept.name} is made of`;
  };
})();
