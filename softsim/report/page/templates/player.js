// The controls of the animation. What moment it shows it tells the page (event `moment`), and it
// goes where the page asks it to (event `seek`); both carry the time of the run [s].

const movie = JSON.parse(document.getElementById("animation").textContent);
const [player, play, slider, reading, speed, camera] =
  ["player", "play", "frame", "reading", "speed", "camera"].map((id) => document.getElementById(id));
const canvas = player.querySelector("canvas"), painter = new Painter(canvas, movie);
const { times } = movie, end = times.length - 1;
let current = 0, playing = null;

const words = (value) => Number(value.toPrecision(4)).toString();

function paint() {
  painter.paint(current, camera.value === "follows");
}

function show(frame) {
  current = Math.max(0, Math.min(end, frame));
  slider.value = current;
  const said = movie.readings.map(({ name, unit, values }) =>
    `${name} ${values[current].toFixed(2)} ${unit}`);
  reading.textContent = [`${words(times[current])} s`, ...said].join(", ");
  slider.setAttribute("aria-valuetext", reading.textContent);
  paint();
  document.dispatchEvent(new CustomEvent("moment", { detail: times[current] }));
}

function frameAt(time) {
  const after = times.findIndex((other) => other >= time);
  if (after === -1) return end;
  const before = Math.max(after - 1, 0);
  return time - times[before] < times[after] - time ? before : after;
}

function pause() {
  cancelAnimationFrame(playing);
  playing = null;
  play.textContent = "\u25b6";
  play.setAttribute("aria-label", "Play");
}

function start() {
  if (current === end) show(0);
  let last = performance.now(), time = times[current];
  const next = (now) => {
    time += ((now - last) / 1000) * (times[end] - times[0]) / Number(speed.value);
    last = now;
    if (frameAt(time) !== current) show(frameAt(time));
    if (current === end) pause();
    else playing = requestAnimationFrame(next);
  };
  playing = requestAnimationFrame(next);
  play.textContent = "\u2016";
  play.setAttribute("aria-label", "Pause");
}

function goTo(frame) {
  pause();
  show(frame);
}

play.addEventListener("click", () => (playing === null ? start() : pause()));
slider.addEventListener("input", () => goTo(Number(slider.value)));
camera.addEventListener("change", paint);
document.addEventListener("seek", (event) => goTo(frameAt(event.detail)));

// Turn a body in space, by angles [rad] to the right and upwards.
function turn(right, upwards) {
  if (painter.dimension === 2) return;
  painter.azimuth += right;
  painter.elevation = Math.max(-1.5, Math.min(1.5, painter.elevation + upwards));
  paint();
}

const KEYS = {
  ArrowLeft: () => goTo(current - 1), ArrowRight: () => goTo(current + 1),
  Home: () => goTo(0), End: () => goTo(end), " ": () => play.click(),
};
const KEYS_WITH_SHIFT = {
  ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0),
  ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1),
};

canvas.addEventListener("keydown", (event) => {
  const act = (event.shiftKey ? KEYS_WITH_SHIFT : KEYS)[event.key];
  if (act === undefined) return;
  event.preventDefault();
  act();
});
canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
canvas.addEventListener("pointermove", ({ buttons, movementX, movementY }) => {
  if (buttons !== 0) turn(-movementX / 150, movementY / 150);
});

new ResizeObserver(paint).observe(canvas);
show(0);
