// What other simulators made of the scenarios: a section of the page, a column of the table, and where they had everybody.

let elsewhere = []; // by simulator, as in the data, with its scenarios by evaluation and its verdicts by row of the page
const VERDICTS = { 1: ["✓", "confirmed"], 0: ["✗", "not confirmed"], "-1": ["?", "not run"] };

function takeElsewhere() {
  elsewhere = data.confirmations.map((one) => {
    const at = new Map(one.scenarios.map((scenario) => [scenario.evaluation, scenario]));
    return { ...one, column: `in ${one.simulator}`, at, values: rows.evaluation.map((evaluation) => verdictOf(at.get(evaluation))) };
  });
}
takeElsewhere();

// A key of VERDICTS; null of what nobody ran there.
function verdictOf(scenario) {
  if (!scenario) return null;
  return scenario.confirmed === null ? -1 : Number(scenario.confirmed);
}

function elsewhereBy(column) {
  return elsewhere.find((one) => one.column === column);
}

// Of the table: what became of a row in a simulator.
function verdictCell(value) {
  if (value === null) return element("td", {}, "–");
  const [sign, words] = VERDICTS[value];
  return element("td", { class: `verdict-${value}`, title: words }, element("span", { role: "img", "aria-label": words }, sign));
}

// Where other simulators had those who were off, of a scenario in the player.
function ghostsOf(kept) {
  kept.ghosts ??= elsewhere.flatMap((one) => (one.at.get(kept.evaluation)?.tracks ?? []).map((track) => {
    const series = (name) => unpackSeries(track[name], track.n, 1).map((value) => (value === null ? null : value / one.scale[name]));
    const e = kept.entities.findIndex((entity) => entity.name === track.entity);
    return { simulator: one.simulator, label: one.label, parted: one.parted_at, entity: e, x: series("x"), y: series("y"), h: series("h") };
  })).filter(({ entity }) => entity >= 0);
  return kept.ghosts;
}

// Those that are somewhere now, and how far from where they are here [m].
function ghostsAt(kept, state) {
  const k = state.index, f = state.time / kept.time_step - k;
  const mix = (row) => (f < 1e-9 || (row[k + 1] ?? null) === null ? row[k] ?? null : row[k] === null ? null : row[k] + f * (row[k + 1] - row[k]));
  return ghostsOf(kept).map((ghost) => {
    const { x: hereX, y: hereY } = state.entities[ghost.entity];
    const [x, y, h] = [mix(ghost.x), mix(ghost.y), mix(ghost.h)];
    const off = x === null || hereX === null ? null : Math.hypot(x - hereX, y - hereY);
    return { simulator: ghost.simulator, parted: ghost.parted, entity: ghost.entity, x, y, h, off };
  }).filter(isPlaced);
}

const GHOST_DASHES = [[6, 4], [2, 3], [10, 3, 2, 3]];

// Outlines where other simulators have them, each simulator in its own dashes, and lines to where they are here.
function drawElsewhere(c, kept, state, scale) {
  for (const ghost of ghostsAt(kept, state)) {
    const body = kept.entities[ghost.entity], here = state.entities[ghost.entity];
    const dashes = GHOST_DASHES[elsewhere.findIndex((one) => one.simulator === ghost.simulator) % GHOST_DASHES.length];
    const stroke = (colour, pixels, dashed) => {
      c.strokeStyle = colour;
      c.lineWidth = pixels / scale;
      c.setLineDash(dashed.map((length) => length / scale));
      c.stroke();
    };
    const outline = () => {
      c.beginPath();
      boxCorners(body, ghost.x, ghost.y, ghost.h).forEach((p, i) => c[i ? "lineTo" : "moveTo"](...p));
      c.closePath();
    };
    outline();
    stroke(palette.label, 4, []);
    stroke(colourOf(kept, ghost.entity), 2.5, dashes);
    if (ghost.off === null || ghost.off <= ghost.parted) continue;
    c.beginPath();
    c.moveTo(...boxCentre(body, here.x, here.y, here.h));
    c.lineTo(...boxCentre(body, ghost.x, ghost.y, ghost.h));
    stroke(colourOf(kept, ghost.entity), 1.5, dashes);
  }
  c.setLineDash([]);
}

// Of an entity, in words: "1.2 m elsewhere in esmini".
function elsewhereWords(kept, state, e) {
  const off = ghostsAt(kept, state).filter((ghost) => ghost.entity === e && ghost.off > ghost.parted);
  return off.map((ghost) => `${ghost.off.toFixed(1)} m elsewhere in ${ghost.simulator}`).join(", ");
}

// The section that tells all of it; open(evaluation, seconds) shows one in the player.
class Elsewhere {
  constructor(open) {
    this.open = open;
    this.fill();
  }

  fill() {
    $("elsewhere").hidden = !elsewhere.length;
    $("elsewhere-cards").replaceChildren(...elsewhere.map((one) => this.card(one)));
  }

  card(one) {
    const byHarm = one.rule === "harm";
    const head = ["Scenario", "There", ...(byHarm ? ["harm", "d_min"] : ["d_min", "v_d"]), "First contact", "Parts first"];
    const units = ["", "", ...(byHarm ? ["", "m"] : ["m", "m/s"]), "s", `by over ${one.parted_at} m`];
    const cells = head.map((name, k) => element("th", { scope: "col" }, name, element("small", {}, units[k] || "\u00a0")));
    const table = element("table", {}, element("caption", { class: "hidden" }, `Scenarios in ${one.label}`),
      element("thead", {}, element("tr", {}, ...cells)), element("tbody", {}, ...one.scenarios.map((scenario) => this.row(one, scenario))));
    const less = one.without_tracks ? [element("p", { class: "muted small" }, `The outlines of ${number(one.without_tracks)} of them, the least critical, found no room in this page.`)] : [];
    return element("div", { class: "card" }, element("h3", {}, one.label), ...one.sentences.map((sentence) => element("p", {}, sentence)),
      element("div", { class: "wide", tabindex: "0", role: "group", "aria-label": `Scenarios in ${one.label}, scrollable` }, table), ...less);
  }

  row(one, scenario) {
    const { here, there, parts } = scenario, verdict = verdictOf(scenario), words = VERDICTS[verdict][1];
    const button = element("button", { type: "button", class: "quiet", "aria-label": `Show ${scenario.name} where it parts` }, scenario.name);
    button.addEventListener("click", () => this.open(scenario.evaluation, parts?.time ?? null));
    const change = (name, none) => {
      const text = (value) => (value === null ? none : value.toFixed(2));
      if (!there) return element("td", {}, text(here[name]));
      const same = text(here[name]) === text(there[name]);
      return element("td", {}, same ? text(here[name]) : `${text(here[name])} → ${text(there[name])}`);
    };
    const first = !there ? "–" : parts ? `${parts.entity} at ${parts.time.toFixed(2)} s` : "nobody";
    const why = element("details", {}, element("summary", {}, first), element("span", {}, scenario.text));
    why.open = verdict !== 1;
    return element("tr", {}, element("td", {}, button), element("td", { class: `verdict-${verdict}` }, words),
      ...(one.rule === "harm" ? [change("harm", "–"), change("d_min", "∞")] : [change("d_min", "∞"), change("v_d", "–")]), change("contact", "none"), element("td", { class: "why" }, why));
  }
}
