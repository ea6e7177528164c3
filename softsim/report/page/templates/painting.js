// Paints a frame of an animation on a canvas, in parallel projection: in the plane cells side by
// side, in space the faces that look at the camera, lit from the upper left. Places are in mm: u to
// the right, v upwards, depth towards the camera.

const LOST = -32768, LIGHTS = 24, ROOM_AROUND = 1.1, SEAM = 0.6, FAR = 1e6;
const FONT = "12px system-ui, sans-serif";
const SOURCE = [-0.5, 0.8, 1.0].map((part) => part / Math.hypot(-0.5, 0.8, 1.0));
const named = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const INK = named("--ink"), QUIET = named("--quiet"), WALL = named("--wall"), BODY = named("--body");
const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);

function unpacked(text, Kind) {
  return new Kind(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
}

const channels = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
const pale = (hex) => `rgb(${channels(hex).map((part) => part + 0.6 * (255 - part)).join()})`;

// A colour under `light`, 0 to 1, as a raster takes it: darker away from it and whiter towards it,
// for black alone would not show in dark colours.
function litColour(hex, light) {
  const dark = 0.4 * (1 - light) ** 1.5, white = 0.25 * light ** 3;
  const [red, green, blue] = channels(hex).map((part) =>
    Math.round(part * (1 - dark) * (1 - white) + 255 * white));
  return (255 << 24) | (blue << 16) | (green << 8) | red;
}

// The largest of 1, 2, 5, 10, 20 ... and their tenths that is no longer than `longest`.
function roundLength(longest) {
  const decade = 10 ** Math.floor(Math.log10(longest));
  return decade * [5, 2, 1].find((step) => step * decade <= longest);
}

class Painter {
  constructor(canvas, movie) {
    Object.assign(this, { canvas, movie, context: canvas.getContext("2d") });
    this.steps = unpacked(movie.places, Int16Array);
    this.shades = unpacked(movie.shades, Uint8Array);
    this.faces = unpacked(movie.faces, Int32Array);
    this.rim = unpacked(movie.rim, Int32Array);
    this.pale = movie.palette.map(pale);
    this.lit = [...movie.palette, WALL].map((hex) => // by shade, the wall's last, and by light
      Array.from({ length: LIGHTS + 1 }, (_, level) => litColour(hex, level / LIGHTS)));
    this.dimension = movie.origins[0].length;
    this.azimuth = Math.PI / 6; // turned about y, from z towards x
    this.elevation = 0.384; // above the plane of x and z
  }

  paint(frame, follows) {
    const pixels = window.devicePixelRatio || 1, { clientWidth, clientHeight } = this.canvas;
    this.canvas.width = Math.round(clientWidth * pixels);
    this.canvas.height = Math.round(clientHeight * pixels);
    this.context.scale(pixels, pixels);
    this.context.lineJoin = "round";
    this.aim(frame, follows);
    if (this.dimension === 3) this.paintSpace(frame);
    else this.paintPlane(frame);
    this.paintLength();
  }

  // Unit vectors to the right, upwards and, in space, towards the camera.
  axes() {
    if (this.dimension === 2) return [[1, 0], [0, 1]];
    const [ca, sa] = [Math.cos(this.azimuth), Math.sin(this.azimuth)];
    const [ce, se] = [Math.cos(this.elevation), Math.sin(this.elevation)];
    return [[ca, 0, -sa], [-se * sa, ce, -se * ca], [ce * sa, se, ce * ca]];
  }

  // Let the canvas show the robot's surroundings, or all that it comes to.
  aim(frame, follows) {
    const { near, everywhere, origins } = this.movie, [low, high] = follows ? near : everywhere;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const [across, upright] = this.axes().map((axis) => {
      const ends = axis.map((part, i) => [part * low[i], part * high[i]].sort((a, b) => a - b));
      const [least, most] = [0, 1].map((k) => ends.reduce((sum, end) => sum + end[k], 0));
      const away = follows ? dot(origins[frame], axis) : 0;
      return { middle: (least + most) / 2 + away, size: ROOM_AROUND * (most - least) };
    });
    this.scale = Math.min(width / across.size, height / upright.size);
    this.x = (u) => width / 2 + (u - across.middle) * this.scale;
    this.y = (v) => height / 2 - (v - upright.middle) * this.scale;
  }

  // Places of the nodes in a frame, one after another; NaN where they are lost.
  places(frame) {
    const { origins, step, node_count: count } = this.movie, d = this.dimension;
    const steps = this.steps.subarray(frame * count * d, (frame + 1) * count * d);
    return Float64Array.from(steps, (s, i) => s === LOST ? NaN : s * step + origins[frame][i % d]);
  }

  // Those places along each of the camera's axes.
  projected(places) {
    const d = this.dimension;
    return this.axes().map((axis) => Float64Array.from({ length: places.length / d }, (_, i) => {
      let along = 0;
      for (let k = 0; k < d; k++) along += places[d * i + k] * axis[k];
      return along;
    }));
  }

  shadesOf(frame) {
    const count = this.faces.length / this.movie.corners;
    return this.shades.subarray(frame * count, (frame + 1) * count);
  }

  paintPlane(frame) {
    const { scenery, outlines, mirrored, palette } = this.movie;
    for (const solid of scenery.solids) this.paintSolid(solid);
    for (const line of scenery.lines) this.paintLine(line, QUIET);
    for (const outline of outlines[frame]) this.paintOutline(outline);
    const [u, v] = this.projected(this.places(frame));
    if (mirrored) {
      this.paintCells(frame, u.map((place) => -place), v, this.pale, QUIET);
      this.paintLine([[0, -FAR], [0, FAR]], QUIET);
    }
    this.paintCells(frame, u, v, palette, INK);
  }

  // The solid behind a wall and, darker, its face; on one side of the axis only where it says so.
  paintSolid({ outline, face, side }) {
    const { context } = this;
    context.save();
    if (side !== 0) {
      context.beginPath();
      context.rect(this.x(0), 0, side * this.canvas.width, this.canvas.height);
      context.clip();
    }
    context.fillStyle = WALL;
    context.beginPath();
    this.trace(outline);
    context.fill();
    this.paintLine(face, INK);
    context.restore();
  }

  paintOutline(outline) {
    const { context } = this;
    Object.assign(context, { fillStyle: BODY, strokeStyle: INK, lineWidth: 1 });
    context.beginPath();
    this.trace(outline);
    context.closePath();
    context.fill();
    context.stroke();
  }

  paintLine(line, colour) {
    const { context } = this;
    Object.assign(context, { strokeStyle: colour, lineWidth: 1 });
    context.beginPath();
    this.trace(line);
    context.stroke();
  }

  // The path from place to place [u, v].
  trace(places) {
    for (const [k, [u, v]] of places.entries()) {
      if (k === 0) this.context.moveTo(this.x(u), this.y(v));
      else this.context.lineTo(this.x(u), this.y(v));
    }
  }

  // The cells of a frame, those of one colour at once, and the rim of the mesh.
  paintCells(frame, u, v, palette, rimColour) {
    const { context, faces, rim, movie: { corners } } = this;
    const ofShade = palette.map(() => []);
    this.shadesOf(frame).forEach((shade, face) => ofShade[shade].push(face));
    context.lineWidth = SEAM;
    for (const [shade, members] of ofShade.entries()) {
      context.fillStyle = context.strokeStyle = palette[shade];
      context.beginPath();
      for (const face of members) this.traceFace(u, v, faces, corners, face);
      context.fill();
      context.stroke();
    }
    context.strokeStyle = rimColour;
    context.beginPath();
    for (let edge = 0; edge < rim.length / 2; edge++) this.traceFace(u, v, rim, 2, edge);
    context.stroke();
  }

  // A face or an edge on the path, unless one of its corners is lost.
  traceFace(u, v, faces, corners, face) {
    const first = corners * face;
    for (let k = 0; k < corners; k++) if (Number.isNaN(u[faces[first + k]])) return;
    this.context.moveTo(this.x(u[faces[first]]), this.y(v[faces[first]]));
    for (let k = 1; k < corners; k++) {
      this.context.lineTo(this.x(u[faces[first + k]]), this.y(v[faces[first + k]]));
    }
    if (corners > 2) this.context.closePath();
  }

  paintSpace(frame) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const raster = new Raster(width, height), { palette, corners, scenery } = this.movie;
    const walls = scenery.faces.flat(2), inOrder = Int32Array.from(walls.keys());
    const wallCorners = inOrder.subarray(0, walls.length / 3);
    this.paintSeen(raster, this.projected(walls), wallCorners, 4, () => palette.length);
    const shades = this.shadesOf(frame);
    const projected = this.projected(this.places(frame));
    this.paintSeen(raster, projected, this.faces, corners, (face) => shades[face]);
    raster.show(this.context, width, height);
    this.paintDirections();
  }

  // The faces that look at the camera; one that has lost a corner does not.
  paintSeen(raster, [u, v, depth], faces, corners, shadeOf) {
    const x = u.map(this.x), y = v.map(this.y);
    for (let first = 0; first < faces.length; first += corners) {
      const a = faces[first];
      for (let k = 1; k < corners - 1; k++) { // triangles around the first corner
        const b = faces[first + k], c = faces[first + k + 1];
        const bu = u[b] - u[a], bv = v[b] - v[a], bw = depth[b] - depth[a];
        const cu = u[c] - u[a], cv = v[c] - v[a], cw = depth[c] - depth[a];
        const nu = bv * cw - bw * cv, nv = bw * cu - bu * cw, nw = bu * cv - bv * cu;
        if (!(nw > 0)) continue;
        const towards = nu * SOURCE[0] + nv * SOURCE[1] + nw * SOURCE[2];
        const light = Math.max(0, towards / Math.sqrt(nu * nu + nv * nv + nw * nw));
        const colour = this.lit[shadeOf(first / corners)][Math.round(light * LIGHTS)];
        raster.fill(x[a], y[a], depth[a], x[b], y[b], depth[b], x[c], y[c], depth[c], colour);
      }
    }
  }

  // The directions of x, y and z, in the lower left corner.
  paintDirections() {
    const { context } = this, [right, up] = this.axes();
    const [x, y] = [34, this.canvas.clientHeight - 52];
    Object.assign(context, { strokeStyle: INK, fillStyle: INK, lineWidth: 1.2, font: FONT });
    Object.assign(context, { textAlign: "center", textBaseline: "middle" });
    for (const [k, name] of [..."xyz"].entries()) {
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(x + 22 * right[k], y - 22 * up[k]);
      context.stroke();
      context.fillText(name, x + 31 * right[k], y - 31 * up[k]);
    }
  }

  // A bar of a round length, in the lower left corner.
  paintLength() {
    const { context } = this, length = roundLength(this.canvas.clientWidth / 4 / this.scale);
    const [left, y] = [12, this.canvas.clientHeight - 10];
    Object.assign(context, { fillStyle: INK, font: FONT, textAlign: "left" });
    context.textBaseline = "bottom";
    context.fillRect(left, y, length * this.scale, 2);
    context.fillText(`${length} mm`, left, y - 3);
  }
}
