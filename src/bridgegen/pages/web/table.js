// The table of all critical scenarios: sorted, filtered; only the rows in sight are in the document.

import { $, element } from "./common.js";
import { criterionOf, marginText, shortName, violatedCriteria, violatesAny } from "./criteria_rows.js";
import { columns, data, rows } from "./data.js";
import { filters } from "./filters.js";
import { conflictWord, findingOf } from "./findings.js";
import { measured, number, shareText, turned, unitText, worded } from "./numbers.js";
import { SOURCES, playbacks } from "./playbacks.js";
import { regionOf } from "./region_rows.js";
import { elsewhere, elsewhereBy, verdictCell } from "./verdicts.js";

export const LISTED = ["d_min", "v_d", "n_collision", "ttc"];
const LISTED_OF_HARM = ["severity", "harm", "d_min", "v_d"];
const TEXTS = ["conflict", "type", "responsible", "partner"]; // of a row's finding
const PLACE_OF = { conflict: 0, type: 1, responsible: 2, partner: 4 };
const SHORT = { n_collision: "collisions", responsible: "by", cause: "cause" };
const UNDER = { cause: "quick label", responsible: "responsible", severity: "MAIS3+" };
const MOST_MARGINS = 3; // columns of criteria
const ROW_HEIGHT = 32; // as in table.css
const SPARE = 6; // rows above and below those in sight

export class Table {
  // open(i, play): called with the row of the page to be shown.
  constructor(open) {
    this.open = open;
    this.sorting = { by: this.usual, down: false };
    this.violated = null; // column of the criterion whose violations alone are listed
    this.only = null; // a metric that is filtered, but has no column of its own
    this.scroll = $("list-scroll");
    this.body = $("list-body");
    this.shown = null; // evaluation in the player
    this.first = this.last = -1;
    $("kept").classList.toggle("conflicts", Boolean(rows.findings));
    this.fillHead();
    this.connect();
    this.refill();
  }

  get columns() {
    const metrics = rows.columns.filter((column) => column.group === "metric").map((column) => column.name);
    const listed = (data.summary.harm ? LISTED_OF_HARM : [...LISTED, "severity", "harm"]).filter((name) => metrics.includes(name));
    const chosen = listed.length ? listed : metrics.slice(0, 4), texts = rows.findings ? TEXTS : [];
    if (this.only && !chosen.includes(this.only)) chosen.push(this.only);
    const margins = this.margins;
    chosen.unshift(...margins.filter((name) => !chosen.includes(name)));
    const names = margins.length ? [...chosen, ...texts] : data.summary.harm ? [...texts, ...chosen] : [...chosen, ...texts];
    return ["rank", ...names, ...(rows.cause ? ["cause"] : []), ...(data.regions ? ["region"] : []), ...elsewhere.map(({ column }) => column)];
  }

  // The criteria whose margins are columns: those that make a scenario critical, or are violated where nothing else is critical.
  get margins() {
    const names = rows.n_critical ? data.criteria?.critical ?? [] : violatedCriteria().map(({ quantity }) => quantity);
    return [...new Set([...(filters.violated ? [filters.violated] : []), ...names.slice(0, MOST_MARGINS)])];
  }

  // The column that the list is sorted by at first.
  get usual() {
    return rows.n_critical ? "rank" : this.margins[0] ?? "rank";
  }

  value(name, i) {
    if (name === "rank") return rows.rank[i] || null;
    if (name === "cause") return rows.cause[i];
    if (name in PLACE_OF) return conflictWord(findingOf(i)[PLACE_OF[name]]) || null;
    return name === "region" ? regionOf(i) : (columns.get(name) ?? elsewhereBy(name)).values[i];
  }

  fillHead() {
    const cells = this.columns.map((name) => {
      const unit = unitText(columns.get(name)?.unit ?? "");
      const button = element("button", { type: "button", title: `Sort by ${name}` }, SHORT[name] ?? elsewhereBy(name)?.simulator ?? shortName(name), element("small", {}, UNDER[name] ?? (unit || "\u00a0")));
      button.addEventListener("click", () => {
        this.sorting = { by: name, down: this.sorting.by === name && !this.sorting.down };
        this.refill();
      });
      return element("th", { scope: "col", class: name in PLACE_OF ? "text" : "", "data-by": name, "aria-sort": "none" }, button);
    });
    $("list-head").replaceChildren(element("tr", {}, ...cells));
  }

