// The table of a suite's scenarios: sorted, searched, filtered; rows are drawn as they come near the screen.

import { readAddress } from "./address.js";
import { $, element } from "./common.js";
import { shareText } from "./numbers.js";
import { Details } from "./suite_details.js";
import { motions } from "./suite_motions.js";
import { CLASSES, PASSES, WORSE, bar, button, counted, happens, suite, verdictWords } from "./suite_words.js";

const entries = suite.entries;
const egos = suite.egos;
const AT_ONCE = 80;
const several = egos.length > 1;

// What is told of all egos together: the verdicts, and the failure that is the worst.
const told = entries.map(({ results }) => {
  const known = results.filter(Boolean), failed = known.filter(({ v }) => v === "f");
  const worst = failed.reduce((a, b) => ((b.severity ?? 0) > (a.severity ?? 0) ? b : a), failed[0]);
  const violated = [...new Set(known.flatMap((one) => one.violated ?? []))].sort((a, b) => a - b);
  return {
    worst, who: worst ? egos[results.indexOf(worst)] : "", violated, verdict: known.length ? Math.min(...known.map(({ v }) => WORSE[v])) : 4,
    problem: known.find(({ problem }) => problem)?.problem ?? known.find(({ unjudged }) => unjudged)?.unjudged ?? "",
    share: failed.reduce((sum, { n }) => sum + n[1] / n.reduce((a, b) => a + b), 0),
  };
});
const texts = entries.map((entry, k) => {
  const { worst, violated, problem } = told[k];
  const standing = entry.results.flatMap((result) => [result?.standing ?? "", result?.comment ?? ""]);
  return [entry.name, entry.title, entry.differ, problem, ...standing, ...(worst?.conflict ?? []), ...violated.map((i) => suite.criteria[i].id)].join("\n").toLowerCase();
});

/** @type {[string, (k: number) => any[], (k: number) => any[], string][]} title, by what it is sorted (the least first), its cell, its class */
const ENTRY_COLUMNS = [
  ["scenario", (k) => [entries[k].name], scenarioCell, "name"],
  ...egos.map((label, e) => [label, (k) => verdictKey(entries[k].results[e]), (k) => resultCell(entries[k].results[e]), "verdict"]),
  ["severity", (k) => [-(told[k].worst?.severity ?? -1)], (k) => [told[k].worst ? shareText(told[k].worst.severity) : "–"], "number"],
  ["worst failure", (k) => [told[k].worst ? 0 : told[k].problem ? 1 : 2, told[k].worst?.conflict?.[1] ?? "", told[k].problem], failureCell, "words"],
  ...(suite.criteria.length ? [["violates", (k) => [-told[k].violated.length, told[k].violated[0] ?? 0], violatedCell, "ids"]] : []),
];
const FIRST = several ? "where egos differ, then failures" : "failures";
const firstKey = (k) => [several && entries[k].differ ? 0 : 1, told[k].verdict, -(told[k].worst?.severity ?? 0), -told[k].share];

function verdictKey(result) {
  if (!result) return [4, 0];
  return [WORSE[result.v], -result.n[1] / Math.max(1, result.n.reduce((a, b) => a + b))];
}

function scenarioCell(k) {
  const { title, differ } = entries[k];
  const open = button(entries[k].name, () => table.toggle(k), { "aria-expanded": "false", class: "open" });
  const picture = element("span", { class: "picture" }), worst = told[k].worst ?? entries[k].results.find((one) => one && "motion" in one);
  if (worst && "motion" in worst) motions.picture(worst.motion, picture);
  return [picture, open, title ? element("small", {}, title) : "", differ ? element("em", {}, differ) : ""];
}

