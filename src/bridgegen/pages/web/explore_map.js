// A map of verdicts over two parameters around the present values, computed while one looks.

import { element } from "./common.js";
import { palette } from "./colours.js";
import { quantity } from "./numbers.js";

const CELLS = 60;
const COARSE = [8, 4, 2, 1]; // strides of the passes: the whole is seen at once, then in full
const CELLS_AT_ONCE = 24; // cells, some milliseconds

/** Verdicts by what they are called, with the name of their colour. */
export const SHADES = [
  ["no conflict", "soft"], ["conflict that does not count", "plain"],
  ["near miss or violation", "critical"], ["collision", "hit"],
];

/** What the colours mean, for those of slices and map. */
export function legendOfShades() {
  return SHADES.map(([name, colour]) => {
    const dot = element("i", { "aria-hidden": "true" });
    dot.style.background = `var(--${colour})`;
    return element("span", { class: "swatch" }, dot, name);
  });
}

// Lets the page draw and hear; a timer would wait for 4 ms each time.
export function breathe() {
  return new Promise((resolve) => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = resolve;
    port2.postMessage(null);
  });
}

export class ExploreMap {
  /**
   * @param {{name: string, low: number, high: number}[]} parameters
   * @param {() => Promise<((others: Record<string, number>[]) => Promise<number[]>)[]>} ready each gives verdicts at values of two parameters, see `Simulator.verdicts`
   * @param {(values: Record<string, number>) => void} choose
   */
  constructor(parameters, ready, choose) {
    Object.assign(this, { parameters, ready, run: 0 });
    const options = () => parameters.map(({ name }) => element("option", {}, name));
    const select = (label, chosen) => {
      const made = element("select", { "aria-label": label }, ...options());
      made.selectedIndex = Math.min(chosen, parameters.length - 1);
      made.addEventListener("change", () => this.draw());
      return made;
    };
    this.x = select("parameter along the map", 0);
    this.y = select("parameter up the map", 1);
    this.canvas = element("canvas", { width: CELLS, height: CELLS, role: "img", "aria-label": "Map of verdicts; a click sets both parameters" });
    this.canvas.addEventListener("click", ({ offsetX, offsetY }) => {
      const { clientWidth, clientHeight } = this.canvas;
      choose(this.at(Math.floor((CELLS * offsetX) / clientWidth), CELLS - 1 - Math.floor((CELLS * offsetY) / clientHeight)));
    });
    this.note = element("p", { class: "muted small", role: "status" });
    this.box = element("details", { class: "map" }, element("summary", {}, "Map of two parameters"),
      element("div", { class: "controls" }, element("label", {}, "along ", this.x), element("label", {}, "up ", this.y)), this.canvas, this.note);
    this.box.addEventListener("toggle", () => this.draw());
    document.addEventListener("theme", () => this.draw());
  }

  at(i, j) {
    const value = ({ low, high }, k) => low + ((k + 0.5) / CELLS) * (high - low);
    const [x, y] = [this.x, this.y].map(({ selectedIndex }) => this.parameters[selectedIndex]);
    return { [x.name]: value(x, i), [y.name]: value(y, j) };
  }

  // In passes, each finer than the one before; a later call ends an earlier one.
  async draw() {
    const run = ++this.run;
    if (!this.box.open) return;
    const judges = await this.ready(), context = this.canvas.getContext("2d"), began = performance.now();
    let done = 0;
    for (const stride of COARSE) {
      const left = [];
      for (let j = 0; j < CELLS; j += stride) {
        for (let i = 0; i < CELLS; i += stride) if (stride === COARSE[0] || i % (2 * stride) || j % (2 * stride)) left.push([i, j]); // else of the pass before
      }
      done += left.length;
      await Promise.all(judges.map(async (judge) => {
        while (left.length) {
          const cells = left.splice(0, CELLS_AT_ONCE), verdicts = await judge(cells.map(([i, j]) => this.at(i, j)));
          if (run !== this.run) return;
          cells.forEach(([i, j], k) => {
            context.fillStyle = verdicts[k] < 0 ? palette.card : palette[SHADES[verdicts[k]][1]];
            context.fillRect(i, CELLS - j - stride, stride, stride);
          });
        }
      }));
      if (run !== this.run) return;
    }
    this.note.textContent = `${done.toLocaleString("en")} encounters in ${quantity((performance.now() - began) / 1000, "s", 2)}; the other parameters as above.`;
  }
}
