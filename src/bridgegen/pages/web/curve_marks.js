// What is marked in the curves: named values, peaks beyond a panel, contacts and the minimum distance.

import { palette } from "./colours.js";
import { ZONED } from "./conflict.js";
import { drawMarker } from "./markers.js";
import { number } from "./numbers.js";

// A value that has a name, as a dashed line.
export function drawMark(c, { left, right, mark: [value, text] }, y) {
  const at = y(value);
  c.strokeStyle = c.fillStyle = palette.hit;
  c.lineWidth = 1;
  c.setLineDash([5, 4]);
  c.beginPath();
  c.moveTo(left, at);
  c.lineTo(right, at);
  c.stroke();
  c.setLineDash([]);
  c.textAlign = "left";
  c.textBaseline = "bottom";
  c.fillText(text, left + 6, at - 1);
}

// What runs out of a panel: an arrowhead at its edge, with the value.
export function drawPeaks(c, { left, right, top, bottom, beyond, high, unit }, x) {
  let ends = { up: -Infinity, down: -Infinity };
  for (const { name, colour, index, value } of beyond.toSorted((a, b) => a.index - b.index)) {
    const shape = value > high ? "up" : "down", at = shape === "up" ? top + 4 : bottom - 4;
    drawMarker(c, { shape, radius: 4.5, colour: colour(), edge: palette.card }, x(index), at);
    const text = `${name} ${number(value, 3)} ${unit}`.trim(), w = c.measureText(text).width;
    const from = x(index) + 9 + w > right ? x(index) - 9 - w : x(index) + 9;
    if (from < Math.max(left, ends[shape] + 6)) continue; // no room beside the last; the heading has the value at each instant
    ends = { ...ends, [shape]: from + w };
    c.save();
    c.fillStyle = palette.card;
    c.globalAlpha = 0.75;
    c.fillRect(from - 2, at - 7, w + 4, 14);
    c.restore();
    c.textAlign = "left";
    c.textBaseline = "middle";
    c.fillStyle = palette.ink;
    c.fillText(text, from, at);
  }
}

// The contacts in every panel; the smallest gap in that of the distance.
export function drawMoments(c, kept, panel, isFirst, x, y) {
  const { closest, contacts, distance, time_step: step } = kept, { left, right, top, bottom } = panel;
  c.lineWidth = 1.5;
  c.strokeStyle = palette.hit;
  for (const k of contacts) {
    c.beginPath();
    c.moveTo(x(k), top);
    c.lineTo(x(k), bottom);
    c.stroke();
  }
  const found = ZONED.includes(kept.conflict?.conflict) ? kept.conflict : null;
  for (const [k, colour] of found ? [[found.decided, palette.ink], ...(contacts.length ? [] : [[found.instant, palette.hit]])] : []) {
    c.strokeStyle = colour;
    c.setLineDash([4, 3]);
    c.beginPath();
    c.moveTo(x(k), top);
    c.lineTo(x(k), bottom);
    c.stroke();
    c.setLineDash([]);
  }
  if (closest === null || !isFirst) return;
  const hit = contacts.length > 0;
  const [px, py] = [x(closest), y(Math.min(distance[closest], panel.high))];
  c.fillStyle = hit ? palette.hit : palette.ink;
  drawMarker(c, { shape: hit ? "diamond" : "disc", radius: 4.8, colour: c.fillStyle }, px, py); // a diamond for a contact
  c.lineWidth = 1;
  c.setLineDash([2, 3]);
  c.strokeStyle = c.fillStyle;
  c.beginPath();
  c.moveTo(px, py - 6);
  c.lineTo(px, top + 8);
  c.stroke();
  c.setLineDash([]);
  const text = `${hit ? "collision" : `d_min ${distance[closest].toFixed(2)} m`} at ${(closest * step).toFixed(2)} s`;
  c.textBaseline = "middle";
  c.textAlign = "left";
  const w = c.measureText(text).width;
  const at = Math.max(left, px + 10 + w > right ? px - w - 10 : px + 10);
  const middle = top + 8;
  c.save();
  c.fillStyle = palette.card;
  c.globalAlpha = 0.75;
  c.fillRect(at - 3, middle - 8, w + 6, 16);
  c.restore();
  c.fillText(text, at, middle);
}
