// Preventability maps: which collisions each driver avoids, and which it should have avoided.

import { $, element } from "./common.js";
import { counted, suite } from "./suite_words.js";

export function showMaps() {
  $("maps").hidden = !suite.maps.length;
  $("maps").append(...suite.maps.map(card));
}

function card(map) {
  const used = map.classes.filter((_, k) => map.drivers.some(({ counts }) => counts[k]));
  const legend = used.map(([label, colour]) => {
    const key = element("i", { class: "key" });
    key.style.background = colour;
    return element("li", {}, key, label);
  });
  const across = `Across: ${map.axes[0]}; up: ${map.axes[1]}${map.held.length ? `; ${map.held.join(", ")}` : ""}.`;
  return element("div", { class: "card map" },
    element("h3", {}, map.title),
    element("ul", { class: "legend" }, ...legend),
    ...map.drivers.map((one) => driver(one, map)),
    element("p", { class: "muted" }, across, " ", element("a", { href: map.page }, "The whole map"), "."));
}

function driver({ name, counts, pictures }, { columns }) {
  const [avoided, preventable, unpreventable] = counts;
  const judged = avoided + preventable + unpreventable;
  const share = (n) => (judged ? `${(100 * n / judged).toFixed(1)} %` : "none");
  const words = `avoids ${share(avoided)} of ${counted(judged)} cells; ${share(preventable)} preventable, ${share(unpreventable)} not`;
  return element("div", { class: "driver" },
    element("p", {}, element("strong", {}, name), element("span", {}, words)),
    ...pictures.map((src, k) => element("figure", {}, element("img", { src, alt: `${name}, ${columns[k]}: ${words}` }), element("figcaption", {}, columns[k]))));
}
