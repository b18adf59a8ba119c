// The list of the runs in a folder: sorted and filtered; two are chosen for a look side by side. Those that grow show it.

import { $, NARROW, element } from "./common.js";
import "./status.js";

const page = JSON.parse($("data").textContent);
const runs = page.runs;
const UNITS = ["B", "kB", "MB", "GB"];
const EACH = 2000; // ms between two questions while a run grows

const plain = (n) => (n === null ? "–" : n.toLocaleString("en-GB"));
const perCent = (share) => `${(100 * share).toPrecision(2)}${NARROW}%`;

function sizeText(bytes) {
  const power = Math.min(UNITS.length - 1, bytes > 0 ? Math.floor(Math.log10(bytes) / 3) : 0);
  const value = bytes / 1000 ** power;
  return `${power && value < 10 ? value.toFixed(1) : Math.round(value)}${NARROW}${UNITS[power]}`;
}

function nameCell(run) {
  const small = run.problem ? element("small", { class: "problem" }, run.problem) : run.finished ? "" : element("small", {}, `not finished: ${plain(run.evaluations)} of ${plain(run.budget)}`);
  return [run.problem ? run.path : element("a", { href: `run/${run.number}/` }, run.path), small];
}

const shareCell = ({ share, low, high, unjudged }) => (share === null || unjudged ? ["–"] : [perCent(share), element("small", {}, `${perCent(low)} to ${perCent(high)}`)]);
const noneFound = ({ finished, problem, judged, unjudged, violated, failures }) => {
  if (!finished || problem || (unjudged && violated)) return ""; // a violation is a verdict
  if (failures) return "fails in fresh random draws alone";
  return unjudged ? "not judged" : judged ? "no harm found" : "no failure found";
};
const judgedCell = ({ judged, violated }) => (judged ? [element("small", { class: violated ? "problem" : "" }, judged)] : []);
const modesCell = (run) => [run.worst || noneFound(run), ...judgedCell(run), run.modes > 1 ? element("small", {}, `the worst of ${plain(run.modes)} ways`) : ""];

/** @type {[string, (run: any) => any, (run: any) => any[], string][]} title, what it is sorted by, its cell, its class */
const COLUMNS = [
  ["run", ({ path }) => path, nameCell, "words"],
  ["scenario", ({ scenario }) => scenario, ({ scenario }) => [scenario], ""],
  ["driver", ({ ego }) => ego, ({ ego }) => [ego], ""],
  ["algorithm", ({ algorithm }) => algorithm, ({ algorithm, seed, problem }) => [algorithm, problem ? "" : element("small", {}, `seed ${seed}`)], ""],
  ["evaluations", ({ evaluations }) => evaluations, ({ evaluations, problem }) => [problem ? "" : plain(evaluations)], "number"],
  ["failures", ({ failures }) => failures ?? -1, ({ failures, unjudged, problem }) => [problem ? "" : plain(unjudged ? null : failures)], "number"],
  ["of the space", ({ share }) => share ?? -1, shareCell, "number"],
  ["worst failure", ({ modes, violated }) => modes + Number(violated), modesCell, "words"],
  ["changed", ({ changed }) => changed, ({ changed, size }) => [new Date(1000 * changed).toLocaleString("sv-SE").slice(0, 16), element("small", {}, sizeText(size))], "number"],
];

class Runs {
  constructor() {
    this.column = 8;
    this.down = true;
    this.chosen = [];
    for (const name of ["scenario", "ego"]) {
      const values = [...new Set(runs.map((run) => run[name]).filter(Boolean))].sort();
      $(name).append(...values.map((value) => element("option", { value }, value)));
    }
    for (const id of ["text", "scenario", "ego", "failing"]) $(id).addEventListener("input", () => this.fill());
    this.head();
    this.fill();
    this.grow();
  }

