// The charts over the iterations.

import { palette } from "./colours.js";
import { $, element } from "./common.js";
import { data, rows } from "./data.js";
import { hook } from "./hook.js";
import { near } from "./near.js";
import { unitText } from "./numbers.js";
import { addSection } from "./sections.js";
import { TrendChart } from "./trend_chart.js";

function trendLines(name) {
  const { median, lower, upper, best } = data.batches.trends[name];
  return [
    { text: "middle half", values: median, lower, upper, band: palette.band },
    { text: "median", values: median, line: palette.accent },
    { text: name === "d_min" ? "smallest" : "largest", values: best, marker: { shape: "diamond", radius: 3, colour: palette.critical } },
  ];
}

function shareLines() {
  const percent = (values) => values.map((v) => (v === null ? null : 100 * v));
  return [
    { text: "this iteration", values: percent(data.batches.share), bar: palette.critical },
    { text: "so far (R_critic)", values: percent(data.batches.cumulative), line: palette.ink },
  ];
}

function trendPlots(found, host) {
  host.hidden = !rows.critical.length;
  if (host.hidden) return;
  /** @type {[string, string, () => any[]][]} */
  const figures = Object.entries(found.trends).map(([name, { unit }]) => [name, unitText(unit), () => trendLines(name)]);
  figures.push(["critical share", "%", shareLines]);
  hook.trends = figures.map(([name, unit, lines]) => {
    const title = unit ? `${name} [${unit}]` : name, plot = element("div", { class: "plot", role: "group", "aria-label": `${title} over the iterations` });
    $("trend-plots").append(element("div", { class: "card" }, element("h3", {}, title), plot));
    const chart = new TrendChart(plot, title, unit, lines);
    near.add(plot, () => chart.draw());
    return chart;
  });
}

addSection({ id: "iterations", key: "batches", draw: trendPlots });
