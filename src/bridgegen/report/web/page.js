// Shared by the report's scripts: the data, formatting, colours; and the parts of the page without motion.

const data = JSON.parse($("data").textContent);
const rows = data.rows;
const columns = new Map(data.rows.columns.map((column) => [column.name, column]));
const darkScheme = matchMedia("(prefers-color-scheme: dark)");

function number(value, digits = 4) {
  if (value === null || value === undefined) return "–";
  if (value < 0) return `−${number(-value, digits)}`;
  if (value !== 0 && (Math.abs(value) < 1e-3 || Math.abs(value) >= 1e6)) return value.toExponential(2);
  if (Number.isInteger(value)) return value.toLocaleString("en-GB");
  const whole = Math.max(1, Math.floor(Math.log10(Math.abs(value))) + 1);
  return value.toFixed(Math.max(0, Math.min(3, digits - whole)));
}

function unitText(unit) {
  return { "": "", 1: "", "-": "", "–": "", count: "", deg: "°", "m/s^2": "m/s²" }[unit] ?? unit;
}

// A measured value keeps its decimals when they are zero; a count has none.
function measured(value, unit, digits = 4) {
  if (value === null || value === undefined || unit === "count" || Math.abs(value) >= 1e6) return number(value, digits);
  if (unitText(unit) && Math.abs(value) < 5e-4) return (0).toFixed(digits - 1); // nobody measures a nanometre
  if (value < 0) return `−${measured(-value, unit, digits)}`;
  if (!Number.isInteger(value)) return number(value, digits);
  return value.toFixed(Math.max(0, digits - 1 - Math.floor(Math.log10(Math.max(1, Math.abs(value))))));
}

function quantity(value, unit, digits) {
  const text = unitText(unit);
  return value === null || value === undefined || !text ? measured(value, unit, digits) : measured(value, unit, digits) + NARROW + text;
}

// A parameter's value as people read it, where that is no plain number: of a category its name, of an angle that within one turn.
function worded(value, of) {
  return of?.words && typeof value === "number" ? of.words[Math.round(value)] ?? "–" : null;
}

function turned(value, of) {
  return of?.turn && value > of.turn ? value - 360 : value;
}

function titled(name) {
  const unit = unitText(columns.get(name)?.unit ?? "");
  return unit ? `${name} [${unit}]` : name;
}

let palette = {};
function readPalette() {
  const style = getComputedStyle(document.documentElement);
  const names = ["bg", "card", "ink", "muted", "line", "soft", "accent", "critical", "plain", "band", "grid", "ground",
    "asphalt", "asphalt-2", "marking", "stop", "ego", "other-1", "other-2", "other-3", "label", "hit", "cone",
    "seen", "displaced", "missed", "fog", "rain"];
  palette = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

// The ego is always the same colour and drawn solid; the others differ by colour and by dashes.
function entityColour(e) {
  return e === 0 ? palette.ego : palette[`other-${((e - 1) % 3) + 1}`];
}
const DASHES = [[], [7, 4], [2, 3], [9, 3, 2, 3]];

async function copy(text, button) {
  const label = button.textContent;
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    // A page opened from disk may not be given the clipboard: select in a field and copy from there.
    const field = element("textarea", { "aria-hidden": "true" });
    field.value = text;
    document.body.append(field);
    field.select();
    document.execCommand("copy");
    field.remove();
    button.focus();
  }
  button.textContent = "Copied";
  setTimeout(() => { button.textContent = label; }, 1500);
}

function fillTable(body, rows) {
  body.replaceChildren(...rows.map(([name, value]) => element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, value))));
}

function fillSummary() {
  const s = data.summary; // another object once a served page has taken in what is new
  $("title").textContent = s.title;
  $("facts").replaceChildren(...s.facts.map((fact) => element("li", {}, fact)));
  if (!s.finished && !data.live) $("facts").append(element("li", { class: "warn" }, "not finished"));
  $("sentences").replaceChildren(...s.sentences.map((sentence) => element("p", {}, sentence)));
  $("description").textContent = s.description;
  $("description").hidden = !s.description;
  fillTable($("figures"), s.table);
  $("figures-note").textContent = s.note;
  fillImplausible();
  const failed = data.rows.n_failed;
  fillTable($("settings"), failed ? [...s.provenance, ["Failed evaluations", `${failed}, counted but not drawn`]] : s.provenance);
  $("command").textContent = s.command;
}

function connectSummary() {
  $("copy-sentences").addEventListener("click", (event) => copy(data.summary.sentences.join(" "), event.currentTarget));
  $("copy-command").addEventListener("click", (event) => copy(data.summary.command, event.currentTarget));
}

// ---- the chosen scenario ----

