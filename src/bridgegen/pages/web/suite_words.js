// Words and small pictures of a suite's results.

import { element } from "./common.js";
import { data } from "./data.js";
import { conflictWord } from "./findings.js";

export const suite = data.suite;
export const WORSE = { f: 0, y: 1, n: 2, u: 3, p: 4 };
export const PASSES = { f: "fails", y: "is flaky", n: "did not run", u: "not judged", p: "passes" };
export const MARKS = { f: "✗", y: "~", n: "?", u: "○", p: "✓" };
export const CLASSES = { f: "failed", y: "unjudged", n: "lost", u: "unjudged", p: "passed" };
export const counted = (n) => n.toLocaleString("en-GB");

// The verdict of a scenario with an ego, in words.
export function verdictWords({ v, n: [passed, failed, lost, unjudged, flaky = 0] }) {
  const n = passed + failed + lost + unjudged + flaky, some = (count, words) => (count ? `${counted(count)} of ${counted(n)} ${words}` : "");
  if (n <= 1 || lost === n) return PASSES[v];
  if (passed === n || unjudged === n) return `${PASSES[v]} (${counted(n)})`;
  return [v === "p" ? `passes ${counted(passed)}` : "", v === "u" ? PASSES.u : "", failed ? `fails ${counted(failed)} of ${counted(n)}` : "", some(flaky, "flaky"), some(lost, PASSES.n), some(unjudged, PASSES.u)].filter(Boolean).join(", ");
}

// A bar of numbers that pass, fail, did not run and are not judged.
export function bar(numbers) {
  const total = numbers.reduce((sum, n) => sum + n, 0);
  const parts = ["passed", "failed", "lost", "unjudged", "unjudged"].map((kind, k) => {
    const part = element("i", { class: kind });
    part.style.flexGrow = `${(numbers[k] ?? 0) / Math.max(1, total)}`;
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
