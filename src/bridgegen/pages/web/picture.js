// A scenario's individuals in five columns: boxes by layer and class, links to the one in focus,
// violated constraints in red, with a mark and the reason. Drawn from `pictures_payload`.

import { element } from "./common.js";

const MEMBERS = 200; // boxes of a group that are put on the page at a time
const SVG = "http://www.w3.org/2000/svg";

export class Picture {
  constructor(host, payload) {
    this.host = host;
    this.layers = payload.layers;
    this.columns = payload.columns;
    this.listen();
  }

  show(picture) {
    this.picture = picture;
    this.boxes = new Map(); // id → { box, title, group, layer }
    this.incoming = new Map(); // id → [[label, id of the box that links here]]
    this.current = null;
    this.grid = element("div", { class: "columns" });
    this.lines = document.createElementNS(SVG, "svg");
    this.lines.setAttribute("class", "links");
    this.lines.setAttribute("aria-hidden", "true");
    const groups = picture.columns.map((number) => this.columns[number]);
    groups.forEach((column, layer) => column.forEach((group) => group.boxes.forEach((box) => this.know(box, group.class, group, layer))));
    this.grid.append(...groups.map((column, i) => this.column(column, i)), this.lines);
    const scroller = element("div", { class: "wide", tabindex: "0", role: "group", "aria-label": "Five columns, scrollable" }, this.grid);
    this.host.replaceChildren(...this.verdict(), ...this.about(), scroller);
    if (picture.left_out.length) {
      this.host.append(element("p", { class: "muted" }, `In no layer, and nothing refers to them: ${picture.left_out.join(", ")}.`));
    }
  }

  know(box, title, group, layer) {
    this.boxes.set(box.id, { box, title, group, layer });
    for (const [label, to] of box.links ?? []) {
      if (!this.incoming.has(to)) this.incoming.set(to, []);
      this.incoming.get(to).push([label, box.id]);
    }
    for (const event of box.inside ?? []) this.know(event, event.class, group, layer);
  }

  // ---- above the columns ----

  verdict() {
    const { checked, violations, homeless } = this.picture;
    if (!violations.length) return checked ? [element("p", { class: "verdict" }, element("span", { class: "tick", "aria-hidden": "true" }, "✓"), ` ${checked}: all are kept.`)] : [];
    const count = violations.length === 1 ? "1 violation" : `${violations.length} violations`;
    const places = violations.map(() => []);
    for (const { box } of this.boxes.values()) for (const number of box.broken ?? []) places[number].push(box);
    const items = violations.map(([about, text], number) => element("li", {}, homeless.includes(number) ? text : about, " ", ...this.jumps(places[number])));
    const head = element("p", {}, element("span", { class: "cross", "aria-hidden": "true" }, "✗"), ` ${checked ? `${checked}: ` : ""}${count}.`);
    return [element("div", { class: "verdict bad", role: "group", "aria-label": "Violated constraints" }, head, element("ol", {}, ...items))];
  }

  jumps(boxes, text = (box) => `show ${box.name}`) {
    const links = boxes.slice(0, 5).map((box) => this.jump(box.id, text(box)));
    return boxes.length > 5 ? [...links, ` and ${boxes.length - 5} more`] : links;
  }

  jump(id, text) {
    const button = element("button", { type: "button", class: "jump" }, text);
    button.addEventListener("click", () => this.go(id));
    return button;
  }

  about() {
    const { name, facts } = this.picture;
    if (!name && !facts.length) return [];
    return [element("div", { class: "about" }, element("b", {}, name), ...facts.map((fact) => this.fact(fact)))];
  }

  // ---- columns, groups, boxes ----

  column(groups, i) {
    const count = groups.reduce((sum, group) => sum + group.boxes.reduce((n, box) => n + 1 + (box.inside?.length ?? 0), 0), 0);
    const head = element("h3", {}, element("span", { class: "number" }, `${i + 1}`), ` ${this.layers[i]} `, element("span", { class: "muted count" }, `${count}`));
    const parts = groups.flatMap((group) => (group.common ? [this.folded(group)] : group.boxes.map((box) => this.box(box, group.class))));
    return element("section", { "aria-label": `Layer ${i + 1}, ${this.layers[i]}` }, head, ...(parts.length ? parts : [element("p", { class: "muted" }, "Nothing.")]));
  }

