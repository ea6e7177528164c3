"""Pictures of bodies, walls and lines in the plane and in space, from the frames of a run."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.patches import Polygon
from matplotlib.transforms import ScaledTranslation, Transform
from scipy.spatial.transform import Rotation

from softsim.mesh.mesh import (
    boundary_facets,
    cell_facets,
    facet_owners,
    find_rows,
    simplex_facets,
    with_corners,
)
from softsim.output.fields import Frames
from softsim.report.diagram import FIELDS, MILLI
from softsim.report.style import (
    AZIMUTH,
    ELEVATION,
    FRAME,
    GLOSS,
    INK,
    ORANGE,
    PALE,
    QUIET,
    SHADE,
    SHADOW,
    WALL,
)

# -------------------------------------------------------------------------------------------------
# Meshes, lines and rigid bodies of a frame: one extraction for figures, pages and the live view.


@dataclass(frozen=True)
class LineLook:
    """Look of lines: colour, width in a figure [points] and on a screen [px], and opacity."""

    colour: str
    width: float
    pixels: float
    opacity: float = 1.0


LINES = {
    "cables": LineLook(INK, 1.6, 2.0),
    "layers": LineLook(ORANGE, 1.2, 2.0),
    "fibres": LineLook(INK, 0.6, 1.0, 0.6),
    "crosses": LineLook(INK, 1.6, 2.0),
}
"""Look of the lines of a frame by kind. Cables are behind the bodies, all others in front."""

Lines = Mapping[str, Sequence[np.ndarray]]
"""Lines (k, d) [mm] of a frame by kind."""


@dataclass(frozen=True)
class Skin:
    """Drawn part of a mesh.

    faces (m, 3|4): cells in the plane, the surface in space; owners: the cell of each; rim (e, 2):
    edges of the boundary, none in space.
    """

    faces: np.ndarray
    owners: np.ndarray
    rim: np.ndarray

    @property
    def nodes(self) -> np.ndarray:
        """Nodes in use (n,), in increasing order."""
        return np.unique(self.faces)

    def in_triangles(self) -> "Skin":
        """Return the surface with its quadrilaterals divided into triangles."""
        faces, numbers = simplex_facets(self.faces)
        return Skin(faces, self.owners[numbers], self.rim)

    def values(self, frames: Frames, indices: Iterable[int], field: str) -> np.ndarray:
        """Return a field on each face in some frames (f, m), in the unit of its label.

        The magnitude of a vector is returned. Point data is averaged over the nodes of a face.
        """
        of_cells = field in frames.cell_data
        data = frames.cell_data if of_cells else frames.point_data
        values = np.array(data[field].at(indices))
        if values.ndim == 3:
            values = np.linalg.norm(values, axis=2)
        values = values[:, self.owners] if of_cells else values[:, self.faces].mean(axis=2)
        return values * FIELDS[field].factor


def skin_of(frames: Frames) -> Skin:
    """Return the drawn part of the mesh of a run."""
    facets = boundary_facets(frames.cells, frames.points.shape[1])
    if frames.points.shape[1] == 2:
        return Skin(frames.cells, np.arange(len(frames.cells)), facets)
    return Skin(facets, facet_owners(facets, frames.cells), np.zeros((0, 2), dtype=int))


def places_at(frames: Frames, index: int) -> np.ndarray:
    """Return the positions (n, d) [mm] of the nodes in a frame."""
    d = frames.points.shape[1]
    return (frames.points + frames.point_data["displacement"][index][:, :d]) * MILLI


ARM = 0.08
"""Arm length of the cross at a rigid body's centre, as a fraction of the size of the mesh."""


def lines_at(frames: Frames, index: int) -> Lines:
    """Return the lines of a frame of each kind in LINES."""
    return {
        "cables": _polylines(frames, index, "cable"),
        "layers": both_sides(frames, list(layers_at(frames, index))),
        "fibres": _polylines(frames, index, "fibre"),
        "crosses": list(crosses_at(frames, index)),
    }


