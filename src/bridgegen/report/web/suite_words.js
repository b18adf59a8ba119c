// Words and small pictures of a suite's results.

import { element } from "./common.js";
import { data } from "./data.js";
import { conflictWord } from "./findings.js";

export const suite = data.suite;
export const WORSE = { f: 0, n: 1, p: 2 };
export const PASSES = { f: "fails", n: "did not run", p: "passes" };
export const MARKS = { f: "✗", n: "?", p: "✓" };
export const counted = (n) => n.toLocaleString("en-GB");

// The verdict of a scenario with an ego, in words.
export function verdictWords({ v, n: [passed, failed, lost] }) {
  const n = passed + failed + lost;
  if (n <= 1 || lost === n) return PASSES[v];
  if (passed === n) return `passes (${counted(n)})`;
  return [failed ? `fails ${counted(failed)} of ${counted(n)}` : "", lost ? `${counted(lost)} of ${counted(n)} did not run` : ""].filter(Boolean).join(", ");
}

// A bar of numbers that pass, fail and did not run.
export function bar(numbers) {
  const total = numbers.reduce((sum, n) => sum + n, 0);
  const parts = ["passed", "failed", "lost"].map((kind, k) => {
    const part = element("i", { class: kind });
    part.style.flexGrow = `${numbers[k] / Math.max(1, total)}`;
    return part;
  });
  return element("span", { class: "share", "aria-hidden": "true" }, ...parts.filter((_, k) => numbers[k]));
}

// What happens in the worst failure.
export function happens({ conflict }) {
  if (!conflict) return "";
  const [what, , partner] = conflict;
  return partner ? `${conflictWord(what)} with ${partner}` : conflictWord(what);
}

export function button(text, act, attributes = {}) {
  const made = element("button", { type: "button", ...attributes }, text);
  made.addEventListener("click", act);
  return made;
}
