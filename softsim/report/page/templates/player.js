// The animation and its controls. What moment it shows it tells the page (event `moment`), and it
// goes where the page asks it to (event `seek`); both carry the time of the run [s].

const movie = JSON.parse(document.getElementById("animation").textContent);
const [player, play, slider, reading, speed, camera] =
  ["player", "play", "frame", "reading", "speed", "camera"].map((id) => document.getElementById(id));
const robot = player.querySelector(".plot");
const { times, faces, rim, signs, origins, shades } = movie, end = times.length - 1, d = origins[0].length;
const places = inFrames(movie.places), values = inFrames(movie.values), [low, high] = movie.scale;
const ofBody = movie.figure.data.flatMap((trace, k) => (trace.x === undefined ? [k] : []));
const others = Object.entries(movie.moving), moving = [...ofBody, ...others.map(([k]) => Number(k))];
let current = 0, playing = false;

// Numbers of each frame from their changes, in steps; NaN where there is none.
function inFrames({ low, step, changes }) {
  const sums = new Int32Array(changes[0].length);
  return changes.map((ofFrame) => Float32Array.from(ofFrame, (change, k) =>
    change === null ? NaN : low + step * (sums[k] += change)));
}

// Polygons or lines of places [x, y] as one trace, with gaps between them.
class Path {
  x = [];
  y = [];

  add(corners) {
    if (corners.some(([x]) => Number.isNaN(x))) return; // a node is lost
    for (const [x, y] of corners) this.x.push(x), this.y.push(y);
    this.x.push(null);
    this.y.push(null);
  }
}

// In the plane: the cells of each shade, those without a value, and the rim.
function plane(frame) {
  const paths = ofBody.map(() => new Path()), noValue = paths.at(-2), edges = paths.at(-1);
  for (const sign of signs) {
    const at = (node) => [sign * places[frame][d * node], places[frame][d * node + 1]];
    faces.forEach((face, number) => {
      const share = (values[frame][number] - low) / (high - low || 1);
      const path = paths[Math.round(share * (shades - 1))] ?? noValue;
      path.add([...face, face[0]].map(at));
    });
    for (const edge of rim) edges.add(edge.map(at));
  }
  return { x: paths.map(({ x }) => x), y: paths.map(({ y }) => y) };
}

// In space: the faces that have a value, those that have none, and all as shadows on the flat walls;
// not those that lost a node.
function space(frame) {
  const [x, y, z] = [0, 1, 2].map((k) => places[frame].filter((_, i) => i % d === k));
  const kept = [...faces.keys()].filter((face) => faces[face].every((node) => !Number.isNaN(x[node])));
  const parts = [true, false].map((has) =>
    kept.filter((face) => Number.isNaN(values[frame][face]) !== has));
  parts.push(...movie.walls.map(() => kept));
  const corner = (k) => parts.map((part) => part.map((face) => faces[face][k]));
  const shadows = movie.walls.map((wall) => shadow([x, y, z], wall));
  return {
    x: [x, x, ...shadows.map((at) => at[0])], y: [y, y, ...shadows.map((at) => at[1])],
    z: [z, z, ...shadows.map((at) => at[2])], i: corner(0), j: corner(1), k: corner(2),
    intensity: [parts[0].map((face) => values[frame][face]), null, ...movie.walls.map(() => null)],
  };
}

// Where places (x, y, z) are on a flat wall, a point and the normal; a little above it, or the wall
// would show through.
function shadow(places, wall) {
  const [point, normal] = [wall.slice(0, 3), wall.slice(3)];
  const above = 2e-3 * Math.max(...movie.near[1].map((end, k) => end - movie.near[0][k]));
  const gaps = [...places[0]].map((_, node) =>
    places.reduce((sum, of, k) => sum + (of[node] - point[k]) * normal[k], 0));
  return places.map((of, k) => of.map((c, node) => c - (gaps[node] - above) * normal[k]));
}

// Axes that show the robot's surroundings, or all that it comes to.
function view(frame) {
  const follows = camera.value === "follows", [low, high] = follows ? movie.near : movie.everywhere;
  const origin = follows ? origins[frame] : low.map(() => 0);
  const room = 0.05 * Math.max(...high.map((end, k) => end - low[k]));
  const ranges = low.map((start, k) => [start - room + origin[k], high[k] + room + origin[k]]);
  if (d === 2) return { "xaxis.range": ranges[0], "yaxis.range": ranges[1] };
  const sizes = ranges.map(([from, to]) => to - from), longest = Math.max(...sizes);
  const [x, y, z] = sizes.map((size) => (1.3 * size) / longest);
  const [ticksX, ticksY, ticksZ] = sizes.map((size) => Math.max(2, Math.round((8 * size) / longest)));
  return {
    "scene.xaxis.nticks": ticksX, "scene.yaxis.nticks": ticksY, "scene.zaxis.nticks": ticksZ,
    "scene.xaxis.range": ranges[0], "scene.yaxis.range": ranges[1], "scene.zaxis.range": ranges[2],
    "scene.aspectratio": { x, y, z },
  };
}

