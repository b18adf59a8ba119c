// The OpenSCENARIO file and the command line of values that a page simulates.

// A number as `format_double` writes it: the shortest digits, without an exponent where other tools have none.
function digits(x) {
  if (Object.is(x, -0)) return "-0.0";
  const text = String(x), size = Math.abs(x), [, sign, head, tail = "", power] = /^(-?)(\d+)\.?(\d*)(?:e([-+]\d+))?$/.exec(text) ?? [];
  if (!Number.isFinite(x)) return x > 0 ? "INF" : "-INF";
  if (!power) return Number.isInteger(x) && size < 1e16 ? `${text}.0` : text;
  if (size < 1e-15 || size >= 1e22) return text;
  return Number(power) < 0 ? `${sign}0.${"0".repeat(-Number(power) - 1)}${head}${tail}` : `${sign}${head}${tail}${"0".repeat(Number(power) - tail.length)}`;
}

const ESCAPES = { "&": "amp", "<": "lt", ">": "gt", '"': "quot" };

// See `storyboard_payload.Hole`.
function filled({ of, whole, words, formula }, evaluate, values, driver) {
  if (!of) return driver;
  const x = formula ? evaluate(formula, { x: values[of] }) : values[of];
  if (words.length) return words[x];
  if (!formula) return whole ? String(Math.trunc(x)) : digits(x);
  return `2025-03-20T${[x / 3600, (x / 60) % 60, x % 60].map((part) => String(Math.floor(part)).padStart(2, "0")).join(":")}`;
}

/**
 * The file of a row, with the bytes that the search's export has.
 * @param {string} template with numbers of holes between two characters of private use
 * @param {any[]} holes
 * @param {(formula: any, values: Record<string, number>) => number} evaluate
 * @param {Record<string, number>} values by parameter, derived ones among them
 * @param {string} driver of the ego
 */
export function fileOf(template, holes, evaluate, values, driver) {
  return template.replace(/\ue000(\d+)\ue001/g, (_, number) => filled(holes[number], evaluate, values, driver).replace(/[&<>"]/g, (sign) => `&${ESCAPES[sign]};`));
}

// A word of a command line, as `shlex.quote` writes it.
export const shellWord = (text) => (/^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", `'"'"'`)}'`);
