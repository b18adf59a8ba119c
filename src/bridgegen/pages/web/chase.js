// The scene in perspective, from behind the ego to straight above it: bodies are boxes on the road, which is flat.

import { darkness } from "./atmosphere.js";
import { LAMPS } from "./bodies.js";
import { palette } from "./colours.js";
import { boxCentre, colourOf, isPlaced, playersOf } from "./geometry.js";
import { drawCross, pill } from "./labels.js";
import { measured } from "./numbers.js";
import { lightAt, showsAt } from "./unpack.js";

const CLIPPED = 0.4; // m: what is nearer to the eye is cut off
const FOCUS = 0.8; // focal length in widths of the picture
const OUT_OF_SIGHT = 220; // m: beyond, lines on the road are finer than a pixel
const EYES = 1.2; // m above the road: what the camera looks at
const POST = 4; // m: a traffic light
const FACES = [ // corners of a box, whether the face looks that way, brightness
  [[0, 1, 2, 3], [0, 0, -1], 0.4], [[4, 5, 6, 7], [0, 0, 1], 1], [[0, 3, 7, 4], [1, 0, 0], 0.86],
  [[1, 2, 6, 5], [-1, 0, 0], 0.8], [[0, 1, 5, 4], [0, 1, 0], 0.7], [[3, 2, 6, 7], [0, -1, 0], 0.7],
];

/** Boxes of which a body is made: from and to in shares of length, width and height, and a colour if it is not the body's. */
function partsOf({ shape, height }, shows, lit) {
  const glass = "#1b2733", whole = [[-0.5, 0.5], [-0.5, 0.5], [0, 1]];
  if (shape === "person") return [[[-0.35, 0.35], [-0.4, 0.4], [0, 0.84]], [[-0.28, 0.28], [-0.25, 0.25], [0.86, 1], "#d9a982"]];
  if (shape === "cycle") return [[[-0.5, 0.5], [-0.12, 0.12], [0.05, 0.5], glass], [[-0.15, 0.2], [-0.4, 0.4], [0.45, 0.85]], [[-0.08, 0.1], [-0.2, 0.2], [0.87, 1], "#d9a982"]];
  if (shape === "cone") return [[[-0.5, 0.5], [-0.5, 0.5], [0, 0.06], palette.cone], [[-0.25, 0.25], [-0.25, 0.25], [0.06, 1], palette.cone]];
  if (shape !== "vehicle") return [shape === "sign" ? [...whole, palette.cone] : whole];
  const lamps = [];
  for (const side of [-1, 1]) {
    const at = (from, to) => [side * from, side * to].sort((a, b) => a - b), beam = [0.3, 0.42];
    lamps.push([[0.48, 0.505], at(0.28, 0.46), beam, "#fff3c4"], [[-0.505, -0.48], at(0.28, 0.46), beam, shows & 4 ? "#ff2d2d" : "#7a1016"]);
    if (lit && shows & (side > 0 ? 1 : 2)) for (const end of [-0.505, 0.48]) lamps.push([[end, end + 0.025], at(0.4, 0.5), [0.32, 0.46], "#ffb000"]);
  }
  if (height > 2.2) return [[[-0.5, 0.5], [-0.5, 0.5], [0.08, 1]], [[0.47, 0.505], [-0.44, 0.44], [0.5, 0.85], glass], ...lamps];
  return [[[-0.5, 0.5], [-0.5, 0.5], [0.12, 0.58]], ...lamps, [[-0.4, 0.22], [-0.43, 0.43], [0.58, 0.94], glass], [[-0.36, 0.12], [-0.42, 0.42], [0.94, 1]]];
}

/** The corners of a stripe of some width [m] along a line, piece by piece, with its gaps. */
export function stripes(points, width, [dash, gap] = [Infinity, 0]) {
  const found = [];
  let done = 0; // m of the present period
  for (let i = 1; i < points.length; i++) {
    const [[ax, ay], [bx, by]] = [points[i - 1], points[i]], long = Math.hypot(bx - ax, by - ay);
    if (!long) continue;
    const [ux, uy] = [(bx - ax) / long, (by - ay) / long], [nx, ny] = [(-uy * width) / 2, (ux * width) / 2];
    for (let at = 0; at < long;) {
      const rest = done < dash ? dash - done : dash + gap - done, step = Math.min(rest, long - at), [from, to] = [at, at + step];
      if (done < dash) found.push([[ax + ux * from + nx, ay + uy * from + ny], [ax + ux * to + nx, ay + uy * to + ny], [ax + ux * to - nx, ay + uy * to - ny], [ax + ux * from - nx, ay + uy * from - ny]]);
      at = to;
      done = step === rest && done >= dash ? 0 : done + step;
    }
  }
  return found;
}

