"""Bodies in space: their deformed surface in parallel projection, lit from above."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.transforms import Affine2D, ScaledTranslation, Transform

from softsim.mesh.mesh import boundary_facets, cell_facets, find_rows
from softsim.output.fields import Frames
from softsim.report.colours import MILLI, shown_values
from softsim.report.style import INK

AZIMUTH, ELEVATION = np.radians(30.0), np.radians(22.0)
"""Where the camera stands: turned about y from z towards x, and above the x-z plane."""

DARKEST = 0.6
"""Brightness of a face that the light does not reach: dark, but its colour still reads."""


@dataclass(frozen=True)
class Camera:
    """Parallel projection: unit vectors to the right, up, and towards the camera, (3,) each."""

    right: np.ndarray
    up: np.ndarray
    towards: np.ndarray

    @classmethod
    def at(cls, azimuth: float, elevation: float) -> "Camera":
        """The camera at these angles [rad], with y upright in the picture."""
        right = np.array([np.cos(azimuth), 0.0, -np.sin(azimuth)])
        across = np.array([np.sin(azimuth), 0.0, np.cos(azimuth)])
        upright = np.array([0.0, 1.0, 0.0])
        towards = np.cos(elevation) * across + np.sin(elevation) * upright
        return cls(right, np.cross(towards, right), towards)

    def project(self, places: np.ndarray) -> np.ndarray:
        """Places (..., 3) in the picture (..., 2)."""
        return places @ np.column_stack([self.right, self.up])

    def brightness(self, normals: np.ndarray) -> np.ndarray:
        """Of faces with these unit normals (k, 3), DARKEST to 1: the light is at the upper left."""
        light = self.towards + 0.8 * self.up - 0.5 * self.right
        lit = np.clip(normals @ light / np.linalg.norm(light), 0.0, 1.0)
        return DARKEST + (1.0 - DARKEST) * lit


@dataclass(frozen=True)
class Shot:
    """The visible side of one frame, from far to near: corners in the picture (k, 3, 2) [mm],
    values (k,), brightness (k,)."""

    corners: np.ndarray
    values: np.ndarray
    brightness: np.ndarray


class Surface:
    """The frames `indices` of a run in space, coloured by `field`.

    values: of all frames (n,), in the unit of the field's label. view: xmin, xmax, ymin, ymax of
    the picture [mm].
    """

    def __init__(self, frames: Frames, indices: list[int], field: str) -> None:
        self.camera = Camera.at(AZIMUTH, ELEVATION)
        facets = boundary_facets(frames.cells)
        owners = find_rows(facets, cell_facets(frames.cells)) // frames.cells.shape[1]
        self.shots = [
            visible_side(
                (frames.points + frames.point_data["displacement"][index])[facets] * MILLI,
                shown_values(frames, index, field, facets, owners),
                self.camera,
            )
            for index in indices
        ]
        self.values = np.concatenate([shot.values for shot in self.shots])
        places = np.concatenate([shot.corners.reshape(-1, 2) for shot in self.shots])
        low, high = places.min(axis=0), places.max(axis=0)
        margin = 0.03 * (high - low).max()
        self.view = np.column_stack([low - margin, high + margin]).ravel()

    def draw(self, axes: Axes, number: int, colours: ScalarMappable) -> None:
        """Draw one of the frames."""
        shot = self.shots[number]
        rgba = colours.to_rgba(np.ma.masked_invalid(shot.values))
        rgba[:, :3] *= shot.brightness[:, None]
        skin = PolyCollection(
            list(shot.corners), facecolors=rgba, edgecolors="face", linewidths=0.25
        )
        axes.add_collection(skin, autolim=False)
        axes.set_axis_off()

    def label(self, panels: np.ndarray) -> None:
        """Below the first panel of the last row: the directions of the axes, and a length."""
        axes = panels[-1, 0]
        _draw_directions(axes, self.camera)
        _draw_length(axes, self.view[1] - self.view[0])


def visible_side(corners: np.ndarray, values: np.ndarray, camera: Camera) -> Shot:
    """The facets that face the camera, far ones first so that near ones cover them.

    corners: (k, 3, 3) [mm], outward by the right-hand rule. values: (k,). Facets that are lost or
    have no area are left out.
    """
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    with np.errstate(invalid="ignore"):
        seen = np.flatnonzero(normals @ camera.towards > 1e-9 * lengths)
    depth = corners[seen].mean(axis=1) @ camera.towards
    seen = seen[np.argsort(depth)]
    brightness = camera.brightness(normals[seen] / lengths[seen, None])
    return Shot(camera.project(corners[seen]), values[seen], brightness)


def _draw_directions(axes: Axes, camera: Camera) -> None:
    """Arrows along x, y and z below the lower left corner of the panel."""
    length, origin = 20.0, np.array([16.0, -24.0])  # points
    for name, direction in zip("xyz", np.eye(3), strict=True):
        tip = camera.project(direction)
        axes.annotate(
            "", origin + length * tip, origin, annotation_clip=False,
            xycoords=_points_from_corner(axes), textcoords=_points_from_corner(axes),
            arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 0.8, "mutation_scale": 6.0,
                        "shrinkA": 0.0, "shrinkB": 0.0},
        )  # fmt: skip
        beyond = origin + length * tip + 5.0 * tip / np.linalg.norm(tip)
        axes.text(
            *beyond, name, transform=_points_from_corner(axes), ha="center", va="center",
            fontsize=8.5, clip_on=False,
        )  # fmt: skip


def _points_from_corner(axes: Axes) -> Transform:
    """Places in points from the lower left corner of the panel."""
    figure = axes.get_figure()
    assert figure is not None
    corner = ScaledTranslation(0.0, 0.0, axes.transAxes)
    return Affine2D().scale(1.0 / 72.0) + figure.dpi_scale_trans + corner


def _draw_length(axes: Axes, width: float) -> None:
    """A bar of a round length, right of the directions; `width` of the panel [mm]."""
    length = round_length(width / 3.0)
    bar = axes.get_xaxis_transform()
    start = axes.get_xlim()[0] + 0.3 * width
    axes.plot([start, start + length], [-0.06] * 2, color=INK, transform=bar, clip_on=False)
    axes.text(start + length / 2, -0.08, f"{length:g} mm", transform=bar, ha="center", va="top", fontsize=8.5)


def round_length(longest: float) -> float:
    """The largest of 1, 2, 5, 10, 20 ... and their tenths that is no longer than `longest`."""
    decade = 10.0 ** np.floor(np.log10(longest))
    return float(max(step * decade for step in (1.0, 2.0, 5.0) if step * decade <= longest))
