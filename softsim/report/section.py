"""Pictures of plane sections and half sections of bodies of revolution, with their walls."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.patches import Polygon

from softsim.mesh.mesh import boundary_facets
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
from softsim.report.style import FRAME, INK, ORANGE, PALE, QUIET, WALL

THICKNESS = 0.08
"""Thickness of the solid behind a curved wall, as a fraction of the longer side of the view."""

POINTS_ON_A_LINE = 33
"""Number of sample points per wall line that decide which walls are near a body.

Straight pipes are lines of 0.1 m.
"""

NO_WALLS, NO_LINES = np.zeros((0, 4)), np.zeros((0, 2, 2))


@dataclass(frozen=True)
class Shot:
    """One frame in the plane [mm].

    corners (m, 3|4, 2), values (m,), rigid outlines (n, 2), edges of the free surface (e, 2,
    2), nodes (n, 2) of each cable, points of each fibre, edges (l, 2, 2) of layers, arms (c, 2,
    2) of the crosses of rigid bodies.
    """

    corners: np.ndarray
    values: np.ndarray
    outlines: list[np.ndarray]
    boundary: np.ndarray
    cables: list[np.ndarray]
    fibres: list[np.ndarray]
    layers: np.ndarray
    crosses: np.ndarray

    def moving(self) -> np.ndarray:
        """Return all finite points (n, 2) that must be visible.

        The last frame of a failed run may have nodes without a position.
        """
        places = np.concatenate(
            [p.reshape(-1, 2) for p in (self.corners, *self.outlines, self.crosses)]
        )
        return places[np.isfinite(places).all(axis=1)]


@dataclass(frozen=True)
class Solid:
    """Solid behind a wall: its outline (n, 2) and the face of the wall (m, 2) [mm]."""

    outline: np.ndarray
    face: np.ndarray


class Section:
    """The frames `indices` of a plane run, coloured by `field`.

    values: those of all frames (n,), in the unit of the field's label. view: xmin, xmax, ymin,
    ymax [mm].
    """

    labels = ("x [mm]", "y [mm]")

    def __init__(self, frames: Frames, indices: list[int], field: str) -> None:
        boundary = boundary_facets(frames.cells, 2)
        self.shots = [_shot(frames, index, field, boundary) for index in indices]
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
        self.values = np.concatenate([shot.values for shot in self.shots])
        wall_points = points_on(np.concatenate(self.wall_lines))
        self.view = view_of(self.places(), np.concatenate(self.walls), wall_points)

    def places(self) -> np.ndarray:
        """Return all points (n, 2) [mm] that every picture must show."""
        return np.concatenate([shot.moving() for shot in self.shots])

    def seen_walls(self, walls: np.ndarray) -> np.ndarray:
        """Return the straight walls (w, 4) as drawn: a point [mm] and the normal."""
        return walls

    def solids(self, view: np.ndarray, number: int) -> list[Solid]:
        """Return the solids behind all walls in one of the frames.

        view: xmin, xmax, ymin, ymax [mm], which the solids must cover.
        """
        depth = THICKNESS * max(np.ptp(self.view[:2]), np.ptp(self.view[2:]))
        curved = [strip_behind(chain, depth) for chain in chains(self.wall_lines[number])]
        return [*self.flat_solids(view, number), *curved]

    def flat_solids(self, view: np.ndarray, number: int) -> list[Solid]:
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
        if len(self.centre_lines):
            draw_edges(axes, self.centre_lines, QUIET, zorder=1.7)
        draw_cables(axes, shot.cables, zorder=1.9)
        draw_outlines(axes, shot.outlines)
        draw_cells(axes, shot.corners, colours.to_rgba(np.ma.masked_invalid(shot.values)))
        draw_edges(axes, shot.boundary, INK)
        draw_lines(axes, shot.layers, ORANGE, LAYER_WIDTH)
        draw_fibres(axes, shot.fibres)
        draw_lines(axes, shot.crosses, INK, WIDTH)

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

    def flat_solids(self, view: np.ndarray, number: int) -> list[Solid]:
        """Return the part of each wall's solid at positive x, and its mirror image."""
        walls = self.walls[number][: len(self.walls[number]) // 2]
        right = [right_half(solid_behind(wall, view)) for wall in walls]
        return right + [Solid(mirrored(s.outline), mirrored(s.face)) for s in right]

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
        draw_cells(axes, mirrored(shot.corners), pale)
        draw_edges(axes, mirrored(shot.boundary), QUIET)
        draw_outlines(axes, [mirrored(outline) for outline in shot.outlines])
        draw_lines(axes, mirrored(shot.layers), ORANGE, LAYER_WIDTH)
        draw_edges(axes, ends(shot.boundary), QUIET, zorder=1.8)  # behind all that stands inside
        axes.axvline(0.0, color=INK, linewidth=0.7, linestyle=(0, (9, 2, 1.5, 2)), zorder=5)

    def label(self, lowest: list[Axes], leftmost: list[Axes]) -> None:
        """Write the axis labels, with a radius that is never negative."""
        super().label(lowest, leftmost)
        for axes in lowest:
            axes.xaxis.set_major_formatter(lambda x, _: f"{abs(x):g}")


def mirrored(places: np.ndarray) -> np.ndarray:
    """Return points (..., 2) mirrored at the axis x = 0."""
    return places * [-1.0, 1.0]


def right_of_axis(lines: np.ndarray) -> np.ndarray:
    """Return the parts (j, 2, 2) of lines (k, 2, 2) at positive x."""
    lines = lines[(lines[..., 0] > 0.0).any(axis=1)]
    x, way = lines[:, :, 0], lines[:, 1] - lines[:, 0]
    cut = lines[:, 0] - way * (x[:, 0] / np.where(way[:, 0] == 0.0, 1.0, way[:, 0]))[:, None]
    return np.where((x < 0.0)[..., None], cut[:, None], lines)


def right_half(solid: Solid) -> Solid:
    """Return the part of a convex solid at positive x."""
    around = np.stack([solid.outline, np.roll(solid.outline, -1, axis=0)], axis=1)
    outline = right_of_axis(around).reshape(-1, 2)
    return Solid(outline, right_of_axis(solid.face[None]).reshape(-1, 2))


def points_on(lines: np.ndarray) -> np.ndarray:
    """Return points (n, 2) on lines (k, 2, 2), dense enough to detect lines near a body."""
    shares = np.linspace(0.0, 1.0, POINTS_ON_A_LINE)[:, None, None]
    return ((1.0 - shares) * lines[:, 0] + shares * lines[:, 1]).reshape(-1, 2)


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


def _shot(frames: Frames, index: int, field: str, boundary: np.ndarray) -> Shot:
    positions = places_at(frames, index)
    values = shown_values(frames, [index], field, frames.cells, slice(None))[0]
    return Shot(
        positions[frames.cells], values, outlines_at(frames, index), positions[boundary],
        cables_at(frames, index), fibres_at(frames, index), layers_at(frames, index),
        crosses_at(frames, index),
    )  # fmt: skip


def outlines_at(frames: Frames, index: int) -> list[np.ndarray]:
    """Return corners (n, 2) [mm] of outlines and surfaces of rigid bodies in a plane frame."""
    vertices, edges = rigid_faces_at(frames, index)
    surfaces = chains(vertices[edges])
    if "outlines" not in frames.described or "frame_pose" not in frames.extra:
        return surfaces
    poses = frames.extra["frame_pose"][index]
    if "outline_bodies" in frames.described:  # not every rigid body has an outline
        poses = poses[frames.described["outline_bodies"].astype(int)]
    return [*outline_corners(frames.described["outlines"], poses) * MILLI, *surfaces]


def draw_cells(axes: Axes, corners: np.ndarray, rgba: np.ndarray) -> None:
    """Draw cells (m, 3|4, 2) [mm] in the colours (m, 4)."""
    cells = PolyCollection(
        list(corners), facecolors=rgba, edgecolors="face", linewidths=0.4, zorder=3
    )
    axes.add_collection(cells, autolim=False)


def draw_edges(axes: Axes, edges: np.ndarray, colour: str, zorder: float = 4.0) -> None:
    """Draw the edges (e, 2, 2) [mm] of the boundary of a body."""
    rim = LineCollection(list(edges), colors=colour, linewidths=0.35, zorder=zorder)
    axes.add_collection(rim, autolim=False)


def draw_outlines(axes: Axes, outlines: list[np.ndarray]) -> None:
    """Draw rigid bodies, given the corners (n, 2) [mm] of their outlines."""
    for outline in outlines:
        axes.add_patch(Polygon(outline, facecolor=FRAME, edgecolor=INK, linewidth=0.7, zorder=2))


def solid_behind(wall: np.ndarray, view: np.ndarray) -> Solid:
    """Return the solid behind a straight wall, larger than the view on all sides.

    wall (4,): a point [mm] and the normal, which points into the free side.
    """
    reach = 2 * np.hypot(view[1] - view[0], view[3] - view[2])
    centre = np.array([view[:2].mean(), view[2:].mean()])
    point, normal = wall[:2], wall[2:]
    along = np.array([-normal[1], normal[0]])
    foot = centre + ((point - centre) @ normal) * normal
    face = np.array([foot - reach * along, foot + reach * along])
    return Solid(np.concatenate([face, face[::-1] - reach * normal]), face)


def strip_behind(chain: np.ndarray, depth: float) -> Solid:
    """Return a strip of the solid behind a curved wall (n, 2)."""
    return Solid(np.concatenate([chain, behind(chain, depth)[::-1]]), chain)


def draw_solid(axes: Axes, solid: Solid, linewidth: float = 0.9, zorder: float = 1.5) -> None:
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
