// The charts over all evaluations, by Plotly: the iterations and the scatter plot.

const MOST_GL = 50000, MOST_SVG = 3000; // points that stay fluid

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

// Plotly reads a little HTML and %{…} in texts: names must stay names.
const plain = (text) => String(text).replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;").replace(/%/g, "&#37;");

function layout(extra) {
  const axis = { gridcolor: palette.grid, zerolinecolor: palette.line, linecolor: palette.line, automargin: true, title: { standoff: 8 } };
  const { xaxis, yaxis, ...rest } = extra, clear = "rgba(0,0,0,0)";
  const font = { family: getComputedStyle(document.body).fontFamily, size: 12, color: palette.ink };
  return {
    paper_bgcolor: clear, plot_bgcolor: clear, font, margin: { l: 8, r: 10, t: 8, b: 8 }, dragmode: false,
    hoverlabel: { bgcolor: palette.card, bordercolor: palette.line, font },
    modebar: { bgcolor: clear, color: palette.muted, activecolor: palette.accent },
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom" },
    xaxis: { ...axis, ...xaxis }, yaxis: { ...axis, ...yaxis }, ...rest,
  };
}
const CONFIG = { responsive: true, displaylogo: false, displayModeBar: false };

// ---- over the iterations ----

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

function trendPlots() {
  const host = $("trend-plots");
  const figures = Object.entries(data.batches.trends).map(([name, trend]) => [`${name} [${unitText(trend.unit)}]`, () => trendFigure(name, data.batches.trends[name])]);
  figures.push(["critical share [%]", shareFigure]);
  return figures.map(([title, traces]) => {
    const plot = element("div", { class: "plot", role: "img", "aria-label": `${title} over the iterations` });
    host.append(element("div", { class: "card" }, element("h3", {}, title), plot));
    const draw = () => {
      const share = traces === shareFigure, top = Math.max(5, 110 * Math.max(...data.batches.share));
      const last = data.batches.last.at(-1), whole = { range: [0.4, last + 0.6], ...(last < 12 ? { dtick: 1 } : {}) };
      const xaxis = { title: { text: "iteration", standoff: 6 }, ...whole };
      const axes = { xaxis, yaxis: { rangemode: "tozero", ...(share ? { range: [0, top] } : {}) } };
      Plotly.react(plot, traces(), layout({ ...axes, bargap: 0.15 }), CONFIG);
    };
    return [plot, draw];
  });
}

// ---- parameter space ----

const NOT_SEARCHED = { evaluation: "Evaluation", iteration: "Iteration" };
function valuesOf(name) {
  if (name === "evaluation") return rows.evaluation.map((i) => i + 1);
  return name === "iteration" ? rows.iteration : columns.get(name).values;
}

// At most `most` of the rows that pass, evenly chosen; half of the places are the critical ones'
// if there are as many.
function subsample(most) {
  const every = (list, n) => (list.length <= n ? list : Array.from({ length: n }, (_, i) => list[Math.floor((i * list.length) / n)]));
  const hit = [], other = [];
  rows.critical.forEach((critical, i) => { if (filters.passes(i)) (critical ? hit : other).push(i); });
  const room = Math.max(most - other.length, Math.ceil(most / 2));
  const hits = every(hit, room);
  return { hits, others: every(other, most - hits.length) };
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
  const chosen = window.bridgegen.state()?.chosen;
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
  plot.on("plotly_click", ({ points: [point] }) => { if (point.data.mode === "markers+text") window.bridgegen.select(point.customdata); });
}

function drawCharts() {
  const charts = new Map(trendPlots());
  let parallel = null;
  if (rows.critical.length) {
    fillAxes();
    charts.set($("scatter"), drawScatter);
    $("parallel-card").hidden = !rows.telling.length;
    if (rows.telling.length) {
      parallel = new Parallel($("parallel"), () => near.again($("parallel")));
      charts.set($("parallel"), () => parallel.draw());
    }
    for (const id of ["axis-x", "axis-y"]) $(id).addEventListener("change", drawScatter);
    connectFront(drawScatter);
    $("swap").addEventListener("click", () => {
      [$("axis-x").value, $("axis-y").value] = [$("axis-y").value, $("axis-x").value];
      drawScatter();
    });
  } else $("space").hidden = $("iterations").hidden = true;
  window.bridgegen.charts = charts.size;
  const near = new NearScreen(charts, () => { window.bridgegen.chartsDrawn += 1; });
  window.bridgegen.grown = () => { parallel?.rescale(); near.all(); };
  darkScheme.addEventListener("change", () => near.all());
  let waiting = null;
  const again = (after) => () => {
    clearTimeout(waiting);
    waiting = setTimeout(() => near.again($("scatter")), after);
  };
  document.addEventListener("filters", again(200)); // dragging must not wait for the scatter plot
  document.addEventListener("shown", again(0));
}