  // Many boxes of a class: one box with a count, which opens. Its members are made when it does.
  folded(group) {
    const details = element("details", {}, element("summary", {}, "each of them"));
    const head = element("p", { class: "head" }, element("b", {}, `${group.class} × ${group.boxes.length}`));
    const said = new Set();
    const node = element("div", { class: "box group" }, head, ...group.common.map((fact) => this.fact(fact, said)), details);
    node.group = group;
    group.fill = (until) => {
      while (details.children.length - 1 < Math.min(until, group.boxes.length)) {
        details.append(this.box(group.boxes[details.children.length - 1], ""));
      }
      group.more?.remove();
      const left = group.boxes.length - (details.children.length - 1);
      if (!left) return;
      group.more = element("button", { type: "button", class: "jump" }, `${Math.min(left, MEMBERS)} more of ${left}`);
      group.more.addEventListener("click", () => { group.more.remove(); group.fill(until + MEMBERS); });
      details.after(group.more);
    };
    group.open = (place = 0) => {
      group.fill(Math.max(MEMBERS, place + 1));
      details.open = true;
    };
    details.addEventListener("toggle", () => {
      if (details.open && details.children.length === 1) group.fill(MEMBERS);
      if (group.more) group.more.hidden = !details.open;
      this.draw();
    });
    return node;
  }

  box(box, title) {
    const said = new Set();
    const shown = box.facts.slice(0, box.shown ?? box.facts.length).map((fact) => this.fact(fact, said));
    if (!shown.length) shown.push(...this.elsewhere(box));
    const name = element("p", { class: "head" }, element("b", {}, box.name), ...(title ? [" ", element("span", { class: "muted" }, title)] : []));
    const label = [title, box.name, box.broken ? "violates a constraint" : ""].filter(Boolean).join(" ");
    const node = element("div", { class: `box${box.broken ? " bad" : ""}`, tabindex: "0", role: "group", "aria-label": label, "data-id": box.id }, name, ...shown);
    if (box.broken) {
      const reasons = box.broken.map((number) => element("p", { class: "reason" }, this.picture.violations[number][1]));
      name.after(this.mark(box.broken.length === 1 ? "violation" : `${box.broken.length} violations`), ...reasons);
    }
    const more = this.more(box);
    if (more) node.append(more);
    if (box.inside) node.append(element("div", { class: "inside" }, ...box.inside.map((event) => this.box(event, event.class))));
    return node;
  }

  // What a box without values is about: what it links to in other layers.
  elsewhere(box) {
    const layer = this.boxes.get(box.id).layer, found = new Map();
    for (const [label, to] of box.links ?? []) {
      if (!this.boxes.has(to) || this.boxes.get(to).layer === layer) continue;
      if (!found.has(label)) found.set(label, []);
      found.get(label).push(this.boxes.get(to).box);
    }
    return [...found].map(([label, boxes]) => element("div", { class: "fact" }, element("span", { class: "label" }, label), " ", element("span", { class: "ends" }, ...this.jumps(boxes, (one) => one.name))));
  }

  // What matters less, and the links in words; made when it is opened.
  more(box) {
    const rest = box.facts.slice(box.shown ?? box.facts.length);
    const links = [...(box.links ?? []), ...(this.incoming.get(box.id) ?? []).map(([label, from]) => [`${label} of`, from])]
      .filter(([, id]) => this.boxes.has(id));
    const counts = [[rest.length, "value"], [links.length, "link"]].filter(([n]) => n).map(([n, noun]) => `${n} ${noun}${n === 1 ? "" : "s"}`);
    if (!counts.length) return null;
    const details = element("details", { class: "more" }, element("summary", {}, counts.join(", ")));
    details.addEventListener("toggle", () => {
      if (details.open && details.children.length === 1) {
        const lines = links.slice(0, MEMBERS).map(([label, id]) => element("p", { class: "fact" }, element("span", { class: "label" }, label), " ", this.jump(id, this.boxes.get(id).box.name)));
        details.append(...rest.map((fact) => this.fact(fact)), ...lines);
      }
      this.draw();
    });
    return details;
  }

  mark(text) {
    return element("p", { class: "mark" }, element("span", { class: "cross", "aria-hidden": "true" }, "✗"), ` ${text}`);
  }

  // A parameter's range is shown once per box: `said` holds those that have been.
  fact([label, text, bound = [], wrong = 0], said = new Set()) {
    const parts = label ? [element("span", { class: "label" }, label), " ", element("b", {}, text)] : [text];
    const line = element("div", { class: `fact${wrong ? " wrong" : ""}${label ? "" : " sentence"}` }, ...parts);
    for (const [name, value] of bound) {
      if (!said.has(name)) line.append(this.range(name, value));
      said.add(name);
    }
    return line;
  }

  range(name, value) {
    const { text, low, high } = this.picture.parameters[name];
    if (high === undefined) return element("div", { class: "from formula" }, `${name} ${text}`);
    const line = element("div", { class: "from" }, element("span", {}, name), " ", element("span", {}, text));
    if (high > low) {
      const mark = element("i");
      mark.style.left = `${(100 * Math.min(1, Math.max(0, (value - low) / (high - low)))).toFixed(1)}%`;
      line.append(element("span", { class: "track", "aria-hidden": "true" }, mark));
    }
    return line;
  }