function resultCell(result) {
  if (!result) return ["–"];
  const words = element("span", { class: result.excused ? "excused" : CLASSES[result.v] }, verdictWords(result));
  const more = result.blameless ? element("small", { title: "others are responsible" }, `${counted(result.blameless)} blameless collision${result.blameless > 1 ? "s" : ""}`) : "";
  const hits = result.hits ? element("small", {}, `${counted(result.hits[0] + result.hits[1])} collide, ${counted(result.hits[0])} of them after slowing down`) : "";
  const standing = result.standing ? element("small", { class: result.excused ? "" : "failed", title: result.comment }, result.standing) : "";
  return [words, bar(result.n), standing, hits, more];
}

function failureCell(k) {
  const { worst, who, problem } = told[k];
  if (!worst) return problem ? [element("small", { class: "problem" }, problem)] : ["–"];
  const words = happens(worst), kind = worst.conflict?.[1];
  return [words || "a criterion is violated", element("small", {}, [kind, several ? who : ""].filter(Boolean).join(" · ")), problem ? element("small", { class: "problem" }, problem) : ""];
}

function violatedCell(k) {
  const ids = told[k].violated.map((i) => element("span", { class: "id", title: suite.criteria[i].text || suite.criteria[i].formula }, suite.criteria[i].id));
  return ids.length ? ids : ["–"];
}

class Entries {
  constructor() {
    this.column = -1;
    this.down = false;
    this.open = -1;
    /** @type {number[]} */
    this.order = [];
    this.drawn = 0;
    this.keys = new Map();
    this.choices();
    this.heads = ENTRY_COLUMNS.map(([title, , , kind], i) => element("th", { scope: "col", class: kind }, button(title, () => this.sort(i, this.column === i && !this.down))));
    $("table").tHead.append(element("tr", {}, ...this.heads));
    new IntersectionObserver(([{ isIntersecting }]) => { if (isIntersecting) this.draw(); }, { rootMargin: "800px" }).observe($("more"));
    addEventListener("beforeprint", () => { while (this.drawn < this.order.length) this.draw(); });
  }

  choices() {
    const group = (label, options) => {
      const kept = options.filter(([, , n]) => n);
      if (kept.length) $("verdict").append(element("optgroup", { label }, ...kept.map(([value, words, n]) => element("option", { value }, `${words} (${counted(n)})`))));
    };
    const words = { ...PASSES, n: "did not run, or not all" };
    egos.forEach((label, e) => group(label, Object.keys(words).map((v) => [`${v}${e}`, words[v], entries.filter(({ results }) => results[e]?.v === v).length])));
    const differ = [...new Set(entries.map((one) => one.differ).filter(Boolean))].sort();
    group("Egos differ", [["differ", "in any way", entries.filter((one) => one.differ).length], ...differ.map((text) => [`=${text}`, text, entries.filter((one) => one.differ === text).length])]);
    $("violated").closest("label").hidden = !suite.criteria.length;
    $("violated").append(...suite.criteria.map(({ id }, i) => element("option", { value: `${i}` }, `${id} (${counted(told.filter(({ violated }) => violated.includes(i)).length)})`)));
    $("sort").append(element("option", { value: "-1" }, FIRST), ...ENTRY_COLUMNS.flatMap(([title], i) => [[`${i}`, title], [`${i}-`, `${title}, reversed`]].map(([value, text]) => element("option", { value }, text))));
    for (const id of ["text", "verdict", "violated"]) $(id).addEventListener("input", () => this.fill());
    $("sort").addEventListener("input", () => this.sort(Number.parseInt($("sort").value), $("sort").value.endsWith("-") && $("sort").value !== "-1"));
    $("clear").addEventListener("click", () => this.filter({}));
  }

  // Shows those of a verdict or that violate a criterion only.
  filter({ verdict = "", violated = "", text = "" }) {
    Object.entries({ verdict, violated, text }).forEach(([id, value]) => { $(id).value = value; });
    this.fill();
  }

  sort(column, down) {
    this.column = column;
    this.down = down;
    $("sort").value = `${column}${column >= 0 && down ? "-" : ""}`;
    this.fill();
  }

