// Coverage of pairs: a triangle with a cell for each pair of parameters, and the chosen pair's bins.

import { MOST_TEXTS, arrowKeys, binCell, binRange, binTicks, depth, percent, share, withUnit } from "./bins.js";
import { $, element } from "./common.js";
import { data } from "./data.js";
import { number } from "./numbers.js";

const READINGS = {
  evaluated: "Per cent of the feasible pairs of bins that were evaluated. Choose a cell to see its bins.",
  critical: "Per cent of the feasible pairs of bins that hold a critical scenario. Choose a cell to see its bins.",
};

export class Pairs {
  constructor({ parameters, pairs }) {
    this.parameters = parameters;
    this.reading = "evaluated";
    this.pairs = pairs;
    this.names = parameters.map((parameter, k) => this.name(parameter, k));
    this.cells = pairs.map((pair, k) => this.cell(pair, k));
    this.matrix = element("div", { class: "matrix", style: `--n: ${parameters.length - 1}` }, ...this.names);
    // Row by row, as they are read.
    const order = this.cells.map((cell, k) => k).sort((a, b) => pairs[a].of[1] - pairs[b].of[1] || pairs[a].of[0] - pairs[b].of[0]);
    this.matrix.append(...order.map((k) => this.cells[k]));
    $("matrix").replaceChildren(this.matrix);
    this.listen();
    this.read("evaluated");
    this.choose(this.telling());
    this.cells[this.chosen].tabIndex = 0;
  }

  // The pair that the scatter plot opens with, where both of it are searched.
  telling() {
    const leading = data.rows.telling.slice(0, 2).map((name) => this.parameters.findIndex((parameter) => parameter.name === name));
    return Math.max(0, this.pairs.findIndex(({ of }) => leading.includes(of[0]) && leading.includes(of[1])));
  }

  // On the diagonal: right of its row, on top of its column.
  name(parameter, k) {
    const first = k === 0 || this.parameters[k - 1].axis !== parameter.axis;
    const axis = first ? [element("small", {}, parameter.axis)] : [];
    return element("span", { class: "matrix-name", style: `--row: ${k + 1}; --column: ${k + 1}`, title: withUnit(parameter) }, parameter.name, ...axis);
  }

  cell(pair, k) {
    const [x, y] = pair.of;
    return element("button", { type: "button", class: "pair", tabindex: "-1", style: `--row: ${y + 1}; --column: ${x + 1}`, "data-row": y, "data-column": x, "data-pair": k });
  }

  listen() {
    arrowKeys(this.matrix);
    this.matrix.addEventListener("click", (event) => { if (event.target.dataset.pair) this.choose(Number(event.target.dataset.pair)); });
    this.matrix.addEventListener("keyup", (event) => {
      if (event.target.dataset.pair && /^(Arrow|Home|End)/.test(event.key)) this.choose(Number(event.target.dataset.pair));
    });
    for (const kind of ["pointerover", "focusin"]) this.matrix.addEventListener(kind, (event) => this.point(event.target.dataset.pair));
    this.matrix.addEventListener("pointerleave", () => this.point(this.chosen));
    for (const reading of Object.keys(READINGS)) $(`read-${reading}`).addEventListener("click", () => this.read(reading));
  }

  // Marks the names of a pair's parameters.
  point(k) {
    const of = this.pairs[k ?? this.chosen]?.of ?? [];
    this.names.forEach((name, i) => name.classList.toggle("on", of.includes(i)));
  }

  read(reading) {
    this.reading = reading;
    for (const one of Object.keys(READINGS)) $(`read-${one}`).setAttribute("aria-pressed", String(one === reading));
    $("pairs-note").textContent = READINGS[reading];
    $("pairs-card").dataset.reading = reading;
    this.cells.forEach((cell, k) => {
      const pair = this.pairs[k];
      cell.textContent = percent(pair[reading], pair.feasible);
      // Squared, since most pairs are nearly done: what is missing is to stand out.
      cell.style.setProperty("--share", (share(pair[reading], pair.feasible) ** (reading === "evaluated" ? 2 : 1)).toFixed(3));
      cell.setAttribute("aria-label", `${this.title(pair)}: ${this.summary(pair)}`);
    });
    if (this.chosen !== undefined) this.choose(this.chosen);
  }

  title({ of: [x, y] }) {
    return `${this.parameters[x].name} × ${this.parameters[y].name}`;
  }

  summary(pair) {
    const out = pair.total - pair.feasible;
    const rest = out ? `; ${number(out)} more ${out === 1 ? "is" : "are"} not reachable` : "";
    return `${number(pair.evaluated)} of ${number(pair.feasible)} feasible pairs of bins evaluated, ${number(pair.critical)} hold${pair.critical === 1 ? "s" : ""} a critical scenario${rest}`;
  }

  choose(k) {
    this.chosen = k;
    this.cells.forEach((cell, i) => { if (i === k) cell.setAttribute("aria-current", "true"); else cell.removeAttribute("aria-current"); });
    this.point(k);
    const pair = this.pairs[k];
    const head = [element("h4", {}, this.title(pair)), element("p", { class: "muted" }, `${this.summary(pair)}.`)];
    $("pair").replaceChildren(...head, pair.cells ? this.grid(pair) : element("p", {}, `Its ${number(pair.total)} pairs of bins are too many to draw.`));
    const cells = $("pair").querySelector(".cells");
    if (cells) arrowKeys(cells);
  }

  // The first parameter across, the second up.
  grid({ of, cells }) {
    const [x, y] = of.map((i) => this.parameters[i]);
    const [nx, ny] = [x, y].map(({ edges }) => edges.length - 1);
    const most = Math.max(...cells.evaluated);
    const drawn = [];
    for (let row = 0; row < ny; row += 1) {
      for (let column = 0; column < nx; column += 1) {
        const up = ny - 1 - row, at = column * ny + up, evaluated = cells.evaluated[at], critical = cells.critical[at];
        const amount = this.reading === "critical" ? share(critical, Math.max(1, evaluated)) : depth(evaluated, most);
        drawn.push(binCell(evaluated, critical, `${x.name} ${binRange(x, column)}, ${y.name} ${binRange(y, up)}`, row, column, amount));
      }
    }
    const dense = nx > MOST_TEXTS || ny > MOST_TEXTS;
    const label = `Bins of ${withUnit(x)} across and of ${withUnit(y)} up`;
    const body = element("div", { class: `cells${dense ? " dense" : ""}`, role: "group", "aria-label": label, style: `--nx: ${nx}; --ny: ${ny}` }, ...drawn);
    return element("div", { class: "pair-plot" },
      element("span", { class: "y-name" }, withUnit(y)), binTicks(y, "left"), body, binTicks(x, "below"), element("span", { class: "x-name" }, withUnit(x)));
  }
}