// Places moved towards the eye, nearly to where the axes end, as nothing is drawn beyond: in front of
// the body, and seen at the same points as before.
function inFront(places) {
  const { eye } = robot.layout.scene.camera, names = ["x", "y", "z"], shown = view(current);
  const ends = names.map((name) => shown[`scene.${name}axis.range`]);
  const eyes = names.map((name, k) => {
    const [from, to] = ends[k];
    return (from + to) / 2 + (eye[name] * (to - from)) / shown["scene.aspectratio"][name];
  });
  const moved = places.x.map((first, node) => {
    const at = names.map((name) => places[name][node]);
    if (first === null) return at;
    const ways = at.map((c, k) => ((eyes[k] > c ? ends[k][1] : ends[k][0]) - c) / (eyes[k] - c));
    const part = 0.98 * Math.max(0, Math.min(1, ...ways.filter(Number.isFinite)));
    return at.map((c, k) => c + part * (eyes[k] - c));
  });
  return Object.fromEntries(names.map((name, k) => [name, moved.map((at) => at[k])]));
}

function placesOf(trace, frames) {
  const places = frames[current];
  return movie.in_front.includes(Number(trace)) ? inFront(places) : places;
}

function paint(layout = camera.value === "follows" ? view(current) : {}) {
  const content = d === 2 ? plane(current) : space(current);
  const shown = others.map(([trace, frames]) => placesOf(trace, frames));
  for (const name of Object.keys(content)) {
    content[name].push(...shown.map((places, k) =>
      places[name] ?? robot.data[others[k][0]][name] ?? null));
  }
  return Plotly.update(robot, content, layout, moving);
}

function show(frame) {
  current = Math.max(0, Math.min(end, frame));
  slider.value = current;
  const said = movie.readings.map(({ name, unit, values }) =>
    `${name} ${values[current].toFixed(2)} ${unit}`);
  reading.textContent = [`${Number(times[current].toPrecision(4))} s`, ...said].join(", ");
  slider.setAttribute("aria-valuetext", reading.textContent);
  document.dispatchEvent(new CustomEvent("moment", { detail: times[current] }));
  return paint();
}

function frameAt(time) {
  const after = times.findIndex((other) => other >= time);
  if (after === -1) return end;
  const before = Math.max(after - 1, 0);
  return time - times[before] < times[after] - time ? before : after;
}

function pause() {
  playing = false;
  play.textContent = "\u25b6";
  play.setAttribute("aria-label", "Play");
}

async function start() {
  playing = true;
  play.textContent = "\u2016";
  play.setAttribute("aria-label", "Pause");
  if (current === end) await show(0);
  let last = performance.now(), time = times[current];
  while (playing && current !== end) {
    const now = await new Promise(requestAnimationFrame);
    time += ((now - last) / 1000) * (times[end] - times[0]) / Number(speed.value);
    last = now;
    if (playing && frameAt(time) !== current) await show(frameAt(time));
  }
  pause();
}

function goTo(frame) {
  pause();
  return show(frame);
}

// Turn a body in space, by angles [rad] to the right and upwards.
function turn(right, upwards) {
  if (d === 2) return;
  const { x, y, z } = robot.layout.scene.camera.eye, away = Math.hypot(x, y, z);
  const azimuth = Math.atan2(x, z) + right;
  const elevation = Math.max(-1.5, Math.min(1.5, Math.asin(y / away) + upwards));
  const [sine, cosine] = [Math.sin(azimuth), Math.cos(azimuth)].map((part) => away * part * Math.cos(elevation));
  Plotly.relayout(robot, { "scene.camera.eye": { x: sine, y: away * Math.sin(elevation), z: cosine } });
}

const KEYS = {
  ArrowLeft: () => goTo(current - 1), ArrowRight: () => goTo(current + 1),
  Home: () => goTo(0), End: () => goTo(end), " ": () => play.click(),
};
const KEYS_WITH_SHIFT = {
  ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0),
  ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1),
};

robot.addEventListener("keydown", (event) => {
  const act = (event.shiftKey ? KEYS_WITH_SHIFT : KEYS)[event.key];
  if (act === undefined) return;
  event.preventDefault();
  act();
});
play.addEventListener("click", () => (playing ? pause() : start()));
slider.addEventListener("input", () => goTo(Number(slider.value)));
camera.addEventListener("change", () => paint(view(current)));
document.addEventListener("seek", (event) => goTo(frameAt(event.detail)));

Plotly.newPlot(robot, movie.figure.data, movie.figure.layout, OPTIONS);
if (movie.in_front.length) robot.on("plotly_relayout", (change) => {
  if (Object.keys(change).some((key) => key.startsWith("scene.camera"))) paint({});
});
show(movie.opens_at);
