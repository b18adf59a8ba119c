// A search in two simulators: how far the cheap one, the screen, agrees with the run's.

import { element } from "./common.js";
import { number } from "./numbers.js";
import { addSection } from "./sections.js";

const CHOSEN = "Most of these scenarios were chosen because they promise to be critical, one in eight at random: the counts are no shares of the search space.";

function fillScreened({ screen, simulator, sentences, counts }, host) {
  const [[both, screenOnly], [simulatorOnly, neither]] = counts;
  const head = (text, scope) => element("th", { scope }, text);
  const line = (text, ...values) => element("tr", {}, head(text, "row"), ...values.map((value) => element("td", {}, number(value))));
  const table = element("table", {}, element("caption", { class: "hidden" }, `Scenarios by ${screen} and ${simulator}`),
    element("thead", {}, element("tr", {}, head("Scenarios", "col"), head(`critical in ${simulator}`, "col"), head(`not critical in ${simulator}`, "col"))),
    element("tbody", {}, line(`critical in ${screen}`, both, screenOnly), line(`not critical in ${screen}`, simulatorOnly, neither)));
  host.append(element("div", { class: "card note-table" }, ...sentences.map((text) => element("p", {}, text)), table, element("p", { class: "muted small" }, CHOSEN)));
}

addSection({ id: "screened", key: "screened", title: "Agreement with the screen", draw: fillScreened });
