// The fields above the table of critical scenarios: by a metric, by cause, by region.

import { $, element } from "./common.js";
import { data, rows } from "./data.js";
import { filters } from "./filters.js";
import { number, titled } from "./numbers.js";
import { LISTED } from "./table.js";
import { VERDICTS, elsewhere } from "./verdicts.js";

export class TableTools {
  constructor(table) {
    this.table = table;
    const metrics = rows.columns.filter((column) => column.group === "metric");
    $("list-metric").append(...metrics.map(({ name, description }) => element("option", { value: name, title: description }, titled(name))));
    const first = LISTED.find((name) => metrics.some((column) => column.name === name));
    if (first) $("list-metric").value = first;
    this.choices($("list-criterion"), data.criteria?.list.map(({ id, quantity, violated }) => [quantity, `${id} (${number(violated)})`]));
    this.choices($("list-cause"), data.causes?.labels.slice(1).map((label, k) => [k + 1, label]));
    this.choices($("list-region"), data.regions?.regions.map((region, k) => [k, `${region.number}: ${region.rule}`]));
    this.choices($("list-elsewhere"), elsewhere.length ? elsewhere.flatMap(({ column }, k) => Object.entries(VERDICTS).map(([value, [, words]]) => [`${k}:${value}`, `${words} ${column}`])) : null);
    $("list-metric").addEventListener("change", () => { this.column(); this.show(); });
    for (const id of ["list-low", "list-high"]) $(id).addEventListener("input", () => this.metric());
    $("list-criterion").addEventListener("change", ({ target: { value } }) => filters.violating(value === "" ? null : value));
    $("list-cause").addEventListener("change", ({ target: { value } }) => {
      if (value === "") filters.set("cause");
      else filters.set("cause", value - 0.3, Number(value) + 0.3);
    });
    $("list-elsewhere").addEventListener("change", ({ target: { value } }) => this.verdict(value));
    $("list-region").addEventListener("change", ({ target: { value } }) => filters.inRegion(value === "" ? null : Number(value)));
    document.addEventListener("filters", () => this.show());
  }

  choices(select, options) {
    select.closest("label").hidden = !options;
    if (options) select.append(...options.map(([value, text]) => element("option", { value }, text)));
  }

  metric() {
    const ends = [$("list-low"), $("list-high")].map((field) => (field.value === "" ? null : Number(field.value)));
    filters.set($("list-metric").value, ...ends);
  }

  verdict(value) {
    const [k, which] = value.split(":").map(Number);
    elsewhere.forEach(({ column }) => filters.ranges.delete(column));
    if (value === "") filters.notify();
    else filters.set(elsewhere[k].column, which - 0.3, which + 0.3);
  }

  // A metric that is filtered by is to be seen.
  column() {
    const name = $("list-metric").value;
    if (this.table.only === name) return;
    this.table.only = name;
    this.table.fillHead();
    this.table.refill();
  }

  show() {
    const range = filters.ranges.get($("list-metric").value) ?? [], cause = filters.ranges.get("cause");
    ["list-low", "list-high"].forEach((id, k) => {
      if (document.activeElement !== $(id)) $(id).value = Number.isFinite(range[k]) ? Number(range[k].toPrecision(4)) : "";
    });
    $("list-cause").value = cause && cause[1] - cause[0] < 1 ? Math.round((cause[0] + cause[1]) / 2) : "";
    const k = elsewhere.findIndex(({ column }) => filters.ranges.has(column));
    $("list-elsewhere").value = k < 0 ? "" : `${k}:${Math.round(filters.ranges.get(elsewhere[k].column)[0])}`;
    $("list-criterion").value = filters.violated ?? "";
    $("list-region").value = filters.region ?? "";
  }
}
