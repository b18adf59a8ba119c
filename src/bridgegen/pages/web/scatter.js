// The scatter plot of the parameter space: its axes are chosen, it follows the filters, its points play.

import { $, element } from "./common.js";
import { rows } from "./data.js";
import { connectFront } from "./front.js";
import { hook } from "./hook.js";
import { near } from "./near.js";
import { number, titled } from "./numbers.js";
import { colourChoices } from "./point_colours.js";
import { NOT_SEARCHED, ScatterChart } from "./scatter_chart.js";
import { addSection } from "./sections.js";

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
  const choices = colourChoices();
  $("colour-by").append(...choices.map(([value, text]) => element("option", { value }, text)));
  $("colour-by").closest("label").hidden = choices.length < 2;
}

// What is drawn and what is not, and the buttons that apply to it.
function noteDrawn(chart) {
  const all = rows.n - rows.n_failed, drawn = chart.series.filter(({ name }) => name !== "front" && name !== "kept").reduce((sum, { items }) => sum + items.length, 0);
  const parts = drawn < all ? [`${number(drawn)} of ${number(all)} evaluations`] : [];
  if (chart.missing) parts.push(`${number(chart.missing)} have no value on these axes`);
  $("space-note").textContent = drawn ? parts.join("; ") : "No evaluation passes the filter.";
  $("regions-drawn").hidden = !chart.projections.length;
  $("scatter-reset").hidden = !chart.zoom.ends;
  const beyond = [chart.x, chart.y].some(({ above, below }) => above + below > 0);
  $("scatter-whole").hidden = Boolean(chart.zoom.ends) || (!beyond && !chart.whole);
  $("scatter-whole").textContent = chart.whole ? "Clip outliers" : "Show all values";
}

// The chart as a picture on the page's ground, twice as sharp as the screen needs.
function savePicture(chart) {
  const { clientWidth: width, clientHeight: height } = chart.canvas, ratio = 2;
  const picture = Object.assign(document.createElement("canvas"), { width: width * ratio, height: height * ratio });
  const c = picture.getContext("2d");
  c.fillStyle = getComputedStyle(chart.host.closest(".card")).backgroundColor;
  c.fillRect(0, 0, picture.width, picture.height);
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  chart.paint(c, width, height, ratio);
  picture.toBlob((blob) => {
    const href = URL.createObjectURL(blob);
    element("a", { href, download: "parameter-space.png" }).click();
    setTimeout(() => URL.revokeObjectURL(href), 10000);
  });
}

function connectScatter(found, host) {
  host.hidden = !found.critical.length;
  if (host.hidden) return;
  const plot = $("scatter");
  fillAxes();
  const chart = new ScatterChart(plot, () => ({ x: $("axis-x").value, y: $("axis-y").value, colours: $("colour-by").value }), noteDrawn);
  hook.scatter = chart;
  const anew = () => { chart.zoom.ends = null; chart.draw(); };
  near.add(plot, () => chart.draw());
  for (const id of ["axis-x", "axis-y"]) $(id).addEventListener("change", anew);
  $("colour-by").addEventListener("change", () => chart.draw());
  connectFront(anew);
  $("swap").addEventListener("click", () => {
    [$("axis-x").value, $("axis-y").value] = [$("axis-y").value, $("axis-x").value];
    anew();
  });
  $("scatter-reset").addEventListener("click", () => chart.zoom.reset());
  $("scatter-whole").addEventListener("click", () => { chart.whole = !chart.whole; chart.draw(); });
  $("scatter-save").addEventListener("click", () => savePicture(chart));
  let waiting = null;
  const again = (after) => () => {
    clearTimeout(waiting);
    waiting = setTimeout(() => near.again(plot), after);
  };
  document.addEventListener("filters", again(200)); // dragging must not wait for the scatter plot
  document.addEventListener("shown", ({ detail }) => {
    chart.played = detail;
    again(0)();
  });
}

addSection({ id: "space", key: "rows", draw: connectScatter });
