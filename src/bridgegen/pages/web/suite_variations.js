// The variations of a scenario with an ego: a table, the failed ones first.

import { element } from "./common.js";
import { conflictWord } from "./findings.js";
import { number, quantity, shareText, unitText } from "./numbers.js";
import { CLASSES, MARKS, PASSES, WORSE, button, counted, suite } from "./suite_words.js";

const ROWS_AT_ONCE = 100;
const FEW_PARAMETERS = 6; // parameters that stand before the results
const OUTCOMES = { a: "avoided", m: "mitigated", n: "not avoided" };
const WORST_OUTCOME = { n: 0, m: 1, a: 2 };
const hits = ({ outcome }, i) => outcome[i] === "m" || outcome[i] === "n";
const valueText = (value) => (typeof value === "string" ? value : number(value));

// The columns: title, values by row, the cell's text, its class, an explanation.
function columnsOf(found, words, ego) {
  const word = (name) => found[name].map((k) => words[k]);
  /** @type {[string, any[], (value: any, row: number) => any, string, string][]} */
  const columns = [
    ["No.", found.at, (value) => counted(value + 1), "number", ""],
    ["verdict", [...found.verdict].map((letter) => WORSE[letter]), (_, i) => rowVerdict(found, i), "", ""],
  ];
  if (found.beside.length) {
    suite.egos.forEach((label, k) => {
      if (k !== ego) columns.push([label, found.beside.map((letters) => WORSE[letters[k]] ?? 4), (_, i) => markCell(found.beside[i][k]), "", `the same variation with ${label}`]);
    });
  }
  const parameters = parametersOf(found), few = parameters.length <= FEW_PARAMETERS;
  if (few) columns.push(...parameters);
  found.criteria.forEach((at, k) => {
    const { id, text, formula } = suite.criteria[at];
    columns.push([`margin ${id}`, found.margins[k], (value) => element("span", { class: value < 0 ? "failed" : "" }, quantity(value, "")), "number", `${text || formula}; below 0 it is violated`]);
  });
  if ([...found.outcome].some((letter) => letter === "m" || letter === "n")) {
    columns.push(
      ["outcome", [...found.outcome].map((letter) => WORST_OUTCOME[letter] ?? 3), (_, i) => OUTCOMES[found.outcome[i]] ?? "–", "", "whether the ego avoids the collision, or hits slower than it was at the start"],
      ["impact [m/s]", found.impact, (value, i) => (hits(found, i) ? quantity(value, "") : "–"), "number", "the ego's speed at its first contact"],
      ["relative [m/s]", found.relative, (value, i) => (hits(found, i) ? quantity(value, "") : "–"), "number", "the same, less the other's speed along the ego's heading"],
    );
  }
  const colours = word("colour");
  if (colours.some(Boolean)) columns.push(["colour", colours, (value) => value || "–", "", "by the bands of Euro NCAP's protocol of 2026"]);
  columns.push(
    ["severity", found.severity, (value, i) => (found.verdict[i] === "n" ? "–" : shareText(value)), "number", "probability of a MAIS3+ injury in the ego's collision"],
    ["d_min [m]", found.d_min, (value) => quantity(value, ""), "number", "minimum distance to others"],
    ["conflict", word("conflict").map(conflictWord), (value) => value || "–", "", ""],
    ["type", word("type"), (value) => value, "", ""],
    ["partner", word("partner"), (value) => value, "words", ""],
    ["responsible", word("responsible"), (value) => value, "", ""],
  );
  const notes = word("note");
  if (notes.some(Boolean)) columns.push(["note", notes, (value) => value, "words", "why it did not run, is flaky or not judged"]);
  if (!few) columns.push(...parameters);
  return columns.filter(([title, values]) => !["conflict", "type", "partner", "responsible"].includes(title) || values.some(Boolean));
}

function parametersOf({ parameters, x }) {
  return parameters.map(([name, unit], k) => {
    const text = unit === "?" ? "" : unitText(unit);
    return [text ? `${name} [${text}]` : name, x[k], valueText, typeof x[k][0] === "string" ? "words" : "number", ""];
  });
}

function rowVerdict({ verdict, critical }, i) {
  return element("span", { class: verdict[i] === "p" ? "" : CLASSES[verdict[i]] }, `${PASSES[verdict[i]]}${critical[i] === "1" ? ": critical" : ""}`);
}

function markCell(letter) {
  if (!(letter in MARKS)) return "–";
  return element("span", { class: letter === "f" ? "failed" : "", role: "img", "aria-label": PASSES[letter] }, MARKS[letter]);
}

export class Variations {
  constructor(found, words, ego, played) {
    this.found = found;
    this.played = played;
    this.columns = columnsOf(found, words, ego);
    this.order = found.at.map((_, i) => i);
    this.column = -1; // as the page holds them
    this.down = false;
    this.body = element("tbody");
    this.heads = this.columns.map(([title, , , kind, says], k) => element("th", { scope: "col", class: kind, title: says }, button(title, () => this.sort(k))));
    this.rest = button("", () => this.draw(), { class: "quiet" });
    this.node = element("div", { class: "variations" },
      element("h3", {}, "Variations"), element("p", { class: "muted" }, this.lead()),
      element("div", { class: "rows", tabindex: "0", role: "group", "aria-label": "Variations, scrollable" },
        element("table", {}, element("thead", {}, element("tr", {}, ...this.heads)), this.body)),
      this.rest);
    this.draw();
  }

  lead() {
    const { at, total } = this.found;
    if (total === 1) return this.found.parameters.length ? "One variation." : "Nothing varies.";
    const all = at.length === total ? `${counted(total)}, the failed ones first.` : `The first ${counted(at.length)} of ${counted(total)}, the failed ones first; the others are in results.jsonl.`;
    return this.played ? `${all} No. ${counted(this.found.worst + 1)} is the one that is played.` : all;
  }

  sort(k) {
    this.down = this.column === k && !this.down;
    this.column = k;
    const values = this.columns[k][1];
    const order = (a, b) => (values[a] === values[b] ? 0 : values[a] === null ? 1 : values[b] === null ? -1 : (values[a] < values[b] ? -1 : 1) * (this.down ? -1 : 1));
    this.order.sort((a, b) => order(a, b) || a - b);
    this.heads.forEach((head, i) => {
      if (i === k) head.setAttribute("aria-sort", this.down ? "descending" : "ascending");
      else head.removeAttribute("aria-sort");
    });
    this.body.replaceChildren();
    this.draw();
  }

  draw() {
    const from = this.body.children.length, some = this.order.slice(from, from + ROWS_AT_ONCE);
    this.body.append(...some.map((i) => element("tr", { class: this.found.at[i] === this.found.worst ? "worst" : "" },
      ...this.columns.map(([, values, cell, kind]) => element("td", { class: kind }, cell(values[i], i))))));
    const left = this.order.length - from - some.length;
    this.rest.hidden = left === 0;
    this.rest.textContent = `Show ${counted(Math.min(ROWS_AT_ONCE, left))} more of ${counted(left)}`;
  }
}
