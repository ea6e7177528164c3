"""Picture of a robot at several moments along its pipe, in the plane of the pipe."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.patches import Polygon

from softsim.mesh.mesh import boundary_facets
from softsim.output.fields import Frames
from softsim.report.cables import cables_at, draw_cables
from softsim.report.colours import MILLI, places_at
from softsim.report.section import Solid, draw_edges, draw_outlines, draw_solid, outlines_at
from softsim.report.style import INK, QUIET

WALL_DEPTH = 3.0
"""Thickness of the hatched wall [mm]."""

LABEL_GAP = 4.0
"""Gap between a wall and the label beside it [mm]."""

LEFT = np.array([[0.0, 1.0], [-1.0, 0.0]])
"""Matrix that, multiplied from the right, turns directions (..., 2) by 90 degrees to the left."""

STRAIGHT = 1e-6
"""Angle [rad] below which a pipe counts as straight."""


@dataclass(frozen=True)
class Pipe:
    """Pipe in the picture.

    s (n,): arc lengths; centre (n, 2): centre line; left (n, 2): unit normals to its left;
    radius (n,), all in mm. Where the radius jumps, two samples have the same position. origin
    (d,) [mm] and axes (2, d) define the plane of the picture.
    """

    s: np.ndarray
    centre: np.ndarray
    left: np.ndarray
    radius: np.ndarray
    origin: np.ndarray
    axes: np.ndarray

    def project(self, places: np.ndarray) -> np.ndarray:
        """Project points (..., d) [mm] to the picture (..., 2)."""
        return places @ self.axes.T

    def side(self, sign: float, beyond: float = 0.0) -> np.ndarray:
        """Return the left (sign 1) or right (-1) wall (n, 2), moved outwards by `beyond` [mm]."""
        return self.centre + sign * (self.radius + beyond)[:, None] * self.left

    def beside(self, s: float, sign: float, beyond: float) -> tuple[np.ndarray, np.ndarray]:
        """Return a point (2,) outside the wall, and its direction (2,) from the centre line.

        The point is `beyond` [mm] from the wall at the arc length s [mm].
        """
        outward = sign * self._at(s, self.left)
        return self._at(s, self.centre) + (self._at(s, self.radius) + beyond) * outward, outward

    def _at(self, s: float, values: np.ndarray) -> np.ndarray:
        columns = values.reshape(len(self.s), -1).T
        found = np.array([np.interp(s, self.s, column) for column in columns])
        return found[0] if values.ndim == 1 else found

    def outer_side(self, s: float) -> float:
        """Return the side (1 left, -1 right) with more space for a label at the arc length s.

        This is the outer side of a bend; elsewhere it is that of the whole pipe.
        """
        here = np.array([self._at(s + way, self.left) for way in (-1.0, 1.0)])
        for left in (here, self.left):
            turn = float(((left[:-1] @ LEFT) * left[1:]).sum())
            if abs(turn) > STRAIGHT:
                return -np.sign(turn)
        return 1.0


def pipes_described(described: Mapping[str, np.ndarray]) -> tuple[Pipe, ...]:
    """Return the pipes of a run, ordered by branch, from the data stored with its results.

    The data is a path (n, 2 d + 2) of arc lengths, points, tangents and radii, and the branch
    of each row (n,). All pipes lie in one plane.
    """
    path, branch = described["path"], described["path_branch"]
    d = (path.shape[1] - 2) // 2
    points, tangents = path[:, 1 : 1 + d] * MILLI, path[:, 1 + d : 1 + 2 * d]
    origin, axes = points[0], plane_of(points, tangents[0])
    along = tangents @ axes.T
    along /= np.linalg.norm(along, axis=1)[:, None]
    left, centre = along @ LEFT, (points - origin) @ axes.T + origin @ axes.T
    return tuple(
        Pipe(path[own, 0] * MILLI, centre[own], left[own], path[own, -1] * MILLI, origin, axes)
        for own in (branch == number for number in range(int(branch.max()) + 1))
    )


def plane_of(points: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return unit vectors (2, d) of the plane of a centre line: its first direction and the normal.

    The second vector points to the left in the plane; in space towards the farthest point of
    the centre line, or into the x-y plane if the line is straight.
    """
    if len(first) == 2:
        return np.array([first, first @ LEFT])
    away = points - points[0]
    away = away - np.outer(away @ first, first)
    across = away[np.argmax(np.linalg.norm(away, axis=1))]
    if np.linalg.norm(across) < 1e-6:
        across = np.array([0.0, 1.0, 0.0]) - first[1] * first
    return np.array([first, across / np.linalg.norm(across)])


