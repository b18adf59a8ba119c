// What stands and moves in the bird's-eye view: vehicles, people, things, traffic lights. In metres.

import { palette } from "./colours.js";
import { boxCentre } from "./geometry.js";
import { lightAt } from "./unpack.js";

export const LAMPS = [ // states: 0 off, 1 red, 2 red and yellow, 3 yellow, 4 green
  { at: 2.2, lit: [1, 2], colour: "#ff4d4d" }, { at: 0, lit: [2, 3], colour: "#ffd23f" }, { at: -2.2, lit: [4], colour: "#38d39f" },
];

export function roundBox(c, x, y, width, height, radius) {
  c.beginPath();
  if (c.roundRect) c.roundRect(x, y, width, height, radius);
  else c.rect(x, y, width, height);
}

const FLASHES = 1.5; // a second; UN R48: 60 to 120 a minute
const RIM = "#10161d"; // tells a lamp from a body of its own colour
const LEAST_LAMP = [0.3, 4]; // radius [m], and [pixels] from afar

// Indicators at the corners, as they flash; brake lights; and the blue lights on the roof.
function drawShown(c, { length, width }, shows, time, scale) {
  const r = Math.max(LEAST_LAMP[0], LEAST_LAMP[1] / scale);
  c.strokeStyle = RIM;
  c.lineWidth = Math.max(0.08, 1.2 / scale);
  const lamp = (x, y, colour) => {
    c.beginPath();
    c.arc(x, y, r, 0, 2 * Math.PI);
    c.fillStyle = colour;
    c.fill();
    c.stroke();
  };
  const lit = (time * FLASHES) % 1 < 0.5;
  for (const side of shows & 4 ? [-1, 1] : []) {
    c.fillStyle = "#ff2d2d";
    c.beginPath();
    c.rect(-length / 2 - 0.6 * r, side * width * 0.25 - width * 0.14, 1.2 * r, width * 0.28);
    c.fill();
    c.stroke();
  }
  for (const [bit, side] of [[1, 1], [2, -1]]) {
    if (shows & bit) for (const end of [-1, 1]) lamp(end * length / 2, side * width / 2, lit ? "#ffb000" : "#7a5200");
  }
  for (const side of [-1, 1]) if (shows & 16) lamp(-length * 0.08, side * width * 0.2, lit === side > 0 ? "#2f8cff" : "#123a75");
}

export function drawBody(c, entity, state, colour, scale, shows = 0, time = 0) {
  const { length, width } = entity;
  c.save();
  c.translate(...boxCentre(entity, state.x, state.y, state.h));
  c.rotate(state.h);
  if (entity.shape !== "vehicle") {
    drawSmall(c, entity, colour, scale);
    c.restore();
    return;
  }
  roundBox(c, -length / 2, -width / 2, length, width, scale > 3 ? width * 0.22 : 0);
  c.fillStyle = colour;
  c.fill();
  c.lineWidth = 1.5 / scale;
  c.strokeStyle = palette.marking;
  c.stroke();
  // Windscreen and roof line tell front from rear.
  c.fillStyle = "rgba(8, 16, 26, 0.62)";
  c.beginPath();
  c.moveTo(length * 0.12, -width * 0.34);
  c.lineTo(length * 0.27, -width * 0.41);
  c.lineTo(length * 0.27, width * 0.41);
  c.lineTo(length * 0.12, width * 0.34);
  c.closePath();
  c.fill();
  c.fillRect(-length * 0.36, -width * 0.34, length * 0.08, width * 0.68);
  c.fillStyle = "rgba(255, 255, 255, 0.9)";
  for (const side of [-1, 1]) c.fillRect(length * 0.455, side * width * 0.33 - width * 0.08, length * 0.035, width * 0.16);
  if (shows) drawShown(c, entity, shows, time, scale);
  c.restore();
}

// People, cycles and things: seen from afar they are a few pixels, so their shape identifies them.
function drawSmall(c, { shape, length, width }, colour, scale) {
  const half = Math.max(0.5 * Math.max(length, width), 2.5 / scale);
  c.beginPath();
  if (shape === "person" || shape === "cone") c.arc(0, 0, half, 0, 2 * Math.PI);
  else if (shape === "cycle") c.ellipse(0, 0, Math.max(length / 2, half), Math.max(width / 2, 2 / scale), 0, 0, 2 * Math.PI);
  else {
    const [long, wide] = [length, shape === "sign" ? 2 * half : width].map((size) => Math.max(size, 3 / scale));
    c.rect(-long / 2, -wide / 2, long, wide);
  }
  c.fillStyle = shape === "cone" || shape === "sign" ? palette.cone : colour;
  c.fill();
  c.lineWidth = 1.2 / scale;
  c.strokeStyle = palette.marking;
  c.stroke();
  if (shape === "cone") {
    c.beginPath();
    c.arc(0, 0, half * 0.45, 0, 2 * Math.PI);
    c.fillStyle = palette.marking;
    c.fill();
  } else if (shape === "person" || shape === "cycle") {
    c.beginPath();
    c.arc(0, 0, half * (shape === "person" ? 0.5 : 0.3), 0, 2 * Math.PI);
    c.fillStyle = "rgba(8, 16, 26, 0.62)";
    c.fill();
  }
}

// A housing beside the lane, red farthest ahead; the place of the lamp that is lit tells as much as its colour.
export function drawLamps(c, lamps, index, scale) {
  for (const lamp of lamps) {
    const state = lightAt(lamp, index), r = Math.max(0.45, 3.2 / scale);
    c.save();
    c.translate(lamp.x, lamp.y);
    c.rotate(lamp.h);
    c.fillStyle = "#10161d";
    c.strokeStyle = palette.marking;
    c.lineWidth = 1 / scale;
    roundBox(c, -3.6 * r, -1.3 * r, 7.2 * r, 2.6 * r, 1.2 * r);
    c.fill();
    c.stroke();
    for (const { at, lit, colour } of LAMPS) {
      c.beginPath();
      c.arc(at * r, 0, 0.85 * r, 0, 2 * Math.PI);
      c.fillStyle = lit.includes(state) ? colour : "#3a434e";
      c.fill();
    }
    c.restore();
  }
}

// Posts; where it is dark, ``atmosphere.js`` lights what is below them.
export function drawStreetLights(c, posts, scale) {
  c.fillStyle = "#f4c542";
  c.strokeStyle = "#10161d";
  c.lineWidth = 1 / scale;
  for (const [x, y] of posts) {
    c.beginPath();
    c.arc(x, y, Math.max(0.35, 2.4 / scale), 0, 2 * Math.PI);
    c.fill();
    c.stroke();
  }
}
