// What the search algorithm learnt: its tables, as they come.

function fillNotes(tables) {
  $("notes").hidden = !tables.length;
  for (const { title, columns, rows, left_out } of tables) {
    const heads = columns.map((name) => element("th", { scope: "col" }, name));
    const body = rows.map((row) => element("tr", {}, ...row.map((text) => element("td", {}, text))));
    const table = element("table", {}, element("caption", { class: "hidden" }, title), element("thead", {}, element("tr", {}, ...heads)), element("tbody", {}, ...body));
    const wide = element("div", { class: "wide", tabindex: "0", role: "group", "aria-label": `${title}, scrollable` }, table);
    const card = element("div", { class: "card note-table" }, element("h3", {}, title), wide);
    if (left_out) card.append(element("p", { class: "muted" }, `${number(left_out)} more are kept with the run.`));
    $("notes").append(card);
  }
}