@dataclass(frozen=True)
class Robot:
    """Robot at one moment.

    branch: number of the pipe that its centre is in; place: its arc length there [mm]; label
    and colour; the stored frame that shows it.
    """

    branch: int
    place: float
    label: str
    colour: str
    frame: int


def draw_pipe(axes: Axes, pipe: Pipe, joints: Sequence[float]) -> None:
    """Draw the walls of a pipe, the solid behind them, and a line across it at each joint [mm].

    The free interior is drawn above all walls, so that pipes that meet open into each other.
    """
    sides = [pipe.side(sign) for sign in (1.0, -1.0)]
    for sign, face in zip((1.0, -1.0), sides, strict=True):
        solid = np.concatenate([face, pipe.side(sign, WALL_DEPTH)[::-1]])
        # The half of the line that lies in the pipe is covered.
        draw_solid(axes, Solid(solid, face), linewidth=1.8, zorder=1.05)
    bore = np.concatenate([sides[0], sides[1][::-1]])
    axes.add_patch(Polygon(bore, facecolor="white", linewidth=0, zorder=1.1))
    axes.plot(*pipe.centre.T, color=QUIET, linewidth=0.5, linestyle=(0, (9, 3, 1.5, 3)), zorder=1.2)
    for joint in joints:
        across = np.array([pipe.beside(joint, sign, 0.0)[0] for sign in (1.0, -1.0)])
        axes.plot(*across.T, color=QUIET, linewidth=0.7, linestyle=":", zorder=1.6)


def draw_robot(axes: Axes, pipe: Pipe, frames: Frames, robot: Robot) -> None:
    """Draw the deformed mesh, the outlines of rigid bodies and the label outside the wall."""
    d = frames.points.shape[1]
    x = pipe.project(places_at(frames, robot.frame))
    draw_cables(axes, [pipe.project(line) for line in cables_at(frames, robot.frame)], zorder=1.9)
    if d == 2:
        draw_outlines(axes, outlines_at(frames, robot.frame))
        faces = frames.cells
        draw_edges(axes, x[boundary_facets(faces, 2)], INK)
    else:
        faces = boundary_facets(frames.cells, 3)
    mesh = PolyCollection(
        list(x[faces]), facecolors=robot.colour, edgecolors=robot.colour, linewidths=0.3, zorder=3
    )
    axes.add_collection(mesh, autolim=False)
    write_beside(axes, pipe, robot.place, pipe.outer_side(robot.place), robot.label, INK)


def write_beside(axes: Axes, pipe: Pipe, place: float, sign: float, text: str, colour: str) -> None:
    """Write a text outside the wall, on one side of the pipe, at the arc length `place` [mm]."""
    at, outward = pipe.beside(place, sign, WALL_DEPTH + LABEL_GAP)
    steep = abs(outward[1]) > abs(outward[0])
    axes.text(
        at[0], at[1], text, color=colour, fontsize=8.0, zorder=6,
        ha="center" if steep else ("left" if outward[0] > 0.0 else "right"),
        va="center" if not steep else ("bottom" if outward[1] > 0.0 else "top"),
    )  # fmt: skip


def view_of(pipes: Sequence[Pipe], frames: Frames, robots: Sequence[Robot]) -> np.ndarray:
    """Return xmin, xmax, ymin, ymax [mm] of the picture.

    It includes the pipes with their walls and labels, and robots that protrude from an end.
    """
    margin = WALL_DEPTH + LABEL_GAP + 12.0
    shown = [pipe.side(sign, margin) for pipe in pipes for sign in (1.0, -1.0)]
    shown += [pipes[0].project(places_at(frames, robot.frame)) for robot in robots]
    everything = np.concatenate(shown)
    everything = everything[np.isfinite(everything).all(axis=1)]
    return np.column_stack([everything.min(axis=0), everything.max(axis=0)]).ravel()
