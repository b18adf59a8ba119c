// The report: its sections, and the list of critical scenarios with the player.

import { $, copy } from "./common.js";
import "./contents.js";
import { anyViolated } from "./criteria_rows.js";
import { data, rows } from "./data.js";
import { filters } from "./filters.js";
import { drawn, nearestToHarm } from "./findings.js";
import { foldSections } from "./fold.js";
import { hook } from "./hook.js";
import { Opener } from "./opener.js";
import { drawSections } from "./sections.js";
import "./summary.js";
import { Table } from "./table.js";
import { TableTools } from "./table_tools.js";

hook.filter = (name, low, high) => filters.set(name, low, high);
drawSections();
foldSections();
if (data.alone) showAlone();
else if (rows.critical.includes(1) || data.kept.length > drawn.length || anyViolated()) listScenarios();
else playNearest();

function listScenarios() {
  const opener = new Opener(hook);
  new TableTools(new Table((i, play) => opener.row(i, play)));
  begin(opener);
}

function showAlone() {
  $("kept").classList.add("alone");
  $("list").hidden = true;
  $("summary-title").textContent = "The search that found it";
  begin(new Opener(hook));
}

function playNearest() {
  const plays = drawn.length > 0 || nearestToHarm() !== null;
  hideScenario(!plays);
  $("no-scenarios").hidden = plays; // the verdict says it
  $("no-scenarios").textContent = `No scenario is critical${data.summary.finished ? "" : " yet"}.`;
  $("kept").classList.add("alone");
  $("list").hidden = true;
  if (plays) return void begin(new Opener(hook));
  hook.show = (...asked) => { // a point of the scatter plot was chosen
    hideScenario(false);
    begin(new Opener(hook));
    hook.show(...asked);
  };
}

function hideScenario(hidden) {
  for (const id of ["player", "measures", "details", "made-of"]) $(id).hidden = hidden;
}

function begin(opener) {
  opener.begin();
  $("copy-no-motion").addEventListener("click", (event) => copy($("no-motion-command").textContent, event.currentTarget));
  document.addEventListener("theme", () => opener.made?.redraw());
}
