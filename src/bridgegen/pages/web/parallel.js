// Parallel coordinates on a canvas: one line per evaluation, a filter on any axis.

import { roundStep } from "./axes.js";
import { palette } from "./colours.js";
import { $, NARROW, element } from "./common.js";
import { columns, data, rows } from "./data.js";
import { filters } from "./filters.js";
import { near } from "./near.js";
import { number, titled, turned, unitText } from "./numbers.js";
import { drawnRegions } from "./regions.js";
import { addSection } from "./sections.js";
import { subsample } from "./subsample.js";
import { FONT, fitCanvas } from "./view.js";

const MOST_LINES = 1500;
const EDGE = 46; // px beside the outermost axes
const TITLE_GAP = 10; // px between two names
const QUICK_LINES = 400; // while a filter is on its way
const least = (values) => values.reduce((a, b) => Math.min(a, b), Infinity);

class Parallel {
  // redraw(): has it drawn again, when that is worth while.
  constructor(canvas, redraw) {
    this.canvas = canvas;
    this.redraw = redraw;
    const chosen = rows.columns.filter((c) => rows.telling.includes(c.name) || c.name in data.batches.trends);
    this.names = chosen.map((column) => column.name);
    this.rescale();
    this.widen();
    this.connect();
    this.note();
  }

  // As wide as the axes' names need, which take turns on two rows; the box around it scrolls.
  widen() {
    const c = this.canvas.getContext("2d", { willReadFrequently: true });
    c.font = FONT;
    const widths = this.axes.map((axis) => c.measureText(this.titleOf(axis)).width);
    const least = widths.slice(2).map((width, a) => ((width + widths[a]) / 2 + TITLE_GAP) / 2 + (a === 0 || a === widths.length - 3 ? EDGE / 4 : 0));
    this.canvas.style.minWidth = `${Math.ceil(Math.max(0, ...least) * (this.axes.length - 1) + 2 * EDGE)}px`;
  }

  titleOf({ name, unit }) {
    return unitText(unit) ? `${name} [${unitText(unit)}]` : name;
  }

  // The axes, as far as the rows go.
  rescale() {
    const chosen = this.names.map((name) => columns.get(name));
    this.axes = chosen.map((c) => ({ ...this.axis(c.name, c.unit, c.values, c.low, c.high), words: c.words, turn: c.turn }));
    if (rows.cause) this.axes.push({ ...this.axis("cause", "", rows.cause, 0, data.causes.labels.length - 1), words: data.causes.labels });
    this.axes.push({ ...this.axis("critical", "", rows.critical, 0, 1), words: ["no", "yes"] });
  }

  axis(name, unit, values, low, high) {
    const finite = values.filter((v) => v !== null);
    const ends = [low ?? least(finite), high ?? -least(finite.map((v) => -v))];
    if (!(ends[1] > ends[0])) ends[1] = ends[0] + 1;
    return { name, unit, values, low: ends[0], high: ends[1] };
  }

  filter(name, low = null, high = null) {
    $("filter-axis").value = name;
    filters.set(name, low, high);
  }

  // What is filtered, here or elsewhere, has changed.
  changed() {
    this.showNumbers();
    this.note();
    this.quick = true;
    this.drawing ??= requestAnimationFrame(() => { this.drawing = null; this.redraw(); });
    clearTimeout(this.resting);
    this.resting = setTimeout(() => { this.quick = false; this.redraw(); }, 300);
  }

  showNumbers() {
    const range = filters.ranges.get($("filter-axis").value) ?? [];
    ["filter-low", "filter-high"].forEach((id, i) => {
      if (document.activeElement !== $(id)) $(id).value = Number.isFinite(range[i]) ? Number(range[i].toPrecision(4)) : "";
    });
  }

