// Other values of the chosen scenario's parameters, simulated in the page while they change.

import { $, copy, element } from "./common.js";
import { SHADES, breathe, ExploreMap, legendOfShades } from "./explore_map.js";
import { workers } from "./explore_workers.js";
import { columns, data } from "./data.js";
import { inflated } from "./inflate.js";
import { quantity, shareText, turned, worded } from "./numbers.js";
import { download } from "./save.js";
import { Simulator } from "./simulator.js";
import { fileOf, shellWord } from "./storyboard.js";
import { unpack } from "./unpack.js";

const given = data.simulation;

const ROUNDED = 0.001; // m: the page holds whole millimetres
const SLICE = 60; // verdicts along a slider
const REST = 150; // ms without a change before slices are drawn

/** @type {Promise<Simulator> | null} */
let started = null;

/** @type {Promise<((asked: any) => Promise<number[]>)[]> | null} */
let helpers = null;

// Compiled when it is first used, so that a page that is only read costs nothing.
function simulator() {
  started ??= (async () => {
    const [kernels, tables] = await Promise.all([inflated(given.kernels), inflated(given.data)]);
    return new Simulator(await WebAssembly.compile(kernels), given, tables);
  })();
  return started;
}

// The motion of a row as a playback, with what the chosen one has of road, bodies and lamps.
function playbackOf(base, simulator, values) {
  const { steps, status } = simulator.run(values);
  const { shape } = simulator.at.record.x, [count, length] = shape;
  // Where traffic drives on the left, what is simulated is its mirror image.
  const rows = (name, side = 1) => {
    const all = simulator.array("record", name);
    return Array.from({ length: count }, (_, e) => Array.from(all.subarray(e * length, e * length + steps), (value) => side * value));
  };
  const made = {
    ...base, x: rows("x"), y: rows("y", labels.side), h: rows("h", labels.side), v: rows("v"), a: rows("a"), n_steps: steps, ttc: null, tried: true,
    players: undefined, conflict: null, distance: null, sensed: null, course: null, plans: [], planAt: new Int32Array(steps).fill(-1), beside: [], lamps: lampsOf(base, simulator, steps),
    weather: values === base.parameters ? base.weather : [], // its words are of other values
  };
  const present = simulator.at.record.present;
  if (present.count) {
    const there = simulator.array("record", "present");
    for (const name of "xyva") made[name].forEach((row, e) => row.forEach((_, k) => { if (!there[e * length + k]) row[k] = null; }));
  }
  judge(made, simulator, status);
  return { made, status };
}

// Distances, contacts and the decisive conflict, as the search judges them.
function judge(made, simulator, status) {
  simulator.judge(made.n_steps, status);
  const [count, length] = simulator.at.verdict.distance.shape, apart = simulator.array("verdict", "distance");
  made.distance = made.x[0].map((_, k) => {
    let least = Infinity;
    for (let e = 1; e < count; e++) least = Math.min(least, apart[e * length + k]);
    return least < Infinity ? least : null;
  });
  made.contacts = made.distance.flatMap((d, k) => (d === 0 && made.distance[k - 1] !== 0 ? [k] : []));
  const closest = Number(simulator.array("verdict", "instants")[1]);
  made.closest = closest < 0 ? null : closest;
  made.conflict = conflictOf(made, simulator);
}

const labels = given?.judged;
const harmsAny = data.summary.harm === "harm_any";

// What the search would also look at, and the page does not compute.
function limits() {
  const { alone, criteria, unmeasured } = given.judged, left = [...(criteria && alone ? ["pass criteria"] : []), ...unmeasured];
  const rule = alone ? "" : `Conflicts only, none of which is called a failure here: in this run critical means ${data.summary.critical_rule}, which the page does not compute. `;
  return `${rule}${left.length ? `Not computed here: ${left.join(", ")}.` : ""}`;
}

function conflictOf(made, simulator) {
  const best = simulator.decisive(harmsAny);
  if (!best) return null;
  const { e, kind, counts, read } = best, words = (list, column) => labels[list][read(e, column)] ?? "";
  return {
    conflict: kind, counts, type: words("types", "type"), responsible: words("responsible", "responsible"), rule: words("rules", "rule"),
    partner: e ? made.entities[e].name : "", partner_number: e, instant: read(e, "instant"), decided: read(e, "decided"),
    zones: [labels.zones[read(e, "zone_ego")], labels.zones[read(e, "zone_other")]], severity: simulator.array("verdict", "severity")[e],
  };
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
const simulates = Boolean(given && !given.refused);

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
  kernels.choose(given.driver);
  const row = { ...kernels.complete(values), ...values };
  const { made, status } = playbackOf(unpack(base), kernels, row);
  return status === 0 ? { ...made, ...facts, tried: false, parameters: row, picture: null } : null;
}

/** @type {boolean | null} */
let isSame = null;

