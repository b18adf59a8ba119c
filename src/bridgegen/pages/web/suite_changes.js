// What changes from the first of two drivers to the second: a row for each variation, with both motions in step.

import { readAddress } from "./address.js";
import { $, element } from "./common.js";
import { inflated } from "./inflate.js";
import { shareText } from "./numbers.js";
import { motions } from "./suite_motions.js";
import { CLASSES, PASSES, button, counted, happens, suite } from "./suite_words.js";

const KIND_NAMES = ["broken", "fixed", "worse", "milder", "same"]; // in the order of difference.py
const CHANGING = 4; // of these
const CHANGES_AT_ONCE = 50;

class Changes {
  constructor() {
    this.open = -1;
    this.drawn = 0;
    /** @type {number[]} */
    this.order = [];
  }

  async fill() {
    $("changes").hidden = !suite.changed;
    if (!suite.changed) return;
    const { kinds, rows, silent, unlisted } = suite.changed, number = Object.fromEntries(kinds);
    this.rows = JSON.parse(new TextDecoder().decode(await inflated(rows)));
    const all = KIND_NAMES.slice(0, CHANGING).reduce((sum, kind) => sum + number[kind], 0);
    const filters = [["", "all that change", all], ...KIND_NAMES.map((kind) => [kind, kind, number[kind]])];
    this.choices = filters.map(([kind, words, n]) => {
      const choice = button(`${words} (${counted(n)})`, () => this.filter(kind), { class: "quiet", "data-kind": kind });
      choice.disabled = !n;
      return choice;
    });
    $("change-kinds").append(...this.choices);
    const heads = ["picture", "variation", "change", ...suite.egos].map((title, k) => element("th", { scope: "col" }, k ? title : element("span", { class: "hidden" }, title)));
    $("change-table").tHead.append(element("tr", {}, ...heads));
    const left = silent.map(([kind, n]) => `${counted(n)} ${kind}`).join(", ");
    $("change-note").textContent = [left ? `Without playback, as the page has no room for it or files have changed: ${left}.` : "", unlisted ? `${counted(unlisted)} others, the same or not run, are in results.jsonl.` : ""].filter(Boolean).join(" ");
    $("change-more").addEventListener("click", () => this.draw());
    this.filter(all ? "" : "same");
  }

  filter(kind) {
    this.close();
    const shown = (name) => (kind ? KIND_NAMES[name] === kind : name < CHANGING);
    this.order = this.rows.kind.map((_, i) => i).filter((i) => shown(this.rows.kind[i]));
    for (const choice of this.choices) choice.setAttribute("aria-pressed", `${choice.dataset.kind === kind}`);
    $("change-table").tBodies[0].replaceChildren();
    this.drawn = 0;
    this.draw();
  }

  draw() {
    const some = this.order.slice(this.drawn, this.drawn + CHANGES_AT_ONCE);
    this.drawn += some.length;
    $("change-table").tBodies[0].append(...some.map((i) => this.row(i)));
    const left = this.order.length - this.drawn;
    $("change-more").hidden = !left;
    $("change-more").textContent = `Show ${counted(Math.min(CHANGES_AT_ONCE, left))} more of ${counted(left)}`;
  }

  name(i) {
    return `${suite.entries[this.rows.entry[i]].name}, variation ${this.rows.row[i] + 1}`;
  }

  row(i) {
    const kind = KIND_NAMES[this.rows.kind[i]] ?? "not comparable", motion = this.rows.motion[i], picture = element("td", { class: "picture" });
    if (motion >= 0) motions.picture(motion, picture);
    const name = motion < 0 ? element("span", {}, this.name(i)) : button(this.name(i), () => this.toggle(i), { class: "open", "aria-expanded": "false" });
    return element("tr", { "data-row": `${i}` }, picture, element("td", { class: "name" }, name), element("td", { "data-title": "change" }, element("span", { class: `kind ${kind}` }, kind)),
      ...suite.egos.map((ego, e) => element("td", { "data-title": ego }, ...this.verdict(i, e))));
  }

  verdict(i, e) {
    const { v, severity, what } = this.rows.of[e], words = this.rows.words[what[i]];
    const happened = words ? happens({ conflict: words.split("\n") }) : "";
    const harm = severity[i] ? `MAIS3+ ${shareText(severity[i])}` : "";
    return [element("span", { class: v[i] === "p" ? "" : CLASSES[v[i]] }, PASSES[v[i]]), element("small", {}, [happened, harm].filter(Boolean).join(", "))];
  }

  close() {
    const host = $("change-table").querySelector("tr.unfolded");
    if (!host) return;
    motions.park();
    host.previousElementSibling.querySelector(".open").setAttribute("aria-expanded", "false");
    host.remove();
    this.open = -1;
  }

  toggle(i) {
    if (this.open === i) return this.close();
    history.replaceState(null, "", `#${encodeURIComponent(this.name(i))}`);
    return this.show(i);
  }

  async show(i, seconds = null) {
    motions.take(this);
    this.close();
    while (this.drawn <= this.order.indexOf(i)) this.draw();
    const row = $("change-table").querySelector(`tr[data-row="${i}"]`), host = element("td", { colspan: `${3 + suite.egos.length}`, class: "playback" });
    row.after(element("tr", { class: "unfolded" }, host));
    row.querySelector(".open").setAttribute("aria-expanded", "true");
    this.open = i;
    await motions.show(this.rows.motion[i], host, seconds);
    return row;
  }

  // Opens the change that the page's address names, else the most important one; whether the address names one.
  async go() {
    if (!suite.changed) return false;
    const { name, seconds } = readAddress(), named = this.rows.motion.findIndex((k, i) => k >= 0 && this.name(i) === name);
    if (named >= 0) {
      if (!this.order.includes(named)) this.filter(KIND_NAMES[this.rows.kind[named]]);
      (await this.show(named, seconds)).scrollIntoView();
      return true;
    }
    const best = this.order.find((i) => this.rows.motion[i] >= 0);
    if (!name && best !== undefined && this.open < 0) await this.show(best);
    return false;
  }
}

export const changes = new Changes();