function fillDetails(kept) {
  const line = (name, value, column) => {
    const text = element("b", {}, worded(value, column) ?? quantity(turned(value, column), column?.unit ?? ""));
    const box = element("div", { title: column?.description ?? "" }, element("span", { class: "name" }, name), text);
    const { low, high } = column ?? {};
    if (typeof low === "number" && high > low && value !== null) {
      const mark = element("i");
      mark.style.left = `${(100 * Math.min(1, Math.max(0, (value - low) / (high - low)))).toFixed(1)}%`;
      box.append(element("span", { class: "range", title: column.words ? column.words.join(", ") : `range ${number(low)} to ${quantity(turned(high, column), column.unit)}` }, mark));
    }
    return box;
  };
  const lines = (values) => Object.entries(values).map(([name, value]) => line(name, value, columns.get(name)));
  const heading = kept.minimal ? `Scenario ${kept.name}, simplest form of evaluation` : `${kept.files.length ? `Scenario ${kept.name}, evaluation` : "Evaluation"}`;
  const name = element("h3", {}, `${heading} ${number(kept.evaluation + 1)}`);
  const cause = kept.cause ? [element("div", { title: `Quick label, of one replay: ${CAUSE_HELP[data.causes.labels.indexOf(kept.cause)]}` }, element("span", { class: "name" }, "cause (quick label)"), element("b", {}, kept.cause))] : [];
  const metrics = kept.conflict ? [element("h3", {}, "Its metrics")] : [];
  $("measures").replaceChildren(name, ...cause, ...conflictLines(kept.conflict), ...metrics, ...lines(kept.metrics));
  const parts = [element("h3", {}, "Its parameters"), ...lines(kept.parameters)];
  if (kept.files.length) {
    const links = kept.files.map(fileLink);
    parts.push(element("h3", {}, "Its files"), element("div", { class: "files" }, ...links));
  }
  $("details").replaceChildren(...parts);
}

// What the chosen scenario is made of.
const showPicture = (() => {
  let picture = null;
  return (kept) => {
    $("made-of").hidden = kept.picture === null;
    if (kept.picture === null) return;
    const pictures = kept.pictures ?? data.pictures;
    picture ??= new Picture($("layers"), pictures);
    Object.assign(picture, { layers: pictures.layers, columns: pictures.columns });
    picture.show(pictures.pictures[kept.picture]);
    $("made-of-title").textContent = `What scenario ${kept.name} is made of`;
  };
})();

function start() {
  readPalette();
  fillSummary();
  connectSummary();
  fillNotes(data.notes);
  $("coverage").hidden = !data.coverage?.parameters.length;
  if (!$("coverage").hidden) new Coverage(data.coverage);
  const hook = { data, state: () => null, charts: 0, chartsDrawn: 0, drawCharts };
  window.bridgegen = hook; // for tests, and for whoever wants to drive the page
  hook.filter = (name, low, high) => filters.set(name, low, high);
  const causes = data.causes ? new Causes(data.causes, hook) : null;
  if (data.regions) new Regions(data.regions);
  const others = new Elsewhere((evaluation, seconds) => hook.show?.(evaluation, seconds));
  const modes = new Modes((evaluation) => hook.show?.(evaluation, 0, true), (evaluation) => hook.showMinimal?.(evaluation));
  darkScheme.addEventListener("change", readPalette);
  let table = null;
  if (rows.critical.includes(1) || data.kept.length) {
    const opener = new Opener(hook);
    table = new Table((i, play) => opener.row(i, play));
    new TableTools(table);
    opener.begin();
    $("copy-no-motion").addEventListener("click", (event) => copy($("no-motion-command").textContent, event.currentTarget));
    darkScheme.addEventListener("change", () => opener.made?.redraw());
  } else {
    const nearest = nearestToHarm();
    $("kept").hidden = $("made-of").hidden = nearest === null;
    $("no-scenarios").hidden = false;
    $("no-scenarios").textContent = `Nothing critical was found${data.summary.finished ? "" : " yet"}.${nearest === null ? "" : " Below is the scenario that came nearest to harm."}`;
    if (nearest !== null) {
      $("kept").classList.add("alone");
      $("list").hidden = true;
      const opener = new Opener(hook);
      opener.begin();
      darkScheme.addEventListener("change", () => opener.made?.redraw());
    }
  }
  if (!data.live) return;
  new Live(() => {
    fillSummary();
    causes?.fill(data.causes);
    modes.fill();
    takeRegions();
    takeElsewhere();
    others.fill();
    table?.refill();
    hook.grown?.();
    document.dispatchEvent(new CustomEvent("filters", { detail: filters.ranges }));
  });
}
