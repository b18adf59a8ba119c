// Canvases: sharp on every screen; and the part of the world that the bird's-eye view shows.

// Fits a canvas to its place on the page in device pixels; returns its size in CSS pixels.
export function fitCanvas(canvas, options) {
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d", options);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return { context, width, height, ratio };
}

export const FONT = '600 12px system-ui, -apple-system, "Segoe UI", Roboto, "Liberation Sans", Arial, sans-serif';
const TURN = 0.006; // rad for each pixel that is dragged
const ABOVE = 46;
const BELOW = 38; // pixels that the clock and the scale bar take

// Where the middle of the canvas lies in the world [m], and how many pixels a metre has.
export class View {
  constructor(canvas, changed) {
    this.canvas = canvas;
    this.changed = changed;
    this.x = this.y = 0;
    this.scale = 6;
    this.factor = 1; // the reader's own zoom, where the camera chooses the scale
    this.orbit = { yaw: 0, pitch: 0.26, away: 17 }; // of the eye about the ego [rad, rad, m], in perspective
    /** @type {"conflict" | "all" | "ego" | "chase" | null} what the camera shows; null once the reader has moved the view */
    this.framing = "all";
    this.listen();
  }

  toScreen([x, y]) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    return [width / 2 + (x - this.x) * this.scale, height / 2 - (y - this.y) * this.scale];
  }

  // Shows all of the points with some air [m] around them, or their middle at the least scale.
  fit(points, margin, [least, most] = [0.5, 24]) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!points.length || !width) return;
    const xs = points.map((p) => p[0]), ys = points.map((p) => p[1]);
    const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const scale = Math.min(width / (x1 - x0 + 2 * margin), (height - ABOVE - BELOW) / (y1 - y0 + 2 * margin));
    this.scale = this.factor * Math.min(most, Math.max(least, scale));
    this.centre([(x0 + x1) / 2, (y0 + y1) / 2]);
  }

  // Shows a point in the middle of what the clock and the scale bar leave.
  centre([x, y]) {
    [this.x, this.y] = [x, y + (ABOVE - BELOW) / 2 / this.scale];
  }

  // Keeps a point within a share of the width and height about the middle.
  keep([x, y], share) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const within = (at, middle, reach) => Math.min(at + reach, Math.max(at - reach, middle));
    this.x = within(x, this.x, (share * width) / this.scale);
    this.y = within(y, this.y, (share * height) / this.scale);
  }

  // Keeps the world's point at the pixel `at` in its place.
  zoom(factor, at = null) {
    if (this.framing === "chase") {
      this.orbit.away = Math.min(150, Math.max(6, this.orbit.away / factor));
      return void this.changed();
    }
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const scale = Math.min(60, Math.max(0.5, this.scale * factor));
    const [px, py] = at ?? [width / 2, height / 2];
    const shift = 1 / this.scale - 1 / scale;
    this.x += (px - width / 2) * shift;
    this.y += (height / 2 - py) * shift;
    if (this.framing === "all") this.framing = null;
    this.factor *= scale / this.scale;
    this.scale = scale;
    this.changed();
  }

  move(dx, dy) {
    if (this.framing === "chase") {
      this.orbit.yaw -= TURN * dx;
      this.orbit.pitch = Math.min(Math.PI / 2, Math.max(0.05, this.orbit.pitch + TURN * dy));
      return void this.changed();
    }
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
    this.framing = null;
    this.changed();
  }

  // Drag to move, pinch or ctrl + wheel to zoom; a plain wheel keeps scrolling the page.
  listen() {
    const pointers = new Map();
    const spread = () => { const [a, b] = [...pointers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
    const at = (event) => { const box = this.canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
    this.canvas.addEventListener("pointerdown", (event) => {
      pointers.set(event.pointerId, at(event));
      this.canvas.setPointerCapture(event.pointerId);
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (!pointers.has(event.pointerId)) return;
      const before = pointers.get(event.pointerId), now = at(event), apart = pointers.size > 1 ? spread() : 0;
      pointers.set(event.pointerId, now);
      if (pointers.size > 1) return this.zoom(spread() / Math.max(1, apart), now);
      this.move(now[0] - before[0], now[1] - before[1]);
    });
    for (const type of ["pointerup", "pointercancel"]) this.canvas.addEventListener(type, (event) => pointers.delete(event.pointerId));
    this.canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY * 0.004), at(event));
    }, { passive: false });
  }
}