  head() {
    const cells = COLUMNS.map(([title, , , kind], i) => {
      const button = element("button", { type: "button" }, title);
      button.addEventListener("click", () => {
        this.down = this.column === i ? !this.down : i > 3;
        this.column = i;
        this.fill();
      });
      return element("th", { scope: "col", class: kind }, button);
    });
    this.heads = cells;
    $("runs").tHead.replaceChildren(element("tr", {}, element("th", {}, element("span", { class: "hidden" }, "choose")), ...cells));
  }

  get shown() {
    const text = $("text").value.toLowerCase(), [, key] = COLUMNS[this.column];
    const chosen = runs.filter((run) => (!$("scenario").value || run.scenario === $("scenario").value)
      && (!$("ego").value || run.ego === $("ego").value) && (!$("failing").checked || run.modes > 0 || run.violated)
      && [run.path, run.scenario, run.ego, run.algorithm, run.worst, run.judged].some((one) => one.toLowerCase().includes(text)));
    const order = (a, b) => (key(a) < key(b) ? -1 : key(a) > key(b) ? 1 : a.number - b.number);
    return chosen.sort((a, b) => (this.down ? -order(a, b) : order(a, b)));
  }

  fill() {
    const { shown } = this;
    this.heads.forEach((head, i) => {
      if (i === this.column) head.setAttribute("aria-sort", this.down ? "descending" : "ascending");
      else head.removeAttribute("aria-sort");
    });
    $("shown").textContent = `${plain(shown.length)} of ${plain(runs.length)} runs`;
    $("runs").tBodies[0].replaceChildren(...shown.map((run) => this.row(run)));
  }

  row(run) {
    const box = element("input", { type: "checkbox", "aria-label": `Choose ${run.path}` });
    box.checked = this.chosen.includes(run.number);
    const row = element("tr", {}, element("td", {}, box), ...COLUMNS.map(([title, , cell, kind]) => element("td", { class: kind, "data-title": title }, ...cell(run))));
    row.classList.toggle("chosen", box.checked);
    box.addEventListener("change", () => {
      this.chosen = box.checked ? [...this.chosen, run.number].slice(-2) : this.chosen.filter((one) => one !== run.number);
      this.offer();
      this.fill();
    });
    return row;
  }

  offer() {
    const link = $("compare"), [a, b] = this.chosen;
    const ready = b !== undefined;
    link.setAttribute("aria-disabled", `${!ready}`);
    if (ready) link.setAttribute("href", `pair?first=${a}&second=${b}`);
    else link.removeAttribute("href");
    link.textContent = ready ? "Show the two side by side" : b === undefined && a !== undefined ? "Choose one more run" : "Choose two runs to compare";
  }

  // The searches that run now, each with its counts.
  grow() {
    const growing = runs.filter((run) => run.grows);
    $("growing").hidden = !growing.length;
    $("growing").replaceChildren(...growing.map((run) => {
      const counts = element("p", {}, element("b", {}, plain(run.evaluations)), ` of ${plain(run.budget)} evaluations, `, element("b", {}, plain(run.critical)), " critical");
      const bar = element("progress", { max: `${run.budget}`, value: `${run.evaluations}`, "aria-label": `Evaluations of ${run.path}` });
      return element("div", { class: "card" }, element("h3", {}, element("i", { "aria-hidden": "true" }), element("a", { href: `run/${run.number}/` }, run.path)), element("p", { class: "muted" }, `${run.scenario}, ${run.ego}, ${run.algorithm}`), counts, bar);
    }));
    setTimeout(() => this.ask(growing), EACH);
  }

  async ask(growing) {
    let news = null;
    try {
      if (!document.hidden) news = await (await fetch(`news?run=${growing.map(({ number }) => number).join()}`)).json();
    } catch { /* no longer served: what was known last stays */ }
    const ended = news?.runs?.some((run) => run.finished), more = news && news.total !== runs.length;
    // Verdict and list follow from it; but nobody loses what is being written or chosen.
    if ((ended || more) && !this.chosen.length && !document.activeElement?.matches("input, select")) return location.reload();
    for (const run of news?.runs ?? []) Object.assign(runs[run.number], run);
    if (news?.runs?.length) this.fill();
    this.grow();
  }
}

new Runs();
