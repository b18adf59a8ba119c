// The decisive conflict of each row, and the failure mode that it belongs to.

import { data, rows } from "./data.js";

// Fresh random draws that fail, where no evaluation does: no rows of the run, and the first of the kept.
export const drawn = (data.kept ?? []).filter(({ evaluation }) => evaluation < 0);

// The evaluation that came nearest to harm where no failure is played and the page holds its motion; else null.
export function nearestToHarm() {
  if (!data.triage || data.triage.modes.length || drawn.length) return null;
  const found = data.triage.bound.least.find(({ evaluation }) => evaluation !== null && rows.evaluation.includes(evaluation));
  return found && (data.live || data.packed.evaluations.includes(found.evaluation)) ? found.evaluation : null;
}

// Whether a row has the conflict of a failure mode; its cause and place are not compared.
export function isInMode(i, k) {
  const mode = data.triage?.modes.find((one) => one.number === k), finding = findingOf(i);
  if (!mode || !finding) return false;
  const [conflict, type, responsible, rule] = finding;
  return conflict === mode.conflict && type === mode.conflict_type && responsible === mode.responsible && mode.rules.includes(rule ?? "") && Boolean(rows.critical[i]);
}

// The page has one word for it: collision.
export function conflictWord(conflict) {
  return conflict === "contact" ? "collision" : conflict;
}

// Conflict, type, responsible, rule and partner of a row of the page; null where none are recorded.
export function findingOf(i) {
  return rows.findings ? rows.findings.keys[rows.findings.at[i]] : null;
}
