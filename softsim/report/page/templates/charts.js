// Each chart stands beside its own content, as JSON. Nothing leaves the page: plotly's button that
// would send a chart away is not there. Charts over time mark the moment that an animation shows,
// and ask it to go (event `seek`) where they are clicked.

function drawChart(chart) {
  const { data, layout } = JSON.parse(chart.querySelector("script").textContent);
  const plot = chart.querySelector(".plot");
  Plotly.newPlot(plot, data, layout, {
    responsive: true, displaylogo: false, displayModeBar: "hover", showSendToCloud: false,
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

// A line across a chart at a time of the run; plotly's own shapes take ten times as long to move.
function markMoment(chart, time) {
  const plot = chart.querySelector(".plot"), line = chart.querySelector(".moment");
  const { xaxis, _size: size } = plot._fullLayout, place = xaxis.l2p(time);
  line.hidden = place < 0 || place > xaxis._length;
  line.style.left = `${xaxis._offset + place}px`;
  line.style.top = `${size.t}px`;
  line.style.height = `${size.h}px`;
}

for (const chart of document.querySelectorAll("figure[data-over-time]")) {
  let moment = NaN;
  document.addEventListener("moment", ({ detail }) => markMoment(chart, moment = detail));
  chart.querySelector(".plot").on("plotly_afterplot", () => markMoment(chart, moment));
}
