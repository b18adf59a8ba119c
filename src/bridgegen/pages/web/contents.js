// A table of contents: a button for each section that the page shows, the present one marked.

import { $, element } from "./common.js";
import { unfold } from "./fold.js";

const shownSections = () => [...document.querySelectorAll("main > section:not([hidden])")];

function fillContents() {
  $("contents").replaceChildren(...shownSections().map((section) => {
    const button = element("button", { type: "button" }, section.dataset.short ?? section.querySelector("h2").textContent);
    button.addEventListener("click", () => {
      unfold(section);
      section.scrollIntoView();
    });
    return button;
  }));
  markPresent();
}

// The present section is the last one that begins in the upper third of the window.
function markPresent() {
  const begun = shownSections().filter((section) => section.getBoundingClientRect().top < innerHeight / 3).length;
  [...$("contents").children].forEach((button, i) => button.toggleAttribute("aria-current", i === Math.max(begun - 1, 0)));
}

fillContents();
addEventListener("scroll", markPresent, { passive: true });
for (const change of ["grown", "shown"]) document.addEventListener(change, fillContents); // either may hide or show sections
