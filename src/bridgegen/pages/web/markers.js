// Markers of points: discs, diamonds, squares, rings, and arrowheads at the end of an axis.

const OUTLINES = {
  diamond: [[0, -1.25], [1.25, 0], [0, 1.25], [-1.25, 0]],
  square: [[-1, -1], [1, -1], [1, 1], [-1, 1]],
  up: [[0, -1.2], [1.1, 0.9], [-1.1, 0.9]],
  down: [[0, 1.2], [1.1, -0.9], [-1.1, -0.9]],
  left: [[-1.2, 0], [0.9, -1.1], [0.9, 1.1]],
  right: [[1.2, 0], [-0.9, -1.1], [-0.9, 1.1]],
};

// Adds a shape's outline around (x, y) to the path.
function outline(c, shape, x, y, r) {
  const corners = OUTLINES[shape];
  if (!corners) {
    c.moveTo(x + r, y);
    c.arc(x, y, r, 0, 2 * Math.PI);
    return;
  }
  corners.forEach(([a, b], i) => c[i ? "lineTo" : "moveTo"](x + a * r, y + b * r));
  c.closePath();
}

/**
 * Draws one marker; `open` ones are a line around what they mark.
 * @param {any} c
 * @param {{ shape: string, radius: number, colour: string, open?: boolean, edge?: string }} how
 */
export function drawMarker(c, { shape, radius, colour, open = false, edge = "" }, x, y) {
  c.beginPath();
  outline(c, shape, x, y, radius);
  if (open) {
    c.strokeStyle = colour;
    c.lineWidth = radius > 8 ? 3 : 1.75;
    c.stroke();
    return;
  }
  c.fillStyle = colour;
  c.fill();
  if (!edge) return;
  c.strokeStyle = edge;
  c.lineWidth = 0.75;
  c.stroke();
}

// A marker drawn once, to be stamped at thousands of places.
export class Stamp {
  constructor(marker, ratio) {
    this.half = Math.ceil(marker.radius * 1.4) + 2;
    const size = 2 * this.half;
    this.picture = Object.assign(document.createElement("canvas"), { width: size * ratio, height: size * ratio });
    const c = this.picture.getContext("2d");
    c.scale(ratio, ratio);
    drawMarker(c, marker, this.half, this.half);
  }

  draw(c, x, y) {
    c.drawImage(this.picture, x - this.half, y - this.half, 2 * this.half, 2 * this.half);
  }
}