// An eye behind the ego, or where the reader has turned it to.
class Eye {
  constructor([x, y], heading, { yaw, pitch, away }, { width, height }) {
    const turned = heading + yaw, [cy, sy, cp, sp] = [Math.cos(turned), Math.sin(turned), Math.cos(pitch), Math.sin(pitch)];
    Object.assign(this, { width, height, focus: FOCUS * width, at: [x - away * cp * cy, y - away * cp * sy, EYES + away * sp], ahead: [cp * cy, cp * sy, -sp], right: [sy, -cy, 0], up: [sp * cy, sp * sy, cp] });
  }

  // Along the three axes of the eye: right, up, ahead [m].
  seen([x, y, z = 0]) {
    const d = [x - this.at[0], y - this.at[1], z - this.at[2]], along = (axis) => axis[0] * d[0] + axis[1] * d[1] + axis[2] * d[2];
    return [along(this.right), along(this.up), along(this.ahead)];
  }

  pixel([right, up, ahead]) {
    return [this.width / 2 + (this.focus * right) / ahead, this.height * 0.56 - (this.focus * up) / ahead];
  }

  // A polygon's pixels, without the part behind the eye; null if nothing is left.
  polygon(points) {
    const from = points.map((point) => this.seen(point)), left = [];
    from.forEach((a, i) => {
      const b = from[(i + 1) % from.length], cut = (a[2] - CLIPPED) / (a[2] - b[2]);
      if (a[2] >= CLIPPED) left.push(a);
      if (a[2] >= CLIPPED !== b[2] >= CLIPPED) left.push(a.map((value, k) => value + cut * (b[k] - value)));
    });
    return left.length > 2 ? left.map((point) => this.pixel(point)) : null;
  }

  path(c, points) {
    const found = this.polygon(points);
    found?.forEach((p, i) => c[i ? "lineTo" : "moveTo"](...p));
    if (found) c.closePath();
  }
}

function shaded(colour, share) {
  return share === 1 ? colour : `color-mix(in srgb, ${colour} ${Math.round(100 * share)}%, #000)`;
}

function drawBox(c, eye, place, { length, width, height }, [x, y, z, own], colour) {
  const [px, py] = place.at, [ch, sh] = [Math.cos(place.h), Math.sin(place.h)];
  const along = (eye.at[0] - px) * ch + (eye.at[1] - py) * sh; // what is at the front or at the rear is hidden from the other end
  if ((x[1] > 0.5 && along < length / 2) || (x[0] < -0.5 && along > -length / 2)) return;
  const corner = (a, b, up) => [px + a * length * ch - b * width * sh, py + a * length * sh + b * width * ch, up * height];
  const corners = z.flatMap((up) => [corner(x[1], y[1], up), corner(x[0], y[1], up), corner(x[0], y[0], up), corner(x[1], y[0], up)]);
  for (const [which, [a, b, up], share] of FACES) {
    const normal = [a * ch - b * sh, a * sh + b * ch, up], point = corners[which[0]];
    if (normal.reduce((sum, n, k) => sum + n * (eye.at[k] - point[k]), 0) <= 0) continue;
    c.beginPath();
    eye.path(c, which.map((k) => corners[k]));
    c.fillStyle = shaded(own ?? colour, share);
    c.fill();
  }
}

function drawShadow(c, eye, place, body) {
  const round = Array.from({ length: 16 }, (_, k) => [Math.cos((k * Math.PI) / 8), Math.sin((k * Math.PI) / 8)].map((u) => Math.sign(u) * Math.abs(u) ** 0.5));
  const [ch, sh] = [Math.cos(place.h), Math.sin(place.h)], [a, b] = [body.length / 2 + 0.25, body.width / 2 + 0.25];
  c.beginPath();
  eye.path(c, round.map(([u, v]) => [place.at[0] + a * u * ch - b * v * sh, place.at[1] + a * u * sh + b * v * ch]));
  c.fillStyle = "rgba(0, 0, 0, 0.28)";
  c.fill();
}

function drawLight(c, eye, lamp, index) {
  const at = eye.seen([lamp.x, lamp.y, POST]);
  if (at[2] < 1) return;
  const [x, y] = eye.pixel(at), foot = eye.pixel(eye.seen([lamp.x, lamp.y])), r = Math.max(1.5, (eye.focus * 0.16) / at[2]), state = lightAt(lamp, index);
  c.strokeStyle = c.fillStyle = "#10161d";
  c.lineWidth = Math.max(1, r / 2);
  c.beginPath();
  c.moveTo(x, y);
  c.lineTo(...foot);
  c.stroke();
  c.fillRect(x - 1.4 * r, y - 3.8 * r, 2.8 * r, 7.6 * r);
  for (const { at: up, lit, colour } of LAMPS) {
    c.beginPath();
    c.arc(x, y - up * r, r, 0, 2 * Math.PI);
    c.fillStyle = lit.includes(state) ? colour : "#3a434e";
    c.fill();
  }
}

