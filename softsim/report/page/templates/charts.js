// Each chart stands beside its own content, as JSON. Nothing leaves the page: plotly's button that
// would send a chart away is not there.

const OPTIONS = {
  responsive: true, displaylogo: false, displayModeBar: "hover", showSendToCloud: false,
  modeBarButtonsToRemove: ["select2d", "lasso2d"],
};

function drawChart(chart) {
  const { data, layout } = JSON.parse(chart.querySelector("script").textContent);
  Plotly.newPlot(chart.querySelector(".plot"), data, layout, OPTIONS);
  chart.dispatchEvent(new Event("drawn"));
}

// Large charts of which there are many are drawn (event `drawn`) as they come into view.
const comingIntoView = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) if (isIntersecting) drawLate(target);
});

function drawLate(chart) {
  comingIntoView.unobserve(chart);
  if (!chart.querySelector(".plot").hasChildNodes()) drawChart(chart);
}

const late = document.querySelectorAll("[data-late] figure.chart");
late.forEach((chart) => comingIntoView.observe(chart));
addEventListener("beforeprint", () => late.forEach(drawLate));
document.querySelectorAll("figure.chart").forEach((chart) => {
  if (!chart.closest("[data-late]")) drawChart(chart);
});
