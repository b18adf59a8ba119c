// What searches found for where the second of two drivers is worse, in the page of a suite.

import { $, element } from "./common.js";
import { number } from "./numbers.js";
import { suite } from "./suite_words.js";

export function showSearches() {
  if (!suite.searches.length) return;
  const [first, second] = suite.egos, found = suite.searches.filter(({ worse, problem }) => worse || problem);
  $("searches").hidden = false;
  $("searches-title").textContent = `Searches for what ${second} fails and ${first} passes`;
  const none = suite.searches.filter(({ worse, problem }) => !worse && !problem);
  const evaluations = none.reduce((sum, one) => sum + one.evaluations, 0);
  $("searches-lead").textContent = none.length ? `${number(evaluations)} evaluations of ${none.length === 1 ? none[0].entry : `${number(none.length)} scenarios`} found nothing of the kind.` : "";
  $("searches-lead").hidden = !none.length;
  $("searches-list").hidden = !found.length;
  $("searches-list").append(...found.map((one) => {
    const name = one.report ? element("a", { href: one.report }, one.entry) : element("span", {}, one.entry);
    return element("div", { class: "search" }, element("h3", {}, name), element("p", {}, one.sentence), element("ul", {}, ...one.modes.map((mode) => element("li", {}, mode))));
  }));
}
