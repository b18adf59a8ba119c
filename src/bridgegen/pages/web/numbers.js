// Numbers as people read them.

import { NARROW } from "./common.js";
import { columns } from "./data.js";

// A share of 1 in per cent, with two significant digits.
export function shareText(value) {
  if (value === null || value === undefined) return "–";
  const p = 100 * value;
  return `${p === 0 || p >= 10 ? Math.round(p) : p >= 0.1 ? p.toPrecision(2) : p.toPrecision(1)}${NARROW}%`;
}

export function number(value, digits = 4) {
  if (value === null || value === undefined) return "–";
  if (value < 0) return `−${number(-value, digits)}`;
  if (value !== 0 && (Math.abs(value) < 1e-3 || Math.abs(value) >= 1e6)) return value.toExponential(2);
  if (Number.isInteger(value)) return value.toLocaleString("en-GB");
  const whole = Math.max(1, Math.floor(Math.log10(Math.abs(value))) + 1);
  return value.toFixed(Math.max(0, Math.min(3, digits - whole)));
}

export function unitText(unit) {
  return { "": "", 1: "", "-": "", "–": "", count: "", deg: "°", "m/s^2": "m/s²" }[unit] ?? unit;
}

// A measured value keeps its decimals when they are zero; a count has none.
export function measured(value, unit, digits = 4) {
  if (value === null || value === undefined || unit === "count" || Math.abs(value) >= 1e6) return number(value, digits);
  if (unitText(unit) && Math.abs(value) < 5e-4) return (0).toFixed(digits - 1); // a nanometre is not measured
  if (value < 0) return `−${measured(-value, unit, digits)}`;
  if (!Number.isInteger(value)) return number(value, digits);
  return value.toFixed(Math.max(0, digits - 1 - Math.floor(Math.log10(Math.max(1, Math.abs(value))))));
}

export function quantity(value, unit, digits) {
  const text = unitText(unit);
  return value === null || value === undefined || !text ? measured(value, unit, digits) : measured(value, unit, digits) + NARROW + text;
}

// A parameter's value as people read it, where that is no plain number: of a category its name, of an angle that within one turn.
export function worded(value, of) {
  return of?.words && typeof value === "number" ? of.words[Math.round(value)] ?? "–" : null;
}

export function turned(value, of) {
  return of?.turn && value > of.turn ? value - 360 : value;
}

export function titled(name) {
  const unit = unitText(columns.get(name)?.unit ?? "");
  return unit ? `${name} [${unit}]` : name;
}
