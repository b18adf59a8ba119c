// The status and the comment of failure modes, set in a served page and kept in failures.yaml.

import { $, element } from "./common.js";

const edits = JSON.parse($("data").textContent).edits; // of a run alone there are none
const BACK_TO = "bridgegen-mode"; // where the reader was, over a reload

class StatusOfMode {
  constructor(pill, mode) {
    this.mode = mode;
    this.known = edits.modes[mode];
    const row = pill.closest("tr, li"), name = row.querySelector("th, h3").textContent.trim().split("\n")[0];
    this.choice = element("select", { "aria-label": `Status of: ${name}`, "data-status": mode }, ...edits.statuses.map((status) => element("option", { value: status }, status)));
    this.comment = element("input", { type: "text", "aria-label": `Comment on: ${name}`, placeholder: "comment", maxlength: edits.most });
    this.said = element("small", { role: "alert", class: "bad" });
    this.choice.value = this.known.status;
    this.comment.value = this.known.comment;
    for (const field of [this.choice, this.comment]) field.addEventListener("change", () => this.save());
    pill.hidden = !pill.classList.contains("regression"); // what a status does not say
    for (const small of row.querySelectorAll("th small")) small.hidden = Boolean(this.known.comment) && small.textContent === this.known.comment;
    pill.after(this.choice, this.comment, this.said);
  }

  async save() {
    const { status, comment } = this.known;
    const asked = { mode: this.mode, status: this.choice.value, comment: this.comment.value, was: [status, comment] };
    try {
      const response = await fetch(edits.post, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(asked) });
      if (response.ok) {
        sessionStorage.setItem(BACK_TO, this.mode);
        location.reload(); // the verdict and the order follow from it
        return;
      }
      this.said.textContent = `Not saved: ${(await response.json()).error.join("; ")}.`;
    } catch {
      this.said.textContent = "Not saved: this page is no longer served.";
    }
  }
}

for (const pill of document.querySelectorAll("[data-mode]")) {
  const { mode } = pill.dataset, known = edits?.modes[mode];
  if (known?.by) pill.title = `Set in ${known.by}`;
  else if (known) new StatusOfMode(pill, mode);
}
const back = sessionStorage.getItem(BACK_TO);
sessionStorage.removeItem(BACK_TO);
if (back) document.querySelector(`[data-status="${CSS.escape(back)}"]`)?.focus();
