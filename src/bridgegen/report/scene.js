// The bird's-eye view: road, vehicles, trails, on a canvas; x to the right, y up, in metres.

const AREAS = { driving: "asphalt", junction: "asphalt", shoulder: "asphalt-2", sidewalk: "asphalt-2", median: "ground", stripe: "marking" };
const LINES = { // colour, width [m], dashes [m]
  edge: ["marking", 0.14, []], solid: ["marking", 0.14, []], broken: ["marking", 0.14, [3, 3]],
  centre: ["marking", 0.2, []], stop: ["stop", 0.45, []], route: ["accent", 0.12, [1, 1]],
  sign: ["hit", 0.3, []],
};

const SMALL = { pedestrian: "person", animal: "person", bicycle: "cycle", motorcycle: "cycle", cone: "cone", sign: "sign", obstacle: "thing" };
const LAMPS = [ // states: 0 off, 1 red, 2 red and yellow, 3 yellow, 4 green
  { at: 2.2, lit: [1, 2], colour: "#ff4d4d" }, { at: 0, lit: [2, 3], colour: "#ffd23f" }, { at: -2.2, lit: [4], colour: "#38d39f" },
];

function overlap([ax0, ay0, ax1, ay1], [bx0, by0, bx1, by1]) {
  return Math.max(0, Math.min(ax1, bx1) - Math.max(ax0, bx0)) * Math.max(0, Math.min(ay1, by1) - Math.max(ay0, by0));
}

class Scene {
  constructor(canvas, changed) {
    this.canvas = canvas;
    this.view = new View(canvas, changed);
  }

  show(kept) {
    this.kept = kept;
    this.places = null;
    this.outlines = data.roads[kept.road].map(({ kind, points }) => {
      const path = new Path2D();
      path.moveTo(points[0], points[1]);
      for (let i = 2; i < points.length; i += 2) path.lineTo(points[i], points[i + 1]);
      if (kind in AREAS) path.closePath();
      return { kind, path };
    });
    this.centres = kept.entities.map((entity, e) => kept.x[e].map((x, k) => {
      const state = { x, y: kept.y[e][k], h: kept.h[e][k] };
      return isPlaced(state) ? boxCentre(entity, state.x, state.y, state.h) : null;
    }));
    this.fit();
  }

  fit() {
    this.view.fit(playersOf(this.kept).flatMap((e) => this.centres[e]).filter(Boolean));
  }

  draw(state) {
    const { context: c, width, height, ratio } = fitCanvas(this.canvas);
    this.size = { width, height };
    if (this.view.follow && isPlaced(state.entities[0])) {
      const { x, y, h } = state.entities[0];
      [this.view.x, this.view.y] = boxCentre(this.kept.entities[0], x, y, h);
    }
    const { x, y, scale } = this.view;
    c.fillStyle = palette.ground;
    c.fillRect(0, 0, width, height);
    c.setTransform(ratio * scale, 0, 0, -ratio * scale, ratio * (width / 2 - x * scale), ratio * (height / 2 + y * scale));
    c.lineJoin = "round";
    this.drawRoad(c, scale);
    this.drawLamps(c, state.index, scale);
    state.entities.forEach((_, e) => this.drawTrail(c, e, state.index, scale));
    this.drawGhosts(c, state, scale);
    state.entities.forEach((s, e) => { if (isPlaced(s)) this.drawBody(c, this.kept.entities[e], s, entityColour(e), scale); });
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.drawContacts(c, state);
    this.drawGap(c, state);
    this.drawLabels(c, state);
    this.drawScaleBar(c, width, height, scale);
  }

  drawRoad(c, scale) {
    for (const { kind, path } of this.outlines) {
      if (kind in AREAS) {
        c.fillStyle = c.strokeStyle = palette[AREAS[kind]];
        c.fill(path);
        c.setLineDash([]);
        c.lineWidth = 0.8 / scale; // hides the hairline between neighbouring areas
        c.stroke(path);
      } else {
        const [colour, metres, dashes] = LINES[kind];
        c.strokeStyle = palette[colour];
        c.lineWidth = Math.max(metres, 1 / scale);
        c.setLineDash(dashes);
        c.stroke(path);
      }
    }
    c.setLineDash([]);
  }

