// Critical regions: the table of what fresh scenarios say of them.

import { $, NARROW, element } from "./common.js";
import { filters } from "./filters.js";
import { number } from "./numbers.js";
import { regionList } from "./region_rows.js";
import { addSection } from "./sections.js";

// Those that are drawn in the charts: the chosen one, or all that hold.
export function drawnRegions() {
  return regionList.filter((region, k) => (filters.region === null ? region.confirmed : filters.region === k));
}

const percentOf = (share) => {
  const value = 100 * share;
  return `${value !== 0 && value < 9.95 ? Number(value.toPrecision(2)) : value > 99.5 && value < 100 ? Math.min(99.9, value).toFixed(1) : Math.round(value)}`;
};

class Regions {
  constructor(found) {
    this.buttons = [];
    const hold = regionList.filter((region) => region.confirmed).length;
    const least = percentOf(found.at_least), sure = percentOf(found.confidence);
    $("regions-lead").textContent = hold
      ? `Boxes of the parameter space in which at least ${least}${NARROW}% of all scenarios are critical, with ${sure}${NARROW}% confidence: each was tried on fresh random scenarios, simulated for this alone. They hold ${number(found.critical_held)} of the ${number(found.critical)} critical scenarios that the search had found then, after ${number(found.evaluations)} evaluations, and ${percentOf(found.space_share)}${NARROW}% of all random scenarios.`
      : `No box was confirmed in which at least ${least}${NARROW}% of all scenarios are critical, with ${sure}${NARROW}% confidence.`;
    if (found.exposure) {
      const [low, high] = found.exposure.interval.map(percentOf);
      $("regions-lead").textContent += ` Of the encounters that the exposure describes, ${percentOf(found.exposure.share)}${NARROW}% (${low} to ${high}) lie in the confirmed ones. Source of the exposure: ${found.exposure_source}`;
      $("regions-road").hidden = false;
    }
    $("regions-body").replaceChildren(...regionList.map((region, k) => this.row(region, k)));
    document.addEventListener("filters", () => this.show());
  }

  row(region, k) {
    const button = element("button", { type: "button", class: "quiet", "aria-pressed": "false", "aria-label": `Show region ${region.number} only` }, "Show");
    button.addEventListener("click", () => filters.inRegion(filters.region === k ? null : k));
    this.buttons.push(button);
    const evidence = ({ rows: n, critical, interval }) => {
      if (!n) return element("td", {}, "none");
      const [low, high] = interval.map(percentOf);
      return element("td", {}, element("b", {}, `${percentOf(critical / n)}${NARROW}%`), element("small", {}, `${low} to ${high}${NARROW}%`), element("small", {}, `${number(critical)} of ${number(n)}`));
    };
    const rules = region.rule.split(" and ").map((rule) => element("span", {}, rule));
    const verdict = region.confirmed ? "confirmed" : region.narrowed ? "not confirmed; narrowed to others" : "not confirmed";
    const row = element("tr", { class: region.confirmed ? "holds" : "fails" }, element("td", {}, `${region.number}`),
      element("td", { class: "rule", title: region.sentence }, ...rules, element("small", {}, verdict)), evidence(region.fresh),
      evidence(region.search), element("td", {}, `${percentOf(region.space_share)}${NARROW}%`),
      ...(region.exposure ? [element("td", {}, `${percentOf(region.exposure.share)}${NARROW}%`)] : []), element("td", {}, button));
    return row;
  }

  show() {
    this.buttons.forEach((button, k) => button.setAttribute("aria-pressed", `${filters.region === k}`));
  }
}

addSection({ id: "regions", key: "regions", draw: (found) => new Regions(found) });
