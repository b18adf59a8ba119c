// The words in the bird's-eye view, in pixels: who is who, which light shows what, how long a metre is.

import { roundBox } from "./bodies.js";
import { palette } from "./colours.js";
import { boxCorners, colourOf, isPlaced } from "./geometry.js";
import { SIGNALS, lightAt } from "./unpack.js";
import { FONT } from "./view.js";

export const CROSS = 8; // pixels, half of its width
const CAR = 8; // m²: the words of people and cycles are as long as a small car's

/** @type {(a: number[], b: number[]) => number} */
function overlap([ax0, ay0, ax1, ay1], [bx0, by0, bx1, by1]) {
  return Math.max(0, Math.min(ax1, bx1) - Math.max(ax0, bx0)) * Math.max(0, Math.min(ay1, by1) - Math.max(ay0, by0));
}

// A text in a rounded box about (x, y), kept inside the picture.
export function pill(c, { width, height }, text, x, y, colour, fill = palette.label) {
  c.font = FONT;
  const w = c.measureText(text).width + 14, h = 20;
  const left = Math.min(width - w - 4, Math.max(4, x - w / 2));
  const top = Math.min(height - h - 4, Math.max(4, y - h / 2));
  c.fillStyle = fill;
  c.strokeStyle = colour;
  c.lineWidth = 1.5;
  roundBox(c, left, top, w, h, 10);
  c.fill();
  c.stroke();
  c.fillStyle = palette.ink;
  c.textBaseline = "middle";
  c.textAlign = "left";
  c.fillText(text, left + 7, top + h / 2 + 0.5);
}

// A cross where a contact began.
export function drawCross(c, x, y) {
  const r = 0.7 * CROSS;
  c.lineCap = "round";
  for (const [colour, pixels] of [[palette.card, 5.5], [palette.hit, 3]]) {
    c.strokeStyle = colour;
    c.lineWidth = pixels;
    c.beginPath();
    for (const side of [-1, 1]) {
      c.moveTo(x - r, y - side * r);
      c.lineTo(x + r, y + side * r);
    }
    c.stroke();
  }
  c.lineCap = "butt";
}

// A body's label goes to that one of eight places around it which hides least; the side away from the
// others and the place it had before are preferred, so that it does not jump about.
export class Labels {
  constructor(kept) {
    this.kept = kept;
    this.places = [];
  }

  // `texts` by entity: null for none, else the whole and the short one, for a body that is smaller on the
  // screen than the whole; `others` are boxes of other words, `free` those that no word should hide.
  draw(c, state, view, size, texts, others, free) {
    this.boxes = [];
    const { width, height } = size;
    const bodies = state.entities.map((s, e) => {
      if (!isPlaced(s)) return null;
      const corners = boxCorners(this.kept.entities[e], s.x, s.y, s.h).map((p) => view.toScreen(p));
      const xs = corners.map((p) => p[0]), ys = corners.map((p) => p[1]);
      return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
    });
    const taken = [...bodies.filter(Boolean), [0, 0, width, 52], [0, height - 36, width, height], ...others]; // clock, zoom; scale bar, weather
    const middles = bodies.map((box) => box && [(box[0] + box[2]) / 2, (box[1] + box[3]) / 2]);
    const seen = middles.filter(Boolean);
    const hub = [0, 1].map((i) => seen.reduce((sum, p) => sum + p[i], 0) / seen.length);
    c.font = FONT;
    texts.forEach((both, e) => {
      const [mx, my] = middles[e] ?? [];
      if (both === null || !bodies[e] || !overlap(bodies[e], [0, 0, width, height])) return;
      const { length, width: across } = this.kept.entities[e], h = 20, wide = (text) => c.measureText(text).width + 14;
      const body = Math.max(length * across, CAR) * view.scale ** 2, [x0, y0, x1, y1] = bodies[e];
      const text = wide(both[0]) * h <= body ? both[0] : both[1], w = wide(text);
      const away = seen.length > 1 ? Math.atan2(my - hub[1], mx - hub[0]) : -Math.PI / 2;
      let best = { cost: Infinity };
      for (let place = 0; place < 8; place++) {
        const angle = (place * Math.PI) / 4;
        const x = mx + Math.cos(angle) * ((x1 - x0) / 2 + w / 2 + 5), y = my + Math.sin(angle) * ((y1 - y0) / 2 + h / 2 + 6);
        const box = [x - w / 2, y - h / 2, x + w / 2, y + h / 2];
        const hidden = taken.reduce((sum, other) => sum + overlap(box, other), 0) + free.reduce((sum, other) => sum + 4 * overlap(box, other), 0);
        const outside = w * h - overlap(box, [0, 0, width, height]);
        const turned = 0.15 * w * h * (1 - Math.cos(angle - away)), kept = this.places[e] === place ? 0.35 * w * h : 0;
        const cost = hidden + outside + turned - kept;
        if (cost < best.cost) best = { cost, place, x, y, box };
      }
      this.places[e] = best.place;
      taken.push(best.box);
      this.boxes.push(best.box);
      pill(c, size, text, best.x, best.y, colourOf(this.kept, e));
    });
  }
}

