// The sections of the report: each is a module that adds itself; report/sections.py lists them, in order.

import { $, element } from "./common.js";
import { data } from "./data.js";

/**
 * @typedef {object} Section
 * @property {string} id of its element
 * @property {string} key of what it draws, in the page's data
 * @property {(found: any, host: HTMLElement) => void} draw called once, if there is anything to draw
 * @property {string} [title] its heading, where page.html has no such element
 */

/** @type {Section[]} */
const sections = [];

/** @param {Section} section */
export function addSection(section) {
  sections.push(section);
}

export function drawSections() {
  for (const { id, key, title, draw } of sections) {
    const found = data[key], host = $(id) ?? newSection(id, title);
    host.hidden = found === null || found.length === 0 || data.alone; // one scenario fills no chart
    if (!host.hidden) draw(found, host);
  }
}

function newSection(id, title) {
  const host = element("section", { id, "aria-labelledby": `${id}-title` }, element("h2", { id: `${id}-title` }, title));
  $("provenance").before(host);
  return host;
}
