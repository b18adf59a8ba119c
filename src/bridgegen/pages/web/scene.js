// The bird's-eye view: road, vehicles, trails, on a canvas; x to the right, y up, in metres.

import { Atmosphere } from "./atmosphere.js";
import { drawBody, drawLamps, drawStreetLights } from "./bodies.js";
import { Camera } from "./camera.js";
import { drawChase, stripes } from "./chase.js";
import { palette } from "./colours.js";
import { drawDecided, drawZones } from "./conflict.js";
import { drawCourse } from "./course.js";
import { data } from "./data.js";
import { boxCentre, boxCorners, colourOf, isPlaced, nearestTo, playersOf, stateAt } from "./geometry.js";
import { drawElsewhere } from "./ghosts.js";
import { CROSS, Labels, drawCross, drawScaleBar, labelLamps, pill, pointTo } from "./labels.js";
import { measured } from "./numbers.js";
import { detectedBoxes, drawDetections } from "./senses.js";
import { detectionAt, showsAt, unpackLine, weatherAt } from "./unpack.js";
import { View, fitCanvas } from "./view.js";
import { detectionWords } from "./words.js";

const AREAS = { driving: "asphalt", junction: "asphalt", shoulder: "asphalt-2", sidewalk: "asphalt-2", median: "ground", stripe: "marking" };

const LINES = { // colour, width [m], dashes [m]
  edge: ["marking", 0.14, []], solid: ["marking", 0.14, []], broken: ["marking", 0.14, [3, 3]],
  centre: ["marking", 0.2, []], stop: ["stop", 0.45, []], route: ["accent", 0.12, [1, 1]],
  sign: ["hit", 0.3, []],
};

export class Scene {
  constructor(canvas, changed) {
    this.canvas = canvas;
    this.view = new View(canvas, changed);
    this.atmosphere = new Atmosphere();
    this.layers = { players: true, motion: true, conflict: true, sensed: true, course: true, weather: true, elsewhere: true }; // the first cannot be hidden
  }

  show(kept) {
    this.kept = kept;
    this.solid = null;
    this.labels = new Labels(kept);
    this.outlines = data.roads[kept.road].map(({ kind, points }) => {
      const path = new Path2D();
      unpackLine(points).forEach((p, i) => path[i ? "lineTo" : "moveTo"](...p));
      if (kind in AREAS) path.closePath();
      return { kind, path };
    });
    this.hits = kept.contacts.map((k) => [k, nearestTo(kept, stateAt(kept, k))]).filter(([, gap]) => gap);
    this.centres = kept.entities.map((entity, e) => kept.x[e].map((x, k) => {
      const state = { x, y: kept.y[e][k], h: kept.h[e][k] };
      return isPlaced(state) ? boxCentre(entity, state.x, state.y, state.h) : null;
    }));
    this.camera = new Camera(this.view, kept, this.centres);
  }

  // The road as areas and stripes with their colours, for the view in perspective.
  get road() {
    this.solid ??= data.roads[this.kept.road].map(({ kind, points }) => {
      const line = unpackLine(points);
      if (kind in AREAS) return { colour: AREAS[kind], polygons: [line] };
      const [colour, width, dashes] = LINES[kind];
      return { colour, polygons: stripes(line, width, dashes.length ? dashes : undefined), isLine: true };
    });
    return this.solid;
  }

