"""Pictures of bodies in space: their deformed surface in parallel projection, lit from above."""

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.transforms import ScaledTranslation, Transform

from softsim.mesh.mesh import boundary_facets, facet_owners, with_corners
from softsim.output.fields import Frames
from softsim.report.cables import (
    LAYER_WIDTH,
    WIDTH,
    cables_at,
    crosses_at,
    draw_cables,
    draw_fibres,
    draw_lines,
    fibres_at,
    layers_at,
    rigid_faces_at,
)
from softsim.report.colours import MILLI, places_at, shown_values
from softsim.report.section import walls_at
from softsim.report.style import (
    AZIMUTH,
    ELEVATION,
    FRAME,
    GLOSS,
    INK,
    ORANGE,
    QUIET,
    SHADE,
    SHADOW,
    WALL,
)

PIPE_FACES = 72
"""Number of faces around a pipe."""

NO_FACES = np.zeros((0, 4, 3))

RIM_WIDTH = 0.6
"""Line width of the edge of a wall [points]."""

ARROW = 20.0
"""Length of the arrows that show directions [points]."""


@dataclass(frozen=True)
class Camera:
    """Parallel projection: unit vectors (3,) to the right, up, and towards the camera."""

    right: np.ndarray
    up: np.ndarray
    towards: np.ndarray

    @property
    def source(self) -> np.ndarray:
        """Unit vector (3,) towards the light, which comes from the upper left."""
        way = self.towards + 0.8 * self.up - 0.5 * self.right
        return way / np.linalg.norm(way)

    @classmethod
    def at(cls, azimuth: float, elevation: float) -> "Camera":
        """Return the camera at these angles [rad], with y upright in the picture."""
        right = np.array([np.cos(azimuth), 0.0, -np.sin(azimuth)])
        across = np.array([np.sin(azimuth), 0.0, np.cos(azimuth)])
        upright = np.array([0.0, 1.0, 0.0])
        towards = np.cos(elevation) * across + np.sin(elevation) * upright
        return cls(right, np.cross(towards, right), towards)

    def project(self, places: np.ndarray) -> np.ndarray:
        """Project points (..., 3) to the picture (..., 2)."""
        return places @ np.column_stack([self.right, self.up])

    def light(self, normals: np.ndarray) -> np.ndarray:
        """Return the light, 0 to 1, on faces with these unit normals (k, 3)."""
        return np.clip(normals @ self.source, 0.0, 1.0)


CAMERA = Camera.at(np.radians(AZIMUTH), np.radians(ELEVATION))


@dataclass(frozen=True)
class Shot:
    """Faces that the camera sees, from far to near.

    corners in the picture (k, 3|4, 2) [mm], values (k,), light (k,), 0 to 1, numbers (k,) among
    all faces.
    """

    corners: np.ndarray
    values: np.ndarray
    light: np.ndarray
    numbers: np.ndarray


