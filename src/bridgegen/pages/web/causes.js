// The causes of the critical scenarios: a bar, and a button for each that filters the page.

import { $, NARROW, element } from "./common.js";
import { data } from "./data.js";
import { filters } from "./filters.js";
import { hook } from "./hook.js";
import { number } from "./numbers.js";
import { addSection } from "./sections.js";

export const CAUSE_HELP = [
  "", "gone with ideal perception", "gone with a careful and competent driver", "gone with ideal control or on a dry road",
  "gone with none of these", "gone with a kinematic vehicle",
];

class Causes {
  constructor(causes) {
    this.chosen = null;
    this.fill(causes);
    hook.cause = (label) => this.choose(label === null ? null : this.labels.indexOf(label));
    document.addEventListener("grown", () => this.fill(data.causes));
    // It can be filtered by in the table and in the parallel coordinates as well.
    document.addEventListener("filters", ({ detail }) => {
      const range = detail.get("cause");
      const i = range ? Math.round((range[0] + range[1]) / 2) : null;
      this.show(range && range[1] - range[0] < 1 ? i : null);
    });
  }

  fill({ labels, counts }) {
    const focused = this.buttons?.find(([, button]) => button === document.activeElement)?.[0];
    this.labels = labels;
    const total = counts.slice(1).reduce((a, b) => a + b, 0);
    const causes = labels.map((label, i) => i).slice(1);
    this.parts = causes.filter((i) => counts[i]).map((i) => {
      const part = element("span", { class: `cause-${i}`, title: `${labels[i]} ${number(counts[i])}` });
      part.style.flexGrow = counts[i];
      return [i, part];
    });
    this.buttons = causes.map((i) => {
      const share = `${((100 * counts[i]) / total).toFixed(1)}${NARROW}%`;
      const text = element("span", {}, labels[i], " ", element("b", {}, number(counts[i])), ` (${share})`, element("small", {}, CAUSE_HELP[i]));
      const button = element("button", { type: "button", class: `cause-${i}`, "aria-pressed": "false" }, element("i", { "aria-hidden": "true" }), text);
      button.disabled = !counts[i];
      button.addEventListener("click", () => this.choose(this.chosen === i ? null : i));
      return [i, button];
    });
    $("causes-bar").replaceChildren(...this.parts.map(([, part]) => part));
    $("causes-list").replaceChildren(...this.buttons.map(([, button]) => element("li", {}, button)));
    this.buttons.find(([i]) => i === focused)?.[1].focus();
    this.show(this.chosen);
  }

  choose(i) {
    if (i === null) filters.set("cause");
    else filters.set("cause", i - 0.3, i + 0.3);
  }

  show(i) {
    this.chosen = i;
    for (const [k, part] of this.parts) part.classList.toggle("off", i !== null && k !== i);
    for (const [k, button] of this.buttons) button.setAttribute("aria-pressed", `${k === i}`);
  }
}

addSection({ id: "causes", key: "causes", draw: (found) => new Causes(found) });