def is_axisymmetric(frames: Frames) -> bool:
    """Return True if the plane mesh is the half section of a body of revolution."""
    return frames.titles.get("formulation") == "axisymmetric"


def both_sides(frames: Frames, lines: list[np.ndarray]) -> list[np.ndarray]:
    """Return lines (n, 2), of a half section followed by their mirror images."""
    return [*lines, *map(mirrored, lines)] if is_axisymmetric(frames) else lines


def mirrored(places: np.ndarray) -> np.ndarray:
    """Return points (..., 2) mirrored at the axis x = 0."""
    return places * [-1.0, 1.0]


def layers_at(frames: Frames, index: int) -> np.ndarray:
    """Return the edges (e, 2, d) [mm] of the layers in a frame; in space only their boundary."""
    if "layers" not in frames.described:
        return np.zeros((0, 2, frames.points.shape[1]))
    edges = frames.described["layers"].astype(int)
    if edges.shape[1] > 2:
        edges = np.unique(cell_facets(edges, 2)[0], axis=0)
        border = edges[find_rows(edges[:, ::-1], edges) < 0]
        edges = border if len(border) else edges
    return places_at(frames, index)[edges]


def crosses_at(frames: Frames, index: int) -> np.ndarray:
    """Return the crosses (k, 2, d) [mm] along the axes of rigid bodies in a frame.

    Only bodies without a drawn outline or surface have a cross.
    """
    d = frames.points.shape[1]
    none = np.zeros((0, 2, d))
    if "frame_pose" not in frames.extra:
        return none
    poses = frames.extra["frame_pose"][index]
    outlined = frames.described.get("outlines", ())  # in sections only
    owners = frames.described.get("outline_bodies", np.arange(len(outlined)))
    surfaces = frames.described.get("rigid_vertex_bodies", ())
    poses = np.delete(poses, np.union1d(owners, surfaces).astype(int), axis=0)
    if len(poses) == 0:
        return none
    arm = ARM * np.ptp(frames.points, axis=0).max() * turned_axes(poses[:, d:])
    centres = poses[:, None, :d]
    return np.stack([centres - arm, centres + arm], axis=2).reshape(-1, 2, d) * MILLI


