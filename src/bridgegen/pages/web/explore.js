// Other values of the chosen scenario's parameters, simulated in the page while they change.

import { $, copy, element } from "./common.js";
import { columns, data } from "./data.js";
import { boxCorners, nearestTo, stateAt } from "./geometry.js";
import { inflated } from "./inflate.js";
import { number, quantity, turned, worded } from "./numbers.js";
import { Simulator } from "./simulator.js";
import { unpack } from "./unpack.js";

const given = data.simulation;

const ROUNDED = 0.001; // m: the page holds whole millimetres

/** @type {Promise<Simulator> | null} */
let started = null;

// Compiled when it is first used, so that a page that is only read costs nothing.
function simulator() {
  started ??= (async () => {
    const [kernels, tables] = await Promise.all([inflated(given.kernels), inflated(given.data)]);
    return new Simulator(await WebAssembly.compile(kernels), given, tables);
  })();
  return started;
}

/** The row with some values, as `SearchSpace.row` completes it: derived ones follow, bounds hold. */
function completed(simulator, values) {
  const row = {}, limits = {};
  for (const part of given.space) {
    if (part.formula) { row[part.name] = simulator.evaluate(part.formula, row); continue; }
    let { low, high } = part;
    for (const [least, most] of part.bounds) {
      if (least !== null) low = Math.max(low, simulator.evaluate(least, row));
      if (most !== null) high = Math.min(high, simulator.evaluate(most, row));
    }
    if (part.whole) { low = Math.ceil(low - 1e-9); high = Math.floor(high + 1e-9); }
    high = Math.min(Math.max(high, part.low), part.high);
    limits[part.name] = [low, high];
    row[part.name] = Math.min(Math.max(values[part.name] ?? part.default, low), high);
  }
  return { row, limits };
}

// The motion of a row as a playback, with what the chosen one has of road, bodies and lamps.
function playbackOf(base, simulator, values) {
  const { steps, status } = simulator.run(values);
  const { shape } = simulator.at.record.x, [count, length] = shape;
  const rows = (name) => {
    const all = simulator.array("record", name);
    return Array.from({ length: count }, (_, e) => Array.from(all.subarray(e * length, e * length + steps)));
  };
  const made = {
    ...base, x: rows("x"), y: rows("y"), h: rows("h"), v: rows("v"), a: rows("a"), n_steps: steps, ttc: null, tried: true,
    players: undefined, conflict: null, sensed: null, course: null, plans: [], planAt: new Int32Array(steps).fill(-1), beside: [], lamps: lampsOf(base, simulator, steps),
    weather: values === base.parameters ? base.weather : [], // its words are of other values
  };
  const present = simulator.at.record.present;
  if (present.count) {
    const there = simulator.array("record", "present");
    for (const name of "xyva") made[name].forEach((row, e) => row.forEach((_, k) => { if (!there[e * length + k]) row[k] = null; }));
  }
  measure(made);
  return { made, status };
}

// Distances of the boxes, where they touch, and when they are closest.
function measure(made) {
  made.distance = new Array(made.n_steps).fill(null);
  for (let k = 0; k < made.n_steps; k++) {
    const state = stateAt({ ...made, distance: made.distance }, k), near = nearestTo(made, state);
    if (near) made.distance[k] = overlaps(made, state, near.entity) ? 0 : near.distance;
  }
  made.contacts = made.distance.flatMap((d, k) => (d === 0 && made.distance[k - 1] !== 0 ? [k] : []));
  const found = made.distance.filter((d) => d !== null);
  made.closest = found.length ? made.distance.indexOf(Math.min(...found)) : null;
}

function overlaps(made, { entities }, other) {
  const boxes = [0, other].map((e) => boxCorners(made.entities[e], entities[e].x, entities[e].y, entities[e].h));
  return [entities[0].h, entities[other].h].every((h) => [[Math.cos(h), Math.sin(h)], [-Math.sin(h), Math.cos(h)]].every(([ux, uy]) => {
    const [own, its] = boxes.map((box) => box.map(([x, y]) => x * ux + y * uy));
    return Math.max(...own) >= Math.min(...its) && Math.max(...its) >= Math.min(...own);
  }));
}

function lampsOf(base, simulator, steps) {
  const { shape } = simulator.at.record.lights, states = simulator.array("record", "lights");
  return base.lamps.map((lamp, i) => {
    const changes = [];
    for (let k = 0; i < shape[0] && k < steps; k++) {
      const now = states[i * shape[1] + k];
      if (!changes.length || changes[changes.length - 1][1] !== now) changes.push([k, now]);
    }
    return { ...lamp, changes };
  });
}

/** Whether the page simulates; not where it only says why it cannot. */
export const simulates = Boolean(given && !given.refused);

/** @type {Promise<Float64Array> | null} */
let exact = null;

/** The values of a row of the page, with all their bits. */
async function exactValues(i) {
  exact ??= inflated(given.rows.data).then((bytes) => new Float64Array(bytes.buffer));
  const { names } = given.rows, all = await exact;
  return Object.fromEntries(names.map((name, j) => [name, all[i * names.length + j]]));
}

