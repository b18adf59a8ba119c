// Simulates rows of a storyboard: the kernels that Python runs, as WebAssembly, with the same bits.
//
// `tables` is what `portable.tables` made: bundles of arrays, and how a row's state follows from its values.

export class Simulator {
  // Constants are the class's own: its text alone makes a worker, see explore_workers.js.
  static STACK = 1 << 20; // bytes below the arrays, for the module's stack
  static SIZE = { f8: 8, i8: 8, u8: 8, i1: 1, b1: 1 };
  static VIEWS = { f8: Float64Array, i8: BigInt64Array, u8: BigUint64Array, i1: Int8Array, b1: Uint8Array };
  static NUMBER = new Float64Array(1);
  static BITS = new BigUint64Array(Simulator.NUMBER.buffer);

  // What a formula's operators do; those of IEEE 754 are the same everywhere, functions are the module's.
  static OPERATORS = {
    "+": (a, b) => a + b, "-": (a, b) => a - b, "*": (a, b) => a * b, "/": (a, b) => a / b, neg: (a) => -a,
    "%": (a, b) => { const rest = a % b; return rest && (rest < 0) !== (b < 0) ? rest + b : rest; },
    "<": (a, b) => a < b, "<=": (a, b) => a <= b, ">": (a, b) => a > b, ">=": (a, b) => a >= b,
    "==": (a, b) => a === b, "!=": (a, b) => a !== b,
    and: (...parts) => parts.every(Boolean), or: (...parts) => parts.some(Boolean), not: (a) => !a,
    abs: Math.abs, ceil: Math.ceil, floor: Math.floor, max: Math.max, min: Math.min, sign: Math.sign, sqrt: Math.sqrt,
    round: (a) => Math.floor(a) + (a - Math.floor(a) >= 0.5 ? 1 : 0),
  };
  static RENAMED = { "**": "power" };

  /**
   * @param {WebAssembly.Module} module
   * @param {any} tables
   * @param {Uint8Array} data the tables' data, inflated
   */
  constructor(module, tables, data) {
    this.module = module;
    this.tables = tables;
    this.data = data;
    this.memory = new WebAssembly.Memory({ initial: 64, maximum: 4096 });
    const { exports } = new WebAssembly.Instance(module, { env: {
      __linear_memory: this.memory,
      __stack_pointer: new WebAssembly.Global({ value: "i32", mutable: true }, Simulator.STACK),
      __indirect_function_table: new WebAssembly.Table({ initial: 256, element: "anyfunc" }),
      fmod: (a, b) => a % b, // exact, as the processor's
    } });
    this.exports = exports;
    this.codes = new Set(tables.codes);
    this.unset = new Set(tables.unset);
    this.numbers = new Map(tables.functions.map((name, i) => [name, i]));
    this.words = Object.entries(tables.noise.words ?? {}).map(([name, word]) => [name, BigInt(word)]);
    this.top = Simulator.STACK;
    this.at = {};
    this.initial = {};
    this.bundles = {};
    for (const name of ["plan", "roads", "state", "record", "facts", "measuring", "verdict"]) this.bundles[name] = this.put(tables[name], name);
    this.records = new Map();
    this.keepRecord();
    this.driver = tables.driver;
    this.heap = this.top;
    const [count, length] = this.at.record.x.shape;
    this.take((1 << 18) + 256 * count * length); // metrics of perception need most: some lists of all detections
  }

  /** A place for some bytes, which move nowhere. */
  take(bytes) {
    const at = (this.top + 15) & ~15;
    this.top = at + bytes;
    const lack = this.top - this.memory.buffer.byteLength;
    if (lack > 0) this.memory.grow(Math.ceil(lack / 65536));
    return at;
  }

