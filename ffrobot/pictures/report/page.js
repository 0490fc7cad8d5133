"use strict";

// What all charts have in common, over the layout that each brings along.
const COMMON_LAYOUT = {
  margin: { l: 70, r: 15, t: 40, b: 50 },
  font: { size: 12 },
  colorway: ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000"],
  legend: { orientation: "h", y: -0.27, font: { size: 11 } },
  hovermode: "closest",
  plot_bgcolor: "#fff",
};
const AXIS = { gridcolor: "#e6e9ee", zerolinecolor: "#c4cad3", linecolor: "#8b95a3", ticks: "outside" };
const CONFIG = {
  responsive: true,
  displaylogo: false,
  // Results stay where they are: Plotly's button that uploads a chart is left out.
  showSendToCloud: false,
  plotlyServerURL: "",
  toImageButtonOptions: { format: "svg" },
};

function chartLayout(layout) {
  return {
    ...COMMON_LAYOUT,
    ...layout,
    title: { ...layout.title, font: { size: 14 }, x: 0, xanchor: "left", xref: "paper" },
    xaxis: { ...AXIS, ...layout.xaxis },
    yaxis: { ...AXIS, ...layout.yaxis },
  };
}

// Charts are drawn when they come near the window: a page of many opens at once.
const CHARTS = JSON.parse(document.getElementById("chart-data").textContent);

function drawChart(element) {
  const chart = CHARTS[element.dataset.chart];
  if (chart && !element.dataset.drawn) {
    element.dataset.drawn = "yes";
    Plotly.newPlot(element, chart.data, chartLayout(chart.layout), CONFIG);
  }
}

const places = document.querySelectorAll("[data-chart]");
const watcher = new IntersectionObserver(
  (entries) => entries.filter((entry) => entry.isIntersecting).forEach((entry) => drawChart(entry.target)),
  { rootMargin: "500px" },
);
places.forEach((place) => watcher.observe(place));
window.addEventListener("beforeprint", () => places.forEach(drawChart));
