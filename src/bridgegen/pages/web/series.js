// Numbers over time, see series.py: runs of [first instant, length, value, difference, second differences …].

export function unpackSeries(runs, n, scale) {
  const values = new Array(n).fill(null);
  for (const [first, length, start, ...rest] of runs) {
    let value = start, step = 0;
    for (let i = 0; i < length; i++) {
      values[first + i] = value / scale;
      step += rest[i] ?? 0;
      value += step;
    }
  }
  return values;
}
