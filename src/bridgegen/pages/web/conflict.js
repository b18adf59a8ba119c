// The decisive conflict of the scenario in the player: its sentence, its instants, where the bodies meet.

import { palette } from "./colours.js";
import { $, element } from "./common.js";
import { data } from "./data.js";
import { conflictWord } from "./findings.js";
import { boxCentre, isPlaced } from "./geometry.js";
import { ZONES } from "./glyph.js";
import { quantity, shareText } from "./numbers.js";

const ZONE_SHOWN = 1; // s, before and after the instant
const INSTANTS = { contact: "collision", "near miss": "least time to collision", "collision course": "least time to collision", violation: "worst" };
const WITH_DECISION = ["contact", "near miss", "violation"];
export const ZONED = ["contact", "near miss"];

export function fillConflict(kept, twin = null) {
  const found = kept.conflict, words = $("conflict");
  words.hidden = !found && !twin;
  $("to-decided").hidden = !found || !WITH_DECISION.includes(found.conflict);
  $("ticks").replaceChildren();
  const last = Math.max(1, kept.n_steps - 1, (twin?.n_steps ?? 0) - 1);
  const tick = (k, name, kind) => {
    const mark = element("i", { class: kind, title: `${name} at ${(k * kept.time_step).toFixed(2)} s` });
    mark.style.left = `${(100 * k) / last}%`;
    $("ticks").append(mark);
  };
  if (twin) {
    const said = (one) => element("span", {}, element("strong", {}, `${one.driver}: `), one.conflict?.sentence ?? "no conflict.");
    words.replaceChildren(said(twin), said(kept));
    if (twin.conflict) tick(twin.conflict.instant, `${twin.driver}: ${INSTANTS[twin.conflict.conflict]}`, "instant");
    if ((kept.diverged ?? null) !== null) tick(kept.diverged, "the drivers diverge", "diverged");
  }
  if (!found) return;
  const judged = data.triage?.judged?.[kept.evaluation]; // by its neighbours: in place of the end on braking
  if (!twin) words.replaceChildren(judged ? `${found.bare}; ${judged}.` : found.sentence);
  if (WITH_DECISION.includes(found.conflict)) tick(found.decided, "decided", "decided");
  tick(found.instant, INSTANTS[found.conflict], "instant");
}

// The figures of the conflict as lines of the details.
export function conflictLines(found) {
  if (!found) return [];
  const line = (name, value, title = "") => element("div", { title }, element("span", { class: "name" }, name), element("b", {}, value));
  const figure = (name) => quantity(...found.numbers[name], 3);
  const lines = [element("h3", {}, "Its conflict"), line("conflict", conflictWord(found.conflict))];
  if (found.vehicle) lines.push(line("of", found.vehicle, "which the ego's driver drives, too"));
  if (WITH_DECISION.includes(found.conflict)) {
    lines.push(line("type", found.type, found.type_source));
    if (found.partner) lines.push(line("partner", found.partner));
    lines.push(
      line("responsible", found.responsible, found.rule_says ?? ""),
      line("rule", found.rule ?? "–", `${found.rule_says ?? ""} (${found.rule_source ?? ""})`), line("decided at", figure("decided")),
    );
  }
  if (found.type === "unjustified braking" && found.conflict === "violation") return [...lines, line(`braking asked of ${found.partner}`, figure("needed_deceleration"), "at least, after 0.75 s"), line("speed of the ego", figure("v_ego")), line("harm", figure("harm"))];
  if (found.conflict === "violation") return [...lines, line("by", figure("aside"), "beyond the border of its lanes or the edge of the road; of a pass the clearance"), line("speed of the ego", figure("v_ego")), line("harm", figure("harm"))];
  if (ZONED.includes(found.conflict)) {
    lines.push(
      line("avoidable by braking (UN R157)", found.preventable ? "yes" : "no", "whether the careful driver of UN R157, who brakes after the risk arose, would have avoided it"),
      line("where the ego is met", found.zone_ego), line(`where ${found.partner} is met`, found.zone_other),
    );
  }
  if (found.conflict === "contact") lines.push(line("severity", shareText(found.numbers.severity[0]), "probability of a MAIS3+ injury"), line("delta-v of the ego", figure("delta_v_ego")), line(`delta-v of ${found.partner}`, figure("delta_v_other")));
  else lines.push(line("least TTC", figure("ttc")), line("needed deceleration", figure("needed_deceleration")));
  lines.push(line("closing speed", figure("closing_normal"), "across the surfaces that meet"), line("harm", figure("harm")));
  return lines;
}

// The edges or corners that meet, near the instant at which they do.
export function drawZones(c, kept, state, scale) {
  const found = kept.conflict;
  if (!found || !ZONED.includes(found.conflict)) return;
  if (Math.abs(state.index - found.instant) * kept.time_step > ZONE_SHOWN) return;
  [[found.vehicle_number ?? 0, found.zones[0]], [found.partner_number, found.zones[1]]].forEach(([e, zone]) => {
    const s = state.entities[e], body = kept.entities[e];
    if (!ZONES[zone] || !isPlaced(s)) return;
    const [cx, cy] = boxCentre(body, s.x, s.y, s.h), ux = Math.cos(s.h), uy = Math.sin(s.h);
    const points = ZONES[zone].map(([a, b]) => {
      const p = (a * body.length) / 2, q = (b * body.width) / 2;
      return [cx + p * ux - q * uy, cy + p * uy + q * ux];
    });
    for (const [colour, width] of [[palette.card, 7], [palette.hit, 4]]) {
      c.strokeStyle = c.fillStyle = colour;
      c.lineWidth = width / scale;
      c.lineCap = "round";
      c.beginPath();
      if (points.length > 1) points.forEach((p, i) => c[i ? "lineTo" : "moveTo"](...p));
      else c.arc(...points[0], width / 2 / scale, 0, 2 * Math.PI);
      if (points.length > 1) c.stroke();
      else { c.stroke(); c.fill(); }
    }
    c.lineCap = "butt";
  });
}

// A ring on both ways where they were at the instant that decided.
export function drawDecided(c, kept, centres, scale) {
  const found = kept.conflict;
  if (!found || !WITH_DECISION.includes(found.conflict)) return;
  for (const e of new Set([found.vehicle_number ?? 0, found.partner_number])) {
    const at = centres[e]?.[found.decided];
    if (!at) continue;
    for (const [colour, width] of [[palette.card, 5], [palette.ink, 2.5]]) {
      c.strokeStyle = colour;
      c.lineWidth = width / scale;
      c.beginPath();
      c.arc(...at, 7 / scale, 0, 2 * Math.PI);
      c.stroke();
    }
  }
}
