// When the ego saw whom: a row over time for each body that is named, above the curves.

import { palette } from "./colours.js";
import { colourOf, playersOf } from "./geometry.js";
import { detectionAt } from "./unpack.js";

const ROW = 27; // a name above its bar
const HEAD = 24;
const MOST_ROWS = 4;

export class Strip {
  constructor(kept, steps) {
    this.kept = kept;
    this.steps = steps; // of the axis; another driver's may last longer
    this.left = this.right = this.top = this.bottom = 0; // see place
    const named = kept.sensed ? playersOf(kept).filter((e) => e > 0).slice(0, MOST_ROWS) : [];
    this.rows = named.map((e) => ({ e, name: kept.entities[e].name, spells: this.spells(e) }));
  }

  get height() {
    return this.rows.length ? HEAD + ROW * this.rows.length : 0;
  }

  // Stretches of the same status: from, to (past the last), status.
  spells(e) {
    const found = [];
    for (let k = 0; k < this.kept.n_steps; k++) {
      const status = detectionAt(this.kept, e, k)?.status ?? null, last = found.at(-1);
      if (last?.status === status) last.to = k + 1;
      else found.push({ from: k, to: k + 1, status });
    }
    return found.filter(({ status }) => status);
  }

  place(width) {
    Object.assign(this, { left: 42, right: width - 14, top: HEAD, bottom: this.height });
  }

  draw(c) {
    if (!this.rows.length) return;
    const { left, right, top, kept } = this, last = Math.max(1, this.steps - 1);
    const x = (k) => left + ((right - left) * Math.min(k, last)) / last;
    this.drawKey(c);
    this.rows.forEach(({ e, name, spells }, i) => {
      const y = top + ROW * i + 20;
      c.textAlign = "left";
      c.textBaseline = "middle";
      c.fillStyle = palette.ink;
      c.fillText(name, left, y - 12, right - left);
      c.strokeStyle = palette.grid;
      c.lineWidth = 1;
      c.beginPath();
      c.moveTo(left, y);
      c.lineTo(right, y);
      c.stroke();
      for (const { from, to, status } of spells) this.drawSpell(c, x(from), Math.max(x(to), x(from) + 1.5), y, status, colourOf(kept, e));
    });
  }

  // Seen: a full bar; displaced: a low one; missed: a hatched frame.
  drawSpell(c, from, to, y, status, colour) {
    const half = status === "displaced" ? 2 : 5;
    c.fillStyle = colour;
    if (status !== "missed") return c.fillRect(from, y - half, to - from, 2 * half);
    c.save();
    c.strokeStyle = palette.hit;
    c.lineWidth = 1;
    c.beginPath();
    c.rect(from, y - half, to - from, 2 * half);
    c.clip();
    c.rect(from + 0.5, y - half + 0.5, Math.max(0.5, to - from - 1), 2 * half - 1);
    for (let u = Math.floor(from / 5) * 5 - 10; u < to; u += 5) {
      c.moveTo(u, y + half);
      c.lineTo(u + 2 * half, y - half);
    }
    c.stroke();
    c.restore();
  }

  drawKey(c) {
    c.textBaseline = "middle";
    c.textAlign = "left";
    c.fillStyle = palette.muted;
    c.fillText("sensors", 8, 13);
    let at = 8 + c.measureText("sensors").width + 18;
    for (const status of ["seen", "displaced", "missed"]) {
      this.drawSpell(c, at, at + 22, 13, status, palette["other-1"]);
      c.fillStyle = palette.muted;
      c.fillText(status, at + 27, 13);
      at += 27 + c.measureText(status).width + 16;
    }
  }
}
