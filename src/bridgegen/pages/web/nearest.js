// The drawn point that is nearest to a place, found by a grid of cells.

const CELL = 24; // px

export class Nearest {
  // points: anything with x and y in pixels.
  constructor(points) {
    this.cells = new Map();
    for (const point of points) {
      const key = this.key(Math.floor(point.x / CELL), Math.floor(point.y / CELL));
      if (!this.cells.has(key)) this.cells.set(key, []);
      this.cells.get(key).push(point);
    }
  }

  key(column, row) {
    return column * 65536 + row;
  }

  // The nearest within `reach` pixels, of equally near ones that which was given last; or null.
  find(x, y, reach) {
    let best = null, least = reach;
    const [left, right, top, bottom] = [x - reach, x + reach, y - reach, y + reach].map((end) => Math.floor(end / CELL));
    for (let column = left; column <= right; column++) {
      for (let row = top; row <= bottom; row++) {
        for (const point of this.cells.get(this.key(column, row)) ?? []) {
          const distance = Math.hypot(point.x - x, point.y - y);
          if (distance > least) continue;
          least = distance;
          best = point;
        }
      }
    }
    return best;
  }
}
