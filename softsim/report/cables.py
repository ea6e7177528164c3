"""Cables, fibres, layers and rigid bodies in figures: lines with common line widths."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from scipy.spatial.transform import Rotation

from softsim.mesh.mesh import cell_facets, find_rows
from softsim.output.fields import Frames
from softsim.report.colours import MILLI, places_at
from softsim.report.style import INK

WIDTH = 1.6
"""Line width of a cable [points]."""

FIBRE_WIDTH, FIBRE_OPACITY = 0.6, 0.6
"""Line width [points] and opacity of fibres, which are drawn over the body."""


LAYER_WIDTH = 1.2
"""Line width of the edge of a layer [points]."""

ARM = 0.08
"""Arm length of the cross at a rigid body's centre, as a fraction of the size of the mesh."""


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


def cables_at(frames: Frames, index: int) -> list[np.ndarray]:
    """Return the nodes (k, d) [mm] of each cable in a frame."""
    return _lines_at(frames, index, "cable")


def fibres_at(frames: Frames, index: int) -> list[np.ndarray]:
    """Return the points (k, d) [mm] along each fibre in a frame."""
    return _lines_at(frames, index, "fibre")


def _lines_at(frames: Frames, index: int, kind: str) -> list[np.ndarray]:
    if f"{kind}s" not in frames.extra:
        return []
    starts = frames.described[f"{kind}_starts"].astype(int)
    return np.split(frames.extra[f"{kind}s"][index] * MILLI, starts[1:])


def draw_cables(axes: Axes, lines: list[np.ndarray], zorder: float) -> None:
    """Draw cables through their nodes (k, 2) [mm] in the picture."""
    for line in lines:
        axes.plot(*line.T, color=INK, linewidth=WIDTH, zorder=zorder)


def draw_lines(
    axes: Axes, lines: np.ndarray, colour: str, width: float, zorder: float = 4.5
) -> None:
    """Draw lines (e, 2, 2) [mm], such as edges of layers, of a width [points]."""
    if len(lines):
        drawn = LineCollection(list(lines), colors=colour, linewidths=width, zorder=zorder)
        axes.add_collection(drawn, autolim=False)


def draw_fibres(axes: Axes, lines: list[np.ndarray]) -> None:
    """Draw fibres through their points (k, 2) [mm] in the picture, above everything else."""
    for line in lines:
        axes.plot(*line.T, color=INK, linewidth=FIBRE_WIDTH, alpha=FIBRE_OPACITY, zorder=3.0)