  // A bundle is a number of 8 bytes, or an array: two unused pointers, counts, where it lies, shape and strides.
  put(bundle, name) {
    const arrays = (this.at[name] = {});
    const own = bundle.filter((part) => part.length > 3), isFilled = ([field]) => name === "record" && this.unset.has(field); // by each row; so those lie last
    const from = this.take(0);
    let to = from;
    for (const part of [...own.filter((one) => !isFilled(one)), ...own.filter(isFilled)]) {
      const [field, kind, shape, begin] = part, count = shape.reduce((a, b) => a * b, 1), size = count * Simulator.SIZE[kind], at = this.take(size + 8);
      if (begin >= 0) new Uint8Array(this.memory.buffer).set(this.data.subarray(begin, begin + size), at);
      arrays[field] = { kind, count, shape, place: at };
      if (!isFilled(part)) to = at + size;
    }
    const place = this.take(bundle.reduce((sum, part) => sum + (part.length === 3 ? 8 : 32 + 16 * part[2].length), 0));
    const view = new DataView(this.memory.buffer);
    let at = place;
    const whole = (value, where) => view.setBigInt64(where, BigInt(value), true);
    bundle.forEach((part) => {
      if (part.length === 3) {
        const [field, value, isReal] = part;
        if (field === "driver_code") this.code = at;
        if (isReal) view.setFloat64(at, value, true);
        else whole(this.codes.has(field) && value ? this.exports.address(value) : value, at);
        at += 8;
        return;
      }
      const [field, kind, shape] = part, { count, place: begin } = arrays[field];
      whole(count, at + 8);
      whole(Simulator.SIZE[kind], at + 16);
      view.setInt32(at + 24, begin, true);
      at += 32;
      for (const length of shape) { whole(length, at); at += 8; }
      let stride = Simulator.SIZE[kind];
      const strides = shape.map((_, axis) => shape.slice(axis + 1).reduce((a, b) => a * b, stride));
      for (const each of strides) { whole(each, at); at += 8; }
    });
    if (name === "plan") {
      for (const field of this.codes) {
        const array = arrays[field];
        if (array) for (let i = 0; i < array.count; i++) { const code = Number(view.getBigInt64(array.place + 8 * i, true)); whole(code ? this.exports.address(code) : 0, array.place + 8 * i); }
      }
    }
    this.initial[name] = { from, bytes: new Uint8Array(this.memory.buffer).slice(from, to) };
    return place;
  }

  // One copy for all arrays: a row is short.
  reset(name) {
    const { from, bytes } = this.initial[name];
    new Uint8Array(this.memory.buffer).set(bytes, from);
  }

  keepRecord() {
    this.records.set(String(this.at.record.detections.shape), { at: this.at.record, place: this.bundles.record, initial: this.initial.record });
  }

  /** Puts another driver that ships at the wheel; one that perceives records its detections. */
  choose(driver) {
    if (driver === this.driver) return;
    const { code, detections } = this.tables.drivers[driver], shape = String(detections);
    if (!this.records.has(shape)) {
      const record = this.tables.record.map((part) => (part[0] === "detections" ? [part[0], part[1], detections, -1] : part));
      this.bundles.record = this.put(record, "record");
      this.keepRecord();
    }
    ({ at: this.at.record, place: this.bundles.record, initial: this.initial.record } = this.records.get(shape));
    new DataView(this.memory.buffer).setBigInt64(this.code, BigInt(this.exports.address(code)), true);
    this.driver = driver;
  }

  /** An array of a bundle, as long as no memory is added. */
  array(name, field) {
    const one = this.at[name][field];
    if (one.view?.buffer !== this.memory.buffer) one.view = new Simulator.VIEWS[one.kind](this.memory.buffer, one.place, one.count);
    return one.view;
  }

  /** The value of a formula of named values, with the bits that Python gets. */
  evaluate(formula, values) {
    if (typeof formula === "number") return formula;
    if (typeof formula === "string") return values[formula];
    const [operator, ...parts] = formula;
    if (operator === "if") return this.evaluate(parts[this.evaluate(parts[0], values) ? 1 : 2], values);
    if (operator === "lookup") return parts[1 + values[parts[0]]];
    const given = parts.map((part) => this.evaluate(part, values));
    if (Simulator.OPERATORS[operator]) return Simulator.OPERATORS[operator](...given);
    return this.call(Simulator.RENAMED[operator] ?? operator, given[0], given[1]);
  }

  call(name, x, y = 0) {
    return this.exports.function(this.numbers.get(name), x, y);
  }

