// Coverage: the figures, a strip of bins for each parameter, and what a bin says when pointed at.

import { MOST_TEXTS, arrowKeys, binCell, binRange, binTicks, depth, percent, share, withUnit } from "./bins.js";
import { $, NARROW, element } from "./common.js";
import { Pairs } from "./coverage_pairs.js";
import { columns } from "./data.js";
import { number } from "./numbers.js";
import { addSection } from "./sections.js";

// The text of the cell under the pointer, or else of the one in focus.
class Tip {
  constructor(section, node) {
    this.section = section;
    this.node = node;
    const cell = (event) => event.target.closest("[data-row]");
    section.addEventListener("pointerover", (event) => { this.over = cell(event); this.show(); });
    section.addEventListener("pointerleave", () => { this.over = null; this.show(); });
    section.addEventListener("focusin", (event) => { this.focused = cell(event); this.show(); });
    section.addEventListener("focusout", () => { this.focused = null; this.show(); });
    section.addEventListener("scroll", () => this.show(), true);
    section.addEventListener("keydown", (event) => { if (event.key === "Escape") node.hidden = true; });
  }

  show() {
    const cell = this.over ?? this.focused;
    this.node.hidden = !cell?.isConnected;
    if (this.node.hidden) return;
    this.node.textContent = cell.getAttribute("aria-label");
    const at = cell.getBoundingClientRect(), frame = this.section.getBoundingClientRect();
    const room = frame.width - this.node.offsetWidth;
    this.node.style.left = `${Math.min(room, Math.max(0, at.left - frame.left + (at.width - this.node.offsetWidth) / 2))}px`;
    this.node.style.top = `${at.top - frame.top - this.node.offsetHeight - 7}px`;
  }
}

class Coverage {
  constructor(found) {
    this.found = found;
    this.figures();
    $("strips").replaceChildren(...this.strips());
    arrowKeys($("strips"));
    if (found.pairs.length) this.pairs = new Pairs(found);
    else $("pairs-card").hidden = true;
    new Tip($("coverage"), $("tip"));
  }

  figures() {
    const { sample, ways } = this.found, things = ["", "bins", "pairs of bins", "triples of bins"];
    $("ways").replaceChildren(...ways.map((one) => {
      const full = one.evaluated === one.feasible || !one.feasible;
      const rounded = Math.min(99.9, Math.floor(1000 * share(one.evaluated, one.feasible)) / 10).toFixed(1);
      const rest = one.total - one.feasible, out = rest ? `${number(rest)} more ${rest === 1 ? "is" : "are"} not feasible.` : "";
      const hits = `${number(one.critical)} ${one.critical === 1 ? "holds" : "hold"} a critical scenario.`;
      return element("li", { class: "card" }, element("strong", {}, `${full ? percent(one.evaluated, one.feasible) : rounded}${NARROW}%`),
        element("span", {}, element("b", {}, `t = ${one.strength}`), ` ${number(one.evaluated)} of ${number(one.feasible)} feasible ${things[one.strength]} evaluated; ${hits} ${out}`));
    }));
    $("ways-note").textContent = sample
      ? `Feasible is an estimate: what was met among ${number(sample)} random scenarios that keep the constraints, or in the run. Rare ones may be missing from it, so that the shares are, if anything, too high.`
      : "No random scenarios could be drawn under the constraints: only what the run itself has met is known to be feasible.";
  }

  // Grouped by axis, in which order the parameters come.
  strips() {
    const groups = new Map();
    this.found.parameters.forEach((parameter, row) => {
      if (!groups.has(parameter.axis)) groups.set(parameter.axis, []);
      groups.get(parameter.axis).push(this.strip(parameter, row));
    });
    return [...groups].map(([axis, strips]) => {
      const body = element("div", { class: "strips", style: `--rows: ${Math.ceil(strips.length / 2)}` }, ...strips);
      return element("div", { role: "group", "aria-label": axis }, element("h4", {}, axis), body);
    });
  }

  strip(parameter, row) {
    const most = Math.max(...parameter.evaluated);
    const cells = parameter.evaluated.map((evaluated, k) => {
      return binCell(evaluated, parameter.critical[k], `${parameter.name} ${binRange(parameter, k)}`, row, k, depth(evaluated, most));
    });
    const bins = element("div", { class: `bins${cells.length > MOST_TEXTS ? " dense" : ""}` }, ...cells);
    const name = element("div", { class: "strip-name", title: columns.get(parameter.name)?.description ?? "" }, withUnit(parameter));
    return element("div", { class: "strip", role: "group", "aria-label": withUnit(parameter) }, name, bins, binTicks(parameter, "below"));
  }
}

function drawCoverage(found, host) {
  host.hidden = !found.parameters.length;
  if (!host.hidden) new Coverage(found);
}

addSection({ id: "coverage", key: "coverage", draw: drawCoverage });