  note() {
    let all = 0, hits = 0;
    rows.critical.forEach((critical, i) => { if (filters.passes(i)) { all += 1; hits += critical; } });
    const share = all ? ` (${((100 * hits) / all).toFixed(1)}${NARROW}%)` : "";
    const text = `${number(all)} of ${number(rows.critical.length)} pass, ${number(hits)} of them critical${share}`;
    $("filter-note").textContent = filters.any ? text : "";
    $("filter-clear").disabled = !filters.any;
  }

  frame() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const left = EDGE, right = width - EDGE;
    return { top: 52, bottom: height - 16, x: (a) => left + ((right - left) * a) / Math.max(1, this.axes.length - 1) };
  }

  y(axis, value) {
    const { top, bottom } = this.frame();
    return bottom - ((value - axis.low) / (axis.high - axis.low)) * (bottom - top);
  }

  value(axis, y) {
    const { top, bottom } = this.frame();
    return axis.low + ((bottom - Math.min(bottom, Math.max(top, y))) / (bottom - top)) * (axis.high - axis.low);
  }

  draw() {
    // Thousands of lines: kept off the graphics card, which is slower at them where it is emulated.
    const { context: c, width, height } = fitCanvas(this.canvas, { willReadFrequently: true });
    const { x } = this.frame();
    c.clearRect(0, 0, width, height);
    const { hits, others } = subsample(this.quick ? QUICK_LINES : MOST_LINES);
    const lines = (list, colour, thick, density) => {
      c.strokeStyle = colour;
      c.lineWidth = thick;
      c.globalAlpha = Math.min(0.9, Math.max(0.07, density / Math.max(1, list.length)));
      for (const i of list) {
        c.beginPath();
        let down = false;
        this.axes.forEach((axis, a) => {
          const value = axis.values[i];
          if (value !== null) c[down ? "lineTo" : "moveTo"](x(a), this.y(axis, value));
          down = value !== null;
        });
        c.stroke();
      }
      c.globalAlpha = 1;
    };
    lines(others, palette.plain, 1, 120);
    lines(hits, palette.critical, 1.2, 60);
    this.axes.forEach((axis, a) => this.drawAxis(c, axis, x(a), a));
    drawnRegions().forEach((region, k) => this.drawRegion(c, region, k, x));
  }

  // A bracket with the region's number beside each axis that it narrows.
  drawRegion(c, region, k, x) {
    c.strokeStyle = c.fillStyle = palette.accent;
    c.lineWidth = 2.5;
    c.font = FONT.replace("600 12px", "600 11px");
    c.textAlign = "left";
    c.setLineDash(region.confirmed ? [] : [3, 3]);
    this.axes.forEach((axis, a) => {
      const ends = region.box[axis.name];
      if (!ends) return;
      const at = x(a) + 9 + 9 * k, low = this.y(axis, ends[0]), high = this.y(axis, ends[1]);
      c.beginPath();
      c.moveTo(at - 4, high);
      c.lineTo(at, high);
      c.lineTo(at, low);
      c.lineTo(at - 4, low);
      c.stroke();
      c.lineWidth = 3.5;
      c.strokeStyle = palette.card;
      const beside = high < this.frame().top + 14; // no room above it
      c.strokeText(`${region.number}`, at + (beside ? 3 : -3), high + (beside ? 6 : -7));
      c.fillText(`${region.number}`, at + (beside ? 3 : -3), high + (beside ? 6 : -7));
      c.strokeStyle = palette.accent;
      c.lineWidth = 2.5;
    });
    c.setLineDash([]);
  }

  drawAxis(c, axis, x, a) {
    const { top, bottom } = this.frame();
    c.strokeStyle = palette.muted;
    c.lineWidth = 1;
    c.beginPath();
    c.moveTo(x, top);
    c.lineTo(x, bottom);
    c.stroke();
    const range = filters.ranges.get(axis.name);
    if (range) {
      const high = Math.max(top, this.y(axis, range[1])), low = Math.min(bottom, this.y(axis, range[0]));
      c.fillStyle = palette.band;
      c.strokeStyle = palette.accent;
      c.lineWidth = 2;
      c.fillRect(x - 8, high, 16, low - high);
      c.strokeRect(x - 8, high, 16, low - high);
    }
    // Names take turns on two rows, so that long ones have room.
    const ends = a === 0 ? "left" : a === this.axes.length - 1 ? "right" : "center";
    c.font = FONT;
    c.textAlign = ends;
    c.textBaseline = "middle";
    c.fillStyle = range ? palette.accent : palette.ink;
    c.fillText(this.titleOf(axis), x + { left: -40, right: 40, center: 0 }[ends], a % 2 ? 28 : 11);
    c.font = FONT.replace("600 12px", "11px");
    c.textAlign = "center";
    c.lineJoin = "round";
    c.lineWidth = 3.5;
    c.strokeStyle = palette.card;
    for (const [value, text] of this.marks(axis)) {
      const y = this.y(axis, value) + (value === axis.low ? 8 : value === axis.high ? -8 : 0);
      c.strokeText(text, x, y);
      c.fillStyle = palette.ink;
      c.fillText(text, x, y);
    }
  }

  // Both ends of the range, and round numbers between them.
  marks(axis) {
    if (axis.words) return axis.words.map((text, i) => [i, text]);
    const { low, high } = axis, span = high - low, step = roundStep(span / 4);
    const between = Array.from({ length: 9 }, (_, i) => (Math.ceil(low / step) + i) * step);
    const kept = between.filter((value) => value > low + 0.08 * span && value < high - 0.08 * span);
    return [low, ...kept, high].map((value) => [value, number(Number(turned(value, axis).toPrecision(6)), 3)]);
  }

  connect() {
    const select = $("filter-axis");
    const numbered = (words) => words.map((word, i) => `${i} ${word}`);
    const shortened = (words) => (words.length > 4 ? [words[0], "…", words.at(-1)] : words).join(", ");
    const text = (axis) => (axis.words ? `${axis.name} (${shortened(numbered(axis.words))})` : titled(axis.name));
    select.append(...this.axes.map((axis) => element("option", { value: axis.name }, text(axis))));
    select.addEventListener("change", () => this.showNumbers());
    for (const id of ["filter-low", "filter-high"]) {
      $(id).addEventListener("input", () => {
        const ends = [$("filter-low"), $("filter-high")].map((field) => (field.value === "" ? null : Number(field.value)));
        this.filter(select.value, ...ends);
      });
    }
    $("filter-clear").addEventListener("click", () => filters.clear());
    document.addEventListener("filters", () => this.changed());
    document.addEventListener("grown", () => this.rescale());
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    this.listen();
  }

  // By mouse or pen; a finger scrolls the page, and the fields above serve it instead.
  listen() {
    let drag = null;
    const at = (event) => { const box = this.canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
    this.canvas.addEventListener("pointerdown", (event) => {
      const [px, py] = at(event), { x } = this.frame();
      const near = this.axes.findIndex((_, a) => Math.abs(x(a) - px) < 20);
      if (near < 0 || event.pointerType === "touch") return;
      drag = { axis: this.axes[near], from: py, moved: false };
      this.canvas.setPointerCapture(event.pointerId);
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (!drag) return;
      const [, py] = at(event);
      drag.moved ||= Math.abs(py - drag.from) > 3;
      if (!drag.moved) return;
      const ends = [this.value(drag.axis, drag.from), this.value(drag.axis, py)];
      this.filter(drag.axis.name, Math.min(...ends), Math.max(...ends));
    });
    this.canvas.addEventListener("pointerup", () => {
      if (drag && !drag.moved) this.filter(drag.axis.name);
      drag = null;
    });
    this.canvas.addEventListener("pointercancel", () => { drag = null; });
  }
}

function connectParallel(found, host) {
  host.hidden = !found.critical.length || !found.telling.length;
  if (host.hidden) return;
  const canvas = $("parallel"), parallel = new Parallel(canvas, () => near.again(canvas));
  near.add(canvas, () => parallel.draw());
}

addSection({ id: "parallel-card", key: "rows", draw: connectParallel });
