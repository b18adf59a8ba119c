// What other simulators made of the scenarios: a section of the page.

import { $, element } from "./common.js";
import { hook } from "./hook.js";
import { number } from "./numbers.js";
import { addSection } from "./sections.js";
import { VERDICTS, elsewhere, verdictOf } from "./verdicts.js";

class Elsewhere {
  constructor() {
    document.addEventListener("grown", () => this.fill());
    this.fill();
  }

  fill() {
    $("elsewhere-cards").replaceChildren(...elsewhere.map((one) => this.card(one)));
  }

  card(one) {
    const byHarm = one.rule === "harm";
    const head = ["Scenario", "There", ...(byHarm ? ["harm", "d_min"] : ["d_min", "v_d"]), "First collision", "Diverges first"];
    const units = ["", "", ...(byHarm ? ["", "m"] : ["m", "m/s"]), "s", `by over ${one.parted_at} m`];
    const cells = head.map((name, k) => element("th", { scope: "col" }, name, element("small", {}, units[k] || "\u00a0")));
    const table = element("table", {}, element("caption", { class: "hidden" }, `Scenarios in ${one.label}`),
      element("thead", {}, element("tr", {}, ...cells)), element("tbody", {}, ...one.scenarios.map((scenario) => this.row(one, scenario))));
    const less = one.without_tracks ? [element("p", { class: "muted small" }, `The outlines of ${number(one.without_tracks)} of them, the least critical, found no room in this page.`)] : [];
    return element("div", { class: "card" }, element("h3", {}, one.label), ...one.sentences.map((sentence) => element("p", {}, sentence)),
      element("div", { class: "wide", tabindex: "0", role: "group", "aria-label": `Scenarios in ${one.label}, scrollable` }, table), ...less);
  }

  row(one, scenario) {
    const { here, there, parts } = scenario, verdict = verdictOf(scenario), words = VERDICTS[verdict][1];
    const button = element("button", { type: "button", class: "quiet", "aria-label": `Show ${scenario.name} where it parts` }, scenario.name);
    button.addEventListener("click", () => hook.show?.(scenario.evaluation, parts?.time ?? null));
    const change = (name, none) => {
      const text = (value) => (value === null ? none : value.toFixed(2));
      if (!there) return element("td", {}, text(here[name]));
      const same = text(here[name]) === text(there[name]);
      return element("td", {}, same ? text(here[name]) : `${text(here[name])} → ${text(there[name])}`);
    };
    const first = !there ? "–" : parts ? `${parts.entity} at ${parts.time.toFixed(2)} s` : "none";
    const why = element("details", {}, element("summary", {}, first), element("span", {}, scenario.text));
    why.open = verdict !== 1;
    return element("tr", {}, element("td", {}, button), element("td", { class: `verdict-${verdict}` }, words),
      ...(one.rule === "harm" ? [change("harm", "–"), change("d_min", "∞")] : [change("d_min", "∞"), change("v_d", "–")]), change("contact", "none"), element("td", { class: "why" }, why));
  }
}

addSection({ id: "elsewhere", key: "confirmations", draw: () => new Elsewhere() });