/** A row of the page, simulated; null if it cannot be. Without one that is exported there is no road to show it on. */
export async function simulated(i, facts) {
  const [base] = data.kept;
  if (!simulates || !base) return null;
  const kernels = await simulator(), values = await exactValues(i);
  if (!agrees(kernels)) return null;
  const row = { ...completed(kernels, values).row, ...values };
  const { made, status } = playbackOf(unpack(base), kernels, row);
  return status === 0 ? { ...made, ...facts, tried: false, parameters: row, picture: null } : null;
}

/** @type {boolean | null} */
let isSame = null;

// Whether the page simulates what the run recorded: kernels that have changed since must not pass for the run's.
function agrees(kernels) {
  if (isSame !== null || !data.kept.length) return isSame ?? true;
  const base = unpack(data.kept[0]), { made } = playbackOf(base, kernels, base.parameters);
  isSame = made.n_steps === base.n_steps && [..."xy"].every((name) => made[name].every((row, e) => row.every((value, k) => {
    const recorded = base[name][e][k];
    return value === recorded || (value !== null && recorded !== null && Math.abs(value - recorded) < ROUNDED);
  })));
  return isSame;
}

export class Explorer {
  /** @param {import("./player.js").Player} player */
  constructor(player) {
    this.player = player;
    this.box = $("explore");
    if (given) this.box.hidden = false;
  }

  // The sliders, at a scenario's values.
  show(kept) {
    if (!given || kept.tried) return;
    this.base = kept;
    if (given.refused) return this.refuse(given.refused);
    this.values = { ...kept.parameters };
    this.sliders = new Map();
    const lines = given.space.filter(({ searched, name }) => searched && !given.unused.includes(name)).map((part) => this.slider(part));
    this.said = element("p", { class: "tried", role: "status" }, "Try other values: move a slider.");
    const button = (text, act, title) => {
      const made = element("button", { type: "button", class: "quiet", title }, text);
      made.addEventListener("click", act);
      return made;
    };
    this.box.replaceChildren(
      element("div", { class: "said" }, this.said, element("div", { class: "presets" },
        button("As found", () => this.set(this.base.parameters), "The values of the chosen scenario"),
        button("Defaults", () => this.set(Object.fromEntries(given.space.map((part) => [part.name, part.default]))), "The scenario's own defaults"),
        button("Copy values", (event) => this.copy(event.currentTarget), "The values, as options of bridgegen draw and search"))),
      element("div", { class: "sliders" }, ...lines));
  }

  refuse(why) {
    this.box.replaceChildren(element("p", { class: "muted small" }, `Its motion is replayed, not simulated here: ${why}.`));
  }

  slider(part) {
    const column = columns.get(part.name), text = element("output", {});
    const range = element("input", { type: "range", min: part.low, max: part.high, step: part.whole ? 1 : (part.high - part.low) / 1000, "aria-label": part.name });
    range.addEventListener("input", () => this.set({ ...this.values, [part.name]: Number(range.value) }, part.name));
    this.sliders.set(part.name, { range, text, column });
    const label = element("label", { title: column?.description ?? "" }, element("span", { class: "name" }, part.name), text, range);
    this.write(part.name, this.values[part.name]);
    return label;
  }

  write(name, value, moving = false) {
    const { range, text, column } = this.sliders.get(name);
    if (!moving) range.value = value;
    text.textContent = worded(value, column) ?? quantity(turned(value, column), column?.unit ?? "");
  }

  // Simulates the values; one at a time, and the last ones in the end.
  async set(values, moved = "") {
    this.values = values;
    if (this.busy) return;
    this.busy = true;
    try {
      const kernels = await simulator(); // the first time some 50 ms
      if (!agrees(kernels)) return this.refuse("the kernels of this page give another motion than the run recorded");
      const { row } = completed(kernels, this.values);
      for (const name of this.sliders.keys()) this.write(name, row[name], name === moved && row[name] === Number(this.sliders.get(name).range.value));
      const { made, status } = playbackOf(this.base, kernels, row);
      this.row = row;
      if (status < 0) this.said.textContent = "Not simulated here: it needs a way that this page does not hold.";
      else if (status > 0) this.said.textContent = "These values make no scenario.";
      else this.tell(made);
    } finally {
      this.busy = false;
    }
    if (values !== this.values) await this.set(this.values, moved);
  }

  tell(made) {
    const seconds = (k) => `${(k * made.time_step).toFixed(2)}\u00a0s`;
    const [contact] = made.contacts;
    this.said.classList.toggle("hit", contact !== undefined);
    if (contact !== undefined) {
      const near = nearestTo(made, stateAt(made, contact));
      this.said.textContent = `Collision with ${made.entities[near.entity].name} at ${seconds(contact)}, ego at ${quantity(made.v[0][contact], "m/s")}.`;
    } else if (made.closest !== null) this.said.textContent = `No collision; closest ${quantity(made.distance[made.closest], "m")} at ${seconds(made.closest)}.`;
    else this.said.textContent = "No collision.";
    this.player.swap(made);
  }

  copy(button) {
    const row = this.row ?? this.values;
    copy([...this.sliders.keys()].map((name) => `--fix ${name}=${number(row[name])}`).join(" "), button);
  }
}
