// What the page is narrowed to: ranges of columns, and a region. The table and the charts follow.

import { criterionOf } from "./criteria_rows.js";
import { columns, rows } from "./data.js";
import { isInMode } from "./findings.js";
import { isInRegion } from "./region_rows.js";
import { elsewhereBy } from "./verdicts.js";

class Filters {
  constructor() {
    this.ranges = new Map(); // column's name → [low, high]
    this.region = null; // index in data.regions.regions
    this.mode = null; // number of a failure mode
  }

  // Of a column: numbers of the rows, null where there is none.
  values(name) {
    if (name === "cause") return rows.cause;
    return name === "critical" ? rows.critical : (columns.get(name) ?? elsewhereBy(name))?.values;
  }

  get any() {
    return this.ranges.size > 0 || this.region !== null || this.mode !== null;
  }

  // Sets or, without numbers, lifts the filter on a column.
  set(name, low = null, high = null) {
    if (!this.values(name)) return;
    if (low === null && high === null) this.ranges.delete(name);
    else this.ranges.set(name, [low ?? -Infinity, high ?? Infinity]);
    this.notify();
  }

  // The criterion, by its column, whose violations alone are shown; null where there is none.
  get violated() {
    for (const [name, [low, high]] of this.ranges) if (low === -Infinity && high === 0 && criterionOf(name)) return name;
    return null;
  }

  violating(name) {
    for (const known of [...this.ranges.keys()]) if (criterionOf(known)) this.ranges.delete(known);
    if (name === null) this.notify();
    else this.set(name, null, 0); // no margin is 0
  }

  inMode(mode) {
    this.mode = mode;
    this.notify();
  }

  inRegion(region) {
    this.region = region;
    this.notify();
  }

  clear() {
    this.ranges.clear();
    this.region = this.mode = null;
    this.notify();
  }

  passes(i) {
    for (const [name, [low, high]] of this.ranges) {
      const value = this.values(name)[i];
      if (value === null || value < low || value > high) return false;
    }
    if (this.mode !== null && !isInMode(i, this.mode)) return false;
    return this.region === null || isInRegion(i, this.region);
  }

  notify() {
    document.dispatchEvent(new CustomEvent("filters", { detail: this.ranges }));
  }
}

export const filters = new Filters();
