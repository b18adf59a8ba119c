// The scatter plot of the parameter space.

import { palette } from "./colours.js";
import { $, element } from "./common.js";
import { columns, data, rows } from "./data.js";
import { connectFront, frontTrace } from "./front.js";
import { hook } from "./hook.js";
import { near } from "./near.js";
import { number, titled } from "./numbers.js";
import { CONFIG, layout, plain } from "./plots.js";
import { drawnRegions } from "./regions.js";
import { addSection } from "./sections.js";
import { subsample } from "./subsample.js";

const MOST_GL = 50000;
const MOST_SVG = 3000; // points that stay fluid

const hasGl = (() => {
  let answer = null;
  return () => {
    if (answer === null) {
      const context = document.createElement("canvas").getContext("webgl");
      answer = Boolean(context);
      context?.getExtension("WEBGL_lose_context")?.loseContext();
    }
    return answer;
  };
})();

const NOT_SEARCHED = { evaluation: "Evaluation", iteration: "Iteration" };

function valuesOf(name) {
  if (name === "evaluation") return rows.evaluation.map((i) => i + 1);
  return name === "iteration" ? rows.iteration : columns.get(name).values;
}

function fillAxes() {
  const varies = (column) => column.values.some((v) => v !== null && v !== column.values.find((w) => w !== null));
  const groups = [["Searched parameters", (c) => c.group === "parameter" && c.searched], ["Metrics", (c) => c.group === "metric"],
    ["Objectives (minimised)", (c) => c.group === "objective"], ["Derived and fixed", (c) => c.group === "parameter" && !c.searched && varies(c)]];
  for (const select of [$("axis-x"), $("axis-y")]) {
    for (const [label, belongs] of groups) {
      const options = rows.columns.filter(belongs).map((c) => element("option", { value: c.name, title: c.description }, titled(c.name)));
      if (options.length) select.append(element("optgroup", { label }, ...options));
    }
    const order = Object.entries(NOT_SEARCHED).map(([value, text]) => element("option", { value }, text));
    select.append(element("optgroup", { label: "Order" }, ...order));
  }
  const names = rows.columns.map((c) => c.name);
  const [x, y] = [...rows.telling, ...names, "evaluation", "iteration"];
  $("axis-x").value = x;
  $("axis-y").value = y;
}

const keptOn = (name) => {
  const at = new Map(rows.evaluation.map((evaluation, i) => [evaluation, i]));
  const values = valuesOf(name);
  return data.kept.map((kept) => (at.has(kept.evaluation) ? values[at.get(kept.evaluation)] : null));
};

function scatterFigure() {
  const gl = hasGl();
  const { hits, others } = subsample(gl ? MOST_GL : MOST_SVG);
  const [nameX, nameY] = [$("axis-x").value, $("axis-y").value];
  const [x, y] = [valuesOf(nameX), valuesOf(nameY)];
  const shown = hits.length + others.length;
  $("space-note").textContent = shown < rows.n - rows.n_failed ? `${number(shown)} of ${number(rows.n - rows.n_failed)} evaluations drawn` : "";
  const hover = `${plain(titled(nameX))} %{x}<br>${plain(titled(nameY))} %{y}<br>evaluation %{customdata}<extra></extra>`;
  const trace = (part, name, marker) => ({
    type: gl ? "scattergl" : "scatter", mode: "markers", name: `${name} (${number(part.length)})`, marker, hovertemplate: hover,
    x: part.map((i) => x[i]), y: part.map((i) => y[i]), customdata: part.map((i) => rows.evaluation[i] + 1),
  });
  const chosen = hook.state()?.chosen;
  const crowd = Math.min(1, Math.sqrt(1500 / Math.max(1, shown))); // smaller and fainter where there are many
  return [
    trace(others, "not critical", { color: palette.plain, size: 3 + 3 * crowd, opacity: 0.25 + 0.35 * crowd, symbol: "circle" }),
    trace(hits, "critical", {
      color: palette.critical, size: 5 + 3 * crowd, opacity: 0.5 + 0.3 * crowd, symbol: "diamond",
      line: { width: 0.5, color: palette.card },
    }),
    ...(rows.front.length ? [frontTrace(nameX, nameY, x, y)] : []),
    {
      type: "scatter", mode: "markers+text", name: "kept (click to play)", x: keptOn(nameX), y: keptOn(nameY),
      text: data.kept.map((kept) => `${kept.rank}`), textposition: "top right", textfont: { size: 11, color: palette.ink },
      customdata: data.kept.map((_, i) => i), hovertemplate: hover.replace("evaluation %{customdata}", "scenario %{text}: click to play"),
      marker: {
        symbol: "circle-open", size: data.kept.map((_, i) => (i === chosen ? 19 : 13)), color: palette.ink,
        line: { width: data.kept.map((_, i) => (i === chosen ? 3.5 : 1.5)) },
      },
      showlegend: data.kept.length > 0,
    },
  ];
}

