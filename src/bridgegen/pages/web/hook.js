// What drives the page from outside, `window.bridgegen`: for tests, and for users' own scripts.

import { data } from "./data.js";

/** @type {any} */
export const hook = { data, state: () => null, charts: 0, chartsDrawn: 0 };
window.bridgegen = hook;