/** Draws an instant; `road` are areas and lines in the order of drawing. Returns the pixels of the bodies' middles on the road. */
export function drawChase(c, size, kept, state, { orbit, road, centres, hits, weather }) {
  const [ego] = state.entities, k = centres[0].findLastIndex((point, i) => point && i <= state.index);
  const at = isPlaced(ego) ? boxCentre(kept.entities[0], ego.x, ego.y, ego.h) : centres[0][k] ?? [0, 0];
  const eye = new Eye(at, isPlaced(ego) ? ego.h : kept.h[0][Math.max(0, k)] ?? 0, orbit, size), dark = weather ? darkness(weather) : 0;
  const horizon = eye.pixel([0, Math.tan(orbit.pitch), 1])[1];
  c.fillStyle = shaded(palette.sky, 1 - 0.85 * dark);
  c.fillRect(0, 0, size.width, size.height);
  c.fillStyle = palette.ground;
  c.fillRect(0, Math.max(0, horizon), size.width, size.height);
  const near = ([x, y]) => Math.hypot(x - eye.at[0], y - eye.at[1]) < OUT_OF_SIGHT;
  for (const { colour, polygons, isLine } of road) {
    c.beginPath();
    for (const points of polygons) if (!isLine || near(points[0])) eye.path(c, points);
    c.fillStyle = palette[colour];
    c.fill();
  }
  c.fillStyle = `rgba(4, 9, 24, ${(0.55 * dark).toFixed(3)})`;
  c.fillRect(0, Math.max(0, horizon), size.width, size.height);
  if (weather?.sight < 1000) drawHaze(c, eye, size, horizon, weather.sight, dark);
  for (const e of playersOf(kept)) drawWay(c, eye, centres[e], state.index, colourOf(kept, e));
  const there = state.entities.map((s, e) => isPlaced(s) && { e, h: s.h, at: boxCentre(kept.entities[e], s.x, s.y, s.h) }).filter(Boolean);
  for (const place of there) drawShadow(c, eye, place, kept.entities[place.e]);
  for (const lamp of kept.lamps) drawLight(c, eye, lamp, state.index);
  const lit = (state.time * 1.5) % 1 < 0.5, depth = (place) => eye.seen(place.at)[2];
  for (const place of there.sort((a, b) => depth(b) - depth(a))) {
    const body = kept.entities[place.e];
    for (const part of partsOf(body, showsAt(body, state.index), lit)) drawBox(c, eye, place, body, part, colourOf(kept, place.e));
  }
  for (const [k, { from, to }] of hits) {
    const met = eye.seen([(from[0] + to[0]) / 2, (from[1] + to[1]) / 2, EYES / 2]);
    if (k <= state.index && met[2] > 1) drawCross(c, ...eye.pixel(met));
  }
  for (const place of there.filter(({ e }) => playersOf(kept).includes(e))) {
    const over = eye.seen([...place.at, kept.entities[place.e].height + 0.5]), s = state.entities[place.e];
    const [x, y] = eye.pixel(over);
    if (over[2] > 2) pill(c, size, `${s.name}  ${measured(s.v, "m/s", 2)} m/s`, x, y - 18, colourOf(kept, place.e));
  }
  const pixels = state.entities.map(() => null);
  for (const place of there) if (depth(place) > 0) pixels[place.e] = eye.pixel(eye.seen(place.at));
  return pixels;
}

// Contrast that is lost on the way to each row of pixels, at the meteorological range (Koschmieder).
function drawHaze(c, eye, size, horizon, sight, dark) {
  const haze = c.createLinearGradient(0, 0, 0, size.height), grey = dark > 0.5 ? "96, 106, 120" : palette.fog;
  for (let i = 0; i <= 12; i++) {
    const y = (i / 12) * size.height, distance = y > horizon ? (eye.focus * eye.at[2]) / (y - horizon) : Infinity;
    haze.addColorStop(i / 12, `rgba(${grey}, ${(0.75 * (1 - Math.exp((-2.996 * distance) / sight))).toFixed(3)})`);
  }
  c.fillStyle = haze;
  c.fillRect(0, 0, size.width, size.height);
}

// Where a body was and will be.
function drawWay(c, eye, centres, index, colour) {
  c.strokeStyle = colour;
  for (const [from, to, width, alpha] of [[index, centres.length - 1, 1.5, 0.45], [0, index, 3, 0.9]]) {
    c.lineWidth = width;
    c.globalAlpha = alpha;
    c.beginPath();
    let down = false;
    for (let k = from; k <= to; k++) {
      const seen = centres[k] && eye.seen(centres[k]), shown = seen && seen[2] > 1;
      if (shown) c[down ? "lineTo" : "moveTo"](...eye.pixel(seen));
      down = Boolean(shown);
    }
    c.stroke();
  }
  c.globalAlpha = 1;
}
