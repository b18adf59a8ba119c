// A playback as it is written (playback_payload.py) made into arrays, once; and what holds at an instant of it.

import { data } from "./data.js";
import { boxCentre } from "./geometry.js";
import { unpackSeries } from "./series.js";

const LETTERS = { "-": [-1, true], 0: [0, true], 1: [1, true], 2: [2, true], 3: [3, true], m: [0, false], a: [1, false], b: [2, false], c: [3, false] };
const SENSORS = ["no sensor", "camera", "LiDAR", "camera and LiDAR"];
export const SIGNALS = ["off", "red", "red and yellow", "yellow", "green"];
const running = (differences) => { let sum = 0; return differences.map((d) => (sum += d)); };

/**
 * x, y of a line's points [m], from the differences in whole units.
 * @returns {[number, number][]}
 */
export function unpackLine(packed) {
  /** @type {[number, number][]} */
  const points = [];
  let x = 0, y = 0;
  for (let i = 0; i < packed.length; i += 2) {
    x += packed[i];
    y += packed[i + 1];
    points.push([x / data.scale.road, y / data.scale.road]);
  }
  return points;
}

export function unpack(kept) {
  if (kept.x) return kept;
  const n = kept.n_steps, { series } = kept, scale = data.scale;
  const one = (name) => unpackSeries(series[name], n, scale[name]);
  const all = (name) => series[name].map((runs) => unpackSeries(runs, n, scale[name]));
  for (const name of "xyhv") kept[name] = all(name);
  kept.a = series.a ? all("a") : null;
  kept.distance = one("distance");
  kept.ttc = series.ttc ? one("ttc") : null;
  if (kept.sensed) kept.sensed = unpackSensed(kept.sensed, n);
  if (kept.course) kept.course = unpackCourse(kept.course, n);
  const plans = kept.plans ?? [];
  kept.planAt = holding(plans.map(({ step }) => step), n);
  for (const plan of plans) plan.points = unpackLine(plan.points);
  return kept;
}

// Which entry of an ascending list holds at each of n instants: the last that is not later; -1 before the first.
function holding(steps, n) {
  const at = new Int32Array(n).fill(-1);
  steps.forEach((k, i) => at.fill(i, k));
  return at;
}

function unpackSensed(packed, n) {
  const steps = running(packed.steps), scale = data.scale;
  const entities = packed.entities.map(({ seen, numbers, taken_for }) => {
    const kinds = new Map(taken_for);
    let next = 0;
    return [...seen].map((letter) => {
      const [by, counts] = LETTERS[letter];
      if (by <= 0) return { by, counts };
      const i = next++;
      const [dx, dy, dh, length, width, confidence] = numbers.map((column) => column[i]);
      return {
        by, counts, dx: dx / scale.length, dy: dy / scale.length, dh: dh / scale.h, length: length / scale.length,
        width: width / scale.width, confidence: confidence / scale.confidence, kind: kinds.has(i) ? packed.kinds[kinds.get(i)] : null,
      };
    });
  });
  const phantoms = packed.phantoms.flat().map(([frame, dx, dy, h, length, width, confidence, kind]) => (
    { frame, dx: dx / scale.length, dy: dy / scale.length, h: h / scale.h, length: length / scale.length, width: width / scale.width, confidence: confidence / scale.confidence, kind: packed.kinds[kind] }
  ));
  return { steps, frame: holding(steps, n), entities, phantoms, tolerance: packed.tolerance };
}

function unpackCourse(packed, n) {
  const steps = running(packed.steps), p = steps.length, scale = data.scale;
  const held = (changes, nothing) => {
    const values = new Array(p).fill(nothing);
    changes.forEach(([i, ...value]) => values.fill(value, i));
    return values;
  };
  return {
    steps, at: holding(steps, n), ways: packed.ways.map(unpackLine),
    way: held(packed.way, [-1]).map(([number]) => number),
    station: unpackSeries(packed.station, p, scale.station),
    acceleration: unpackSeries(packed.acceleration, p, scale.a),
    shift: held(packed.shift, [0, 0, 0, 0]),
  };
}

// What the ego's sensors made of an entity in the latest frame; null where it does not apply, or where it is
// too far away for a miss to count.
export function detectionAt(kept, e, index) {
  const frame = kept.sensed?.frame[index] ?? -1;
  const found = frame < 0 ? null : kept.sensed.entities[e][frame];
  if (!found || found.by < 0 || (found.by === 0 && !found.counts)) return null;
  if (found.by === 0) return { status: "missed" };
  const k = kept.sensed.steps[frame], body = kept.entities[e], h = kept.h[e][k];
  const [cx, cy] = boxCentre(body, kept.x[e][k], kept.y[e][k], h);
  const off = Math.hypot(found.dx, found.dy);
  return {
    status: off > kept.sensed.tolerance ? "displaced" : "seen", off, sensor: SENSORS[found.by], kind: found.kind, counts: found.counts,
    confidence: found.confidence, x: cx + found.dx, y: cy + found.dy, h: h + found.dh, length: found.length, width: found.width, truth: [cx, cy],
  };
}

// What the sensors reported in the latest frame where nothing is.
export function phantomsAt(kept, index) {
  const frame = kept.sensed?.frame[index] ?? -1;
  if (frame < 0) return [];
  const k = kept.sensed.steps[frame], [x, y] = [kept.x[0][k], kept.y[0][k]];
  return kept.sensed.phantoms.filter((one) => one.frame === frame).map((one) => ({ ...one, status: "displaced", truth: null, x: x + one.dx, y: y + one.dy }));
}

export function lightAt(lamp, index) {
  return lamp.changes.reduce((now, [k, to]) => (k <= index ? to : now), 0);
}

// What a vehicle's lamps show: 1 left, 2 right, 4 brake; both indicators are hazard lights.
export function showsAt(entity, index) {
  return (entity.shows ?? []).reduce((now, [k, to]) => (k <= index ? to : now), 0);
}

export function weatherAt(kept, index) {
  return kept.weather.reduce((now, one) => (one.step <= index ? one : now), null);
}
