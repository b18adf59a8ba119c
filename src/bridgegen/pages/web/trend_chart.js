// The drawing of a chart over the iterations: the middle half as a band, lines, dots, bars.

import { Axis } from "./axes.js";
import { Chart } from "./chart.js";
import { palette } from "./colours.js";
import { data } from "./data.js";
import { drawMarker } from "./markers.js";
import { measured } from "./numbers.js";

const GAP = 0.15; // of a bar's room

/**
 * @typedef {object} Line values over the batches
 * @property {string} text
 * @property {(number | null)[]} values
 * @property {string} [band] colour of the area between its `lower` and `upper`
 * @property {(number | null)[]} [lower]
 * @property {(number | null)[]} [upper]
 * @property {string} [line] colour
 * @property {string} [bar] colour
 * @property {any} [marker]
 */

export class TrendChart extends Chart {
  /**
   * @param {HTMLElement} host
   * @param {string} title
   * @param {string} unit
   * @param {() => Line[]} lines
   */
  constructor(host, title, unit, lines) {
    super(host);
    this.title = title;
    this.unit = unit;
    this.lines = lines;
    this.canvas.addEventListener("pointerdown", (event) => this.point(this.nearest(this.pixels(event)[0])));
  }

  figure() {
    const { last } = data.batches;
    const few = last.length < 3; // too few for lines
    const series = this.lines().map((one) => {
      const dot = few && (one.line || one.band) ? { shape: one.band ? "square" : "disc", radius: 3.5, colour: one.line ?? palette.accent, open: Boolean(one.band) } : one.marker;
      return { ...one, name: one.text, label: one.text, line: few ? undefined : one.line, band: few ? undefined : one.band, marker: dot };
    });
    const all = series.filter(({ name }) => !this.off.has(name)).flatMap(({ values, lower = [], upper = [] }) => [...values, ...lower, ...upper]);
    const x = Object.assign(new Axis([], { ends: [0.4, (last.at(-1) ?? 1) + 0.6] }), { title: "iteration" });
    return { x, y: new Axis(all, { zero: true }), series, text: this.words(series) };
  }

  // The first and the last batch in words.
  words(series) {
    const { last } = data.batches, at = (k) => series.filter(({ band }) => !band).map(({ text, values }) => `${text} ${this.value(values[k])}`).join(", ");
    const ends = last.length ? `: in iteration ${last[0]} ${at(0)}; in iteration ${last.at(-1)} ${at(last.length - 1)}` : "";
    return `${this.title} over the iterations${ends}. Arrow keys lead from iteration to iteration.`;
  }

  value(value) {
    return `${measured(value, this.unit)}${value === null || !this.unit ? "" : ` ${this.unit}`}`;
  }

  // Stretches of batches that have a value.
  stretches(values) {
    const found = [];
    values.forEach((value, k) => {
      if (value === null) return;
      if (found.at(-1)?.at(-1) === k - 1) found.at(-1).push(k);
      else found.push([k]);
    });
    return found;
  }

  paintSeries(c) {
    for (const one of this.shown) {
      if (one.bar) this.paintBars(c, one);
      if (one.band) this.paintBand(c, one);
      if (one.line) this.paintLine(c, one);
      if (one.marker) this.paintMarkers(c, one);
    }
  }

  placed(values, k) {
    return [this.x.at(data.batches.last[k]), this.y.within(values[k])];
  }

  paintLine(c, { values, line }) {
    c.strokeStyle = line;
    c.lineWidth = 2.5;
    c.lineJoin = "round";
    for (const stretch of this.stretches(values)) {
      c.beginPath();
      stretch.forEach((k, i) => c[i ? "lineTo" : "moveTo"](...this.placed(values, k)));
      if (stretch.length === 1) c.lineTo(this.placed(values, stretch[0])[0] + 0.01, this.placed(values, stretch[0])[1]);
      c.stroke();
    }
  }

  paintBand(c, { values, lower, upper, band }) {
    c.fillStyle = band;
    for (const stretch of this.stretches(values)) {
      c.beginPath();
      stretch.forEach((k, i) => c[i ? "lineTo" : "moveTo"](...this.placed(lower, k)));
      for (const k of stretch.toReversed()) c.lineTo(...this.placed(upper, k));
      c.fill();
    }
  }

  paintBars(c, { values, bar }) {
    const { first, last } = data.batches;
    c.fillStyle = bar;
    c.globalAlpha = 0.55;
    values.forEach((value, k) => {
      if (value === null) return;
      const from = this.x.at(first[k] - 0.5 + GAP / 2), to = this.x.at(last[k] + 0.5 - GAP / 2), top = this.y.within(value);
      c.fillRect(from, top, Math.max(0.5, to - from), this.box.bottom - top);
    });
    c.globalAlpha = 1;
  }

  paintMarkers(c, { values, lower, upper, marker }) {
    for (const list of lower ? [lower, upper] : [values]) {
      list.forEach((value, k) => {
        if (value === null) return;
        const share = this.y.share(value), shape = share > 1 ? "up" : share < 0 ? "down" : marker.shape;
        drawMarker(c, { ...marker, shape }, ...this.placed(list, k));
      });
    }
  }

  places() {
    return data.batches.last.map((last, k) => ({ x: this.x.at(last), y: this.box.top, item: k }));
  }

  // Of the iterations, whatever the height.
  nearest(x) {
    return (this.points ?? []).reduce((best, point) => (best && Math.abs(best.x - x) <= Math.abs(point.x - x) ? best : point), null);
  }

  paintPointed(c, { x, item }) {
    c.strokeStyle = palette.muted;
    c.lineWidth = 1;
    c.setLineDash([3, 3]);
    c.beginPath();
    c.moveTo(Math.round(x) + 0.5, this.box.top);
    c.lineTo(Math.round(x) + 0.5, this.box.bottom);
    c.stroke();
    c.setLineDash([]);
    for (const { values, line, marker, bar } of this.shown) {
      const colour = line ?? marker?.colour ?? bar;
      if (colour && values[item] !== null) drawMarker(c, { shape: "disc", radius: 3.5, colour, edge: palette.card }, ...this.placed(values, item));
    }
  }

  linesOf(k) {
    const { first, last } = data.batches;
    const values = this.shown.map(({ text, values: all, lower, upper }) => (lower ? `${text} ${measured(lower[k], this.unit)} to ${this.value(upper[k])}` : `${text} ${this.value(all[k])}`));
    return [first[k] === last[k] ? `iteration ${last[k]}` : `iterations ${first[k]}–${last[k]}`, ...values];
  }

  // For tests and users' scripts: where a value of a batch is drawn.
  pixelOf(name, k) {
    return this.placed(this.series.find((one) => one.name === name).values, k);
  }
}
