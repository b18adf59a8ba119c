// Axes of charts: the range that they show, where a value lies on it, and round marks.

import { number, turned } from "./numbers.js";

const RULED = 4; // times the range of nearly all values: a longer one is ruled by a few of them
const FEW = 0.005; // of all values, at either end
const ENOUGH = 8; // values, of fewer all are shown
const MAGNITUDES = 300; // times the smallest of nearly all values: their largest on a logarithmic axis, at least
const PADDING = 0.03;

export function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((m) => m * power).find((step) => step >= least * 0.999);
}

export function ticks(low, high, wanted) {
  const step = roundStep((high - low) / wanted), list = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-4; i++) list.push(i * step || 0); // no −0
  return list;
}

// Nearly all of the ascending values: from which to which.
function core(sorted) {
  const n = sorted.length, few = n < ENOUGH ? 0 : Math.max(n < 20 ? 1 : 2, Math.floor(n * FEW));
  return [sorted[few], sorted[n - 1 - few]];
}

/**
 * The range of ascending values without those few at the ends that would rule it.
 * @param {Float64Array} sorted
 */
export function unruled(sorted) {
  const low = sorted[0], high = sorted[sorted.length - 1], [from, to] = core(sorted), width = to - from;
  if (!width || high - low <= RULED * width) return [low, high];
  return [low < from - width ? from - width / 4 : low, high > to + width ? to + width / 4 : high];
}

const superscript = (power) => String(power).replace(/./g, (sign) => (sign === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[sign]));

export class Axis {
  /**
   * @param {Iterable<number | null>} values that lie on it
   * @param {object} [how]
   * @param {any} [how.column] their column, for the names of categories and for angles
   * @param {boolean} [how.whole] shows every value, however far off
   * @param {boolean} [how.zero] begins at 0 if no value is below
   * @param {[number, number] | null} [how.ends] shows this range
   */
  constructor(values, { column = null, whole = false, zero = false, ends = null } = {}) {
    this.column = column;
    const sorted = Float64Array.from([...values].filter((value) => Number.isFinite(value))).sort();
    [this.least, this.most] = sorted.length ? [sorted[0], sorted.at(-1)] : [0, 1];
    const [from, to] = core(sorted);
    this.log = !column?.words && !zero && this.least > 0 && sorted.length >= ENOUGH && to / from >= MAGNITUDES;
    this.below = this.above = 0; // values beyond the ends
    if (ends) [this.low, this.high] = ends;
    else if (this.log) [this.low, this.high] = this.padded(this.least, this.most);
    else {
      const [low, high] = whole || !sorted.length ? [this.least, this.most] : unruled(sorted);
      [this.low, this.high] = this.padded(zero ? Math.min(0, low) : low, high, zero && low >= 0);
      this.below = sorted.findIndex((value) => value >= this.low);
      const first = sorted.findIndex((value) => value > this.high);
      this.above = first < 0 ? 0 : sorted.length - first;
      if (!sorted.length) this.below = 0;
    }
    this.place(0, 1);
  }

  padded(low, high, fromZero = false) {
    if (this.column?.words) return [low - 0.5, high + 0.5];
    if (this.log) return [low / (high / low) ** PADDING, high * (high / low) ** PADDING];
    if (high <= low) return fromZero && low === 0 ? [0, 1] : [low - (Math.abs(low) || 1) / 2, high + (Math.abs(high) || 1) / 2];
    const room = PADDING * (high - low);
    return [fromZero ? low : low - room, high + room];
  }

  // Its ends in pixels.
  place(from, to) {
    this.from = from;
    this.to = to;
    return this;
  }

  share(value) {
    if (this.log) return Math.log(value / this.low) / Math.log(this.high / this.low);
    return (value - this.low) / (this.high - this.low);
  }

  at(value) {
    return this.from + (this.to - this.from) * this.share(value);
  }

  // Where a value is drawn: at the end if it lies beyond.
  within(value) {
    return this.from + (this.to - this.from) * Math.min(1, Math.max(0, this.share(value)));
  }

  valueAt(pixel) {
    const share = (pixel - this.from) / (this.to - this.from);
    return this.log ? this.low * (this.high / this.low) ** share : this.low + (this.high - this.low) * share;
  }

  // Round values with their texts, a mark every so many pixels.
  marks(every) {
    const wanted = Math.max(2, Math.abs(this.to - this.from) / every), words = this.column?.words;
    if (words) return words.map((text, i) => ({ value: i, text })).filter(({ value }) => value >= this.low && value <= this.high);
    const first = Math.ceil(Math.log10(this.low) - 1e-9), last = Math.floor(Math.log10(this.high) + 1e-9);
    if (this.log && last - first >= 1) {
      const powers = Array.from({ length: last - first + 1 }, (_, i) => first + i), skip = Math.ceil(powers.length / wanted);
      return powers.filter((power) => power % skip === 0).map((power) => ({ value: 10 ** power, text: power >= -3 && power <= 4 ? (power < 0 ? (10 ** power).toFixed(-power) : number(10 ** power)) : `10${superscript(power)}` }));
    }
    const values = ticks(this.low, this.high, wanted), step = values.length > 1 ? values[1] - values[0] : 1;
    return values.map((value) => ({ value, text: this.text(turned(value, this.column), step) }));
  }

  text(value, step) {
    if (Math.abs(value) >= 1e6 || (value !== 0 && step < 1e-4)) return number(value);
    const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    return Math.abs(value).toLocaleString("en-GB", { minimumFractionDigits: places, maximumFractionDigits: places }).replace(/^(?=.)/, value < 0 ? "−" : "");
  }

  // What lies beyond the ends, in words; an arrow says where.
  beyond(arrows) {
    const many = (n) => `${number(n)} ${n === 1 ? "value" : "values"}`;
    const limit = (value, end) => number(Math.abs(value - end) < 1e-9 ? value : Number(value.toPrecision(3)), 3);
    return [
      this.below ? `${arrows[0]} ${many(this.below)} below ${limit(this.low, this.least)}, to ${number(this.least, 3)}` : "",
      this.above ? `${many(this.above)} above ${limit(this.high, this.most)}, to ${number(this.most, 3)} ${arrows[1]}` : "",
    ].filter(Boolean);
  }
}
