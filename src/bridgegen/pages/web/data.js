// What the page holds.

import { $ } from "./common.js";

export const data = JSON.parse($("data").textContent);
export const rows = data.rows;
export const columns = new Map(data.rows.columns.map((column) => [column.name, column]));
