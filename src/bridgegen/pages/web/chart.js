// A chart on a canvas: axes, grid, legend, and what is known of the point under the pointer or chosen by keys.

import { palette } from "./colours.js";
import { element } from "./common.js";
import { drawMarker } from "./markers.js";
import { Nearest } from "./nearest.js";
import { FONT, fitCanvas } from "./view.js";

const REACH = 18; // px from a point that still belong to it
const TEXT = FONT.replace("600 12px", "12px");
const SMALL = FONT.replace("600 12px", "11.5px");

/**
 * @typedef {object} Point a value that is drawn
 * @property {number} x in pixels
 * @property {number} y
 * @property {any} item what it stands for
 */

export class Chart {
  constructor(host) {
    this.host = host;
    this.canvas = element("canvas", { tabindex: "0", role: "img" });
    this.tip = element("div", { class: "chart-tip", "aria-hidden": "true", hidden: "" });
    this.keys = element("ul", { class: "chart-legend", "aria-label": "Legend; choose one to hide or show it" });
    this.said = element("p", { class: "hidden", role: "status" });
    this.stage = element("div", { class: "chart-stage" }, this.canvas, this.tip);
    host.append(this.keys, this.stage, this.said);
    this.off = new Set(); // names of series that are hidden
    /** @type {any[]} */
    this.series = [];
    /** @type {Point | null} */
    this.pointed = null;
    this.layer = document.createElement("canvas");
    new ResizeObserver(() => { if (this.points) this.draw(); }).observe(this.canvas);
    this.canvas.addEventListener("pointermove", (event) => this.hover(event));
    this.canvas.addEventListener("pointerleave", () => this.point(null));
    this.canvas.addEventListener("blur", () => this.point(null));
    this.canvas.addEventListener("keydown", (event) => this.key(event));
  }

  // ---- what each chart says of itself ----

  /** @returns {any} axes x and y, the series with name, marker and colour, and a text of it all */
  figure() { throw new Error("not declared"); }

  // Draws the series.
  paintSeries(_c, _ratio) {}

  /** @returns {Point[]} what can be pointed at */
  places() { return []; }

  /** @returns {string[]} what is known of an item; the first line is its title */
  linesOf(_item) { return []; }

  /** @param {Point} _point chosen by a click or a key */
  choose(_point) {}

  // ---- drawing ----

  draw() {
    this.pointed = null;
    Object.assign(this, this.figure());
    this.canvas.setAttribute("aria-label", this.text);
    this.fillLegend();
    const { width, height, ratio } = fitCanvas(this.canvas);
    if (!width || !height) return; // not laid out yet
    Object.assign(this.layer, { width: this.canvas.width, height: this.canvas.height });
    const c = this.layer.getContext("2d");
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.paint(c, width, height, ratio);
    this.points = this.places();
    this.index = null;
    this.refresh();
  }

  get shown() {
    return this.series.filter(({ name }) => !this.off.has(name));
  }

  // The canvas: what stays, and the point that is looked at.
  refresh() {
    const { context: c, width, height } = fitCanvas(this.canvas);
    c.clearRect(0, 0, width, height);
    c.drawImage(this.layer, 0, 0, width, height);
    if (this.pointed) this.paintPointed(c, this.pointed);
    this.showTip();
  }

  paintPointed(c, { x, y }) {
    drawMarker(c, { shape: "disc", radius: 8, colour: palette.ink, open: true }, x, y);
  }

  paint(c, width, height, ratio) {
    c.font = TEXT;
    c.textBaseline = "middle";
    const { x, y } = this;
    this.box = { left: 0, right: width - 12, top: 10, bottom: height - 40 };
    y.place(this.box.bottom, this.box.top);
    const marks = y.marks(40), widest = Math.max(...marks.map(({ text }) => c.measureText(text).width), 0);
    this.box.left = Math.ceil(widest) + (y.title ? 30 : 12);
    x.place(this.box.left, this.box.right);
    this.paintAxes(c, marks, x.marks(78));
    c.save();
    c.beginPath();
    c.rect(this.box.left - 7, this.box.top - 7, this.box.right - this.box.left + 14, this.box.bottom - this.box.top + 14);
    c.clip();
    this.paintSeries(c, ratio);
    c.restore();
    this.paintBeyond(c);
  }

  paintAxes(c, marksY, marksX) {
    const { left, right, top, bottom } = this.box, { x, y } = this;
    const line = (x0, y0, x1, y1) => { c.beginPath(); c.moveTo(x0, y0); c.lineTo(x1, y1); c.stroke(); };
    const crisp = (at) => Math.round(at) + 0.5;
    c.strokeStyle = palette.grid;
    c.lineWidth = 1;
    for (const { value } of marksX) line(crisp(x.at(value)), top, crisp(x.at(value)), bottom);
    for (const { value } of marksY) line(left, crisp(y.at(value)), right, crisp(y.at(value)));
    c.strokeStyle = palette.line;
    line(left, crisp(bottom), right, crisp(bottom));
    line(crisp(left), top, crisp(left), bottom);
    c.fillStyle = palette.ink;
    c.textAlign = "right";
    for (const { value, text } of marksY) c.fillText(text, left - 7, y.at(value));
    let end = -Infinity;
    for (const { value, text } of marksX) {
      const half = c.measureText(text).width / 2, at = Math.min(right + 10 - half, x.at(value));
      if (at - half < end + 6) continue; // no room beside the last
      end = at + half;
      c.textAlign = "center";
      c.fillText(text, at, bottom + 13);
    }
    c.textAlign = "center";
    const scale = (axis) => `${axis.title}${axis.log ? ", logarithmic" : ""}`;
    if (x.title) c.fillText(scale(x), (left + right) / 2, bottom + 31, right - left);
    if (!y.title) return;
    c.save();
    c.translate(9, (top + bottom) / 2);
    c.rotate(-Math.PI / 2);
    c.fillText(scale(y), 0, 0, bottom - top);
    c.restore();
  }