// Whether the page simulates what the run recorded: kernels that have changed since must not pass for the run's.
function agrees(kernels) {
  if (isSame !== null || !data.kept.length) return isSame ?? true;
  kernels.choose(given.driver);
  const base = unpack(data.kept[0]), { made } = playbackOf(base, kernels, base.parameters);
  isSame = made.n_steps === base.n_steps && [..."xy"].every((name) => made[name].every((row, e) => row.every((value, k) => {
    const recorded = base[name][e][k];
    return value === recorded || (value !== null && recorded !== null && Math.abs(value - recorded) < ROUNDED);
  })));
  return isSame;
}

export class Explorer {
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
    this.row = null;
    this.slicing = 0;
    this.driver = given.driver;
    this.sliders = new Map();
    const lines = given.space.filter(({ searched, name }) => searched && !given.unused.includes(name)).map((part) => this.slider(part));
    this.said = element("p", { class: "tried", role: "status" }, "Try other values: move a slider.");
    this.closest = element("summary", {});
    this.metrics = element("div", { class: "details" });
    this.figures = element("details", { class: "small", hidden: true }, this.closest, this.metrics);
    const button = (text, act, title) => {
      const made = element("button", { type: "button", class: "quiet", title }, text);
      made.addEventListener("click", act);
      return made;
    };
    const drivers = Object.keys(given.drivers), sliders = element("div", { class: "sliders" }, ...lines);
    for (const type of ["pointerenter", "focusin"]) sliders.addEventListener(type, () => { if (!this.slicing) void this.slices(); });
    this.box.replaceChildren(
      element("div", { class: "said" }, this.said, element("div", { class: "presets" },
        ...(drivers.length > 1 ? [this.drivers(drivers)] : []), button("As found", () => this.set(this.base.parameters), "The values of the chosen scenario"),
        button("Defaults", () => this.set(Object.fromEntries(given.space.map((part) => [part.name, part.default]))), "The scenario's own defaults"),
        button("Copy command", (event) => this.copy(event.currentTarget), "The command line that simulates what is shown, to the last bit"), ...this.savers(button))),
      this.figures, sliders, element("p", { class: "legend" }, ...legendOfShades()), element("p", { class: "muted small" }, limits()));
    if (given.file.refused) this.box.append(element("p", { class: "muted small" }, `What is shown is not saved as a file here: ${given.file.refused}.`));
    if (this.sliders.size > 1) this.addMap();
  }

  refuse(why) {
    this.box.replaceChildren(element("p", { class: "muted small" }, `Its motion is replayed, not simulated here: ${why}.`));
  }

  // The driver at the wheel: the run's, or another one that ships.
  drivers(names) {
    const made = element("select", { "aria-label": "Driver", title: "Another driver in the same encounter" }, ...names.map((name) => element("option", { value: name }, name)));
    made.value = given.driver;
    made.addEventListener("change", () => { this.driver = made.value; this.set(this.values); });
    return made;
  }

  // What gives verdicts on rows around the present one: a worker for each core, else the page itself.
  async judges() {
    const kernels = await simulator(), own = async (asked) => { await breathe(); return kernels.verdicts(asked); };
    helpers ??= workers(kernels);
    const found = await helpers;
    return (found.length ? found : [own]).map((judge) => (others) => judge({ driver: this.driver, any: harmsAny, values: this.values, others }));
  }

  // Below each slider, the verdicts along it while the others stay; a later call ends an earlier one.
  async slices() {
    const run = ++this.slicing, left = [...this.sliders];
    if (!agrees(await simulator())) return;
    const judges = await this.judges();
    await Promise.all(judges.map(async (judge) => {
      while (left.length && run === this.slicing) {
        const [name, { range, strip }] = left.shift(), low = Number(range.min), high = Number(range.max), cells = Math.min(SLICE, range.step === "1" ? high - low + 1 : SLICE);
        const verdicts = await judge(Array.from({ length: cells }, (_, k) => ({ [name]: low + ((high - low) * k) / Math.max(1, cells - 1) })));
        if (run !== this.slicing) return;
        const stops = verdicts.map((verdict, k) => `var(--${verdict < 0 ? "card" : SHADES[verdict][1]}) ${(100 * k) / cells}% ${(100 * (k + 1)) / cells}%`);
        strip.style.background = `linear-gradient(to right, ${stops.join(", ")})`;
      }
    }));
  }

  addMap() {
    const parts = given.space.filter(({ name }) => this.sliders.has(name));
    // First those that the failures differ in most from other rows.
    const telling = data.rows.telling.filter((name) => this.sliders.has(name));
    parts.sort((a, b) => (telling.indexOf(a.name) + 1 || 99) - (telling.indexOf(b.name) + 1 || 99));
    this.map = new ExploreMap(parts, () => this.judges(), (values) => this.set({ ...this.values, ...values }));
    this.box.append(this.map.box);
  }

  slider(part) {
    const column = columns.get(part.name), text = element("output", {});
    const range = element("input", { type: "range", min: part.low, max: part.high, step: part.whole ? 1 : (part.high - part.low) / 1000, "aria-label": part.name });
    range.addEventListener("input", () => this.set({ ...this.values, [part.name]: Number(range.value) }, part.name));
    const strip = element("i", { class: "strip", "aria-hidden": "true" });
    this.sliders.set(part.name, { range, text, strip, column });
    const label = element("label", { title: column?.description ?? "" }, element("span", { class: "name" }, part.name), text, range, strip);
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
      kernels.choose(this.driver);
      const row = kernels.complete(this.values);
      for (const name of this.sliders.keys()) this.write(name, row[name], name === moved && row[name] === Number(this.sliders.get(name).range.value));
      const { made, status } = playbackOf(this.base, kernels, row);
      this.row = row;
      this.figures.hidden = status !== 0;
      if (status < 0) this.said.textContent = "Not simulated here: it needs a way that this page does not hold.";
      else if (status > 0) this.said.textContent = "These values make no scenario.";
      else this.tell(made, kernels);
      if (status >= 0) setTimeout(() => { if (row === this.row) void this.slices(); }, REST);
      if (!(moved && [this.map?.x.value, this.map?.y.value].includes(moved))) this.map?.draw();
    } finally {
      this.busy = false;
    }
    if (values !== this.values) await this.set(this.values, moved);
  }

  // Of the row that the kernels judged last.
  tell(made, kernels) {
    const seconds = (k) => `${(k * made.time_step).toFixed(2)}\u00a0s`, found = made.conflict;
    const { alone, gated } = given.judged, reason = kernels.implausible(made.n_steps);
    const fails = Boolean(found?.counts && alone && !(gated && reason));
    this.said.classList.toggle("hit", fails);
    const least = made.closest === null ? "" : `; closest ${quantity(made.distance[made.closest], "m")} at ${seconds(made.closest)}`;
    let text = `${this.driver}: no conflict${least}.`;
    if (found) {
      const whom = found.partner ? ` with ${found.partner}` : "", severe = found.conflict === "contact" ? `, MAIS3+ ${shareText(found.severity)}` : "";
      const named = found.conflict === "contact" ? "collision" : found.conflict;
      text = `${fails ? `${this.driver} FAILS: ` : ""}${named}${whom} at ${seconds(found.instant)}: ${[found.type, found.rule].filter(Boolean).join(", ")}; responsible: ${found.responsible}${severe}${fails || !alone ? "" : ". Not counted"}.`;
      found.sentence = found.bare = text;
    }
    this.said.textContent = reason ? `implausible: ${reason}${gated ? "; the search leaves it out" : ""}. ${text}` : text;
    this.measure(kernels.metrics(made.n_steps));
    this.player.swap(made);
  }

  // The metrics as a list, which is folded to the two that all runs have.
  measure(metrics) {
    const shown = metrics.map(([name, unit, value]) => [name, quantity(Number.isFinite(value) ? value : null, unit)]);
    this.closest.textContent = shown.filter(([name]) => ["d_min", "v_d"].includes(name)).map((pair) => pair.join(" ")).join(", ");
    this.metrics.replaceChildren(...shown.map(([name, text]) => element("div", { title: columns.get(name)?.description ?? "" }, element("span", { class: "name" }, name), element("b", {}, text))));
  }

  // All values of what is shown, derived ones among them.
  async shown() {
    return this.row ?? { ...(await simulator()).complete(this.values), ...this.values };
  }

  async copy(button) {
    const row = await this.shown(), [own, others] = given.commands;
    const begun = this.driver === given.driver ? own : `${others} --ego ${shellWord(this.driver)}`;
    const fixed = given.space.filter(({ name, formula }) => !formula && !given.unused.includes(name));
    copy([begun, ...fixed.map(({ name }) => `--fix ${shellWord(`${name}=${row[name]}`)}`)].join(" "), button);
  }

  // Buttons that save the scenario file of what is shown, and the map that it names.
  savers(button) {
    const { file } = given;
    if (file.refused) return [];
    const save = async () => {
      const kernels = await simulator(), row = await this.shown(), template = new TextDecoder().decode(await inflated(file.template));
      if (this.driver !== given.driver && !file.drivers) this.said.textContent = "The file states the ideal stages of the run's own driver: choose that one to save it.";
      else download(new Blob([fileOf(template, file.holes, (...asked) => kernels.evaluate(...asked), row, this.driver)]), `${file.stem}.xosc`);
    };
    return [
      button("Save .xosc", save, "The scenario file of what is shown, as the search exports it; its map is beside it"),
      button("Save map", async () => download(new Blob([await inflated(file.road)]), `${file.stem}.xodr`), "The OpenDRIVE file that the scenario file names"),
    ];
  }
}