  drawTrail(c, e, index, scale) {
    const centres = this.centres[e];
    const stroke = (from, to, alpha, pixels) => {
      c.globalAlpha = alpha;
      c.strokeStyle = entityColour(e);
      c.lineWidth = pixels / scale;
      c.beginPath();
      let down = false;
      for (let k = from; k <= to; k++) {
        if (centres[k]) c[down ? "lineTo" : "moveTo"](...centres[k]);
        down = Boolean(centres[k]);
      }
      c.stroke();
    };
    stroke(index, centres.length - 1, 0.45, 1.5);
    stroke(0, index, 0.95, 3);
    // A dot every second: their spacing shows the speed.
    const every = Math.max(1, Math.round(1 / this.kept.time_step));
    c.fillStyle = palette.marking;
    for (let k = 0; k <= index; k += every) {
      if (!centres[k]) continue;
      c.beginPath();
      c.arc(...centres[k], 2 / scale, 0, 2 * Math.PI);
      c.fill();
    }
    c.globalAlpha = 1;
  }

  drawBody(c, entity, state, colour, scale) {
    const { length, width } = entity;
    c.save();
    c.translate(...boxCentre(entity, state.x, state.y, state.h));
    c.rotate(state.h);
    if (entity.type in SMALL) {
      this.drawSmall(c, entity, colour, scale);
      c.restore();
      return;
    }
    c.beginPath();
    if (c.roundRect && scale > 3) c.roundRect(-length / 2, -width / 2, length, width, width * 0.22);
    else c.rect(-length / 2, -width / 2, length, width);
    c.fillStyle = colour;
    c.fill();
    c.lineWidth = 1.5 / scale;
    c.strokeStyle = palette.marking;
    c.stroke();
    // Windscreen and roof line tell front from rear.
    c.fillStyle = "rgba(8, 16, 26, 0.62)";
    c.beginPath();
    c.moveTo(length * 0.12, -width * 0.34);
    c.lineTo(length * 0.27, -width * 0.41);
    c.lineTo(length * 0.27, width * 0.41);
    c.lineTo(length * 0.12, width * 0.34);
    c.closePath();
    c.fill();
    c.fillRect(-length * 0.36, -width * 0.34, length * 0.08, width * 0.68);
    c.fillStyle = "rgba(255, 255, 255, 0.9)";
    for (const side of [-1, 1]) c.fillRect(length * 0.455, side * width * 0.33 - width * 0.08, length * 0.035, width * 0.16);
    c.restore();
  }

  // People, cycles and things: seen from afar they are a few pixels, so they are told by their shape.
  drawSmall(c, { type, length, width }, colour, scale) {
    const shape = SMALL[type], half = Math.max(0.5 * Math.max(length, width), 2.5 / scale);
    c.beginPath();
    if (shape === "person" || shape === "cone") c.arc(0, 0, half, 0, 2 * Math.PI);
    else if (shape === "cycle") c.ellipse(0, 0, Math.max(length / 2, half), Math.max(width / 2, 2 / scale), 0, 0, 2 * Math.PI);
    else c.rect(-Math.max(length / 2, 1.5 / scale), -half, Math.max(length, 3 / scale), 2 * half);
    c.fillStyle = shape === "cone" || shape === "sign" ? palette.cone : colour;
    c.fill();
    c.lineWidth = 1.2 / scale;
    c.strokeStyle = palette.marking;
    c.stroke();
    if (shape === "cone") {
      c.beginPath();
      c.arc(0, 0, half * 0.45, 0, 2 * Math.PI);
      c.fillStyle = palette.marking;
      c.fill();
    } else if (shape === "person" || shape === "cycle") {
      c.beginPath();
      c.arc(0, 0, half * (shape === "person" ? 0.5 : 0.3), 0, 2 * Math.PI);
      c.fillStyle = "rgba(8, 16, 26, 0.62)";
      c.fill();
    }
  }