class Surface:
    """The frames `indices` of a run in space, coloured by `field`.

    values: those of all frames (n,), in the unit of the field's label. view: xmin, xmax, ymin,
    ymax of the picture [mm].
    """

    def __init__(self, frames: Frames, indices: list[int], field: str) -> None:
        self.camera = CAMERA
        facets = boundary_facets(frames.cells, 3)
        owners = facet_owners(facets, frames.cells)
        corners = [places_at(frames, index)[facets] for index in indices]
        values = shown_values(frames, indices, field, facets, owners)
        self.values = np.concatenate(values)
        self.face_count = len(facets)  # those of rigid bodies come after them
        self.shots = []
        for number, index in enumerate(indices):
            vertices, faces = rigid_faces_at(frames, index)
            rigid = vertices[with_corners(faces, 2, facets.shape[1])]
            corners[number] = np.concatenate([corners[number], rigid])
            shown = np.append(values[number], np.full(len(rigid), np.nan))
            self.shots.append(visible_side(corners[number], shown, self.camera))
        self.cables = [
            [self.camera.project(line) for line in cables_at(frames, index)] for index in indices
        ]
        self.fibres = [
            [self.camera.project(line) for line in fibres_at(frames, index)] for index in indices
        ]
        layers, crosses = ([at(frames, k) for k in indices] for at in (layers_at, crosses_at))
        self.layers = [self.camera.project(lines) for lines in layers]
        self.crosses = [self.camera.project(lines) for lines in crosses]
        places = np.concatenate([*corners, *crosses], axis=None).reshape(-1, 3)
        places = places[np.isfinite(places).all(axis=1)]
        box = corners_of_box(places)
        # In each of the frames, for walls may move.
        self.walls, self.rims, self.shadows = [], [], []
        for number, index in enumerate(indices):
            faces, curved = seen_walls(frames, box, index)
            facing = [
                wall for wall in flat_walls(frames, box, index) if wall[3:] @ CAMERA.towards > 0
            ]
            self.shadows.append(
                [self.camera.project(shadow(corners[number], wall)) for wall in facing]
            )
            self.rims.append(self.camera.project(rim(faces)))
            sides = [visible_side(f, np.zeros(len(f)), self.camera) for f in (faces, curved)]
            # Quieter than the body.
            self.walls.append([replace(side, light=0.5 + 0.5 * side.light) for side in sides])
        flat = [walls[0].corners.reshape(-1, 2) for walls in self.walls]
        parts = [self.camera.project(places), *flat]
        if len(curved):  # it leads on and on: as far as there is something near the body
            parts.append(self.camera.project(around(box)))
        shown = np.concatenate(parts)
        low, high = shown.min(axis=0), shown.max(axis=0)
        margin = 0.03 * (high - low).max()
        self.view = np.column_stack([low - margin, high + margin]).ravel()

    def draw(self, axes: Axes, number: int, colours: ScalarMappable) -> None:
        """Draw one of the frames, in front of the walls behind it."""
        for wall in self.walls[number]:
            _draw_faces(axes, wall, np.tile(to_rgba(WALL), (len(wall.light), 1)))
        draw_lines(axes, self.rims[number], QUIET, RIM_WIDTH, zorder=1.0)
        for dark in self.shadows[number]:
            faces = PolyCollection(
                list(dark), facecolors=SHADOW, edgecolors="face", linewidths=0.25
            )
            axes.add_collection(faces, autolim=False)
        draw_cables(axes, self.cables[number], zorder=1.0)  # behind the body, as a tether is
        shot = self.shots[number]
        rgba = colours.to_rgba(np.ma.masked_invalid(shot.values))
        rgba[shot.numbers >= self.face_count] = to_rgba(FRAME)
        _draw_faces(axes, shot, rgba)
        draw_lines(axes, self.layers[number], ORANGE, LAYER_WIDTH)
        draw_fibres(axes, self.fibres[number])
        draw_lines(axes, self.crosses[number], INK, WIDTH)
        axes.set_axis_off()

    def label(self, lowest: list[Axes], leftmost: list[Axes]) -> None:
        """Draw axis directions and a scale bar below the lowest panel on the left."""
        _draw_directions(lowest[0], self.camera)
        _draw_length(lowest[0], self.view)


def visible_side(corners: np.ndarray, values: np.ndarray, camera: Camera) -> Shot:
    """Return the facets that face the camera, far ones first so that near ones cover them.

    corners: (k, 3|4, 3) [mm], outward by the right-hand rule. values: (k,). Facets that are not
    finite or have no area are omitted.
    """
    # Of triangles two sides, of quadrilaterals the diagonals.
    normals = np.cross(corners[:, -2] - corners[:, 0], corners[:, -1] - corners[:, 1])
    lengths = np.linalg.norm(normals, axis=1)
    with np.errstate(invalid="ignore"):
        seen = np.flatnonzero(normals @ camera.towards > 1e-9 * lengths)
    depth = corners[seen].mean(axis=1) @ camera.towards
    seen = seen[np.argsort(depth)]
    light = camera.light(normals[seen] / lengths[seen, None])
    return Shot(camera.project(corners[seen]), values[seen], light, seen)


