// A scenario of the suite, opened: by ego, the playback of the worst failure and all variations.

import { copy, element } from "./common.js";
import { inflated } from "./inflate.js";
import { motions } from "./suite_motions.js";
import { Variations } from "./suite_variations.js";
import { WORSE, button, suite, verdictWords } from "./suite_words.js";

const read = new Map(); // number of the entry → what its details hold

async function detailsOf(number) {
  if (!read.has(number)) {
    const bytes = await inflated(suite.details[number]);
    read.set(number, JSON.parse(new TextDecoder().decode(bytes)));
  }
  return read.get(number);
}

// The ego that fails the worst, of those that are told; the one that is played first.
function worstOf({ results }) {
  const known = results.map((_, k) => k).filter((k) => results[k]);
  const rank = (k) => [WORSE[results[k].v], "motion" in results[k] ? 0 : 1, -(results[k].severity ?? 0)];
  return known.sort((a, b) => rank(a).map((value, i) => value - rank(b)[i]).find(Boolean) ?? a - b)[0];
}

export class Details {
  constructor(number, host) {
    this.entry = suite.entries[number];
    this.number = number;
    this.host = host;
    this.tabs = element("div", { class: "tabs", role: "group", "aria-label": "Driver" });
    this.body = element("div", { class: "opened" });
    host.replaceChildren(...(suite.egos.length > 1 ? [this.tabs] : []), this.body);
  }

  // Shows an ego, by default the one that fails the worst; at a time [s] of its playback, if one is named.
  async show(ego = worstOf(this.entry), seconds = null) {
    motions.park();
    const { results, words } = await detailsOf(this.number);
    const found = results[ego], of = this.entry.results[ego];
    this.tabs.replaceChildren(...suite.egos.map((label, k) => {
      const result = this.entry.results[k];
      const tab = button(`${label}: ${result ? verdictWords(result) : "no result"}`, () => this.show(k), { "aria-pressed": `${k === ego}`, class: "quiet" });
      tab.disabled = !result;
      return tab;
    }));
    const stage = element("div", { class: of.motion === undefined ? "playback none" : "playback" });
    const parts = [this.facts(found, of), stage, ...(found.total ? [new Variations(found, words, ego, of.motion !== undefined).node] : [])];
    this.body.replaceChildren(...parts);
    if (of.v !== "f" && of.motion === undefined) return void stage.remove(); // one that was asked for is played though it passes
    if (of.motion === undefined) stage.append(element("p", { class: "muted" }, "This page holds no playback of it: only of the most severe failures, and where the files are unchanged."));
    if (of.motion !== undefined) await motions.show(of.motion, stage, seconds);
    if (found.command) stage.append(this.command(found.command));
  }

  command(text) {
    const code = element("pre", {}, element("code", {}, text)), copying = button("Copy", () => copy(text, copying), { class: "quiet" });
    return element("div", { class: "replay" }, element("p", { class: "muted" }, "To run it again, in the folder in which the suite was run:"), element("div", { class: "command" }, code, copying));
  }

  facts({ driver, files, notes }, { problem, unjudged, blameless, standing, comment }) {
    const lines = [standing ? element("p", {}, `${standing[0].toUpperCase()}${standing.slice(1)}${comment ? `: ${comment}` : ""}.`) : "", problem ? element("p", { class: "lost" }, `Did not run: ${problem}`) : "", unjudged ? element("p", { class: "lost" }, `Not judged: ${unjudged}.`) : "", element("p", { class: "muted files" }, [...files, driver ? `driver ${driver}` : ""].filter(Boolean).join("  ·  "))];
    if (blameless) lines.push(element("p", {}, `${blameless} of the variations that pass ${blameless === 1 ? "has a collision that is" : "have collisions that are"} no failure of the ego: others are responsible.`));
    if (notes.length) lines.push(element("details", {}, element("summary", {}, notes.length === 1 ? "1 note" : `${notes.length} notes`), element("ul", {}, ...notes.map((note) => element("li", {}, note)))));
    return element("div", { class: "told" }, ...lines);
  }
}
