// Charts over time and the animation show one moment: a chart marks the one that the animation is at
// (event `moment`), and leads the animation to where it is clicked (event `seek`).

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
  const plot = chart.querySelector(".plot");
  let moment = NaN;
  document.addEventListener("moment", ({ detail }) => markMoment(chart, moment = detail));
  plot.on("plotly_afterplot", () => markMoment(chart, moment));
  plot.on("plotly_click", ({ points: [{ x }] }) =>
    document.dispatchEvent(new CustomEvent("seek", { detail: x })));
}
