// Where the ego means to go: a band as wide as it is, as far as it would come within three seconds at the
// acceleration that it plans now, with a mark for each of them and a bar where it would stand. Of a driver that
// plans trajectories: its last one, dashed, with a dot for each second from now.

import { palette } from "./colours.js";
import { isPlaced } from "./geometry.js";

const AHEAD = 3; // s
const ROUTE = 60; // m of the way that are drawn beyond

// How far left of its way [m] a change of lanes has it at a station; see the driver's shift.
function asideAt([before, after, begins, length], s) {
  if (before === after || s >= begins + length) return after;
  if (s <= begins) return before;
  const u = (s - begins) / length;
  return before + (after - before) * u * u * u * (10 + u * (6 * u - 15));
}

// The way between two stations, shifted: points, each with its direction.
function alongWay(way, shift, from, to) {
  const points = [];
  let s = 0;
  for (let i = 1; i < way.length; i++) {
    const [[ax, ay], [bx, by]] = [way[i - 1], way[i]], d = Math.hypot(bx - ax, by - ay);
    if (!d) continue;
    const ux = (bx - ax) / d, uy = (by - ay) / d;
    const put = (at) => {
      const aside = asideAt(shift, at), f = at - s;
      points.push({ x: ax + f * ux - aside * uy, y: ay + f * uy + aside * ux, ux, uy });
    };
    const first = Math.max(from, s), last = Math.min(to, s + d);
    if (last > first || (last === first && to === from)) {
      const parts = shift[0] === shift[1] ? 1 : Math.max(1, Math.ceil((last - first) / 1.5));
      for (let j = 0; j <= parts; j++) put(first + ((last - first) * j) / parts);
    }
    s += d;
  }
  return points;
}

// Stations of the ego's front now, after each of the seconds ahead, and whether it would stand by then.
export function intentionAt(kept, state) {
  const { course } = kept, i = course?.at[state.index] ?? -1;
  if (i < 0 || course.way[i] < 0 || course.station[i] === null || !isPlaced(state.entities[0])) return null;
  const body = kept.entities[0], v = Math.max(0, state.entities[0].v);
  const planned = course.acceleration[i], a = planned ?? kept.a?.[0][state.index] ?? 0;
  const since = state.time - course.steps[i] * kept.time_step;
  const front = course.station[i] + v * since + body.center_ahead + body.length / 2;
  const until = a < 0 ? Math.min(AHEAD, v / -a) : AHEAD;
  const after = (t) => { const u = Math.min(t, until); return front + v * u + 0.5 * a * u * u; };
  return {
    way: course.ways[course.way[i]], shift: course.shift[i], front, planned, a,
    marks: [1, 2, 3].map(after), end: after(AHEAD), stands: until < AHEAD, standsIn: until,
  };
}

// What is left of the trajectory that the driver follows now: points, and where it will be after 1, 2 … s; or null.
export function plannedAt(kept, state) {
  const plan = kept.plans?.[kept.planAt[state.index]];
  if (!plan || !isPlaced(state.entities[0])) return null;
  const { points, seconds } = plan, each = seconds / (points.length - 1);
  const since = state.time - plan.step * kept.time_step;
  if (since > seconds) return null;
  const at = (t) => {
    const i = Math.min(Math.floor(t / each), points.length - 2), f = t / each - i;
    return points[i].map((from, axis) => from + f * (points[i + 1][axis] - from));
  };
  const dots = [];
  for (let t = since + 1; t <= seconds + 1e-9; t += 1) dots.push(at(Math.min(t, seconds)));
  return { points: [at(since), ...points.filter((_, i) => i * each > since)], dots };
}

function drawPlan(c, { points, dots }, scale) {
  c.save();
  c.lineJoin = "round";
  for (const [colour, pixels] of [["rgba(8, 16, 26, 0.6)", 5], [palette.marking, 2.5]]) {
    c.strokeStyle = c.fillStyle = colour;
    c.lineWidth = pixels / scale;
    c.setLineDash([8 / scale, 5 / scale]);
    c.beginPath();
    points.forEach((p, i) => c[i ? "lineTo" : "moveTo"](...p));
    c.stroke();
    for (const dot of dots) {
      c.beginPath();
      c.arc(...dot, (pixels + 2) / scale, 0, 2 * Math.PI);
      c.fill();
    }
  }
  c.restore();
}

export function drawCourse(c, kept, state, scale) {
  const planned = plannedAt(kept, state);
  if (planned) {
    drawPlan(c, planned, scale);
    return;
  }
  const meant = intentionAt(kept, state);
  if (!meant) return;
  const { way, shift, front, end, stands, marks } = meant, half = kept.entities[0].width / 2;
  const line = (points) => {
    c.beginPath();
    points.forEach(({ x, y }, j) => c[j ? "lineTo" : "moveTo"](x, y));
    c.stroke();
  };
  c.save();
  c.lineJoin = "round";
  c.strokeStyle = palette.ego;
  c.globalAlpha = 0.7;
  c.lineWidth = 1.5 / scale;
  c.setLineDash([2 / scale, 6 / scale]);
  line(alongWay(way, shift, end, end + ROUTE));
  c.setLineDash([]);
  c.globalAlpha = 0.32;
  c.lineWidth = 2 * half;
  line(alongWay(way, shift, front, end));
  c.globalAlpha = 1;
  const across = (at, reach, pixels) => {
    const [p] = alongWay(way, shift, at, at + 1e-3);
    if (!p) return;
    for (const [colour, more] of [["rgba(8, 16, 26, 0.6)", 2], [palette.marking, 0]]) {
      c.strokeStyle = colour;
      c.lineWidth = (pixels + more) / scale;
      c.beginPath();
      c.moveTo(p.x - reach * p.uy, p.y + reach * p.ux);
      c.lineTo(p.x + reach * p.uy, p.y - reach * p.ux);
      c.stroke();
    }
  };
  for (const at of marks) if (at < end - 0.3 || !stands) across(at, half, 1.5);
  if (stands) across(end, 1.5 * half, 5);
  c.restore();
}
