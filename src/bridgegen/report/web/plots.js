// What all charts by Plotly share.

import { palette } from "./colours.js";

// Plotly reads a little HTML and %{…} in texts: names must stay names.
export const plain = (text) => String(text).replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;").replace(/%/g, "&#37;");

export function layout(extra) {
  const axis = { gridcolor: palette.grid, zerolinecolor: palette.line, linecolor: palette.line, automargin: true, title: { standoff: 8 } };
  const { xaxis, yaxis, ...rest } = extra, clear = "rgba(0,0,0,0)";
  const font = { family: getComputedStyle(document.body).fontFamily, size: 12, color: palette.ink };
  return {
    paper_bgcolor: clear, plot_bgcolor: clear, font, margin: { l: 8, r: 10, t: 8, b: 8 }, dragmode: false,
    hoverlabel: { bgcolor: palette.card, bordercolor: palette.line, font },
    modebar: { bgcolor: clear, color: palette.muted, activecolor: palette.accent },
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom" },
    xaxis: { ...axis, ...xaxis }, yaxis: { ...axis, ...yaxis }, ...rest,
  };
}

export const CONFIG = { responsive: true, displaylogo: false, displayModeBar: false };
