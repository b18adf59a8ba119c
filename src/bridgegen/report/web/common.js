// Shared by all pages: finding and making elements.

const $ = (id) => document.getElementById(id);
const NARROW = "\u202f"; // narrow no-break space, between a number and its unit

function element(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  node.append(...children);
  return node;
}
