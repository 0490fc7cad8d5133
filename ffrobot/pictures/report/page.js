"use strict";

// Colours of the page, light or dark, as its style sheet has them; paper is always light.
const SCREEN = matchMedia("(prefers-color-scheme: dark)");
const NARROW = matchMedia("(max-width: 40rem)").matches;
const pageColor = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// What all charts have in common, over the layout that each brings along.
const COMMON_LAYOUT = {
  margin: { l: 70, r: 15, t: 55, b: 50 },
  colorway: ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#7A7A7A"],
  legend: {
    orientation: "h", yref: "container", y: 0, yanchor: "bottom", maxheight: 0.9, font: { size: NARROW ? 10 : 11 }, tracegroupgap: 0,
    ...(NARROW ? { xref: "container", x: 0, entrywidthmode: "fraction" } : {}),
  },
  hovermode: "closest",
};
const paint = () => ({ font: { size: 12, color: pageColor("--ink") }, plot_bgcolor: pageColor("--paper"), paper_bgcolor: pageColor("--paper") });
const axis = () => ({ gridcolor: pageColor("--grid"), zerolinecolor: pageColor("--line"), linecolor: pageColor("--axis"), ticks: "outside" });
// In 3D; of the axes themselves, which keep their ranges.
const tickCount = ([a, b], longest) => 2 + Math.round(((NARROW ? 4 : 6) * (b - a)) / longest);
const axis3D = () => ({ color: pageColor("--ink"), gridcolor: pageColor("--grid"), zerolinecolor: pageColor("--line") });
const CONFIG = {
  responsive: true,
  displaylogo: false,
  displayModeBar: NARROW || matchMedia("(pointer: coarse)").matches ? false : "hover",
  // Results stay where they are: Plotly's button that uploads a chart is left out.
  showSendToCloud: false,
  plotlyServerURL: "",
  toImageButtonOptions: { format: "svg" },
};

function chartLayout({ data, layout }) {
  return {
    ...COMMON_LAYOUT,
    ...paint(),
    legend: NARROW ? { ...COMMON_LAYOUT.legend, entrywidth: 1 / legendColumns({ data, layout }) } : COMMON_LAYOUT.legend,
    ...layout,
    title: {
      ...layout.title, font: { size: NARROW ? 13 : 14 }, x: 0, xanchor: "left", xref: NARROW ? "container" : "paper", y: 1, yanchor: "top",
      pad: { t: 8 },
    },
    xaxis: { ...axis(), automargin: true, ...layout.xaxis },
    yaxis: { ...axis(), ...layout.yaxis },
  };
}

// A chart that is drawn takes the colours of the page anew.
function repaint(element) {
  const colors = { ...paint() }, is3D = element.layout.scene !== undefined;
  const names = is3D ? ["scene.xaxis", "scene.yaxis", "scene.zaxis"] : ["xaxis", "yaxis"];
  for (const name of names)
    for (const [key, value] of Object.entries(is3D ? axis3D() : axis())) if (key !== "ticks") colors[`${name}.${key}`] = value;
  return Plotly.relayout(element, { "font.color": colors.font.color, ...Object.fromEntries(Object.entries(colors).filter(([key]) => key !== "font")) });
}

// The numbers of an entry as the page has them: little-endian, in base64.
const TYPED = { f4: Float32Array, i4: Int32Array, i2: Int16Array };
const typedArray = (entry) => new TYPED[entry.dtype](Uint8Array.from(atob(entry.bdata), (c) => c.charCodeAt(0)).buffer);

// Every `step`-th of values, from `offset` on.
const every = (values, step, offset) => Array.from(values).filter((_, i) => i % step === offset);

// Charts are drawn when they come near the window: a page of many opens at once.
const CHARTS = JSON.parse(document.getElementById("chart-data").textContent);

// Of a legend on phones and paper: its entries, and how many stand side by side; on phones Plotly puts groups below each other.
const legendEntries = ({ data, layout }) => [
  ...data.filter((trace) => trace.showlegend !== false), ...(layout.shapes ?? []).filter((shape) => shape.showlegend),
];
const legendColumns = (chart) =>
  legendEntries(chart).some(({ name, legendgroup }) => (name ?? "").length > 22 || (NARROW && legendgroup)) ? 1 : 2;

function drawChart(element) {
  const chart = CHARTS[element.dataset.chart];
  if (chart && !element.dataset.drawn) {
    element.dataset.drawn = "yes";
    // Rows of the legend beyond those that the height is for; on a wide page one more entry stands side by side.
    const [columns, few, height] = NARROW ? [legendColumns(chart), 3, 19] : [legendColumns(chart) + 1, 6, 22];
    const rows = Math.ceil(legendEntries(chart).length / columns) - few;
    if (rows > 0 && !element.style.height) element.style.height = `calc(${height}rem + ${19 * rows}px)`;
    Plotly.newPlot(element, chart.data, chartLayout(chart), CONFIG);
  }
}

const places = document.querySelectorAll("[data-chart]");
const watcher = new IntersectionObserver(
  (entries) => entries.filter((entry) => entry.isIntersecting).forEach((entry) => drawChart(entry.target)),
  { rootMargin: "500px" },
);
places.forEach((place) => watcher.observe(place));
const drawn = () => [...document.querySelectorAll(".js-plotly-plot")];
SCREEN.addEventListener("change", () => drawn().forEach(repaint));

// On paper: every chart, two side by side on A4 or letter, and everything that is folded. A chart keeps the size that it
// is drawn with, and the width of the paper is not known before the page is laid out.
const ROW = 16; // of a legend, in pixels
const SIZES = {
  paper: {
    mechanism: { width: 690, height: 400, "legend.y": -0.2 },
    chart: { width: 340, height: 265, "font.size": 10, "legend.font.size": 8, "title.font.size": 11, "title.xref": "container" },
  },
  screen: {
    mechanism: { width: null, height: null, "legend.y": -0.13 },
    chart: {
      width: null, height: null, "font.size": 12, "legend.font.size": NARROW ? 10 : 11, "title.font.size": NARROW ? 13 : 14,
      "title.xref": NARROW ? "container" : "paper",
    },
  },
};
function resize(place) {
  for (const chart of drawn()) {
    if (chart.id === "modes-3d") continue;
    const columns = chart.dataset.chart ? legendColumns(chart) : 3; // of the legend
    const size = { ...(SIZES[place][chart.id] ?? SIZES[place].chart) };
    if (size.height) size.height += ROW * Math.max(0, Math.ceil(legendEntries(chart).length / columns) - 2);
    Plotly.relayout(chart, size);
  }
}
window.addEventListener("beforeprint", () => {
  document.querySelectorAll("details").forEach((fold) => (fold.open = true));
  places.forEach(drawChart);
  resize("paper");
});
window.addEventListener("afterprint", () => resize("screen"));
