// Critical regions: which rows lie in them.

// Rows of the page, by region.
const inRegions = (data.regions?.regions ?? []).map((region) => new Set(region.rows));

function isInRegion(i, region) {
  return inRegions[region].has(i);
}

// The number of the first region that a row lies in, those that hold first; null in none.
function regionOf(i) {
  const k = inRegions.findIndex((one) => one.has(i));
  return k < 0 ? null : data.regions.regions[k].number;
}
