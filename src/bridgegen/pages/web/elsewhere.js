// What other simulators made of the scenarios: a section of the page.

import { $, element } from "./common.js";
import { criterionOf, shortName } from "./criteria_rows.js";
import { hook } from "./hook.js";
import { number, unitText } from "./numbers.js";
import { addSection } from "./sections.js";
import { VERDICTS, elsewhere, verdictOf } from "./verdicts.js";

const MOST_MARGINS_ELSEWHERE = 3; // columns

class Elsewhere {
  constructor() {
    document.addEventListener("grown", () => this.fill());
    this.fill();
  }

  fill() {
    $("elsewhere-cards").replaceChildren(...elsewhere.map((one) => this.card(one)));
  }

  card(one) {
    const figures = this.figures(one), head = ["Scenario", "There", ...figures.map(([name]) => shortName(name)), "First collision", "Diverges first"];
    const units = ["", "", ...figures.map(([, unit]) => unit), "s", `by over ${one.parted_at} m`];
    const cells = head.map((name, k) => element("th", { scope: "col" }, name, element("small", {}, units[k] || "\u00a0")));
    const table = element("table", {}, element("caption", { class: "hidden" }, `Scenarios in ${one.label}`),
      element("thead", {}, element("tr", {}, ...cells)), element("tbody", {}, ...one.scenarios.map((scenario) => this.row(one, scenario))));
    const less = one.without_tracks ? [element("p", { class: "muted small" }, `The outlines of ${number(one.without_tracks)} of them, the least critical, found no room in this page.`)] : [];
    return element("div", { class: "card" }, element("h3", {}, one.label), ...one.sentences.map((sentence) => element("p", {}, sentence)),
      element("div", { class: "wide", tabindex: "0", role: "group", "aria-label": `Scenarios in ${one.label}, scrollable` }, table), ...less);
  }

  // What the verdict depends on, and d_min: name and unit each; margins by the names of their columns.
  figures({ rule, scenarios }) {
    if (rule === "harm") return [["harm", ""], ["d_min", "m"]];
    if (rule !== "criteria") return [["d_min", "m"], ["v_d", "m/s"]];
    const names = Object.keys(scenarios[0]?.here.margins ?? {}).slice(0, MOST_MARGINS_ELSEWHERE);
    return [...names.map((name) => [`criterion:${name}`, unitText(criterionOf(`criterion:${name}`)?.unit ?? "")]), ["d_min", "m"]];
  }

  row(one, scenario) {
    const { here, there, parts } = scenario, verdict = verdictOf(scenario), words = VERDICTS[verdict][1];
    const button = element("button", { type: "button", class: "quiet", "aria-label": `Show ${scenario.name} where it parts` }, scenario.name);
    button.addEventListener("click", () => hook.show?.(scenario.evaluation, parts?.time ?? null));
    const change = (name, none) => {
      const figure = (outcome) => (name.startsWith("criterion:") ? outcome.margins[shortName(name)] ?? null : outcome[name]);
      const text = (outcome) => (figure(outcome) === null ? none : figure(outcome).toFixed(2).replace("-", "−"));
      if (!there || text(here) === text(there)) return element("td", {}, text(here));
      return element("td", {}, `${text(here)} → ${text(there)}`);
    };
    const first = !there ? "–" : parts ? `${parts.entity} at ${parts.time.toFixed(2)} s` : "none";
    const why = element("details", {}, element("summary", {}, first), element("span", {}, scenario.text));
    why.open = verdict !== 1;
    return element("tr", {}, element("td", {}, button), element("td", { class: `verdict-${verdict}` }, words),
      ...this.figures(one).map(([name]) => change(name, name === "d_min" ? "∞" : "–")), change("contact", "none"), element("td", { class: "why" }, why));
  }
}

addSection({ id: "elsewhere", key: "confirmations", draw: () => new Elsewhere() });