// Where somebody out of sight is: a word at the picture's edge, with the distance [m] between the bodies' middles.
export function pointTo(c, { width, height }, view, name, from, to, colour) {
  const [x, y] = view.toScreen(to), inset = 26;
  if (x > 0 && y > 0 && x < width && y < height) return null;
  const [mx, my] = [width / 2, height / 2], angle = Math.atan2(y - my, x - mx);
  const reach = Math.min((mx - inset) / Math.abs(Math.cos(angle) || 1e-9), (my - inset - 34) / Math.abs(Math.sin(angle) || 1e-9));
  const arrow = "→↘↓↙←↖↑↗"[(Math.round((4 * angle) / Math.PI) + 8) % 8];
  const at = [mx + Math.cos(angle) * reach, my + Math.sin(angle) * reach];
  pill(c, { width, height }, `${arrow} ${name}  ${Math.round(Math.hypot(to[0] - from[0], to[1] - from[1]))} m`, ...at, colour);
  return [at[0] - 45, at[1] - 10, at[0] + 45, at[1] + 10];
}

// What a light shows, as a word beside it, on the side that traffic does not come from. Returns the words' boxes.
export function labelLamps(c, kept, index, view, size) {
  const boxes = [];
  c.font = FONT.replace("600 12px", "600 11px");
  c.textBaseline = "middle";
  c.textAlign = "center";
  for (const lamp of kept.lamps) {
    const text = SIGNALS[lightAt(lamp, index)] ?? "?", w = c.measureText(text).width + 8;
    const reach = Math.max(0.45, 3.2 / view.scale) * 3.6 * view.scale;
    const [x, y] = view.toScreen([lamp.x, lamp.y]);
    const ux = Math.cos(lamp.h), uy = -Math.sin(lamp.h);
    const [cx, cy] = [x + ux * (reach + 4 + w / 2 * Math.abs(ux)), y + uy * (reach + 10)];
    if (cx < 0 || cy < 0 || cx > size.width || cy > size.height) continue;
    c.fillStyle = "rgba(16, 22, 29, 0.85)";
    roundBox(c, cx - w / 2, cy - 8, w, 16, 4);
    c.fill();
    c.fillStyle = "#ffffff";
    c.fillText(text, cx, cy + 0.5);
    boxes.push([cx - w / 2, cy - 8, cx + w / 2, cy + 8]);
  }
  return boxes;
}

export function drawScaleBar(c, { height }, scale) {
  const metres = [1, 2, 5, 10, 20, 50, 100].find((m) => m * scale >= 50) ?? 100;
  const x = 14, y = height - 16;
  c.fillStyle = palette.label;
  c.fillRect(x - 6, y - 15, metres * scale + 12, 23);
  c.strokeStyle = c.fillStyle = palette.ink;
  c.lineWidth = 1.5;
  c.beginPath();
  c.moveTo(x, y - 3);
  c.lineTo(x, y + 2);
  c.lineTo(x + metres * scale, y + 2);
  c.lineTo(x + metres * scale, y - 3);
  c.stroke();
  c.font = FONT;
  c.textBaseline = "alphabetic";
  c.textAlign = "center";
  c.fillText(`${metres} m`, x + (metres * scale) / 2, y - 2);
}
