"""Natural modes of bodies: the shape of each mode, drawn over the body at rest."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import SubFigure

from softsim.output.fields import Frames, SeriesInMemory
from softsim.report.diagram import MILLI
from softsim.report.snapshots import Arrangement, Pictures, arranged, pictures, show
from softsim.report.style import COLOUR_MAP, WALL, drawing
from softsim.solver.natural_modes import NaturalMode, NaturalModes

STEEPEST, FARTHEST = 0.4, 0.12
"""Largest displacement gradient and largest displacement of a drawn mode shape.

The displacement is a fraction of the longest side of the body; the smaller amplitude is taken.
"""

AT_REST = ScalarMappable(Normalize(0.0, 1.0), ListedColormap([WALL]))


def draw_modes(found: Sequence[NaturalModes], path: Path, grey: str = "at rest") -> None:
    """Draw the modes of bodies, coloured by displacement; the body at rest is grey.

    grey: state of the grey body in words.

    Raises OutputError if the file cannot be written.
    """
    shown = [pictures(frames_of(m), list(range(len(m.modes) + 1)), "displacement") for m in found]
    grids = [arranged(len(m.modes), body.view) for m, body in zip(found, shown, strict=True)]
    heights = [grid.rows * (grid.height + 0.45) + 0.7 for grid in grids]
    with drawing(path, sum(heights)) as figure:
        parts = figure.subfigures(len(found), 1, squeeze=False, height_ratios=heights)[:, 0]
        for part, modes, body, grid in zip(parts, found, shown, grids, strict=True):
            _draw_body(part, modes, body, grid, grey)


def frames_of(found: NaturalModes) -> Frames:
    """Return the body at rest, followed by each of its modes, as frames of a run."""
    body = found.body
    shapes = [mode.shape * amplitude(found, mode) for mode in found.modes]
    return Frames(
        body.points, body.cells, np.arange(1.0 + len(shapes)),
        point_data={"displacement": SeriesInMemory([np.zeros_like(body.points), *shapes])},
        cell_data={}, extra={}, described={},
        titles={"formulation": body.regions[0].geometry.name}, sets={},
    )  # fmt: skip


def amplitude(found: NaturalModes, mode: NaturalMode) -> float:
    """Return the drawn displacement [m] of the node that moves most."""
    body = found.body
    length = float(np.ptp(body.points, axis=0).max())
    gradients = [r.deformation(body.points + mode.shape) - np.eye(3) for r in body.regions]
    steepest = max(float(np.linalg.norm(g, axis=(1, 2)).max()) for g in gradients)
    return min(STEEPEST / steepest, FARTHEST * length)


def _draw_body(
    part: SubFigure, found: NaturalModes, body: Pictures, grid: Arrangement, grey: str
) -> None:
    part.suptitle(f"body '{found.body.name}' (grey: {grey})", fontsize=9.0)
    panels = part.subplots(grid.rows, grid.columns, sharex=True, sharey=True, squeeze=False)
    count = len(found.modes)
    for axes in panels.flat[count:]:
        axes.set_axis_off()
    viscoelastic = any(region.material.branches for region in found.body.regions)
    for number, (axes, mode) in enumerate(zip(panels.flat, found.modes, strict=False), start=1):
        stiffened = f"\ndynamic {mode.dynamic_frequency:.4g} Hz" if viscoelastic else ""
        show(axes, body, f"{number}: {mode.frequency:.4g} Hz{stiffened}")
        body.draw(axes, 0, AT_REST)
        largest = amplitude(found, mode) * MILLI
        body.draw(axes, number, ScalarMappable(Normalize(0.0, largest), COLOUR_MAP))
    lowest = [panels[(count - 1 - c) // grid.columns, c] for c in range(grid.columns)]
    body.label(lowest, list(panels[:, 0]))
