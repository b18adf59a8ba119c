// Distance and speeds over time, under the bird's-eye view; a click or a drag jumps to an instant.

function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((m) => m * power).find((step) => step >= least * 0.999);
}

function ticks(top, wanted) {
  const step = roundStep(top / wanted), list = [];
  for (let i = 0; i * step <= top * 1.0001; i++) list.push(i * step);
  return list;
}

class Curves {
  constructor(canvas, jump) {
    this.canvas = canvas;
    const to = (event) => {
      const box = canvas.getBoundingClientRect();
      jump(this.indexAt(event.clientX - box.left));
    };
    canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); to(event); });
    canvas.addEventListener("pointermove", (event) => { if (event.buttons) to(event); });
  }

  show(kept) {
    this.kept = kept;
    const finite = kept.distance.filter((d) => d !== null);
    const speeds = kept.v.flat().filter((v) => v !== null);
    // What happens near counts: the far part of a close encounter runs out of the panel.
    const far = Math.max(1, ...finite) * 1.05, near = kept.closest !== null && kept.distance[kept.closest] < 8;
    this.tops = [near ? Math.min(far, 20) : far, Math.max(1, ...speeds) * 1.15];
  }

  // Left and right end of the time axis, and each panel's top and bottom, in CSS pixels.
  frame() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const half = (height - 22) / 2;
    return { left: 40, right: width - 14, panels: [[28, half - 6], [half + 24, height - 22]] };
  }

  indexAt(x) {
    const { left, right } = this.frame(), last = this.kept.distance.length - 1;
    return Math.min(last, Math.max(0, Math.round(((x - left) / (right - left)) * last)));
  }

  draw(state) {
    const { context: c, width, height } = fitCanvas(this.canvas);
    const { kept } = this, last = kept.distance.length - 1;
    const { left, right, panels } = this.frame();
    const x = (k) => left + (right - left) * (last ? k / last : 0);
    const y = (panel, value) => {
      const [top, bottom] = panels[panel];
      return bottom - (bottom - top) * (value / this.tops[panel]);
    };
    c.clearRect(0, 0, width, height);
    c.lineJoin = "round";
    c.font = FONT.replace("600 12px", "11.5px");
    this.drawAxes(c, x, y, last);
    const threshold = data.summary.critical_distance;
    if (threshold !== null && threshold < this.tops[0]) this.drawThreshold(c, left, right, y(0, threshold), threshold);
    c.save();
    c.beginPath();
    c.rect(left, panels[0][0], right - left, panels[0][1] - panels[0][0] + 3);
    c.clip();
    this.drawLine(c, kept.distance, x, (v) => y(0, v), palette.ink, []);
    c.restore();
    playersOf(kept).forEach((e) => this.drawLine(c, kept.v[e], x, (v) => y(1, v), entityColour(e), DASHES[e % DASHES.length]));
    this.drawCursor(c, state, x, y, panels);
    this.drawMarks(c, x, y, panels);
    this.drawHeadings(c, state, left, right, panels);
  }

  drawAxes(c, x, y, last) {
    const { left, right, panels } = this.frame(), duration = last * this.kept.time_step;
    c.strokeStyle = palette.grid;
    c.fillStyle = palette.muted;
    c.lineWidth = 1;
    c.textBaseline = "middle";
    c.textAlign = "right";
    panels.forEach((_, panel) => {
      for (const value of ticks(this.tops[panel], 3)) {
        const at = Math.round(y(panel, value)) + 0.5;
        c.beginPath();
        c.moveTo(left, at);
        c.lineTo(right, at);
        c.stroke();
        c.fillText(number(value, 3), left - 6, at);
      }
    });
    c.textBaseline = "top";
    c.textAlign = "center";
    if (!last) return;
    for (const seconds of ticks(duration, right - left > 500 ? 10 : 5)) {
      const end = seconds / duration > 0.96;
      c.textAlign = end ? "right" : "center";
      c.fillText(`${number(seconds, 3)} s`, x(seconds / this.kept.time_step) + (end ? 6 : 0), panels[1][1] + 6);
    }
  }

  drawThreshold(c, left, right, at, threshold) {
    c.strokeStyle = c.fillStyle = palette.hit;
    c.lineWidth = 1;
    c.setLineDash([5, 4]);
    c.beginPath();
    c.moveTo(left, at);
    c.lineTo(right, at);
    c.stroke();
    c.setLineDash([]);
    c.textAlign = "left";
    c.textBaseline = "bottom";
    c.fillText(`critical below ${number(threshold, 3)} m`, left + 6, at - 1);
  }

  drawLine(c, row, x, y, colour, dashes) {
    c.strokeStyle = colour;
    c.lineWidth = 2;
    c.setLineDash(dashes);
    c.beginPath();
    let down = false;
    row.forEach((value, k) => {
      if (value !== null) c[down ? "lineTo" : "moveTo"](x(k), y(value));
      down = value !== null;
    });
    c.stroke();
    c.setLineDash([]);
  }

  drawMarks(c, x, y, panels) {
    const { closest, contacts, distance, time_step: step } = this.kept;
    c.lineWidth = 1.5;
    c.strokeStyle = palette.hit;
    for (const k of contacts) {
      c.beginPath();
      c.moveTo(x(k), panels[0][0]);
      c.lineTo(x(k), panels[1][1]);
      c.stroke();
    }
    if (closest === null) return;
    const hit = contacts.length > 0;
    const [px, py] = [x(closest), y(0, distance[closest])];
    c.fillStyle = hit ? palette.hit : palette.ink;
    c.beginPath();
    if (hit) { // a diamond for a contact, a disc for a near miss
      [[0, -6], [6, 0], [0, 6], [-6, 0]].forEach(([a, b], i) => c[i ? "lineTo" : "moveTo"](px + a, py + b));
      c.closePath();
    } else c.arc(px, py, 4.5, 0, 2 * Math.PI);
    c.fill();
    const text = `${hit ? "collision" : `d_min ${distance[closest].toFixed(2)} m`} at ${(closest * step).toFixed(2)} s`;
    c.textBaseline = "middle";
    c.textAlign = "left";
    const w = c.measureText(text).width, { left, right } = this.frame();
    const at = Math.max(left, px + 10 + w > right ? px - w - 10 : px + 10);
    const middle = Math.max(panels[0][0] + 8, py - 12);
    c.save();
    c.fillStyle = palette.card;
    c.globalAlpha = 0.85;
    c.fillRect(at - 3, middle - 8, w + 6, 16);
    c.restore();
    c.fillText(text, at, middle);
  }

  drawCursor(c, state, x, y, panels) {
    const at = x(state.time / this.kept.time_step);
    c.strokeStyle = palette.accent;
    c.lineWidth = 1.5;
    c.beginPath();
    c.moveTo(at, panels[0][0] - 4);
    c.lineTo(at, panels[1][1]);
    c.stroke();
    const dot = (value, panel, colour) => {
      if (value === null || value > this.tops[panel]) return;
      c.fillStyle = colour;
      c.strokeStyle = palette.card;
      c.beginPath();
      c.arc(at, y(panel, value), 4, 0, 2 * Math.PI);
      c.fill();
      c.stroke();
    };
    dot(state.distance, 0, palette.ink);
    playersOf(this.kept).forEach((e) => dot(state.entities[e].v, 1, entityColour(e)));
  }

  // The panels' titles, with the legend and the values of this instant.
  drawHeadings(c, state, left, right, panels) {
    c.textBaseline = "middle";
    c.textAlign = "left";
    c.fillStyle = palette.muted;
    c.fillText("distance [m]", 8, panels[0][0] - 14);
    c.fillText("speed [m/s]", 8, panels[1][0] - 14);
    c.textAlign = "right";
    c.fillStyle = palette.ink;
    c.fillText(state.distance === null ? "–" : state.distance.toFixed(2), right, panels[0][0] - 14);
    let end = right;
    for (const e of playersOf(this.kept).toReversed()) {
      const text = `${state.entities[e].name} ${measured(state.entities[e].v, "m/s", 2)}`;
      const y = panels[1][0] - 14, w = c.measureText(text).width;
      c.fillStyle = palette.ink;
      c.fillText(text, end, y);
      c.strokeStyle = entityColour(e);
      c.lineWidth = 2.5;
      c.setLineDash(DASHES[e % DASHES.length]);
      c.beginPath();
      c.moveTo(end - w - 28, y);
      c.lineTo(end - w - 6, y);
      c.stroke();
      c.setLineDash([]);
      end -= w + 42;
    }
  }
}