  // ---- links ----

  listen() {
    const boxAt = (event) => event.target.closest?.("[data-id]");
    this.host.addEventListener("pointerover", (event) => { this.hovered = boxAt(event)?.dataset.id ?? null; this.draw(); });
    this.host.addEventListener("pointerleave", () => { this.hovered = null; this.draw(); });
    this.host.addEventListener("focusin", (event) => { this.focused = boxAt(event)?.dataset.id ?? null; this.draw(); });
    this.host.addEventListener("focusout", () => { this.focused = null; this.draw(); });
    new ResizeObserver(() => this.draw(true)).observe(this.host);
  }

  // What stands for a box: itself, or the closed group that it is in; null where it is not drawn.
  standIn(id) {
    const node = this.grid.querySelector(`[data-id="${CSS.escape(id)}"]`);
    if (node?.checkVisibility?.() ?? node) return node;
    return node ? node.closest(".group") : this.groupOf(id);
  }

  groupOf(id) {
    const { group } = this.boxes.get(id) ?? {};
    return group?.common ? [...this.grid.querySelectorAll(".group")].find((node) => node.group === group) ?? null : null;
  }

  draw(again = false) {
    if (!this.grid) return;
    const id = this.hovered ?? this.focused ?? null;
    if (id === this.current && !again && id === null) return;
    this.current = id;
    this.lines.replaceChildren();
    this.grid.querySelectorAll(".linked").forEach((node) => node.classList.remove("linked"));
    const known = id && this.boxes.get(id);
    const from = known && this.standIn(id);
    if (!from) return;
    const ends = new Map(); // element → { labels, ids, out }
    const add = (label, other, out) => {
      const node = other !== id && this.boxes.has(other) && this.standIn(other);
      if (!node || node === from) return;
      if (!ends.has(node)) ends.set(node, { labels: new Set(), out });
      // A closed group stands for several: their names tell which.
      ends.get(node).labels.add(node.dataset.id ? label : `${label} ${this.boxes.get(other).box.name}`);
    };
    for (const [label, to] of known.box.links ?? []) add(label, to, true);
    for (const [label, other] of this.incoming.get(id) ?? []) add(label, other, false);
    const frame = this.grid.getBoundingClientRect();
    this.lines.setAttribute("viewBox", `0 0 ${frame.width} ${frame.height}`);
    for (const [node, end] of ends) this.line(this.place(from, frame), this.place(node, frame), end, node);
  }

  place(node, frame) {
    const own = node.querySelector(":scope > .head") ?? node;
    const outer = node.getBoundingClientRect(), box = own.getBoundingClientRect();
    return { left: outer.left - frame.left, right: outer.right - frame.left, top: outer.top - frame.top, y: box.top - frame.top + box.height / 2 };
  }

  line(a, b, { labels, out }, node) {
    node.classList.add("linked");
    const same = Math.abs(a.left - b.left) < 60;
    const right = b.left > a.left;
    const [x1, x2] = same ? [a.left, b.left] : right ? [a.right, b.left] : [a.left, b.right];
    const bend = same ? -Math.min(26, 12 + Math.abs(b.y - a.y) / 12) : (x2 - x1) / 2;
    const shape = (tag, attributes) => {
      const one = document.createElementNS(SVG, tag);
      for (const [name, value] of Object.entries(attributes)) one.setAttribute(name, value);
      this.lines.append(one);
      return one;
    };
    const c1 = x1 + bend, c2 = same ? x2 + bend : x2 - bend;
    shape("path", { d: `M${x1} ${a.y}C${c1} ${a.y} ${c2} ${b.y} ${x2} ${b.y}` });
    const tip = out ? [x2, b.y] : [x1, a.y];
    shape("circle", { cx: tip[0], cy: tip[1], r: 3.5 });
    const texts = [...labels];
    if (texts.length > 3) texts.splice(2, Infinity, `and ${texts.length - 2} more`);
    texts.reverse().forEach((text, k) => {
      const left = same || right;
      const line = shape("text", { x: left ? b.left + 4 : b.right - 4, y: b.top - 4 - 14 * k, "text-anchor": left ? "start" : "end" });
      line.textContent = text.length > 34 ? `${text.slice(0, 32)}…` : text;
    });
  }

  // Opens whatever hides a box, and puts the focus on it.
  go(id) {
    const known = this.boxes.get(id);
    if (!known) return;
    if (known.group.common) known.group.open(known.group.boxes.findIndex((box) => box.id === id || box.inside?.some((event) => event.id === id)));
    const node = this.grid.querySelector(`[data-id="${CSS.escape(id)}"]`);
    node.scrollIntoView({ block: "center", inline: "center" });
    node.focus({ preventScroll: true });
  }
}