  /** The row with some values, as `SearchSpace.row` completes it: derived ones follow, bounds hold. */
  complete(values) {
    const row = {};
    for (const part of this.tables.space) {
      if (part.formula) { row[part.name] = this.evaluate(part.formula, row); continue; }
      let { low, high } = part;
      for (const [least, most] of part.bounds) {
        if (least !== null) low = Math.max(low, this.evaluate(least, row));
        if (most !== null) high = Math.min(high, this.evaluate(most, row));
      }
      if (part.whole) { low = Math.ceil(low - 1e-9); high = Math.floor(high + 1e-9); }
      high = Math.min(Math.max(high, part.low), part.high);
      row[part.name] = Math.min(Math.max(values[part.name] ?? part.default, low), high);
    }
    return row;
  }

  /**
   * Simulates a row. Its record then lies in the arrays of "record", until the next one.
   * @param {Record<string, number>} values by parameter
   * @returns {{steps: number, status: number}} real instants, and a status; −1: a way is missing, so it ended early
   */
  run(values) {
    const { tables } = this, known = { ...tables.parameters };
    for (const name of Object.keys(known)) if (name in values) known[name] = values[name];
    this.reset("state");
    this.reset("record");
    const slots = this.array("state", "slots");
    tables.slots.forEach((slot, i) => { slots[i] = this.evaluate(slot, known); });
    const { station, aside } = tables, along = this.array("state", "station"), across = this.array("state", "aside");
    station.slots.forEach((slot, e) => { along[e] = this.station(slots[Math.max(slot, 0)], station.pieces[e]); });
    aside.slots.forEach((slot, e) => { across[e] = slot >= 0 ? aside.each[e] * slots[slot] : 0; });
    this.array("state", "key")[0] = this.key(known);
    this.exports.simulate(this.bundles.plan, this.bundles.roads, this.bundles.state, this.bundles.record, this.heap);
    const ending = this.array("state", "ending");
    return { steps: Number(ending[0]), status: Number(ending[1]) };
  }

  // Where along its path starts who starts at s along its road; the sum is grouped as NumPy's.
  station(s, pieces) {
    const away = ({ low, high }) => Math.max(low - s, s - high, 0);
    const piece = pieces.length > 1 ? pieces.reduce((best, one) => (away(one) < away(best) ? one : best)) : pieces[0];
    if (!piece.nodes) return piece.first + piece.each * s;
    const { nodes, travelled, direction, entry, start, t: [a, b, c, d], curvature: [bend, rate] } = piece;
    const distance = (s - piece.s) * direction, within = Math.min(Math.max(distance, 0), nodes[nodes.length - 1]);
    const cell = Math.max(nodes.slice(0, -1).findLastIndex((node) => node <= within), 0), width = within - nodes[cell];
    const parts = piece.quadrature.map((node, i) => {
      const local = entry + direction * (nodes[cell] + width * node), aside = a + local * (b + local * (c + local * d));
      return this.call("hypot", 1 - (bend + rate * (start + local)) * aside, b + local * (2 * c + local * 3 * d)) * piece.weights[i];
    });
    while (parts.length > 1) parts.splice(0, parts.length, ...parts.flatMap((part, i) => (i % 2 ? [] : [part + parts[i + 1]])));
    return piece.first + (travelled[cell] + width * parts[0] + (distance - within));
  }

  /** Judges the row that was simulated last; what is found then lies in the arrays of "verdict". */
  judge(steps, status) {
    const { facts, record, verdict } = this.bundles;
    const path = Number(this.array("state", "on")[0]), friction = this.array("state", "weather")[this.tables.friction];
    this.exports.judge(steps, status, path, friction, facts, record, verdict);
  }

  /** Why the traffic of the row judged last is implausible; "" if it is not. */
  implausible(steps) {
    const { facts, measuring, record, verdict } = this.bundles;
    return this.tables.judged.implausible[this.exports.implausible(steps, facts, measuring, record, verdict, this.heap)];
  }