// The shadows of the regions on the two axes; one that names neither would cover everything.
function regionShapes(nameX, nameY) {
  const shapes = [], annotations = [];
  for (const region of drawnRegions()) {
    const x = region.box[nameX], y = region.box[nameY];
    if (!x && !y) continue;
    const [x0, x1] = x ?? [0, 1], [y0, y1] = y ?? [0, 1], xref = x ? "x" : "x domain", yref = y ? "y" : "y domain";
    const line = { color: palette.accent, width: 2, dash: region.confirmed ? "solid" : "dot" };
    shapes.push({ type: "rect", xref, yref, x0, x1, y0, y1, line, fillcolor: palette.band, layer: "below" });
    annotations.push({
      xref, yref, x: x0, y: y1, text: `${region.number}`, showarrow: false, xanchor: "left", yanchor: "top",
      font: { size: 12, color: palette.accent }, bgcolor: palette.card, borderpad: 2,
    });
  }
  return { shapes, annotations };
}

function drawScatter() {
  const plot = $("scatter"), narrow = innerWidth < 700;
  const axis = (id) => ({ title: { text: plain(titled($(id).value)), standoff: 8 }, zeroline: false });
  const boxes = regionShapes($("axis-x").value, $("axis-y").value);
  $("regions-drawn").hidden = !boxes.shapes.length;
  const extra = { ...boxes, xaxis: axis("axis-x"), yaxis: axis("axis-y"), dragmode: narrow ? false : "zoom", hovermode: "closest" };
  // Only these buttons: Plotly's own set has one that hands the data to a website.
  const config = {
    ...CONFIG, displayModeBar: narrow ? false : "hover", modeBarButtons: [["toImage"], ["zoom2d", "pan2d"], ["resetScale2d"]],
    toImageButtonOptions: { filename: "parameter-space", scale: 2 },
  };
  Plotly.react(plot, scatterFigure(), layout(extra), config);
  if (plot.listening) return;
  plot.listening = true;
  plot.on("plotly_click", ({ points: [point] }) => { if (point.data.mode === "markers+text") hook.select(point.customdata); });
}

function connectScatter(found, host) {
  host.hidden = !found.critical.length;
  if (host.hidden) return;
  const plot = $("scatter");
  fillAxes();
  near.add(plot, drawScatter);
  for (const id of ["axis-x", "axis-y"]) $(id).addEventListener("change", drawScatter);
  connectFront(drawScatter);
  $("swap").addEventListener("click", () => {
    [$("axis-x").value, $("axis-y").value] = [$("axis-y").value, $("axis-x").value];
    drawScatter();
  });
  let waiting = null;
  const again = (after) => () => {
    clearTimeout(waiting);
    waiting = setTimeout(() => near.again(plot), after);
  };
  document.addEventListener("filters", again(200)); // dragging must not wait for the scatter plot
  document.addEventListener("shown", again(0));
}

addSection({ id: "space", key: "rows", draw: connectScatter });
