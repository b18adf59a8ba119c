// The pass criteria: whether they are met, in a clause above all else; a table with their margins.

import { $, element } from "./common.js";
import { data, rows } from "./data.js";
import { marginText } from "./criteria_rows.js";
import { filters } from "./filters.js";
import { hook } from "./hook.js";
import { number } from "./numbers.js";
import { playbacks } from "./playbacks.js";
import { addSection } from "./sections.js";

const NAMESPACE = "http://www.w3.org/2000/svg";
const WIDE = 180; // of a histogram, without its labels
const HIGH = 44;

function drawing(tag, attributes, ...children) {
  const node = document.createElementNS(NAMESPACE, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, `${value}`);
  node.append(...children);
  return node;
}

class Criteria {
  constructor() {
    document.addEventListener("filters", () => this.mark());
    document.addEventListener("grown", () => this.fill());
    this.fill();
  }

  fill() {
    const { headline, violated, list } = data.criteria, verdict = $("criteria-verdict");
    const focused = this.buttons?.find(([, button]) => button === document.activeElement)?.[0];
    verdict.hidden = !headline;
    verdict.className = `criteria-verdict ${violated ? "violated" : "met"}`;
    verdict.replaceChildren(element(violated ? "h2" : "p", {}, element("span", { "aria-hidden": "true" }, violated ? "✗ " : "✓ "), headline));
    this.buttons = [];
    $("criteria-body").replaceChildren(...list.map((one) => this.row(one)));
    this.buttons.find(([name]) => name === focused)?.[1].focus();
    this.mark();
  }

  row(one) {
    const state = one.violated ? "violated" : one.met ? "met" : "unknown";
    return element("tr", { class: state }, this.requirement(one), this.counts(one), this.worst(one), this.margins(one), this.tools(one));
  }

  requirement({ id, text, formula, severity, tags }) {
    const cell = element("th", { scope: "row", class: "requirement" }, element("b", {}, id), element("span", { class: `severity ${severity}` }, severity), ...tags.map((tag) => element("span", { class: "tag" }, tag)));
    if (text) cell.append(element("span", { class: "text" }, text));
    cell.append(element("code", {}, formula));
    return cell;
  }

  counts({ met, violated, failed }) {
    const parts = [["violated", violated], ["met", met], ["failed", failed]].filter(([, n]) => n);
    const bar = element("span", { class: "criteria-bar", "aria-hidden": "true" }, ...parts.map(([name, n]) => {
      const part = element("i", { class: name });
      part.style.flexGrow = `${n}`;
      return part;
    }));
    const texts = parts.map(([name, n]) => element("span", { class: name }, element("b", {}, number(n)), ` ${name}`));
    return element("td", { class: "counts" }, ...(parts.length ? [bar, ...texts] : ["no evaluation yet"]));
  }

  worst({ id, worst, at, unit }) {
    const cell = element("td", { class: "worst" }, element("b", { class: worst < 0 ? "hit" : "" }, marginText(worst, unit)));
    if (at === null || !rows.evaluation.includes(at)) return cell;
    const button = element("button", { type: "button", class: "quiet", "aria-label": `${playbacks.source(at) ? "Play" : "Show"} evaluation ${number(at + 1)}, the least margin of ${id}` }, `${playbacks.source(at) ? "▶" : "▷"} evaluation ${number(at + 1)}`);
    button.addEventListener("click", () => hook.show?.(at, 0, true));
    cell.append(button);
    return cell;
  }

  margins({ histogram, unit, id }) {
    const cell = element("td", { class: "margins" });
    if (!histogram) return cell;
    const { first, width, counts } = histogram, most = Math.max(...counts), bar = WIDE / counts.length;
    const bars = counts.map((n, k) => {
      const height = n ? Math.max(1.5, (HIGH * n) / most) : 0, low = (first + k) * width;
      const title = drawing("title", {}, `${marginText(low, unit)} to ${marginText(low + width, unit)}: ${number(n)}`);
      return drawing("rect", { x: k * bar + 0.5, y: HIGH - height, width: Math.max(0.5, bar - 1), height, class: low < -width / 2 ? "violated" : "met" }, title);
    });
    const zero = -first * bar, ends = [first * width, (first + counts.length) * width].map((end) => marginText(end, unit));
    const text = `Margins of ${id}, from ${ends[0]} to ${ends[1]}; violated left of 0`;
    const label = (x, anchor, words) => drawing("text", { x, y: HIGH + 13, "text-anchor": anchor }, words);
    const labels = [zero > 50 ? label(0, "start", ends[0]) : null, label(Math.min(WIDE - 4, Math.max(4, zero)), "middle", "0"), zero < WIDE - 50 ? label(WIDE, "end", ends[1]) : null].filter((one) => one !== null);
    cell.append(drawing("svg", { viewBox: `0 0 ${WIDE} ${HIGH + 16}`, width: WIDE, height: HIGH + 16, role: "img", "aria-label": text },
      ...bars, drawing("path", { d: `M0 ${HIGH}H${WIDE}`, class: "axis" }), drawing("path", { d: `M${zero} 0V${HIGH + 3}`, class: "zero" }), ...labels));
    return cell;
  }

  tools({ id, quantity, violated }) {
    const button = element("button", { type: "button", class: "quiet", "aria-pressed": "false", title: "Show only these evaluations in the list and the charts", "aria-label": `Show the violations of ${id} only` }, "Violations");
    button.disabled = !violated;
    button.addEventListener("click", () => filters.violating(filters.violated === quantity ? null : quantity));
    this.buttons.push([quantity, button]);
    return element("td", {}, button);
  }

  mark() {
    for (const [name, button] of this.buttons) button.setAttribute("aria-pressed", `${filters.violated === name}`);
  }
}

addSection({ id: "criteria", key: "criteria", draw: () => new Criteria() });
