// The failure modes: the ways in which the driver fails, or what is known where there is none.

import { $, NARROW, element } from "./common.js";
import { anyViolated } from "./criteria_rows.js";
import { data } from "./data.js";
import { filters } from "./filters.js";
import { drawn, nearestToHarm } from "./findings.js";
import { glyph } from "./glyph.js";
import { hook } from "./hook.js";
import { number, shareText } from "./numbers.js";
import { minimals } from "./playbacks.js";
import { addSection } from "./sections.js";

const CAUSES_SAID = {
  perception: "perception", planning: "planning", control: "control", "vehicle dynamics": "vehicle dynamics",
  unavoidable: "unavoidable by what was tried: none of the fixes removes the harm", sensitive: "sensitive: small changes of the parameters alone remove most of the harm",
};

const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

class Modes {
  constructor() {
    this.chosen = null;
    document.addEventListener("filters", () => this.mark());
    document.addEventListener("grown", () => this.fill());
    this.fill();
  }

  fill() {
    const found = data.triage;
    const n = found.modes.length + found.more;
    $("modes-title").textContent = n ? `${number(n)} ${n === 1 ? "way" : "ways"} in which ${found.ego} fails${found.baseline ? ` and ${found.baseline} does not` : ""}` : found.bound.failures ? `${capital(found.ego)} fails in fresh random draws alone` : found.bound.judged === false ? "Not judged" : data.criteria ? "No harm found" : "No failure found";
    $("modes-lead").textContent = capital(found.bound.sentence.replace(n ? /^.*? fails in [\d,]+ ways?: / : /^(Not judged: |No (failure found|scenario in which .*? was found) in )/, "")); // the title says the rest
    const kind = n || found.bound.failures ? "fails" : found.bound.judged === false ? "open" : data.criteria ? "" : "passes";
    // Not green where careful drivers avoid collisions that do not count: the sentence says so after "but".
    $("verdict").className = `banner ${kind === "passes" && (found.missed || found.bound.sentence.includes(", but ")) ? "open" : kind}`;
    $("verdict-word").textContent = { fails: "FAILS", open: "NOT JUDGED", passes: "NO FAILURE FOUND", "": "" }[kind];
    $("modes-title").classList.toggle("hidden", $("modes-title").textContent.toUpperCase() === $("verdict-word").textContent);
    $("verdict-next").textContent = kind === "fails" ? data.summary.next : "";
    this.buttons = [];
    $("modes-list").replaceChildren(...found.modes.map((mode) => this.card(mode)), ...drawn.map((kept, k) => this.draw(kept, k)));
    $("modes-list").hidden = !n && !drawn.length;
    const notes = found.rate ? [`${found.rate}.`] : [], nearest = nearestToHarm();
    if (nearest !== null && !anyViolated()) notes.push(`Evaluation ${number(nearest + 1)}, which came nearest to harm, is shown below.`);
    if (n) notes.push(found.untested || `Robustness: share of ${number(found.neighbours)} neighbours, each parameter moved by at most ${number(100 * found.radius, 2)}${NARROW}% of its range, that are harmful, too.`);
    if (found.covered) notes.push(`Share found: of fresh random scenarios, ${found.covered}.`);
    if (found.influences.length) notes.push(`What matters most: ${found.influences.slice(0, 3).map(({ name }) => name).join(", ")}.`);
    if (found.steps) notes.push(`${capital(found.steps)}.`);
    if (found.extrapolated) notes.push(`Extrapolated: ${found.extrapolated}.`);
    if (found.more) notes.push(`${number(found.more)} more not shown.`);
    $("modes-note").textContent = notes.join(" ");
  }

  play(evaluation) {
    hook.show?.(evaluation, 0, true);
  }

