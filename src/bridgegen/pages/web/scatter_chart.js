// The scatter plot's drawing: rows of the page on two axes, the Pareto front, projections of critical regions.

import { Axis } from "./axes.js";
import { Chart } from "./chart.js";
import { palette } from "./colours.js";
import { columns, data, rows } from "./data.js";
import { filters } from "./filters.js";
import { conflictWord, drawn, findingOf } from "./findings.js";
import { frontSeries } from "./front.js";
import { hook } from "./hook.js";
import { Stamp, drawMarker } from "./markers.js";
import { number, quantity, titled, turned, worded } from "./numbers.js";
import { playbacks } from "./playbacks.js";
import { drawnRegions } from "./regions.js";
import { pointColours } from "./point_colours.js";
import { FONT } from "./view.js";
import { Zoom } from "./zoom.js";

export const NOT_SEARCHED = { evaluation: "Evaluation", iteration: "Iteration" };

const PLAYS = {
  kept: "Click to play it", packed: "Click to play it", served: "Click to simulate and play it",
  none: "Click for its figures; to play it: bridgegen open",
};

function valuesOf(name) {
  if (name === "evaluation") return rows.evaluation.map((i) => i + 1);
  return name === "iteration" ? rows.iteration : columns.get(name).values;
}

export class ScatterChart extends Chart {
  // chosen(): names of the two axes, and by what the critical ones are coloured; drawn(chart): called when it is drawn.
  constructor(host, chosen, drawn) {
    super(host);
    this.chosen = chosen;
    this.drawn = drawn;
    this.whole = false; // all values, however far off
    this.played = null; // evaluation in the player
    this.zoom = new Zoom(this, () => this.draw());
  }

  draw() {
    super.draw();
    this.drawn(this);
  }

  figure() {
    const { x: nameX, y: nameY, colours } = this.chosen();
    this.values = { x: valuesOf(nameX), y: valuesOf(nameY) };
    const there = (i) => this.values.x[i] !== null && this.values.y[i] !== null;
    const passing = Array.from(rows.evaluation.keys()).filter((i) => filters.passes(i)), seen = passing.filter(there);
    this.missing = passing.length - seen.length;
    const axis = (name, key) => Object.assign(
      new Axis(seen.map((i) => this.values[key][i]), { column: columns.get(name), whole: this.whole || Boolean(columns.get(name)?.searched), ends: this.zoom.ends?.[key] ?? null }),
      { title: titled(name) },
    );
    const kept = seen.filter((i) => playbacks.keptAt.has(rows.evaluation[i]));
    const crowd = Math.min(1, Math.sqrt(1500 / Math.max(1, seen.length))); // smaller and fainter where there are many
    const series = [
      { name: "plain", text: "not critical", items: seen.filter((i) => !rows.critical[i]), alpha: 0.35 + 0.35 * crowd, marker: { shape: "disc", radius: 1.6 + 1.4 * crowd, colour: palette.plain } },
      ...pointColours(colours, seen.filter((i) => rows.critical[i])).map((one) => ({ ...one, alpha: 0.5 + 0.35 * crowd, marker: { ...one.marker, radius: 2.4 + 1.4 * crowd, edge: palette.card } })),
      ...frontSeries(nameX, nameY, seen, this.values),
      ...(data.kept.length > drawn.length ? [{ name: "kept", text: "exported", items: kept, ranks: true, marker: { shape: "disc", radius: 7, colour: palette.ink, open: true } }] : []),
    ].map((one) => ({ ...one, label: `${one.text} (${number(one.items.length)})` }));
    this.names = [nameX, nameY];
    const text = `Scatter plot, ${titled(nameY)} over ${titled(nameX)}: ${series.map(({ label }) => label).join(", ")}. Arrow keys lead from point to point, Enter plays one.`;
    return { x: axis(nameX, "x"), y: axis(nameY, "y"), series, text };
  }

  // Where a row is drawn; null where that is outside of what is zoomed to.
  placeOf(i) {
    const { x, y } = this, [u, v] = [x.share(this.values.x[i]), y.share(this.values.y[i])];
    const out = u < 0 ? "left" : u > 1 ? "right" : v < 0 ? "down" : v > 1 ? "up" : null;
    if (out && this.zoom.ends) return null;
    return { x: x.within(this.values.x[i]), y: y.within(this.values.y[i]), item: i, out };
  }

  places() {
    return this.shown.flatMap(({ items }) => items.map((i) => this.placeOf(i)).filter(Boolean));
  }