  // How many values lie beyond the ends of the axes, in the corners where they are.
  paintBeyond(c) {
    const { left, right, top, bottom } = this.box, texts = { y: this.y.beyond(["▼", "▲"]), x: this.x.beyond(["◀", "▶"]) };
    c.font = SMALL;
    const label = (text, align, at, y) => {
      c.textAlign = align;
      const width = c.measureText(text).width;
      c.fillStyle = palette.card;
      c.globalAlpha = 0.8;
      c.fillRect(align === "left" ? at - 3 : at - width - 3, y - 9, width + 6, 18);
      c.globalAlpha = 1;
      c.fillStyle = palette.ink;
      c.fillText(text, at, y);
    };
    for (const text of texts.y) label(text, "left", left + 8, text.endsWith("▲") ? top + 10 : bottom - 12);
    for (const text of texts.x) label(text, text.endsWith("▶") ? "right" : "left", text.endsWith("▶") ? right - 6 : left + 8, bottom - (texts.y.length > 1 || text.endsWith("▶") ? 32 : 12));
    c.font = TEXT;
  }

  // ---- legend ----

  fillLegend() {
    const focused = [...this.keys.children].findIndex((one) => one.contains(document.activeElement));
    this.keys.replaceChildren(...this.series.map((one) => {
      const icon = element("canvas", { width: "36", height: "32", "aria-hidden": "true" });
      const c = icon.getContext("2d");
      c.scale(2, 2);
      this.paintKey(c, one);
      const button = element("button", { type: "button", "aria-pressed": String(!this.off.has(one.name)), title: "Hide or show" }, icon, one.label);
      button.addEventListener("click", () => {
        if (!this.off.delete(one.name)) this.off.add(one.name);
        this.draw();
      });
      return element("li", {}, button);
    }));
    if (focused >= 0) this.keys.children[focused]?.querySelector("button").focus();
  }

  paintKey(c, { band, line, marker, bar }) {
    if (band) { c.fillStyle = band; c.fillRect(1, 3, 16, 10); }
    if (bar) { c.fillStyle = bar; c.fillRect(4, 3, 10, 11); }
    if (line) {
      c.strokeStyle = line;
      c.lineWidth = 2.5;
      c.beginPath();
      c.moveTo(1, 8);
      c.lineTo(17, 8);
      c.stroke();
    }
    if (marker) drawMarker(c, { ...marker, radius: Math.min(5.5, Math.max(3, marker.radius)) }, 9, 8);
  }

  // ---- pointing ----

  pixels(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  /** @returns {Point | null} */
  nearest(x, y) {
    this.index ??= new Nearest(this.points ?? []);
    return this.index.find(x, y, REACH);
  }

  hover(event) {
    if (event.pointerType === "touch" || !this.points) return;
    this.point(this.nearest(...this.pixels(event)));
  }

  point(point, aloud = false) {
    if (this.pointed === point) return;
    this.pointed = point;
    this.canvas.classList.toggle("on", Boolean(point));
    if (this.points) this.refresh();
    if (aloud && point) this.said.textContent = this.linesOf(point.item).join(", ");
  }

  showTip() {
    this.tip.hidden = !this.pointed;
    if (!this.pointed) return;
    const [title, ...lines] = this.linesOf(this.pointed.item);
    this.tip.replaceChildren(element("b", {}, title), ...lines.map((line) => element("span", {}, line)));
    const { x, y } = this.pointed, { offsetWidth: w, offsetHeight: h } = this.tip, { clientWidth: width } = this.canvas;
    const beside = x + 14 + w <= width ? x + 14 : x - 14 - w;
    this.tip.style.left = `${Math.max(0, Math.min(width - w, beside))}px`;
    this.tip.style.top = `${Math.max(0, y - h / 2)}px`;
  }

  // Arrow keys lead from point to point: left and right along the X axis, up and down along the Y axis.
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || !this.points?.length) return;
    const by = { ArrowRight: ["x", 1], ArrowLeft: ["x", -1], ArrowUp: ["y", -1], ArrowDown: ["y", 1], Home: ["x", -Infinity], End: ["x", Infinity] }[event.key];
    const chosen = (event.key === "Enter" || event.key === " ") && this.pointed;
    if (!by && !chosen && event.key !== "Escape") return;
    event.preventDefault();
    event.stopPropagation(); // they are the player's keys too
    if (chosen) return void this.choose(this.pointed);
    if (!by) return void this.point(null);
    const [axis, step] = by, other = axis === "x" ? "y" : "x";
    const order = this.points.toSorted((a, b) => a[axis] - b[axis] || a[other] - b[other]);
    const now = this.pointed ? order.indexOf(this.pointed) : step > 0 ? -1 : order.length;
    this.point(order[Math.min(order.length - 1, Math.max(0, now + step))], true);
  }
}