def lit(colours: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Return the colours (k, 3) of faces lit by `light` (k,), 0 to 1."""
    shade, gloss = SHADE * (1.0 - light[:, None]) ** 1.5, GLOSS * light[:, None] ** 3
    return (1.0 - gloss) * (1.0 - shade) * colours + gloss


def corners_of_box(places: np.ndarray) -> np.ndarray:
    """Return the corners (8, 3) of the box around points (n, 3)."""
    ends = np.stack([places.min(axis=0), places.max(axis=0)])
    return np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i, j, k in np.ndindex(2, 2, 2)])


def seen_walls(frames: Frames, box: np.ndarray, index: int) -> tuple[np.ndarray, np.ndarray]:
    """Return faces [mm] of walls in a frame: (k, 4, 3) and (m, 3|4, 3).

    The first are flat walls and straight pipes near the box, corners (8, 3) around the whole
    motion of the body; the second are all curved walls.
    """
    walls = flat_walls(frames, box, index)
    pipes = walls_at(frames, "pipes", index, np.zeros((0, 7)))
    curved = walls_at(frames, "wall_faces", index, NO_FACES) * MILLI
    return wall_faces(walls, pipes * [*[MILLI] * 3, 1.0, 1.0, 1.0, MILLI], box), curved


def flat_walls(frames: Frames, box: np.ndarray, index: int) -> np.ndarray:
    """Return the flat walls (w, 6) near the box in a frame, a point [mm] and the normal each.

    Walls farther away than half the size of the box are omitted. box: corners (8, 3).
    """
    walls = walls_at(frames, "walls", index, np.zeros((0, 6))) * [*[MILLI] * 3, 1.0, 1.0, 1.0]
    return near_walls(walls, box)


def near_walls(walls: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Return the flat walls (w, 6) that are near a box (8, 3)."""
    gaps = [((box - wall[:3]) @ wall[3:]).min() for wall in walls]
    return walls[np.array(gaps, dtype=float) < np.ptp(box, axis=0).max() / 2]


def shadow(corners: np.ndarray, wall: np.ndarray) -> np.ndarray:
    """Return the projection of faces (k, 3|4, 3) onto a flat wall (6,), a point and the normal.

    Where a body touches the wall, it touches its shadow. Faces that are not finite are omitted.
    """
    known = corners[np.isfinite(corners).all(axis=(1, 2))]
    return known - ((known - wall[:3]) @ wall[3:])[..., None] * wall[3:]


def rim(faces: np.ndarray) -> np.ndarray:
    """Return the edges (e, 2, 3) of faces (k, 4, 3) that belong to only one face."""
    if len(faces) == 0:
        return np.zeros((0, 2, 3))
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2, 3)
    size = np.ptp(edges.reshape(-1, 3), axis=0).max()
    places = np.rint(edges.reshape(-1, 3) / (1e-6 * size))
    nodes = np.unique(places, axis=0, return_inverse=True)[1].reshape(-1, 2)
    _, numbers, counts = np.unique(
        np.sort(nodes, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    return edges[counts[numbers.ravel()] == 1]


def wall_faces(walls: np.ndarray, pipes: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Return the walls near a body as faces (k, 4, 3) [mm].

    The normals point towards the free side by the right-hand rule. walls: (w, 6) a point [mm]
    and the normal. pipes: (p, 7) a point on the axis [mm], its direction, the radius [mm]. box:
    corners (8, 3) around the whole motion of the body [mm]. The faces extend slightly beyond
    the box; walls farther away than half its size are omitted.
    """
    size = np.ptp(box, axis=0).max()
    faces = [np.zeros((0, 4, 3))]
    near = near_walls(walls, box)
    for point, normal in zip(near[:, :3], near[:, 3:], strict=True):
        one, other = tangents(normal)
        a, b = (_reach((box - point) @ along, size) for along in (one, other))
        square = [(a[0], b[0]), (a[1], b[0]), (a[1], b[1]), (a[0], b[1])]
        faces.append(np.array([[point + i * one + j * other for i, j in square]]))
    for point, axis, radius in zip(pipes[:, :3], pipes[:, 3:6], pipes[:, 6], strict=True):
        arms = box - point - ((box - point) @ axis)[:, None] * axis
        if radius - np.linalg.norm(arms, axis=1).max() < size / 2:
            one, other = tangents(axis)
            angles = np.linspace(0.0, 2.0 * np.pi, PIPE_FACES + 1)[:, None]
            ring = point + radius * (np.cos(angles) * one + np.sin(angles) * other)
            low, high = (end * axis for end in _reach((box - point) @ axis, size))
            sides = [ring[:-1] + low, ring[:-1] + high, ring[1:] + high, ring[1:] + low]
            faces.append(np.stack(sides, axis=1))
    return np.concatenate(faces)


def around(box: np.ndarray) -> np.ndarray:
    """Return the corners (8, 3) of a box, enlarged on all sides by 1/4 of its longest edge."""
    centre = box.mean(axis=0)
    return box + np.sign(box - centre) * 0.25 * np.ptp(box, axis=0).max()


def tangents(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit vectors (3,) in a plane, right-handed with the unit vector `normal`."""
    one = np.cross(np.eye(3)[np.argmin(np.abs(normal))], normal)
    one = one / np.linalg.norm(one)
    return one, np.cross(normal, one)


def _reach(places: np.ndarray, size: float) -> tuple[float, float]:
    return float(places.min() - 0.1 * size), float(places.max() + 0.1 * size)


def _draw_faces(axes: Axes, shot: Shot, rgba: np.ndarray) -> None:
    """Draw lit faces in the colours (k, 4)."""
    rgba[:, :3] = lit(rgba[:, :3], shot.light)
    faces = PolyCollection(list(shot.corners), facecolors=rgba, edgecolors="face", linewidths=0.25)
    axes.add_collection(faces, autolim=False)


def _draw_directions(axes: Axes, camera: Camera) -> None:
    """Draw arrows along x, y and z below the lower left corner of the panel."""
    origin = _below(axes.transAxes, axes, 14.0)
    for name, direction in zip("xyz", camera.project(np.eye(3)), strict=True):
        tip = ARROW * direction
        axes.annotate(
            "", (0.0, 0.0), tuple(tip), xycoords=origin, textcoords="offset points",
            arrowprops={"arrowstyle": "<|-", "color": INK, "linewidth": 0.8, "mutation_scale": 6.0,
                        "shrinkA": 0.0, "shrinkB": 0.0},
        )  # fmt: skip
        beyond = tip + 5.0 * direction / np.linalg.norm(direction)
        axes.annotate(
            name, (0.0, 0.0), tuple(beyond), xycoords=origin, textcoords="offset points",
            ha="center", va="center", fontsize=8.5,
        )  # fmt: skip


def _draw_length(axes: Axes, view: np.ndarray) -> None:
    """Draw a scale bar of a round length, right of the arrows."""
    length = round_length((view[1] - view[0]) / 3.0)
    bar = _below(axes.get_xaxis_transform(), axes, 60.0)
    axes.plot([view[0], view[0] + length], [0.0, 0.0], color=INK, transform=bar, clip_on=False)
    axes.annotate(
        f"{length:g} mm", (view[0] + length / 2.0, 0.0), (0.0, -4.0), xycoords=bar,
        textcoords="offset points", ha="center", va="top", fontsize=8.5,
    )  # fmt: skip


def _below(transform: Transform, axes: Axes, right: float) -> Transform:
    """Return the transform moved down by slightly more than ARROW, and right by `right` points."""
    inch = axes.figure.dpi_scale_trans
    return transform + ScaledTranslation(right / 72.0, (-ARROW - 6.0) / 72.0, inch)


def round_length(longest: float) -> float:
    """Return the largest of 1, 2, 5, 10, 20 ... and their tenths not above `longest`."""
    decade = 10.0 ** np.floor(np.log10(longest))  # of a length just below a decade: rounded up
    steps = decade * np.array([0.5, 1.0, 2.0, 5.0])
    return float(steps[steps <= longest].max())
