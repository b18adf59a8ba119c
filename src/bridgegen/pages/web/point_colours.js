// By what the critical points of the scatter plot are told apart: nothing, their cause, what another simulator says.

import { palette } from "./colours.js";
import { data, rows } from "./data.js";
import { VERDICTS, elsewhere } from "./verdicts.js";

const SHAPES = ["diamond", "square", "up", "down", "disc"];

// Value and text of each choice.
export function colourChoices() {
  const found = [["", "critical or not"]];
  if (rows.cause) found.push(["cause", "cause (quick label)"]);
  for (const { column, simulator } of elsewhere) found.push([column, `confirmed in ${simulator}`]);
  return found;
}

// The series of the critical rows.
export function pointColours(by, critical) {
  const verdicts = elsewhere.find(({ column }) => column === by)?.values;
  const series = (name, text, items, k, colour) => ({ name, text, items, marker: { shape: SHAPES[k], colour } });
  if (by === "cause" && rows.cause) {
    const colours = [palette.critical, palette["other-3"], palette.ego, palette["other-2"], palette["other-1"], palette["other-4"]];
    const all = data.causes.labels.map((label, k) => series(`cause ${k}`, k ? label : "without a label", critical.filter((i) => rows.cause[i] === k), k, colours[k]));
    return all.filter(({ items }) => items.length);
  }
  if (verdicts) {
    const colours = { 1: palette["other-2"], 0: palette.hit, "-1": palette["other-1"] };
    const all = Object.entries(VERDICTS).map(([value, [, words]], k) => series(words, `critical, ${words}`, critical.filter((i) => verdicts[i] === Number(value)), k + 1, colours[value]));
    const others = series("critical", "critical, not tried", critical.filter((i) => verdicts[i] === null), 0, palette.critical);
    return [...all, others].filter(({ items }) => items.length);
  }
  return [series("critical", "critical", critical, 0, palette.critical)];
}
