// Which rows of the page lie in which critical region.

import { data } from "./data.js";

export let regionList = [];
let inRegions = []; // rows of the page

function takeRegions() {
  regionList = data.regions?.regions ?? [];
  inRegions = regionList.map((region) => new Set(region.rows));
}

export function isInRegion(i, region) {
  return inRegions[region].has(i);
}

takeRegions();
document.addEventListener("grown", takeRegions);

// The number of the first region that a row lies in, those that hold first; null in none.
export function regionOf(i) {
  const k = inRegions.findIndex((one) => one.has(i));
  return k < 0 ? null : regionList[k].number;
}
