// Zooming and moving in a chart: drag a box, shift and drag, ctrl and wheel, + and −; a click chooses a point.

import { palette } from "./colours.js";

const CLICK = 4; // px that a click may move

export class Zoom {
  // changed(): called when the ranges have changed.
  constructor(chart, changed) {
    this.chart = chart;
    this.changed = changed;
    /** @type {{ x: [number, number], y: [number, number] } | null} */
    this.ends = null;
    this.drag = null;
    const { canvas } = chart;
    canvas.addEventListener("pointerdown", (event) => this.press(event));
    canvas.addEventListener("pointermove", (event) => this.pull(event));
    canvas.addEventListener("pointerup", (event) => this.release(event));
    canvas.addEventListener("pointercancel", () => { this.drag = null; });
    canvas.addEventListener("dblclick", () => this.reset());
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      this.by(Math.exp(-event.deltaY * 0.002), chart.pixels(event));
    }, { passive: false });
    canvas.addEventListener("keydown", ({ key }) => {
      if (key === "+" || key === "-") this.by(key === "+" ? 1.4 : 1 / 1.4);
    });
  }

  reset() {
    if (this.ends) this.set(null);
  }

  set(ends) {
    this.ends = ends;
    this.changed();
  }

  // The values at two corners, in pixels.
  between([x0, y0], [x1, y1]) {
    const { x, y } = this.chart, ascending = (axis, a, b) => [axis.valueAt(a), axis.valueAt(b)].sort((p, q) => p - q);
    return { x: ascending(x, x0, x1), y: ascending(y, y0, y1) };
  }

  // Keeps the place at a pixel.
  by(factor, at = null) {
    const { left, right, top, bottom } = this.chart.box, [px, py] = at ?? [(left + right) / 2, (top + bottom) / 2];
    const near = (to, from) => from + (to - from) / factor;
    this.set(this.between([near(left, px), near(bottom, py)], [near(right, px), near(top, py)]));
  }

  inside([x, y]) {
    const { left, right, top, bottom } = this.chart.box;
    return x >= left - 8 && x <= right + 8 && y >= top - 8 && y <= bottom + 8;
  }

  press(event) {
    const from = this.chart.pixels(event);
    if (event.button || !this.chart.points || !this.inside(from)) return;
    this.drag = { from, to: from, moved: false, moves: event.shiftKey, ends: this.between([this.chart.box.left, this.chart.box.bottom], [this.chart.box.right, this.chart.box.top]) };
    if (event.pointerType !== "touch") this.chart.canvas.setPointerCapture(event.pointerId);
  }

  pull(event) {
    const drag = this.drag;
    if (!drag) return;
    drag.to = this.chart.pixels(event);
    drag.moved ||= Math.hypot(drag.to[0] - drag.from[0], drag.to[1] - drag.from[1]) > CLICK;
    if (!drag.moved || event.pointerType === "touch") return; // a finger scrolls the page
    this.chart.point(null);
    if (drag.moves) this.move(drag);
    else this.outline(drag);
  }

  move(drag) {
    const { left, right, top, bottom } = this.chart.box, [dx, dy] = [drag.to[0] - drag.from[0], drag.to[1] - drag.from[1]];
    const ends = this.between([left - dx, bottom - dy], [right - dx, top - dy]);
    drag.from = drag.to;
    this.set(ends);
  }

  outline({ from, to }) {
    this.chart.refresh();
    const c = this.chart.canvas.getContext("2d");
    c.fillStyle = palette.band;
    c.strokeStyle = palette.accent;
    c.lineWidth = 1.5;
    c.fillRect(from[0], from[1], to[0] - from[0], to[1] - from[1]);
    c.strokeRect(from[0], from[1], to[0] - from[0], to[1] - from[1]);
  }

  release(event) {
    const drag = this.drag;
    this.drag = null;
    if (!drag) return;
    if (!drag.moved) return void this.click(drag.from, event);
    if (drag.moves || event.pointerType === "touch") return;
    const { left, right, top, bottom } = this.chart.box, held = ([x, y]) => [Math.min(right, Math.max(left, x)), Math.min(bottom, Math.max(top, y))];
    const from = held(drag.from), to = held(drag.to);
    if (Math.abs(from[0] - to[0]) > CLICK && Math.abs(from[1] - to[1]) > CLICK) this.set(this.between(from, to));
    else this.chart.refresh();
  }

  // The first tap of a finger shows what is known of a point, the second chooses it.
  click(at, event) {
    const point = this.chart.nearest(...at);
    if (event.pointerType === "touch" && point?.item !== this.chart.pointed?.item) return void this.chart.point(point, true);
    if (point) this.chart.choose(point);
  }
}