  paintSeries(c, ratio) {
    this.paintRegions(c);
    if (!this.shown.some(({ items }) => items.length)) {
      c.textAlign = "center";
      c.fillStyle = palette.muted;
      c.fillText(this.missing ? "No evaluation has values on both axes" : "No evaluation to show", (this.box.left + this.box.right) / 2, (this.box.top + this.box.bottom) / 2);
    }
    for (const { items, marker, alpha = 1, line, ranks } of this.shown) {
      const places = items.map((i) => this.placeOf(i)).filter(Boolean);
      if (line) this.paintSteps(c, places, line);
      if (ranks) for (const place of places) this.paintRank(c, place, marker);
      else {
        const stamps = new Map();
        c.globalAlpha = alpha;
        for (const { x, y, out } of places) {
          const shape = out ?? marker.shape;
          if (!stamps.has(shape)) stamps.set(shape, new Stamp({ ...marker, shape, radius: out ? 4.5 : marker.radius }, ratio));
          stamps.get(shape).draw(c, x, y);
        }
        c.globalAlpha = 1;
      }
    }
    const played = rows.evaluation.indexOf(this.played), place = this.shown.some(({ items }) => items.includes(played)) ? this.placeOf(played) : null;
    if (place) drawMarker(c, { shape: "disc", radius: 10, colour: palette.ink, open: true }, place.x, place.y);
  }

  // An exported scenario: a ring with its rank.
  paintRank(c, { x, y, item }, marker) {
    drawMarker(c, marker, x, y);
    const { rank } = data.kept[playbacks.keptAt.get(rows.evaluation[item])];
    c.font = FONT.replace("600 12px", "600 11px");
    c.textAlign = "left";
    c.lineJoin = "round";
    c.lineWidth = 3;
    c.strokeStyle = palette.card;
    c.fillStyle = palette.ink;
    c.strokeText(`${rank}`, x + 7, y - 9);
    c.fillText(`${rank}`, x + 7, y - 9);
  }

  // The front of two objectives: what it bounds has corners.
  paintSteps(c, places, colour) {
    c.strokeStyle = colour;
    c.lineWidth = 1.5;
    c.beginPath();
    places.forEach(({ x, y }, k) => {
      if (k) c.lineTo(x, places[k - 1].y);
      c[k ? "lineTo" : "moveTo"](x, y);
    });
    c.stroke();
  }

  // The projections of the regions on the two axes; one that names neither would cover everything.
  get projections() {
    const [nameX, nameY] = this.names, { left, right, top, bottom } = this.box;
    const named = drawnRegions().filter(({ box }) => box[nameX] || box[nameY]);
    return named.map(({ box, number: label, confirmed }) => ({
      label: `${label}`, confirmed,
      x: box[nameX]?.map((value) => this.x.within(value)) ?? [left, right],
      y: box[nameY]?.map((value) => this.y.within(value)) ?? [bottom, top],
    }));
  }

  paintRegions(c) {
    for (const { label, confirmed, x: [x0, x1], y: [y1, y0] } of this.projections) {
      c.fillStyle = palette.band;
      c.strokeStyle = palette.accent;
      c.lineWidth = 2;
      c.setLineDash(confirmed ? [] : [2, 4]);
      c.fillRect(x0, y0, x1 - x0, y1 - y0);
      c.strokeRect(x0, y0, x1 - x0, y1 - y0);
      c.setLineDash([]);
      c.font = FONT;
      c.textAlign = "left";
      const { width } = c.measureText(label);
      c.fillStyle = palette.card;
      c.fillRect(x0 + 2, y0 + 2, width + 6, 17);
      c.fillStyle = palette.accent;
      c.fillText(label, x0 + 5, y0 + 11);
    }
  }

  linesOf(i) {
    const evaluation = rows.evaluation[i], kept = data.kept[playbacks.keptAt.get(evaluation)], finding = findingOf(i);
    const value = (name) => {
      const column = columns.get(name), shown = valuesOf(name)[i];
      return `${NOT_SEARCHED[name] ?? name} ${worded(shown, column) ?? quantity(turned(shown, column), column?.unit ?? "")}`;
    };
    const source = playbacks.source(evaluation) ?? "none";
    return [
      `${kept ? `Scenario ${kept.name}, evaluation` : "Evaluation"} ${number(evaluation + 1)}`,
      ...new Set(this.names.map(value)),
      [rows.critical[i] ? `critical, rank ${number(rows.rank[i])}` : "not critical", ...(finding?.[0] ? [`${conflictWord(finding[0])}: ${finding[1]}`] : [])].join("; "),
      ...(rows.front.includes(i) ? ["on the Pareto front"] : []),
      ...(hook.show ? [PLAYS[source]] : []),
    ];
  }

  choose({ item }) {
    hook.show?.(rows.evaluation[item], null, true);
  }

  // For tests and users' scripts: where a row of the run is drawn.
  pixelOf(evaluation) {
    const place = this.placeOf(rows.evaluation.indexOf(evaluation));
    return place && [place.x, place.y];
  }
}