  matches(k) {
    const verdict = $("verdict").value, violated = $("violated").value, { differ, results } = entries[k];
    const fits = verdict === "" || (verdict === "differ" ? differ !== "" : verdict[0] === "=" ? differ === verdict.slice(1) : results[Number(verdict.slice(1))]?.v === verdict[0]);
    return fits && (violated === "" || told[k].violated.includes(Number(violated))) && texts[k].includes($("text").value.trim().toLowerCase());
  }

  fill() {
    const key = this.column < 0 ? firstKey : ENTRY_COLUMNS[this.column][1], sign = this.down ? -1 : 1;
    const keys = entries.map((_, k) => key(k));
    const order = (a, b) => {
      const i = keys[a].findIndex((value, at) => value !== keys[b][at]);
      return i < 0 ? a - b : (keys[a][i] < keys[b][i] ? -1 : 1) * sign;
    };
    this.order = entries.map((_, k) => k).filter((k) => this.matches(k)).sort(order);
    this.heads.forEach((head, i) => {
      if (i === this.column) head.setAttribute("aria-sort", this.down ? "descending" : "ascending");
      else head.removeAttribute("aria-sort");
    });
    this.close();
    $("table").tBodies[0].replaceChildren();
    this.drawn = 0;
    $("shown").textContent = `${counted(this.order.length)} of ${counted(entries.length)} scenario${entries.length === 1 ? "" : "s"}`;
    $("clear").hidden = !["text", "verdict", "violated"].some((id) => $(id).value);
    $("none").hidden = this.order.length > 0;
    this.draw();
  }

  draw() {
    const some = this.order.slice(this.drawn, this.drawn + AT_ONCE);
    this.drawn += some.length;
    $("table").tBodies[0].append(...some.map((k) => this.row(k)));
  }

  row(k) {
    const row = element("tr", { class: told[k].verdict === 0 ? "fails" : "" }, ...ENTRY_COLUMNS.map(([title, , cell, kind]) => element("td", { class: kind, "data-title": title }, ...cell(k))));
    row.addEventListener("click", ({ target }) => { if (!target.closest("button") && !window.getSelection().toString()) this.toggle(k); });
    return row;
  }

  rowOf(k) {
    const at = this.order.indexOf(k);
    while (this.drawn <= at) this.draw();
    return [...$("table").tBodies[0].rows].filter((row) => !row.classList.contains("unfolded"))[at];
  }

  close() {
    if (this.open < 0) return;
    motions.park();
    const host = $("table").querySelector("tr.unfolded");
    host.previousElementSibling.querySelector(".open").setAttribute("aria-expanded", "false");
    host.remove();
    this.open = -1;
  }

  toggle(k) {
    if (this.open !== k) return this.show(k);
    this.close();
    history.replaceState(null, "", location.href.split("#")[0]);
  }

  async show(k, ego, seconds) {
    motions.take(this);
    this.close();
    const row = this.rowOf(k), host = element("td", { colspan: `${ENTRY_COLUMNS.length}` });
    this.open = k;
    row.querySelector(".open").setAttribute("aria-expanded", "true");
    row.after(element("tr", { class: "unfolded" }, host));
    if (ego === undefined) history.replaceState(null, "", `#${encodeURIComponent(entries[k].name)}`);
    await new Details(k, host).show(ego, seconds ?? null);
    return row;
  }

  // Opens what the page's address names: a scenario, or a playback and a time.
  async go() {
    const { name, seconds } = readAddress(), motion = motions.named(name);
    const ofMotion = entries.findIndex(({ results }) => motion >= 0 && results.some((one) => one?.motion === motion));
    const k = ofMotion >= 0 ? ofMotion : entries.findIndex((one) => one.name === name);
    if (k < 0) return;
    if (!this.order.includes(k)) this.filter({});
    const ego = ofMotion < 0 ? undefined : entries[k].results.findIndex((one) => one?.motion === motion);
    (await this.show(k, ego, seconds)).scrollIntoView();
  }
}

export const table = new Entries();
