// Each chart stands beside its own content, as JSON. Nothing leaves the page: plotly's button that
// would send a chart away is not there. Charts over time mark the moment that an animation shows,
// and ask it to go (event `seek`) where they are clicked.

for (const chart of document.querySelectorAll("figure.chart")) {
  const { data, layout } = JSON.parse(chart.querySelector("script").textContent);
  const plot = chart.querySelector(".plot");
  Plotly.newPlot(plot, data, layout, {
    responsive: true, displaylogo: false, showSendToCloud: false,
    modeBarButtonsToRemove: ["select2d", "lasso2d"],
  });
  if (!("overTime" in chart.dataset)) continue;
  plot.on("plotly_click", ({ points: [{ x }] }) =>
    document.dispatchEvent(new CustomEvent("seek", { detail: x })));
}

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
