// The charts over the iterations.

import { palette } from "./colours.js";
import { $, element } from "./common.js";
import { data, rows } from "./data.js";
import { near } from "./near.js";
import { unitText } from "./numbers.js";
import { CONFIG, layout } from "./plots.js";
import { addSection } from "./sections.js";

function trendFigure(name, trend) {
  const b = data.batches, unit = unitText(trend.unit), best = name === "d_min" ? "smallest" : "largest";
  const when = b.first.map((first, i) => (first === b.last[i] ? `iteration ${first}` : `iterations ${first}–${b.last[i]}`));
  const line = (y, label, style) => ({
    x: b.last, y, name: label, customdata: when, hovertemplate: `%{customdata}<br>${label} %{y:.3g} ${unit}<extra></extra>`, ...style,
  });
  const few = b.last.length < 3; // too few for lines
  const mode = few ? "markers" : "lines", color = palette.accent;
  const quartile = { mode, line: { width: 0 }, marker: { color, symbol: "line-ew-open" }, showlegend: false };
  return [
    line(trend.lower, "lower quartile", quartile),
    line(trend.upper, "upper quartile", { ...quartile, fill: few ? "none" : "tonexty", fillcolor: palette.band }),
    line(trend.median, "median", { mode, line: { color, width: 2.5 }, marker: { color, size: 8 } }),
    line(trend.best, best, { mode: "markers", marker: { color: palette.critical, size: 6, symbol: "diamond" }, cliponaxis: false }),
  ];
}

function shareFigure() {
  const b = data.batches, percent = (values) => values.map((v) => (v === null ? null : 100 * v));
  const hover = (label) => `iteration %{x}<br>${label} %{y:.1f} %<extra></extra>`;
  return [
    {
      type: "bar", x: b.last, y: percent(b.share), name: "this iteration", hovertemplate: hover("this iteration"),
      marker: { color: palette.critical, opacity: 0.55 },
    },
    {
      x: b.last, y: percent(b.cumulative), name: "so far (R_critic)", hovertemplate: hover("so far"),
      mode: b.last.length < 3 ? "markers" : "lines", line: { color: palette.ink, width: 2.5 },
    },
  ];
}

function trendPlots(found, host) {
  host.hidden = !rows.critical.length;
  if (host.hidden) return;
  /** @type {[string, () => any[]][]} */
  const figures = Object.entries(found.trends).map(([name, trend]) => [`${name} [${unitText(trend.unit)}]`, () => trendFigure(name, data.batches.trends[name])]);
  figures.push(["critical share [%]", shareFigure]);
  for (const [title, traces] of figures) {
    const plot = element("div", { class: "plot", role: "img", "aria-label": `${title} over the iterations` });
    $("trend-plots").append(element("div", { class: "card" }, element("h3", {}, title), plot));
    const draw = () => {
      const share = traces === shareFigure, top = Math.max(5, 110 * Math.max(...data.batches.share));
      const last = data.batches.last.at(-1), whole = { range: [0.4, last + 0.6], ...(last < 12 ? { dtick: 1 } : {}) };
      const xaxis = { title: { text: "iteration", standoff: 6 }, ...whole };
      const axes = { xaxis, yaxis: { rangemode: "tozero", ...(share ? { range: [0, top] } : {}) } };
      Plotly.react(plot, traces(), layout({ ...axes, bargap: 0.15 }), CONFIG);
    };
    near.add(plot, draw);
  }
}

addSection({ id: "iterations", key: "batches", draw: trendPlots });
