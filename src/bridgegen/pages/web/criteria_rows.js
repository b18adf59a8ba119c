// The pass criteria, and which rows of the page violate them: a column of margins each, below 0 where one is violated.

import { NARROW } from "./common.js";
import { columns, data, rows } from "./data.js";
import { unitText } from "./numbers.js";

const PREFIX = "criterion:"; // of the columns' names
const NOTHING = 1e-6; // a smaller margin is that of two equal sides

export function criterionOf(column) {
  return data.criteria?.list.find(({ quantity }) => quantity === column) ?? null;
}

// A column's name as a table's head: of a margin the id.
export function shortName(column) {
  return column.startsWith(PREFIX) ? column.slice(PREFIX.length) : column;
}

// Whether a row of the page violates any criterion.
export function violatesAny(i) {
  return Boolean(data.criteria?.list.some(({ quantity }) => columns.get(quantity).values[i] < 0));
}

export function anyViolated() {
  return Boolean(data.criteria?.violated) && rows.evaluation.some((_, i) => violatesAny(i));
}

// The violated criteria, the gravest first, then those violated most often.
export function violatedCriteria() {
  const grave = ({ severity }) => ["critical", "major", "minor"].indexOf(severity);
  return (data.criteria?.list.filter(({ violated }) => violated) ?? []).sort((a, b) => grave(a) - grave(b) || b.violated - a.violated);
}

// The evaluation that violates the gravest of them most, if the page has it; else null.
export function worstViolation() {
  return violatedCriteria().find(({ at }) => rows.evaluation.includes(at))?.at ?? null;
}

export function marginText(margin, unit) {
  if (margin === null || margin === undefined) return "–";
  const text = Math.abs(margin) < NOTHING ? "0" : `${margin > 0 ? "+" : "−"}${Number(Math.abs(margin).toPrecision(3))}`;
  return unitText(unit) ? text + NARROW + unitText(unit) : text;
}
