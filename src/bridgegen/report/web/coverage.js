// Coverage: the figures, a strip of bins for each parameter, and what a bin says when pointed at.

const IMPOSSIBLE = -1; // rows in a bin that is not feasible
const MOST_TEXTS = 14; // bins side by side that have room for their counts

const share = (part, whole) => (part === whole ? 1 : part / Math.max(1, whole));

// Whole per cent; 0 and 100 only where they are exact.
function percent(part, whole) {
  if (!whole) return "–";
  const exact = part === 0 || part === whole;
  return `${exact ? 100 * share(part, whole) : Math.min(99, Math.max(1, Math.round((100 * part) / whole)))}`;
}

function brief(value) {
  return String(Number(value.toPrecision(4))).replace("-", "−");
}

function withUnit(parameter) {
  const unit = unitText(parameter.unit);
  return unit ? `${parameter.name} [${unit}]` : parameter.name;
}

function binName(parameter, k) {
  return worded(k, parameter) ?? brief(parameter.edges[k] + 0.5);
}

function edgeText(parameter, k) {
  return brief(turned(parameter.edges[k], parameter));
}

function binRange(parameter, k) {
  const { edges, integer } = parameter, unit = unitText(parameter.unit);
  const range = integer ? binName(parameter, k) : `${edgeText(parameter, k)} to ${edgeText(parameter, k + 1)}`;
  return unit ? `${range}${NARROW}${unit}` : range;
}

function binState(evaluated, critical) {
  if (evaluated === IMPOSSIBLE) return "out";
  return evaluated === 0 ? "none" : critical ? "hit" : "seen";
}

function binText(evaluated, critical) {
  if (evaluated === IMPOSSIBLE) return data.coverage.sample ? "not reachable under the constraints (by the sample)" : "not evaluated; not known whether reachable";
  if (evaluated === 0) return "not evaluated";
  const count = `${number(evaluated)} evaluated`;
  return critical ? `${count}, ${number(critical)} of them critical (${percent(critical, evaluated)}${NARROW}%)` : `${count}, none critical`;
}

// How deep the colour of a count is: the square root keeps small ones apart.
function depth(count, most) {
  return Math.sqrt(Math.max(0, count) / Math.max(1, most));
}

function thousands(count) {
  return count < 10000 ? `${count}` : `${Math.round(count / 1000)}k`;
}

// A bin, or a pair of bins: its state shows in pattern, border, text and colour, an amount in [0, 1] in the colour's depth.
function binCell(evaluated, critical, label, row, column, amount) {
  const text = evaluated === IMPOSSIBLE ? [] : [element("span", {}, thousands(evaluated))];
  if (critical) text.push(element("b", {}, `◆${NARROW}${thousands(critical)}`));
  return element("div", {
    class: `bin ${binState(evaluated, critical)}`, role: "img", "aria-label": `${label}: ${binText(evaluated, critical)}`,
    tabindex: "-1", "data-row": row, "data-column": column, style: `--share: ${amount.toFixed(3)}`,
  }, ...text);
}

// Values at the edges of the bins, or below the whole numbers; not more than there is room for.
function binTicks(parameter, className) {
  const { edges, integer } = parameter, n = edges.length - 1;
  const marks = integer ? edges.slice(0, n).map((_, k) => [(k + 0.5) / n, binName(parameter, k)]) : edges.map((_, k) => [k / n, edgeText(parameter, k)]);
  const each = Math.ceil(marks.length / 11);
  const shown = marks.filter((_, k) => k % each === 0).map(([at, text]) => {
    const place = integer || (at > 0 && at < 1) ? "" : at ? "last" : "first";
    return element("span", { class: place, style: `--at: ${(100 * at).toFixed(2)}%` }, text);
  });
  return element("div", { class: `ticks ${className}`, "aria-hidden": "true" }, ...shown);
}

// Arrow keys lead from cell to cell; one of the cells at a time is reached by the tab key.
function arrowKeys(host) {
  const cells = () => [...host.querySelectorAll("[data-row]")];
  const place = (cell) => [Number(cell.dataset.row), Number(cell.dataset.column)];
  const enter = (cell) => {
    host.querySelectorAll('[data-row][tabindex="0"]').forEach((other) => { other.tabIndex = -1; });
    cell.tabIndex = 0;
  };
  host.addEventListener("focusin", (event) => { if (event.target.dataset.row) enter(event.target); });
  host.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0], Home: [0, -Infinity], End: [0, Infinity] }[event.key];
    if (!step || !event.target.dataset.row || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    const [row, column] = place(event.target);
    const wanted = column + step[1], away = (cell) => Math.abs(place(cell)[1] - Math.min(1e6, Math.max(-1e6, wanted)));
    const there = cells().filter((cell) => place(cell)[0] === row + step[0]);
    there.sort((a, b) => away(a) - away(b))[0]?.focus();
  });
  if (cells().length) enter(cells()[0]);
}

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