  // A housing beside the lane, red farthest ahead; the place of the lamp that is lit tells as much as its colour.
  drawLamps(c, index, scale) {
    for (const lamp of this.kept.lamps) {
      const state = lamp.changes.reduce((now, [k, to]) => (k <= index ? to : now), 0);
      const r = Math.max(0.45, 3.2 / scale);
      c.save();
      c.translate(lamp.x, lamp.y);
      c.rotate(lamp.h);
      c.fillStyle = "#10161d";
      c.strokeStyle = palette.marking;
      c.lineWidth = 1 / scale;
      c.beginPath();
      if (c.roundRect) c.roundRect(-3.6 * r, -1.3 * r, 7.2 * r, 2.6 * r, 1.2 * r);
      else c.rect(-3.6 * r, -1.3 * r, 7.2 * r, 2.6 * r);
      c.fill();
      c.stroke();
      LAMPS.forEach(({ at, lit, colour }) => {
        c.beginPath();
        c.arc(at * r, 0, 0.85 * r, 0, 2 * Math.PI);
        c.fillStyle = lit.includes(state) ? colour : "#3a434e";
        c.fill();
      });
      c.restore();
    }
  }

  // Where both stood at the smallest gap, as dashed outlines.
  drawGhosts(c, state, scale) {
    const k = this.kept.closest;
    if (k === null || k === state.index) return;
    c.lineWidth = 1.5 / scale;
    c.setLineDash([4 / scale, 3 / scale]);
    c.strokeStyle = palette.marking;
    stateAt(this.kept, k).entities.forEach((s, e) => {
      if (!isPlaced(s) || !playersOf(this.kept).includes(e)) return;
      c.beginPath();
      boxCorners(this.kept.entities[e], s.x, s.y, s.h).forEach((p, i) => c[i ? "lineTo" : "moveTo"](...p));
      c.closePath();
      c.stroke();
    });
    c.setLineDash([]);
  }

  drawGap(c, state) {
    const gap = nearestTo(this.kept, state);
    if (!gap || !(state.distance > 0) || state.distance > 20) return;
    const from = this.view.toScreen(gap.from), to = this.view.toScreen(gap.to);
    c.strokeStyle = palette.ink;
    c.lineWidth = 1.5;
    c.setLineDash([3, 3]);
    c.beginPath();
    c.moveTo(...from);
    c.lineTo(...to);
    c.stroke();
    c.setLineDash([]);
    const apart = Math.hypot(to[0] - from[0], to[1] - from[1]);
    if (apart > 46) this.pill(c, `${state.distance.toFixed(1)} m`, (from[0] + to[0]) / 2, (from[1] + to[1]) / 2, palette.ink);
  }

  // A cross where a contact began, from that instant on.
  drawContacts(c, state) {
    for (const k of this.kept.contacts) {
      if (k > state.index) continue;
      const gap = nearestTo(this.kept, stateAt(this.kept, k));
      if (!gap) continue;
      const [x, y] = this.view.toScreen([(gap.from[0] + gap.to[0]) / 2, (gap.from[1] + gap.to[1]) / 2]);
      const r = 8;
      c.lineCap = "round";
      for (const [colour, pixels] of [[palette.card, 5.5], [palette.hit, 3]]) {
        c.strokeStyle = colour;
        c.lineWidth = pixels;
        c.beginPath();
        for (const [a, b] of [[-1, -1], [-1, 1]]) {
          c.moveTo(x + a * r * 0.7, y + b * r * 0.7);
          c.lineTo(x - a * r * 0.7, y - b * r * 0.7);
        }
        c.stroke();
      }
      c.lineCap = "butt";
    }
  }

