// Each chart stands beside its own content, as JSON. Nothing leaves the page: plotly's button that
// would send a chart away is not there. Charts over time mark the moment that an animation shows,
// and ask it to go (event `seek`) where they are clicked.

function drawChart(chart) {
  const { data, layout } = JSON.parse(chart.querySelector("script").textContent);
  const plot = chart.querySelector(".plot");
  Plotly.newPlot(plot, data, layout, {
    responsive: true, displaylogo: false, showSendToCloud: false,
    modeBarButtonsToRemove: ["select2d", "lasso2d"],
  });
  chart.dispatchEvent(new Event("drawn"));
  if (!("overTime" in chart.dataset)) return;
  plot.on("plotly_click", ({ points: [{ x }] }) =>
    document.dispatchEvent(new CustomEvent("seek", { detail: x })));
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

let moment = null; // that the charts do not mark yet

function markMoment() {
  const place = { "shapes[0].x0": moment, "shapes[0].x1": moment };
  moment = null;
  for (const plot of document.querySelectorAll("figure[data-over-time] .plot")) {
    Plotly.relayout(plot, place);
  }
}

document.addEventListener("moment", ({ detail }) => {
  if (moment === null) requestAnimationFrame(markMoment);
  moment = detail;
});
