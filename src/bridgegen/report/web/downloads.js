// The files of a scenario: out of the page itself where it holds them, else from where they lie.

import { element } from "./common.js";
import { data } from "./data.js";
import { inflated } from "./inflate.js";

export function fileLink(name) {
  // Always relative: a path with a scheme or a leading slash cannot lead elsewhere.
  const href = `./${name.split("/").map(encodeURIComponent).join("/")}`, short = name.split("/").at(-1);
  const held = Object.hasOwn(data.files, name), title = held ? "Saved from this page" : "Beside this page, in the run's folder";
  const link = element("a", { href, download: short, title }, name);
  if (held) {
    link.addEventListener("click", (event) => {
      event.preventDefault();
      save(data.files[name], short);
    });
  }
  return link;
}

async function save(text, name) {
  const url = URL.createObjectURL(new Blob([await inflated(text)], { type: "application/octet-stream" }));
  element("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}