  card(mode) {
    const fact = (strong, text, title = "") => element("li", { title }, element("b", {}, strong), ` ${text}`);
    const share = mode.space.share === null ? [] : [fact(shareText(mode.space.share), `of the space (95${NARROW}%: ${shareText(mode.space.low)} to ${shareText(mode.space.high)})`, `${mode.space.harmful} of ${mode.space.rows} ${mode.space.drawn} scenarios`)];
    const { probability: p } = mode, often = p ? [fact(p.estimate ? p.estimate.toPrecision(2) : `< ${p.high.toPrecision(2)}`, p.estimate ? `probability (95${NARROW}%: ${p.low.toPrecision(2)} to ${p.high.toPrecision(2)})` : "probability", p.doubt)] : [];
    const robust = mode.robustness === null ? fact("not tested", "for robustness") : fact(`${mode.harmful} of ${mode.rows}`, "neighbours harmful", "robustness");
    const severity = mode.severity > 0 ? [fact(shareText(mode.severity), "worst severity", "highest probability of a MAIS3+ injury")] : [];
    const exported = data.kept.find(({ evaluation }) => evaluation === mode.shown), picture = exported && glyph(exported);
    const name = exported?.name ?? `evaluation ${number(mode.shown + 1)}`;
    const play = element("button", { type: "button", class: "primary", "aria-label": `Play ${name}, mode ${mode.number}` }, `▶ ${name}`);
    play.addEventListener("click", () => this.play(mode.shown));
    const only = element("button", { type: "button", class: "quiet", "aria-pressed": "false", title: "Show only scenarios of this conflict, responsibility and rule below" }, "Its scenarios");
    only.addEventListener("click", () => filters.inMode(filters.mode === mode.number ? null : mode.number));
    this.buttons.push([mode.number, only]);
    const more = element(
      "div", { class: "mode-more", hidden: "" },
      element("ul", { class: "mode-facts" }, robust, ...share),
      ...(mode.knife_edge ? [element("p", { class: "mode-edge" }, "Knife-edge: fewer than half of its neighbours are harmful.")] : []),
      ...(mode.step ? [element("p", { class: "mode-edge" }, `${capital(mode.step)}.`)] : []),
      this.cause(mode),
      element("p", { class: "mode-buttons" }, only),
      ...this.minimal(mode),
    );
    const fold = element("button", { type: "button", class: "quiet", "aria-expanded": "false", "aria-label": `Details of mode ${mode.number}` }, "Details");
    fold.addEventListener("click", () => {
      more.hidden = !more.hidden;
      fold.setAttribute("aria-expanded", `${!more.hidden}`);
    });
    return element(
      "li", { class: `card mode${mode.knife_edge || mode.step ? " edge" : ""}` },
      element(
        "div", { class: "mode-head" },
        element("span", { class: "mode-number", "aria-hidden": "true" }, `${mode.number}`),
        element("h3", {}, capital(mode.title)),
        ...(picture ? [picture] : []),
        element("ul", { class: "mode-facts" }, fact(number(mode.count), mode.count === 1 ? "scenario" : "scenarios"), ...often, ...severity),
        element("p", { class: "mode-buttons" }, play, fold),
      ),
      ...(data.mode_ids ? [element("p", { class: "mode-status" }, element("span", { "data-mode": data.mode_ids[mode.number] }))] : []), // see status.js
      more,
    );
  }

  // A fresh random draw that fails; the player has the whole sentence.
  draw({ name, conflict, metrics: { severity } }, k) {
    const facts = severity > 0 ? [element("li", { title: "probability of a MAIS3+ injury" }, element("b", {}, shareText(severity)), " severity (MAIS3+)")] : [];
    if (conflict?.responsible) facts.push(element("li", { title: conflict.rule_says ?? "" }, "responsible: ", element("b", {}, conflict.responsible), conflict.rule ? ` (${conflict.rule})` : ""));
    const play = element("button", { type: "button", class: "primary", "aria-label": `Play ${name}` }, `▶ ${name}`);
    play.addEventListener("click", () => hook.select?.(k, true));
    return element(
      "li", { class: "card mode" },
      element(
        "div", { class: "mode-head" },
        element("span", { class: "mode-number", "aria-hidden": "true" }, `${k + 1}`),
        element("h3", { title: conflict?.sentence ?? "" }, conflict?.sentence.split(";")[0] ?? name),
        element("ul", { class: "mode-facts" }, ...facts),
        element("p", { class: "mode-buttons" }, play),
      ),
    );
  }

  // The cause, with what the fix made of the neighbours; or the quick label where nothing was tested.
  cause(mode) {
    const words = element("p", { class: "mode-cause" }, element("span", { class: "name" }, mode.tested ? "Cause: " : "Cause (quick label, not tested): "));
    words.append(element("b", {}, CAUSES_SAID[mode.cause] ?? "not known"));
    if (mode.judgement) words.replaceChildren(capital(mode.judgement));
    const { fix, placebo } = mode;
    if (fix) {
      const points = (value) => number(Math.round(100 * value));
      const less = placebo ? `; after a random move of the same size by ${points(placebo.drop)}` : "";
      words.append(`. If ${fix.name}, the harmful share of its neighbours drops by ${points(fix.drop)} percentage points (95${NARROW}%: ${points(fix.low)} to ${points(fix.high)})${less}.`);
    }
    return words;
  }

  minimal(mode) {
    const one = mode.minimal;
    if (!one) return [];
    const text = element("p", {}, element("span", { class: "name" }, "Simplest form: "), one.sentence.replaceAll(">=", "≥").replaceAll("<=", "≤"), ".");
    if (one.knife_edge) text.append(` Knife-edge: ${one.harmful} of ${one.rows} neighbours harmful.`);
    const parts = [text];
    if (minimals.has(mode.shown)) {
      const play = element("button", { type: "button", class: "quiet", "aria-label": `Play the simplest form of mode ${mode.number}` }, `▶ ${one.name || "simplest form"}`);
      play.addEventListener("click", () => hook.showMinimal?.(mode.shown));
      parts.push(element("p", { class: "mode-buttons" }, play));
    }
    return [element("div", { class: "mode-minimal" }, ...parts)];
  }

  mark() {
    for (const [k, button] of this.buttons ?? []) button.setAttribute("aria-pressed", `${filters.mode === k}`);
  }
}

addSection({ id: "modes", key: "triage", draw: () => new Modes() });
