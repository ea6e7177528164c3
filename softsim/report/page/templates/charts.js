// Each chart stands beside its own content, as JSON. Nothing leaves the page: plotly's button that would send a
// chart away is not there.

for (const chart of document.querySelectorAll("figure.chart")) {
  const { data, layout } = JSON.parse(chart.querySelector("script").textContent);
  Plotly.newPlot(chart.querySelector(".plot"), data, layout, {
    responsive: true, displaylogo: false, showSendToCloud: false,
    modeBarButtonsToRemove: ["select2d", "lasso2d"],
  });
}
