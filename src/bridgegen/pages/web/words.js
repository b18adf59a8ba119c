// The moment in words: for who cannot see the picture, and for who wants to copy it.

import { intentionAt } from "./course.js";
import { isPlaced, playersOf } from "./geometry.js";
import { elsewhereWords } from "./ghosts.js";
import { SIGNALS, detectionAt, lightAt, phantomsAt, showsAt, weatherAt } from "./unpack.js";

const INDICATORS = ["", "indicates left", "indicates right", "hazard lights on"];

// What a vehicle's lamps show, see `bridgegen.ego.lamps`.
function lampWords(shows) {
  return [INDICATORS[shows & 3], shows & 4 ? "brake lights on" : "", shows & 16 ? "blue lights on" : ""];
}

export function detectionWords(found) {
  if (!found) return "";
  if (found.status === "missed") return "missed";
  const off = found.status === "displaced" ? `seen ${found.off.toFixed(1)} m off` : "seen";
  return found.kind ? `${off}, as ${found.kind}` : off;
}

/** What the sensors report where nothing is. */
export function phantomWords(kept, index) {
  return phantomsAt(kept, index).map(({ dx, dy }) => `ghost ${Math.hypot(dx, dy).toFixed(0)}\u00a0m`);
}

function intentionWords(kept, state) {
  const meant = intentionAt(kept, state);
  if (!meant || meant.planned === null) return "";
  if (meant.stands && state.entities[0].v < 0.05) return "it plans to stand";
  if (meant.stands) return `it plans to stop in ${meant.standsIn.toFixed(1)} s`;
  const a = meant.planned;
  return Math.abs(a) < 0.05 ? "it plans to hold its speed" : `it plans to ${a < 0 ? "brake" : "speed up"} at ${Math.abs(a).toFixed(1)} m/s²`;
}

// All that the picture and the curves show now, in sentences.
export function stateWords(kept, state) {
  const value = (v, unit, places) => (v === null || v === undefined ? "none" : `${v.toFixed(places).replace(/^-(?=[0.]*$)/, "").replace("-", "−")} ${unit}`);
  const parts = [`${state.time.toFixed(2)} s`];
  const [ego] = state.entities;
  if (kept.contacts.some((k) => state.index >= k && state.index < k + 1 / kept.time_step)) parts.push("collision");
  parts.push(`${ego.name} ${value(ego.v, "m/s", 1)}, acceleration ${value(state.a?.[0], "m/s²", 1)}`);
  const plans = intentionWords(kept, state);
  if (plans) parts.push(plans);
  parts.push(`distance ${value(state.distance, "m", 2)}, time to collision ${value(state.ttc, "s", 1)}`);
  for (const e of playersOf(kept)) {
    const s = state.entities[e];
    if (e === 0 || !isPlaced(s)) continue;
    const told = [...lampWords(showsAt(kept.entities[e], state.index)), detectionWords(detectionAt(kept, e, state.index))].filter(Boolean);
    parts.push([`${s.name} ${value(s.v, "m/s", 1)}`, ...told].join(", "));
  }
  parts.push(...phantomWords(kept, state.index).map((words) => `sensors report a ${words} away, where nothing is`));
  state.entities.forEach((s, e) => {
    const off = elsewhereWords(kept, state, e);
    if (off) parts.push(`${s.name} ${off}`);
  });
  for (const lamp of kept.lamps) parts.push(`light ${lamp.name} ${SIGNALS[lightAt(lamp, state.index)] ?? "other"}`);
  const weather = weatherAt(kept, state.index);
  if (weather) parts.push(weather.words);
  return `${parts.join("; ")}.`;
}
