// Fog, darkness, rain and snow over the road, weaker than they are: whoever is there is drawn on top, and stays in sight.

import { palette } from "./colours.js";
import { boxCentre, isPlaced } from "./geometry.js";
import { pill } from "./labels.js";
import { number } from "./numbers.js";

const MOST_FOG = 0.7;
const MOST_DARK = 0.66;
const LAMP_REACH = 14; // m
const BEAM = 38; // m
const BEAM_SPREAD = 0.34; // rad to either side
const CLEAR = 1000; // m, who sees farther sees the whole picture

// 0 by day to 1 in a moonless night, by the luminance of the ground [cd/m²].
export function darkness({ background }) {
  return Math.min(1, Math.max(0, (2 - Math.log10(Math.max(background, 1e-3))) / 4));
}

function isWet({ friction_scale: friction, rain }) {
  return rain > 0 || friction < 0.95;
}

export class Atmosphere {
  constructor() {
    this.layer = document.createElement("canvas");
  }

  // In metres: what lies on the road. Then, in pixels: `over`.
  drawRoadState(c, weather, outlines) {
    if (!isWet(weather)) return;
    c.fillStyle = `rgba(70, 130, 190, ${(0.1 + 0.12 * Math.min(1, Math.max(0, 1 - weather.friction_scale) / 0.4)).toFixed(3)})`;
    for (const { kind, path } of outlines) if (kind === "driving" || kind === "junction") c.fill(path);
  }

  over(c, scene, state, weather) {
    const dark = darkness(weather);
    if (dark > 0.02) this.drawNight(c, scene, state, dark);
    if (weather.sight < CLEAR) this.drawFog(c, scene, state, weather, dark);
    if (weather.rain > 0 || weather.snow > 0) this.drawFalling(c, scene.size, state, weather);
  }

  // A dark sheet with holes where lamps shine.
  drawNight(c, { view, size, kept }, state, dark) {
    const { layer } = this, half = 0.34; // the sheet is soft: a third of the pixels will do
    const width = Math.ceil(size.width * half), height = Math.ceil(size.height * half);
    if (layer.width !== width || layer.height !== height) Object.assign(layer, { width, height });
    const d = layer.getContext("2d");
    d.setTransform(1, 0, 0, 1, 0, 0);
    d.globalCompositeOperation = "copy";
    d.fillStyle = `rgba(4, 9, 24, ${(MOST_DARK * dark).toFixed(3)})`;
    d.fillRect(0, 0, width, height);
    d.globalCompositeOperation = "destination-out";
    d.setTransform(half, 0, 0, half, 0, 0);
    const shine = (x, y, reach, from, to) => {
      const r = reach * view.scale, light = d.createRadialGradient(x, y, 0, x, y, r);
      light.addColorStop(0, "rgba(0, 0, 0, 0.95)");
      light.addColorStop(0.5, "rgba(0, 0, 0, 0.6)");
      light.addColorStop(1, "rgba(0, 0, 0, 0)");
      d.fillStyle = light;
      d.beginPath();
      d.moveTo(x, y);
      d.arc(x, y, r, from, to);
      d.fill();
    };
    for (const at of kept.street_lights) shine(...view.toScreen(at), LAMP_REACH, 0, 2 * Math.PI);
    state.entities.forEach((s, e) => {
      const body = kept.entities[e];
      if (!isPlaced(s) || !(e === 0 || body.headlights)) return;
      const reach = body.center_ahead + body.length / 2;
      for (const side of [-0.35, 0.35]) {
        const [x, y] = view.toScreen([
          s.x + reach * Math.cos(s.h) - side * body.width * Math.sin(s.h), s.y + reach * Math.sin(s.h) + side * body.width * Math.cos(s.h),
        ]);
        shine(x, y, BEAM, -s.h - BEAM_SPREAD, -s.h + BEAM_SPREAD);
      }
    });
    c.drawImage(layer, 0, 0, size.width, size.height);
  }

  // As thick as the contrast that is lost between the ego and there, and a ring where 5 % of it are left.
  drawFog(c, { view, size, kept }, state, { sight }, dark) {
    const ego = state.entities[0];
    if (!isPlaced(ego)) return;
    const [x, y] = view.toScreen(boxCentre(kept.entities[0], ego.x, ego.y, ego.h)), r = sight * view.scale;
    const fog = c.createRadialGradient(x, y, 0, x, y, 1.5 * r);
    for (let i = 0; i <= 12; i++) {
      const share = i / 12, alpha = MOST_FOG * (1 - 0.45 * dark) * (1 - Math.exp(-2.996 * 1.5 * share));
      fog.addColorStop(share, `rgba(${dark > 0.5 ? "96, 106, 120" : palette.fog}, ${alpha.toFixed(3)})`);
    }
    c.fillStyle = fog;
    c.fillRect(0, 0, size.width, size.height);
    if (r > 1.1 * Math.hypot(size.width, size.height)) return;
    c.save();
    for (const [colour, pixels] of [["rgba(8, 16, 26, 0.55)", 3], ["rgba(255, 255, 255, 0.95)", 1.25]]) {
      c.strokeStyle = colour;
      c.lineWidth = pixels;
      c.setLineDash([3, 5]);
      c.beginPath();
      c.arc(x, y, r, 0, 2 * Math.PI);
      c.stroke();
    }
    c.restore();
    const spots = [[x, y - r], [x + r, y], [x, y + r], [x - r, y]];
    const spot = spots.find(([u, v]) => u > 60 && v > 60 && u < size.width - 60 && v < size.height - 50);
    if (spot) pill(c, size, `sight ${number(sight, 2)} m`, ...spot, palette.line);
  }

  // Streaks and flakes, the same at the same time; where motion is not wanted they stand still.
  drawFalling(c, { width, height }, { time }, { rain, snow }) {
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const n = Math.round(Math.min(110, 25 + 6 * Math.max(rain, 4 * snow))), now = still ? 0 : time;
    c.save();
    c.strokeStyle = c.fillStyle = palette.rain;
    c.lineWidth = 1;
    c.beginPath();
    for (let i = 0; i < n; i++) {
      const u = (Math.sin(i * 12.9898) * 43758.5453) % 1, v = (Math.sin(i * 78.233) * 24634.6345) % 1;
      const x = Math.abs(u) * width, fall = rain > 0 ? 420 : 60;
      const y = (Math.abs(v) * height + now * fall) % height;
      if (rain > 0) {
        c.moveTo(x, y);
        c.lineTo(x - 2, y + 9);
      } else {
        c.moveTo(x + 1.6, y);
        c.arc(x, y, 1.6, 0, 2 * Math.PI);
      }
    }
    if (rain > 0) c.stroke();
    else c.fill();
    c.restore();
  }
}