  // Whether a row is one of the list's: a critical one; a violation, where these are asked for, or nothing is critical.
  belongs(i) {
    if (rows.critical[i] || filters.violated) return true;
    return !rows.n_critical && violatesAny(i);
  }

  // Which rows there are, and in which order.
  refill() {
    const { by, down } = this.sorting, sign = down ? -1 : 1, kept = $("only-kept").checked;
    const there = [];
    for (let i = 0; i < rows.critical.length; i++) {
      const exported = playbacks.keptAt.has(rows.evaluation[i]);
      if ((this.belongs(i) || exported) && (exported || !kept) && filters.passes(i)) there.push(i);
    }
    const key = new Map(there.map((i) => [i, this.value(by, i)]));
    const order = (a, b) => {
      const [x, y] = [key.get(a), key.get(b)];
      // What does not exist sorts last, whichever way.
      return Number(x === null) - Number(y === null) || sign * (typeof x === "string" ? x.localeCompare(y) : x - y) || (rows.rank[a] || Infinity) - (rows.rank[b] || Infinity) || a - b;
    };
    this.order = there.sort(order);
    for (const th of $("list-head").querySelectorAll("th")) {
      th.setAttribute("aria-sort", th.dataset.by === by ? (down ? "descending" : "ascending") : "none");
    }
    $("list-table").setAttribute("aria-rowcount", this.order.length + 1);
    this.note();
    this.draw(true);
  }

  // After a change of the filters: the violations of a criterion are listed with their margins, the least first.
  follow() {
    const { violated } = filters;
    if (violated !== this.violated) {
      this.violated = violated;
      this.sorting = { by: violated ?? this.usual, down: false };
      this.fillHead();
    }
    this.refill();
  }

  note() {
    const n = this.order.length, criterion = criterionOf(filters.violated);
    $("scenarios-title").textContent = criterion || !rows.n_critical ? "Violations of pass criteria" : "Critical scenarios";
    if (criterion || !rows.n_critical) {
      const which = criterion ? `that violate ${criterion.id}` : "that violate a pass criterion";
      $("list-note").textContent = `${number(n)} ${n === 1 ? "evaluation" : "evaluations"} ${rows.evaluation.length < rows.n - rows.n_failed ? "of this page " : ""}${n === 1 ? which.replace("violate", "violates") : which}`;
      $("list-clear").hidden = !filters.any && !$("only-kept").checked;
      return;
    }
    const here = rows.critical.reduce((a, b) => a + b, 0), all = rows.n_critical;
    const some = filters.any || $("only-kept").checked;
    const which = here < all ? `${number(here)} of ${number(all)} critical scenarios, evenly chosen` : `${number(all)} critical ${all === 1 ? "scenario" : "scenarios"}`;
    $("list-note").textContent = some ? `${number(n)} of ${which}` : which;
    $("list-clear").hidden = !some;
  }

  // Draws the rows in sight, if they are not drawn yet.
  draw(anew = false) {
    const { scrollTop, clientHeight } = this.scroll;
    const first = Math.max(0, Math.min(this.order.length, Math.floor(scrollTop / ROW_HEIGHT)) - SPARE);
    const last = Math.min(this.order.length, Math.ceil((scrollTop + clientHeight) / ROW_HEIGHT) + SPARE);
    if (!anew && first === this.first && last === this.last) return;
    [this.first, this.last] = [first, last];
    const focused = this.body.contains(document.activeElement) ? Number(document.activeElement.closest("tr").dataset.i) : null;
    const room = (n) => {
      const cell = element("td", { colspan: this.columns.length });
      cell.style.height = `${n * ROW_HEIGHT}px`;
      return element("tr", { class: "room", "aria-hidden": "true" }, cell);
    };
    const drawn = this.order.slice(first, last).map((i, k) => this.row(i, first + k));
    if (!this.order.length) {
      const empty = element("td", { colspan: this.columns.length }, rows.n_critical ? "No critical scenario passes the filter." : "No evaluation passes the filter.");
      return void this.body.replaceChildren(element("tr", { class: "none" }, empty));
    }
    this.body.replaceChildren(...(first ? [room(first)] : []), ...drawn, ...(last < this.order.length ? [room(this.order.length - last)] : []));
    if (focused !== null) this.buttonOf(focused)?.focus({ preventScroll: true });
  }