  // A label goes to that one of eight places around its vehicle which hides least; the side away
  // from the others and the place it had before are preferred, so that it does not jump about.
  drawLabels(c, state) {
    const bodies = state.entities.map((s, e) => {
      if (!isPlaced(s)) return null;
      const corners = boxCorners(this.kept.entities[e], s.x, s.y, s.h).map((p) => this.view.toScreen(p));
      const xs = corners.map((p) => p[0]), ys = corners.map((p) => p[1]);
      return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
    });
    const { width, height } = this.size;
    const taken = [...bodies.filter(Boolean), [0, 0, width, 44], [0, height - 36, 130, height]]; // clock, zoom, scale bar
    const middles = bodies.map((box) => box && [(box[0] + box[2]) / 2, (box[1] + box[3]) / 2]);
    const seen = middles.filter(Boolean);
    const hub = [0, 1].map((i) => seen.reduce((sum, p) => sum + p[i], 0) / seen.length);
    c.font = FONT;
    const players = playersOf(this.kept);
    state.entities.forEach((s, e) => {
      if (!bodies[e] || !players.includes(e)) return;
      const text = `${s.name}  ${measured(s.v, "m/s", 2)} m/s`;
      const w = c.measureText(text).width + 14, h = 20, [mx, my] = middles[e], [x0, y0, x1, y1] = bodies[e];
      const away = seen.length > 1 ? Math.atan2(my - hub[1], mx - hub[0]) : -Math.PI / 2;
      let best = { cost: Infinity };
      for (let place = 0; place < 8; place++) {
        const angle = (place * Math.PI) / 4;
        const x = mx + Math.cos(angle) * ((x1 - x0) / 2 + w / 2 + 5), y = my + Math.sin(angle) * ((y1 - y0) / 2 + h / 2 + 6);
        const box = [x - w / 2, y - h / 2, x + w / 2, y + h / 2];
        const hidden = taken.reduce((sum, other) => sum + overlap(box, other), 0);
        const outside = w * h - overlap(box, [0, 0, width, height]);
        const turned = 0.15 * w * h * (1 - Math.cos(angle - away)), kept = this.places?.[e] === place ? 0.35 * w * h : 0;
        const cost = hidden + outside + turned - kept;
        if (cost < best.cost) best = { cost, place, x, y, box };
      }
      (this.places ??= [])[e] = best.place;
      taken.push(best.box);
      this.pill(c, text, best.x, best.y, entityColour(e));
    });
  }

  pill(c, text, x, y, colour) {
    c.font = FONT;
    const w = c.measureText(text).width + 14, h = 20;
    const left = Math.min(this.size.width - w - 4, Math.max(4, x - w / 2));
    const top = Math.min(this.size.height - h - 4, Math.max(4, y - h / 2));
    c.fillStyle = palette.label;
    c.strokeStyle = colour;
    c.lineWidth = 1.5;
    c.beginPath();
    if (c.roundRect) c.roundRect(left, top, w, h, 10);
    else c.rect(left, top, w, h);
    c.fill();
    c.stroke();
    c.fillStyle = palette.ink;
    c.textBaseline = "middle";
    c.textAlign = "left";
    c.fillText(text, left + 7, top + h / 2 + 0.5);
  }

  drawScaleBar(c, width, height, scale) {
    const metres = [1, 2, 5, 10, 20, 50, 100].find((m) => m * scale >= 50) ?? 100;
    const x = 14, y = height - 16;
    c.fillStyle = palette.label;
    c.fillRect(x - 6, y - 15, metres * scale + 12, 23);
    c.strokeStyle = c.fillStyle = palette.ink;
    c.lineWidth = 1.5;
    c.beginPath();
    c.moveTo(x, y - 3);
    c.lineTo(x, y + 2);
    c.lineTo(x + metres * scale, y + 2);
    c.lineTo(x + metres * scale, y - 3);
    c.stroke();
    c.font = FONT;
    c.textBaseline = "alphabetic";
    c.textAlign = "center";
    c.fillText(`${metres} m`, x + (metres * scale) / 2, y - 2);
  }
}
