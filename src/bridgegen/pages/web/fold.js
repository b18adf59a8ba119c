// Sections fold: a button beside each heading. A link to a folded section opens it; paper shows all.

import { element } from "./common.js";

export function unfold(section) {
  section.querySelector(":scope > .fold[aria-expanded='false']")?.click();
}

function addFold(section) {
  const heading = section.querySelector(":scope > h2");
  if (!heading) return; // the failures, which the page is for
  const button = element("button", { type: "button", class: "fold quiet", "aria-expanded": "true", "aria-labelledby": heading.id }, "▾");
  const toggle = () => {
    const folded = section.classList.toggle("folded");
    button.setAttribute("aria-expanded", `${!folded}`);
    button.textContent = folded ? "▸" : "▾";
  };
  button.addEventListener("click", toggle);
  heading.addEventListener("click", toggle);
  heading.before(button);
}

export function foldSections() {
  document.querySelectorAll("main > section").forEach(addFold);
  let folded = [];
  addEventListener("beforeprint", () => {
    folded = [...document.querySelectorAll(".folded")];
    for (const section of folded) section.classList.remove("folded");
  }, { capture: true }); // before the charts are drawn for it
  addEventListener("afterprint", () => { for (const section of folded) section.classList.add("folded"); });
}