  row(i, place) {
    const evaluation = rows.evaluation[i], kept = data.kept[playbacks.keptAt.get(evaluation)];
    const rank = rows.rank[i] || "–", source = playbacks.source(evaluation);
    const label = `${source ? "Play" : "Show"} ${kept ? `scenario ${kept.name}, ` : ""}evaluation ${evaluation + 1}, rank ${rank}`;
    const button = element("button", { type: "button", "aria-label": label, title: SOURCES[source ?? "none"], class: `from-${source ?? "none"}` }, `${rank}`);
    const first = element("td", {}, button);
    if (kept) button.append(element("small", {}, kept.name));
    else if (!rows.rank[i]) button.append(element("small", {}, `evaluation ${number(evaluation + 1)}`));
    const row = element("tr", { "data-i": i, "aria-rowindex": place + 2 }, first);
    if (evaluation === this.shown) row.setAttribute("aria-current", "true");
    for (const name of this.columns.slice(1)) row.append(this.cell(name, i));
    return row;
  }

  cell(name, i) {
    const value = this.value(name, i);
    if (name === "cause") return element("td", {}, value ? data.causes.labels[value] : "–");
    if (name in PLACE_OF) return element("td", { class: `text${value === "ego" ? " blamed" : ""}`, title: name === "type" && value ? `${value}; ${findingOf(i)[3]}` : value ?? "" }, value?.replace("vulnerable road user", "VRU") ?? "–");
    if (name === "severity" && value !== null) return element("td", {}, value > 0 ? shareText(value) : "–");
    if (name === "region") return element("td", {}, value === null ? "–" : `${value}`);
    if (elsewhereBy(name)) return verdictCell(value);
    const digits = name === "harm" || name === "harm_any" ? 4 : 3; // collisions differ by their severity, in the third decimal
    const column = columns.get(name);
    if (criterionOf(name)) return element("td", { class: value < 0 ? "hit" : "" }, marginText(value, "1"));
    const cell = element("td", {}, worded(value, column) ?? measured(turned(value, column), column?.unit, digits));
    if (name === "n_collision" && value > 0) cell.className = "hit";
    return cell;
  }

  buttonOf(i) {
    return this.body.querySelector(`tr[data-i="${i}"] button`);
  }

  // Brings a row into sight, if it is in the table.
  reveal(place, focus = false) {
    if (place < 0 || place >= this.order.length) return;
    const top = place * ROW_HEIGHT, head = $("list-head").offsetHeight, seen = this.scroll.clientHeight - head;
    if (top < this.scroll.scrollTop) this.scroll.scrollTop = top;
    else if (top + ROW_HEIGHT > this.scroll.scrollTop + seen) this.scroll.scrollTop = top + ROW_HEIGHT - seen;
    this.draw();
    if (focus) this.buttonOf(this.order[place])?.focus({ preventScroll: true });
  }

  // Marks the one in the player, and brings it into sight.
  mark(evaluation) {
    this.shown = evaluation;
    this.reveal(this.order.findIndex((i) => rows.evaluation[i] === evaluation));
    for (const row of this.body.querySelectorAll("tr[data-i]")) {
      if (rows.evaluation[row.dataset.i] === evaluation) row.setAttribute("aria-current", "true");
      else row.removeAttribute("aria-current");
    }
  }

  connect() {
    this.scroll.addEventListener("scroll", () => { this.drawing ??= requestAnimationFrame(() => { this.drawing = null; this.draw(); }); });
    new ResizeObserver(() => this.draw()).observe(this.scroll);
    this.body.addEventListener("click", (event) => {
      const i = event.target.closest("tr[data-i]")?.dataset.i;
      if (i !== undefined) this.open(Number(i), true);
    });
    this.body.addEventListener("keydown", (event) => {
      const row = event.target.closest("tr[data-i]"), page = Math.max(1, Math.floor(this.scroll.clientHeight / ROW_HEIGHT) - 2);
      const by = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -Infinity, End: Infinity }[event.key];
      if (by === undefined || !row || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      event.stopPropagation(); // Home and End are the player's keys too
      const place = Number(row.getAttribute("aria-rowindex")) - 2 + by;
      this.reveal(Math.min(this.order.length - 1, Math.max(0, place)), true);
    });
    $("only-kept").addEventListener("change", () => this.refill());
    $("list-clear").addEventListener("click", () => { $("only-kept").checked = false; filters.clear(); });
    document.addEventListener("filters", () => this.follow());
    document.addEventListener("grown", () => this.refill());
    document.addEventListener("shown", ({ detail }) => this.mark(detail));
  }
}
