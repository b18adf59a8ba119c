// The files of a scenario: out of the page itself where it holds them, else from where they lie.

import { element } from "./common.js";
import { data } from "./data.js";
import { inflated } from "./inflate.js";
import { download } from "./save.js";

export function fileLink(name) {
  // Always relative: a path with a scheme or a leading slash cannot lead elsewhere.
  const href = `./${name.split("/").map(encodeURIComponent).join("/")}`, short = name.split("/").at(-1);
  const held = data.files.names.includes(name), title = held ? "Saved from this page" : "Beside this page, in the run's folder";
  const link = element("a", { href, download: short, title }, name);
  if (held) {
    link.addEventListener("click", (event) => {
      event.preventDefault();
      save(name, short);
    });
  }
  return link;
}

// The bytes of a file that the page holds, see packed.py: runs of lines out of those of all files.
async function bytesOf(name) {
  const [lines, runs] = await Promise.all([data.files.lines, data.files.runs].map(inflated));
  const starts = [0];
  lines.forEach((byte, i) => { if (byte === 10) starts.push(i + 1); });
  starts.push(lines.length + 1);
  const run = JSON.parse(new TextDecoder().decode(runs))[data.files.names.indexOf(name)], parts = [];
  for (let i = 0; i < run.length; i += 2) parts.push(...(i ? ["\n"] : []), lines.subarray(starts[run[i]], starts[run[i] + run[i + 1]] - 1));
  return new Blob(parts, { type: "application/octet-stream" });
}

async function save(name, short) {
  download(await bytesOf(name), short);
}
