// Distance, time to collision, speeds and accelerations over time; a click or a drag jumps to an instant.

import { ticks, unruled } from "./axes.js";
import { DASHES, palette } from "./colours.js";
import { drawMark, drawMoments, drawPeaks } from "./curve_marks.js";
import { data } from "./data.js";
import { colourOf, playersOf } from "./geometry.js";
import { number } from "./numbers.js";
import { Strip } from "./strip.js";
import { FONT, fitCanvas } from "./view.js";

// What is beyond runs out of its panel, where what is near would be flat otherwise.
const FAR = 20; // m
const LATE = 10; // s
const HARDEST = 15; // m/s²: more than tyres can give; a participant that stops dead has hundreds
const CURVE_FONT = FONT.replace("600 12px", "11.5px");

const present = (values) => values.filter((value) => value !== null);

export class Curves {
  constructor(canvas, jump) {
    this.canvas = canvas;
    const to = (event) => {
      const box = canvas.getBoundingClientRect();
      jump(this.indexAt(event.clientX - box.left, event.clientY - box.top));
    };
    canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); to(event); });
    canvas.addEventListener("pointermove", (event) => { if (event.buttons) to(event); });
  }

  // `twin`: the same with another driver, of which the ego's lines stand beside, in dots.
  show(kept, twin = null) {
    this.kept = kept;
    this.steps = Math.max(kept.n_steps, twin?.n_steps ?? 0);
    this.still = null;
    this.strip = new Strip(kept, this.steps);
    this.canvas.style.setProperty("--strip", `${this.strip.height}px`);
    const players = playersOf(kept), { critical_distance: critical, hard_braking: hard } = data.summary;
    const line = (values, e = null) => ({
      values, colour: () => (e === null ? palette.ink : colourOf(kept, e)), dashes: e === null ? [] : DASHES[players.indexOf(e) % DASHES.length],
      name: e === null ? "" : kept.entities[e].name,
    });
    const beside = (values, e = null) => (twin ? [{ values, colour: () => (e === null ? palette.muted : colourOf(kept, e)), dashes: [2, 3], name: twin.driver }] : []);
    const gaps = present(kept.distance), least = Math.min(...gaps, Infinity), speeds = Float64Array.from(present(players.flatMap((e) => kept.v[e]))).sort();
    /** @type {any[]} */
    const panels = [{
      title: "distance", unit: "m", lines: [line(kept.distance), ...beside(twin?.distance)], low: 0, high: least < 8 ? Math.min(Math.max(1, ...gaps) * 1.05, FAR) : Math.max(1, ...gaps) * 1.05,
      mark: critical === null ? null : [critical, `critical below ${number(critical, 3)} m`],
    }, {
      title: "speed", unit: "m/s", lines: [...players.map((e) => line(kept.v[e], e)), ...beside(twin?.v[0], 0)], low: 0, high: Math.max(1, speeds.length ? unruled(speeds)[1] : 0) * 1.15, peaks: true,
    }];
    if (kept.ttc) {
      const finite = present(kept.ttc);
      panels.splice(1, 0, {
        title: "time to collision", unit: "s", lines: [line(kept.ttc)], low: 0, high: Math.min(LATE, Math.max(1, ...finite) * 1.1),
        empty: finite.length ? null : "never on a collision course",
      });
    }
    if (kept.a) {
      const all = present(players.flatMap((e) => kept.a[e].slice(0, -1))).filter((value) => Math.abs(value) <= HARDEST);
      const low = Math.min(-1, ...all) * 1.1, high = Math.max(1, ...all) * 1.1;
      panels.push({
        title: "acceleration", unit: "m/s²", lines: [...players.map((e) => line(kept.a[e], e)), ...beside(twin?.a?.[0] ?? [], 0)], low, high, steps: true, peaks: true,
        mark: low < -hard ? [-hard, `hard braking below −${hard} m/s²`] : null,
      });
    }
    this.panels = panels;
    for (const panel of panels) panel.beyond = panel.peaks ? panel.lines.flatMap((one) => this.peaksOf(one, panel)) : [];
  }

  // The largest and the least value of a line where they are beyond its panel, with their instants.
  peaksOf({ values, name, colour }, { low, high, steps }) {
    const all = steps ? values.slice(0, -1) : values;
    return [(value) => value - high, (value) => low - value].flatMap((excess) => {
      const out = (value) => (value === null ? -Infinity : excess(value)), index = all.reduce((best, value, k) => (out(value) > out(all[best]) ? k : best), 0);
      return out(all[index]) > 0 ? [{ name, colour, index, value: all[index] }] : [];
    });
  }

  // Places the panels, two beside each other where there is room; in CSS pixels.
  place() {
    const { clientWidth: width, clientHeight: height } = this.canvas, across = width >= 560 ? 2 : 1;
    const rows = Math.ceil(this.panels.length / across), w = width / across, { height: under } = this.strip, h = (height - under - 20) / rows;
    this.strip.place(width);
    this.panels.forEach((panel, i) => {
      const column = across === 1 ? 0 : Math.floor(i / rows), row = i - column * rows;
      Object.assign(panel, { left: column * w + 42, right: (column + 1) * w - 14, top: under + row * h + 26, bottom: under + (row + 1) * h - 6, last: row === rows - 1 || i === this.panels.length - 1 });
    });
  }

  // The nearest instant in the panel at (x, y).
  indexAt(x, y) {
    this.place();
    const outside = (panel) => Math.max(0, panel.left - x, x - panel.right) + Math.max(0, panel.top - y, y - panel.bottom);
    const all = this.strip.height ? [this.strip, ...this.panels] : this.panels;
    const { left, right } = all.reduce((best, panel) => (outside(panel) < outside(best) ? panel : best));
    const last = this.steps - 1;
    return Math.min(last, Math.max(0, Math.round(((x - left) / (right - left)) * last)));
  }

  // Where an instant is in a panel, for who wants to click there.
  pixelOf(panel, index) {
    this.place();
    const { left, right, top, bottom } = this.panels[panel];
    return [left + ((right - left) * index) / Math.max(1, this.steps - 1), (top + bottom) / 2];
  }

  // What stays is drawn once and kept; at each instant only the cursor and the values are new.
  draw(state) {
    const { context: c, width, height, ratio } = fitCanvas(this.canvas);
    if (!width || !height) return; // not laid out yet
    const still = [this.kept, palette, width, height, ratio];
    if (still.some((one, i) => one !== this.still?.[i])) {
      this.still = still;
      this.drawStill(width, height, ratio);
    }
    c.clearRect(0, 0, width, height);
    c.drawImage(this.layer, 0, 0, width, height);
    c.font = CURVE_FONT;
    if (this.strip.height) this.drawLineAt(c, this.strip, this.scales(this.strip).x(state.time / this.kept.time_step));
    for (const panel of this.panels) {
      const { x, y } = this.scales(panel);
      this.drawCursor(c, panel, state, x, y);
      this.drawHeading(c, panel, state);
    }
  }

  drawStill(width, height, ratio) {
    this.place();
    this.layer = Object.assign(document.createElement("canvas"), { width: width * ratio, height: height * ratio });
    const c = this.layer.getContext("2d");
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.lineJoin = "round";
    c.font = CURVE_FONT;
    this.strip.draw(c);
    for (const panel of this.panels) {
      const { left, right, top, bottom, low, high } = panel, { x, y } = this.scales(panel);
      this.drawAxes(c, panel, x, y);
      c.save();
      c.beginPath();
      c.rect(left, top - 1, right - left, bottom - top + 2);
      c.clip();
      if (panel.mark && panel.mark[0] < high && panel.mark[0] > low) drawMark(c, panel, y);
      for (const line of panel.lines) this.drawLine(c, line, x, y, panel.steps);
      c.restore();
      drawMoments(c, this.kept, panel, panel === this.panels[0], x, y);
      drawPeaks(c, panel, x);
    }
  }

  /**
   * An instant, and a value, in pixels.
   * @param {any} panel
   */
  scales({ left, right, top, bottom, low, high }) {
    const last = Math.max(1, this.steps - 1);
    return {
      x: (k) => left + ((right - left) * k) / last,
      y: (value) => bottom - ((bottom - top) * (value - low)) / (high - low),
    };
  }

  drawAxes(c, panel, x, y) {
    const { left, right, bottom, low, high } = panel, duration = (this.steps - 1) * this.kept.time_step;
    c.strokeStyle = palette.grid;
    c.fillStyle = palette.muted;
    c.lineWidth = 1;
    c.textBaseline = "middle";
    c.textAlign = "right";
    for (const value of ticks(low, high, low < 0 ? 4 : 3)) {
      const at = Math.round(y(value)) + 0.5;
      c.beginPath();
      c.moveTo(left, at);
      c.lineTo(right, at);
      c.stroke();
      c.fillText(number(value, 3), left - 6, at);
    }
    if (panel.empty) {
      c.textAlign = "center";
      c.fillText(panel.empty, (left + right) / 2, (panel.top + bottom) / 2);
    }
    if (!panel.last || !duration) return;
    c.textBaseline = "top";
    for (const seconds of ticks(0, duration, (right - left) / 70)) {
      const end = seconds / duration > 0.95;
      c.textAlign = end ? "right" : "center";
      c.fillText(`${number(seconds, 3)} s`, x(seconds / this.kept.time_step) + (end ? 6 : 0), bottom + 6);
    }
  }

  // A gap where there is no value; an acceleration lasts from one instant to the next.
  drawLine(c, { values, colour, dashes }, x, y, steps) {
    c.strokeStyle = colour();
    c.lineWidth = 2;
    c.setLineDash(dashes);
    c.beginPath();
    let down = false;
    values.forEach((value, k) => {
      if (value !== null) {
        c[down ? "lineTo" : "moveTo"](x(k), y(value));
        if (steps && k + 1 < values.length) c.lineTo(x(k + 1), y(value));
        else if (!down) c.lineTo(x(k) + 0.01, y(value)); // a lone value is a dot
      }
      down = value !== null;
    });
    c.stroke();
    c.setLineDash([]);
  }

  now(values, state) {
    const { index } = state, f = state.time / this.kept.time_step - index;
    const value = values[index], next = values[index + 1];
    return f < 1e-6 || value === null || next === null || next === undefined ? value : value + f * (next - value);
  }

  drawLineAt(c, { top, bottom }, at) {
    c.strokeStyle = palette.accent;
    c.lineWidth = 1.5;
    c.beginPath();
    c.moveTo(at, top - 4);
    c.lineTo(at, bottom);
    c.stroke();
  }

  drawCursor(c, panel, state, x, y) {
    const { low, high, lines, steps } = panel, at = x(state.time / this.kept.time_step);
    this.drawLineAt(c, panel, at);
    for (const { values, colour } of lines) {
      const value = steps ? values[state.index] : this.now(values, state);
      if (value === null || value > high || value < low) continue;
      c.fillStyle = colour();
      c.strokeStyle = palette.card;
      c.beginPath();
      c.arc(at, y(value), 4, 0, 2 * Math.PI);
      c.fill();
      c.stroke();
    }
  }

  // The panel's title, with the legend and the values of this instant as far as there is room.
  drawHeading(c, panel, state) {
    const { left, right, top, lines, steps, title, unit } = panel, y = top - 13, name = `${title} [${unit}]`;
    c.textBaseline = "middle";
    c.textAlign = "left";
    c.fillStyle = palette.muted;
    c.fillText(name, left - 34, y);
    const least = left - 34 + c.measureText(name).width + 10;
    c.textAlign = "right";
    let end = right;
    for (const line of lines.toReversed()) {
      const value = steps ? line.values[state.index] : this.now(line.values, state);
      const shown = value === null ? "–" : `${value < 0 ? "−" : ""}${Math.abs(value).toFixed(unit === "m" ? 2 : 1)}`;
      const text = `${line.name} ${shown}`, w = c.measureText(text).width;
      if (end - w - (line.name ? 28 : 0) < least) break;
      c.fillStyle = palette.ink;
      c.fillText(text, end, y);
      if (!line.name) continue;
      c.strokeStyle = line.colour();
      c.lineWidth = 2.5;
      c.setLineDash(line.dashes);
      c.beginPath();
      c.moveTo(end - w - 28, y);
      c.lineTo(end - w - 6, y);
      c.stroke();
      c.setLineDash([]);
      end -= w + 38;
    }
  }
}
