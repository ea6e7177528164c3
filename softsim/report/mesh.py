"""Figure of a mesh: the whole body, and the body cut open, with its sets in colour."""

from pathlib import Path

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex, to_rgb
from matplotlib.patches import Patch

from softsim.mesh.cad import END_NAMES
from softsim.mesh.mesh import SURFACE, Mesh, boundary_facets, facet_keys, find_rows
from softsim.report.body import CAMERA, lit, visible_side
from softsim.report.diagram import MILLI
from softsim.report.style import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PAGE_WIDTH,
    PALE,
    PURPLE,
    QUIET,
    RED,
    SKY,
    WALL,
    drawing,
)

OF_AXES = {"x": BLUE, "y": GREEN, "z": PURPLE}
OTHERS = (ORANGE, RED, SKY)
"""Colours of the ends of each axis, of which the lower one is paler, and of all other sets."""


def draw_mesh(mesh: Mesh, path: Path) -> None:
    """Draw a mesh of a solid as PNG: the body, and its farther half, cut along its longest side.

    Raises OutputError if the file cannot be written.
    """
    colours = _colours([name for name in mesh.facet_sets if name != SURFACE])
    extent = np.ptp(mesh.points, axis=0)
    towards = np.where(np.arange(3) == np.argmax(extent), 0.0, CAMERA.towards)
    axis = int(np.argmax(np.abs(towards)))
    middle = mesh.points[:, axis].min() + 0.5 * extent[axis]
    centres = mesh.points[mesh.cells].mean(axis=1)[:, axis]
    farther = mesh.cells[(centres - middle) * towards[axis] < 1e-6 * extent[axis]]
    flat = CAMERA.project(mesh.points * MILLI)
    low, high = flat.min(axis=0), flat.max(axis=0)
    low, high = low - 0.02 * (high - low).max(), high + 0.02 * (high - low).max()
    aspect = float((high[1] - low[1]) / (high[0] - low[0]))
    height = min(0.5 * PAGE_WIDTH * aspect, PAGE_WIDTH) + 0.7
    with drawing(path, height) as figure:
        panels = figure.subplots(1, 2)
        titles = "whole", f"cut open at {'xyz'[axis]} = {middle * MILLI:.4g} mm"
        for axes, cells, title in zip(panels, (mesh.cells, farther), titles, strict=True):
            facets = boundary_facets(cells, 3)
            faces = np.array([to_rgb(WALL)] * len(facets))
            keys = facet_keys(facets)
            for name, colour in colours.items():
                found = find_rows(facet_keys(mesh.facet_sets[name]), keys)
                faces[found[found >= 0]] = to_rgb(colour)
            shot = visible_side(mesh.points[facets] * MILLI, np.zeros(len(facets)), CAMERA)
            drawn = PolyCollection(
                list(shot.corners),
                facecolors=lit(faces[shot.numbers], shot.light),
                edgecolors=INK,
                linewidths=0.25,
            )
            axes.add_collection(drawn)
            axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", title=title)
            axes.set_axis_off()
        figure.legend(
            handles=[Patch(color=colour, label=name) for name, colour in colours.items()],
            loc="outside lower center",
            ncols=7,
            labelcolor=QUIET,
        )


def _colours(names: list[str]) -> dict[str, str]:
    """Return the colour of each set."""
    colours: dict[str, str] = {}
    for name in names:
        if name in END_NAMES:
            pale = PALE if name.endswith("min") else 0.0
            red, green, blue = (pale + (1.0 - pale) * c for c in to_rgb(OF_AXES[name[0]]))
            colours[name] = to_hex((red, green, blue))
    others = [name for name in names if name not in colours]
    return colours | {n: OTHERS[k % len(OTHERS)] for k, n in enumerate(others)}