  draw(state) {
    const { context: c, width, height, ratio } = fitCanvas(this.canvas);
    this.size = { width, height };
    if (!width || !height) return; // not laid out yet
    if (this.view.framing === "chase") {
      this.labels.boxes = this.crosses = [];
      const weather = this.layers.weather ? weatherAt(this.kept, state.index) : null;
      this.pixels = drawChase(c, this.size, this.kept, state, { orbit: this.view.orbit, road: this.road, centres: this.centres, hits: this.hits, weather });
      return;
    }
    this.pixels = null;
    this.camera.aim(state);
    const { x, y, scale } = this.view;
    c.fillStyle = palette.ground;
    c.fillRect(0, 0, width, height);
    const metres = () => c.setTransform(ratio * scale, 0, 0, -ratio * scale, ratio * (width / 2 - x * scale), ratio * (height / 2 + y * scale));
    const pixels = () => c.setTransform(ratio, 0, 0, ratio, 0, 0);
    const weather = this.layers.weather ? weatherAt(this.kept, state.index) : null;
    metres();
    c.lineJoin = "round";
    this.drawRoad(c, scale);
    if (weather) {
      this.atmosphere.drawRoadState(c, weather, this.outlines);
      pixels();
      this.atmosphere.over(c, this, state, weather);
      metres();
    }
    drawStreetLights(c, this.kept.street_lights, scale);
    drawLamps(c, this.kept.lamps, state.index, scale);
    if (this.layers.course) drawCourse(c, this.kept, state, scale);
    for (const e of playersOf(this.kept)) this.drawTrail(c, e, state.index, scale);
    drawDecided(c, this.kept, this.centres, scale);
    this.drawGhosts(c, state, scale);
    state.entities.forEach((s, e) => {
      const entity = this.kept.entities[e];
      if (isPlaced(s)) drawBody(c, entity, s, colourOf(this.kept, e), scale, showsAt(entity, state.index), state.index * this.kept.time_step);
    });
    drawZones(c, this.kept, state, scale);
    if (this.layers.elsewhere) drawElsewhere(c, this.kept, state, scale);
    if (this.layers.sensed) drawDetections(c, this.kept, state, scale);
    pixels();
    this.drawContacts(c, state);
    this.drawGap(c, state);
    const words = labelLamps(c, this.kept, state.index, this.view, this.size);
    const boxes = this.layers.sensed ? detectedBoxes(this.kept, state, this.view) : [], pointer = this.drawPointer(c, state);
    this.labels.draw(c, state, this.view, this.size, this.texts(state, pointer && this.camera.partner), pointer ? [...words, ...boxes, pointer] : [...words, ...boxes], this.crosses);
    drawScaleBar(c, this.size, scale);
  }

  // What stands beside each body: who it is and how fast, and how the ego sees it. `named` has its name elsewhere.
  texts(state, named) {
    const players = playersOf(this.kept);
    return state.entities.map((s, e) => {
      if (!players.includes(e) || (named && e === named)) return null;
      const seen = this.layers.sensed && e > 0 ? detectionWords(detectionAt(this.kept, e, state.index)) : "";
      const marked = seen && seen !== "seen" ? `  ${seen}` : "";
      return [`${s.name}  ${measured(s.v, "m/s", 2)} m/s${marked}`, `${s.name}${marked}`];
    });
  }

  // Where the conflict's other participant is while it is out of sight.
  drawPointer(c, state) {
    const e = this.camera.partner, at = (k) => this.centres[k][state.index];
    if (!e || !at(0) || !at(e)) return null;
    return pointTo(c, this.size, this.view, this.kept.entities[e].name, at(0), at(e), colourOf(this.kept, e));
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
      c.strokeStyle = colourOf(this.kept, e);
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
    if (apart > 46) pill(c, this.size, `${state.distance.toFixed(1)} m`, (from[0] + to[0]) / 2, (from[1] + to[1]) / 2, palette.ink);
  }

  // A cross where a contact began, from that instant on.
  drawContacts(c, state) {
    this.crosses = [];
    for (const [k, gap] of this.hits) {
      if (k > state.index) continue;
      const [x, y] = this.view.toScreen([(gap.from[0] + gap.to[0]) / 2, (gap.from[1] + gap.to[1]) / 2]);
      this.crosses.push([x - CROSS, y - CROSS, x + CROSS, y + CROSS]);
      drawCross(c, x, y);
    }
  }
}