def rigid_faces_at(frames: Frames, index: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the mesh surfaces of rigid bodies in a frame.

    These are the vertices (v, d) [mm] and the edges or triangles (m, d) by vertex number.
    """
    d = frames.points.shape[1]
    if "rigid_faces" not in frames.described or "frame_pose" not in frames.extra:
        return np.zeros((0, d)), np.zeros((0, d), dtype=int)
    bodies = frames.described["rigid_vertex_bodies"].astype(int)
    poses = frames.extra["frame_pose"][index][bodies]
    arms = np.einsum("vi,vij->vj", frames.described["rigid_vertices"], turned_axes(poses[:, d:]))
    return (poses[:, :d] + arms) * MILLI, frames.described["rigid_faces"].astype(int)


def turned_axes(turns: np.ndarray) -> np.ndarray:
    """Return the unit vectors (k, d, d) along the axes of bodies, one per row.

    turns: angles [rad] (k, 1) in a section, unit quaternions w, x, y, z (k, 4) in space.
    """
    if turns.shape[1] == 1:
        c, s = np.cos(turns[:, 0]), np.sin(turns[:, 0])
        return np.stack([np.stack([c, s], axis=-1), np.stack([-s, c], axis=-1)], axis=1)
    return Rotation.from_quat(np.roll(turns, -1, axis=1)).as_matrix().swapaxes(1, 2)


def _polylines(frames: Frames, index: int, kind: str) -> list[np.ndarray]:
    """Return the points (k, d) [mm] of each cable or fibre in a frame."""
    if f"{kind}s" not in frames.extra:
        return []
    starts = frames.described[f"{kind}_starts"].astype(int)
    return np.split(frames.extra[f"{kind}s"][index] * MILLI, starts[1:])


def outlines_at(frames: Frames, index: int) -> list[np.ndarray]:
    """Return closed outlines (n, 2) [mm] of rigid bodies and their surfaces in a plane frame."""
    vertices, edges = rigid_faces_at(frames, index)
    outlines = chains(vertices[edges])
    if "outlines" in frames.described and "frame_pose" in frames.extra:
        poses = frames.extra["frame_pose"][index]
        if "outline_bodies" in frames.described:  # not every rigid body has an outline
            poses = poses[frames.described["outline_bodies"].astype(int)]
        corners = outline_corners(frames.described["outlines"], poses) * MILLI
        outlines = [*corners[:, [0, 1, 2, 3, 0]], *outlines]
    return both_sides(frames, outlines)


def draw_lines(
    axes: Axes,
    lines: Sequence[np.ndarray] | np.ndarray,
    colour: str,
    width: float = 0.35,
    zorder: float = 4.0,
    opacity: float = 1.0,
) -> None:
    """Draw lines (k, 2) [mm] of a width [points]; the default is that of edges of a body."""
    if len(lines):
        drawn = LineCollection(
            list(lines), colors=colour, linewidths=width, zorder=zorder, alpha=opacity
        )
        axes.add_collection(drawn, autolim=False)


def draw_lines_of_body(axes: Axes, lines: Lines, behind: float) -> None:
    """Draw the lines of a frame, projected to the plane; behind: zorder of cables."""
    for kind, look in LINES.items():
        zorder = behind if kind == "cables" else 4.5
        draw_lines(axes, lines[kind], look.colour, look.width, zorder, look.opacity)


def draw_faces(
    axes: Axes, corners: np.ndarray, colours: Any, edges: str = "face", width: float = 0.25,
    zorder: float = 1.0,
) -> None:  # fmt: skip
    """Draw faces (m, 3|4, 2) [mm] in one colour, or the colours (m, 4)."""
    faces = PolyCollection(
        list(corners), facecolors=colours, edgecolors=edges, linewidths=width, zorder=zorder
    )
    axes.add_collection(faces, autolim=False)


def draw_outlines(axes: Axes, outlines: list[np.ndarray]) -> None:
    """Draw rigid bodies, given their outlines (n, 2) [mm]."""
    for outline in outlines:
        axes.add_patch(Polygon(outline, facecolor=FRAME, edgecolor=INK, linewidth=0.7, zorder=2))


# -------------------------------------------------------------------------------------------------
# Pictures of plane sections and half sections of bodies of revolution, with their walls.

THICKNESS = 0.08
"""Thickness of the solid behind a curved wall, as a fraction of the longer side of the view."""

POINTS_ON_A_LINE = 33
"""Number of sample points per wall line that decide which walls are near a body.

Straight pipes are lines of 0.1 m.
"""

NO_WALLS, NO_LINES = np.zeros((0, 4)), np.zeros((0, 2, 2))


@dataclass(frozen=True)
class SectionShot:
    """One frame in the plane [mm].

    corners (m, 3|4, 2), values (m,), outlines (n, 2) of rigid bodies, edges of the free surface
    (e, 2, 2), and lines.
    """

    corners: np.ndarray
    values: np.ndarray
    outlines: list[np.ndarray]
    boundary: np.ndarray
    lines: Lines

    def moving(self) -> np.ndarray:
        """Return all finite points (n, 2) that must be visible.

        The last frame of a failed run may have nodes without a position.
        """
        places = np.concatenate(
            [p.reshape(-1, 2) for p in (self.corners, *self.outlines, *self.lines["crosses"])]
        )
        return places[np.isfinite(places).all(axis=1)]


@dataclass(frozen=True)
class WallSolid:
    """Solid behind a wall: its outline (n, 2) and the face of the wall (m, 2) [mm]."""

    outline: np.ndarray
    face: np.ndarray

    @property
    def quads(self) -> np.ndarray:
        """Quadrilaterals (k, 4, 2) that make up the solid, between its front and its back."""
        front, back = np.split(self.outline, 2)
        back = back[::-1]
        return np.stack([front[:-1], front[1:], back[1:], back[:-1]], axis=1)


class Section:
    """The frames `indices` of a plane run, coloured by `field`.

    values: those of all frames (n,), in the unit of the field's label. view: xmin, xmax, ymin,
    ymax [mm].
    """

    labels = ("x [mm]", "y [mm]")

    def __init__(self, frames: Frames, indices: list[int], field: str) -> None:
        skin = skin_of(frames)
        values = skin.values(frames, indices, field)
        places = [places_at(frames, index) for index in indices]
        self.shots = [
            SectionShot(x[skin.faces], v, outlines_at(frames, k), x[skin.rim], lines_at(frames, k))
            for k, x, v in zip(indices, places, values, strict=True)
        ]
        # In each of the frames, for walls may move.
        self.walls = [
            self.seen_walls(walls_at(frames, "walls", index, NO_WALLS) * [MILLI, MILLI, 1.0, 1.0])
            for index in indices
        ]
        self.wall_lines = [
            self.seen_lines(walls_at(frames, "wall_lines", index, NO_LINES) * MILLI)
            for index in indices
        ]
        self.centre_lines = frames.described.get("centre_lines", NO_LINES) * MILLI
        self.values = np.concatenate(values)
        share, lines = np.linspace(0.0, 1.0, POINTS_ON_A_LINE), np.concatenate(self.wall_lines)
        along = (1.0 - share)[:, None, None] * lines[:, 0] + share[:, None, None] * lines[:, 1]
        self.view = view_of(self.places(), np.concatenate(self.walls), along.reshape(-1, 2))

    def places(self) -> np.ndarray:
        """Return all points (n, 2) [mm] that every picture must show."""
        return np.concatenate([shot.moving() for shot in self.shots])

    def seen_walls(self, walls: np.ndarray) -> np.ndarray:
        """Return the straight walls (w, 4) as drawn: a point [mm] and the normal."""
        return walls

    def solids(self, view: np.ndarray, number: int) -> list[WallSolid]:
        """Return the solids behind all walls in one of the frames.

        view: xmin, xmax, ymin, ymax [mm], which the solids must cover.
        """
        depth = THICKNESS * max(np.ptp(self.view[:2]), np.ptp(self.view[2:]))
        curved = [
            WallSolid(np.concatenate([chain, behind(chain, depth)[::-1]]), chain)
            for chain in chains(self.wall_lines[number])
        ]
        return [*self.flat_solids(view, number), *curved]

    def flat_solids(self, view: np.ndarray, number: int) -> list[WallSolid]:
        """Return the solids behind the straight walls."""
        return [solid_behind(wall, view) for wall in self.walls[number]]

    def seen_lines(self, lines: np.ndarray) -> np.ndarray:
        """Return lines (k, 2, 2) [mm] of curved walls as drawn, the free side on their left."""
        return lines

    def draw(self, axes: Axes, number: int, colours: ScalarMappable) -> None:
        """Draw one of the frames, with its walls."""
        shot = self.shots[number]
        for solid in self.solids(self.view, number):
            draw_solid(axes, solid)
        draw_lines(axes, self.centre_lines, QUIET, zorder=1.7)
        draw_outlines(axes, shot.outlines)
        rgba = colours.to_rgba(np.ma.masked_invalid(shot.values))
        draw_faces(axes, shot.corners, rgba, width=0.4, zorder=3.0)
        draw_lines(axes, shot.boundary, INK)
        draw_lines_of_body(axes, shot.lines, behind=1.9)

    def label(self, lowest: list[Axes], leftmost: list[Axes]) -> None:
        """Write the axis labels at the edge of the figure only."""
        for axes in lowest:
            axes.set_xlabel(self.labels[0])
            axes.tick_params(labelbottom=True)  # even with an empty place below it
        for axes in leftmost:
            axes.set_ylabel(self.labels[1])


class HalfSection(Section):
    """Frames of an axisymmetric run: the half section and, paler, its mirror image.

    x is the radius, y the axis. A wall is mirrored as the body is.
    """

    labels = ("radius x [mm]", "axis y [mm]")

    def places(self) -> np.ndarray:
        """Return the points of the half section and of its mirror image."""
        places = super().places()
        return np.concatenate([places, mirrored(places)])

    def seen_walls(self, walls: np.ndarray) -> np.ndarray:
        """Return the walls, followed by their mirror images."""
        return np.concatenate([walls, walls * [-1.0, 1.0, -1.0, 1.0]])

    def flat_solids(self, view: np.ndarray, number: int) -> list[WallSolid]:
        """Return the part of each wall's solid at positive x, and its mirror image."""
        walls = self.walls[number][: len(self.walls[number]) // 2]
        right = []
        for solid in (solid_behind(wall, view) for wall in walls):
            around = np.stack([solid.outline, np.roll(solid.outline, -1, axis=0)], axis=1)
            face = right_of_axis(solid.face[None]).reshape(-1, 2)
            right.append(WallSolid(right_of_axis(around).reshape(-1, 2), face))
        return right + [WallSolid(mirrored(s.outline), mirrored(s.face)) for s in right]

    def seen_lines(self, lines: np.ndarray) -> np.ndarray:
        """Return the part of each line at positive x, and its mirror image in reversed order.

        So the free side of the mirror image is on its left too.
        """
        kept = right_of_axis(lines)
        return np.concatenate([kept, mirrored(kept)[::-1, ::-1]])

    def draw(self, axes: Axes, number: int, colours: ScalarMappable) -> None:
        """Draw one of the frames and its mirror image, the walls, and the axis."""
        super().draw(axes, number, colours)
        shot = self.shots[number]
        pale = colours.to_rgba(np.ma.masked_invalid(shot.values))
        pale[:, :3] += PALE * (1.0 - pale[:, :3])
        draw_faces(axes, mirrored(shot.corners), pale, width=0.4, zorder=3.0)
        draw_lines(axes, mirrored(shot.boundary), QUIET)
        draw_lines(axes, ends(shot.boundary), QUIET, zorder=1.8)  # behind all that stands inside
        axes.axvline(0.0, color=INK, linewidth=0.7, linestyle=(0, (9, 2, 1.5, 2)), zorder=5)

    def label(self, lowest: list[Axes], leftmost: list[Axes]) -> None:
        """Write the axis labels, with a radius that is never negative."""
        super().label(lowest, leftmost)
        for axes in lowest:
            axes.xaxis.set_major_formatter(lambda x, _: f"{abs(x):g}")


def plane_picture(frames: Frames, indices: list[int], field: str) -> Section:
    """Return the picture of frames of a plane run."""
    kind = HalfSection if is_axisymmetric(frames) else Section
    return kind(frames, indices, field)


def right_of_axis(lines: np.ndarray) -> np.ndarray:
    """Return the parts (j, 2, 2) of lines (k, 2, 2) at positive x."""
    lines = lines[(lines[..., 0] > 0.0).any(axis=1)]
    x, way = lines[:, :, 0], lines[:, 1] - lines[:, 0]
    cut = lines[:, 0] - way * (x[:, 0] / np.where(way[:, 0] == 0.0, 1.0, way[:, 0]))[:, None]
    return np.where((x < 0.0)[..., None], cut[:, None], lines)


def ends(boundary: np.ndarray) -> np.ndarray:
    """Return lines (2, 2, 2) across the axis at both ends of a body of revolution.

    They are side views of the circles at each end that are nearest to the axis. boundary: edges
    (e, 2, 2) of the half section.
    """
    places = boundary.reshape(-1, 2)
    places = places[np.isfinite(places).all(axis=1)]
    size = np.ptp(places, axis=0).max()
    lines = []
    for height in (places[:, 1].min(), places[:, 1].max()):
        inner = places[np.abs(places[:, 1] - height) < 1e-3 * size, 0].min()
        lines.append([[-inner, height], [inner, height]])
    return np.array(lines)


def walls_at(frames: Frames, name: str, index: int, none: np.ndarray) -> np.ndarray:
    """Return the wall data (k, ...) [m] stored under `name`, displaced as in a frame.

    The result is `none` if there is no data. The first coordinates of the last axis are
    positions.
    """
    rows = frames.described.get(name, none).astype(float)
    if f"{name}_owner" not in frames.described or "wall_offset" not in frames.extra:
        return rows
    owner = frames.described[f"{name}_owner"].astype(int)
    offset = frames.extra["wall_offset"][index][owner]
    d = offset.shape[1]
    rows[..., :d] += offset.reshape(len(rows), *[1] * (rows.ndim - 2), d)
    return rows


def outline_corners(outlines: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """Return the corners (k, 4, 2) [m] of the rigid outlines in space.

    outlines: (k, 4) centre in the body's axes, length, height [m]. poses: (k, 3) x, y [m],
    angle.
    """
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2
    local = outlines[:, None, :2] + signs * outlines[:, None, 2:]
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    turn = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    return poses[:, None, :2] + np.einsum("kij,knj->kni", turn, local)


def solid_behind(wall: np.ndarray, view: np.ndarray) -> WallSolid:
    """Return the solid behind a straight wall, larger than the view on all sides.

    wall (4,): a point [mm] and the normal, which points into the free side.
    """
    reach = 2 * np.hypot(view[1] - view[0], view[3] - view[2])
    centre = np.array([view[:2].mean(), view[2:].mean()])
    point, normal = wall[:2], wall[2:]
    along = np.array([-normal[1], normal[0]])
    foot = centre + ((point - centre) @ normal) * normal
    face = np.array([foot - reach * along, foot + reach * along])
    return WallSolid(np.concatenate([face, face[::-1] - reach * normal]), face)


def draw_solid(axes: Axes, solid: WallSolid, linewidth: float = 0.9, zorder: float = 1.5) -> None:
    """Draw the solid behind a wall, and the face of the wall as a line."""
    look: dict[str, Any] = {"facecolor": WALL, "edgecolor": QUIET, "hatch": "////", "linewidth": 0}
    axes.add_patch(Polygon(solid.outline, zorder=1, **look))
    axes.plot(*solid.face.T, color=INK, linewidth=linewidth, zorder=zorder)


def chains(lines: np.ndarray) -> list[np.ndarray]:
    """Return polylines (n, 2) of lines (k, 2, 2), joined where one starts at the last end."""
    if not len(lines):
        return []
    size = np.ptp(lines.reshape(-1, 2), axis=0).max()
    apart = np.linalg.norm(lines[1:, 0] - lines[:-1, 1], axis=1) > 1e-6 * size
    parts = np.split(lines, np.flatnonzero(apart) + 1)
    return [np.concatenate([part[:, 0], part[-1:, 1]]) for part in parts]


def behind(chain: np.ndarray, depth: float) -> np.ndarray:
    """Return a polyline (n, 2) moved by `depth` to its right, mitred at its corners."""
    way = np.diff(chain, axis=0)
    right = np.stack([way[:, 1], -way[:, 0]], axis=1) / np.linalg.norm(way, axis=1)[:, None]
    before, after = np.concatenate([right[:1], right]), np.concatenate([right, right[-1:]])
    # (a + b) / (1 + a b) has the length 1 / cos of half the turn; a hairpin is cut off.
    mitre = (before + after) / np.maximum(1.0 + (before * after).sum(axis=1), 0.5)[:, None]
    return chain + depth * mitre


def view_of(places: np.ndarray, walls: np.ndarray, wall_points: np.ndarray) -> np.ndarray:
    """Return xmin, xmax, ymin, ymax [mm] around all points (n, 2) and the walls near them.

    walls: flat ones, (w, 4). wall_points: points on curved ones (p, 2) [mm].
    """
    size = np.ptp(places, axis=0).max()
    feet = []
    for wall in walls:
        gaps = (places - wall[:2]) @ wall[2:]
        nearest = np.argmin(gaps)
        if gaps[nearest] < size / 2:
            feet.append(places[nearest] - gaps[nearest] * wall[2:])
    low, high = places.min(axis=0) - size / 4, places.max(axis=0) + size / 4
    near = np.all((wall_points > low) & (wall_points < high), axis=1)
    shown = np.concatenate([places, np.reshape(feet, (-1, 2)), wall_points[near]])
    low, high = shown.min(axis=0), shown.max(axis=0)
    margin = 0.06 * size
    return np.array([low[0] - margin, high[0] + margin, low[1] - margin, high[1] + margin])


# -------------------------------------------------------------------------------------------------
# Pictures of bodies in space: their deformed surface in parallel projection, lit from above.

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
class SurfaceShot:
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
        skin = skin_of(frames)
        corners = [places_at(frames, index)[skin.faces] for index in indices]
        values = skin.values(frames, indices, field)
        self.values = np.concatenate(values)
        self.face_count = len(skin.faces)  # those of rigid bodies come after them
        self.shots = []
        for number, index in enumerate(indices):
            vertices, faces = rigid_faces_at(frames, index)
            rigid = vertices[with_corners(faces, 2, skin.faces.shape[1])]
            corners[number] = np.concatenate([corners[number], rigid])
            shown = np.append(values[number], np.full(len(rigid), np.nan))
            self.shots.append(visible_side(corners[number], shown, self.camera))
        lines = [lines_at(frames, index) for index in indices]
        self.lines = [
            {kind: list(map(self.camera.project, of_kind)) for kind, of_kind in shown.items()}
            for shown in lines
        ]
        crosses = [arm for shown in lines for arm in shown["crosses"]]
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
            rgba = np.tile(to_rgba(WALL), (len(wall.light), 1))
            draw_faces(axes, wall.corners, lit(rgba, wall.light))
        draw_lines(axes, self.rims[number], QUIET, RIM_WIDTH, zorder=1.0)
        for dark in self.shadows[number]:
            draw_faces(axes, dark, SHADOW)
        draw_lines_of_body(axes, self.lines[number], behind=1.0)  # a tether is behind the body
        shot = self.shots[number]
        rgba = colours.to_rgba(np.ma.masked_invalid(shot.values))
        rgba[shot.numbers >= self.face_count] = to_rgba(FRAME)
        draw_faces(axes, shot.corners, lit(rgba, shot.light))
        axes.set_axis_off()

    def label(self, lowest: list[Axes], leftmost: list[Axes]) -> None:
        """Draw axis directions and a scale bar below the lowest panel on the left."""
        _draw_directions(lowest[0], self.camera)
        _draw_length(lowest[0], self.view)


def visible_side(corners: np.ndarray, values: np.ndarray, camera: Camera) -> SurfaceShot:
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
    return SurfaceShot(camera.project(corners[seen]), values[seen], light, seen)


def lit(colours: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Return the colours (k, 3|4) of faces lit by `light` (k,), 0 to 1."""
    shade, gloss = SHADE * (1.0 - light[:, None]) ** 1.5, GLOSS * light[:, None] ** 3
    shown = colours.copy()
    shown[:, :3] = (1.0 - gloss) * (1.0 - shade) * colours[:, :3] + gloss
    return shown


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