  /** The metrics of the row judged last, which did not fail: name, unit and value of each. */
  metrics(steps) {
    const { facts, measuring, record, verdict } = this.bundles, best = this.decisive(false), seen = this.at.record.detections.count > 0;
    return this.tables.judged.metrics.filter(([, , , sees]) => seen || !sees).map(([name, unit, at]) => {
      if (typeof at === "number") return [name, unit, this.exports.measure(at, steps, facts, measuring, record, verdict, this.heap)];
      return [name, unit, best ? this.array("verdict", at[0])[best.e * at[1]] : 0]; // of the conflict that decides
    });
  }

  /**
   * The conflict of the row judged last that decides, as `harm.decisive` has it; null if there is none.
   * @param {boolean} any whether conflicts count for which the ego is not responsible
   */
  decisive(any) {
    const { columns, kinds, harm } = this.tables.judged, { whole: { shape: [count, width] }, real: { shape: [, wide] } } = this.at.verdict;
    const [whole, real, fault, breach, potential] = ["whole", "real", "at_fault", "breach", "potential"].map((name) => this.array("verdict", name));
    const read = (e, column) => Number(whole[e * width + columns[column]]);
    let best = null;
    for (let e = 0; e < count; e++) {
      const kind = kinds[read(e, "kind")], [ttc, needed, nearness] = ["ttc", "needed", "nearness"].map((name) => real[e * wide + columns[name]]);
      const urgent = (1 - Math.min(ttc, harm.horizon) / harm.horizon) * (1 - this.call("exp", -needed / harm.serious));
      const worth = (share) => harm.near + (1 - harm.near) * (this.call("log", 1 + (share * potential[e]) / harm.light) / this.call("log", 1 + 1 / harm.light));
      const partly = (share) => harm.course + (harm.near - harm.course) * share;
      const touches = kind === "contact", happens = touches || kind === "near miss", violates = kind === "violation";
      let value = happens ? worth(touches ? 1 : harm.nearly * urgent) : kind && ttc < Infinity ? partly(urgent) : harm.course * nearness;
      if (e === 0 || (happens && !any && !fault[e])) value = 0;
      if (violates) value = Math.max(value, breach[e] < 1 ? partly(breach[e]) : worth(harm.violates));
      const order = e === 0 && !violates ? -1 : value + (value >= harm.course ? 4 + Number(touches) : read(e, "kind"));
      if (!best || order > best.order) best = { e, kind, order, read, counts: violates ? breach[e] >= 1 : any || Boolean(fault[e]) };
    }
    return best.kind && best.kind !== "collision course" ? best : null;
  }

  /**
   * Numbers of verdicts on rows: −1 none (the row fails, or the search leaves it out as implausible), 0 no conflict, 1 one that does not count, 2 one that does, 3 a collision.
   * @param {{driver: string, any: boolean, values: Record<string, number>, others: Record<string, number>[]}} asked rows are `values` with each of `others`
   */
  verdicts({ driver, any, values, others }) {
    this.choose(driver);
    return others.map((other) => {
      const { steps, status } = this.run(this.complete({ ...values, ...other }));
      if (status !== 0) return -1;
      this.judge(steps, status);
      if (this.tables.judged.gated && this.implausible(steps)) return -1;
      const found = this.decisive(any);
      return !found ? 0 : !found.counts ? 1 : found.kind === "contact" ? 3 : 2;
    });
  }

  // The key of a row's random numbers: SplitMix64 over the bits of its values.
  key(values) {
    const { noise } = this.tables;
    if (noise.key) return BigInt(noise.key);
    let key = 0n;
    for (const [name, word] of this.words) {
      Simulator.NUMBER[0] = values[name] + 0;
      key = Simulator.mix(Simulator.mix(key ^ word) + Simulator.BITS[0]);
    }
    return key;
  }

  // Words of 64 bits, which engines keep in registers where `asUintN` says so.
  static mix(word) {
    let mixed = BigInt.asUintN(64, word + 0x9E3779B97F4A7C15n);
    mixed = BigInt.asUintN(64, (mixed ^ (mixed >> 30n)) * 0xBF58476D1CE4E5B9n);
    mixed = BigInt.asUintN(64, (mixed ^ (mixed >> 27n)) * 0x94D049BB133111EBn);
    return mixed ^ (mixed >> 31n);
  }
}
