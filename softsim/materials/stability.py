"""Material stability of a law: the stretch at which its stress stops rising.

The check is of the material point, not of structures: a balloon has a limit pressure although the
nominal stress of its rubber rises monotonically.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from softsim.materials.law import Law
from softsim.materials.modes import EQUIBIAXIAL, PLANAR, UNIAXIAL

LARGEST_STRETCH, SMALLEST_STRETCH = 10.0, 0.2
"""Range of stretches that `instability_stretch` searches, beyond those of most robots."""

# Points looked at, then looked at again between the last good and the first bad one: an
# instability narrower than 1/2000 of the range is not found, and a found one is exact to 1e-9.
GRID = 2000
REFINEMENTS = 3


def instability_stretch(
    law: Law, largest_stretch: float = LARGEST_STRETCH, smallest_stretch: float = SMALLEST_STRETCH
) -> dict[str, float | None]:
    """Return the first stretch at which the nominal stress stops rising, or None, for each mode.

    The solid is incompressible. The search covers uniaxial, equibiaxial and planar tension from 1
    up to `largest_stretch`, and uniaxial compression from 1 down to `smallest_stretch`: Drucker's
    criterion along these paths. Keys: "uniaxial tension", "equibiaxial tension", "planar tension",
    "compression".
    """
    tension = np.linspace(1.0, largest_stretch, GRID)
    compression = np.linspace(1.0, smallest_stretch, GRID)
    paths = {f"{mode.name} tension": (mode, tension) for mode in (UNIAXIAL, EQUIBIAXIAL, PLANAR)}
    paths["compression"] = (UNIAXIAL, compression)
    return {
        name: _first_not_positive(partial(mode.stress_slope, law), stretches)
        for name, (mode, stretches) in paths.items()
    }


def first_unstable_I1(law: Law, largest_I1: float) -> float | None:
    """Return the first I1_bar in [3, largest_I1] without positive shear stiffness, or None.

    There W1 + W2 b_k <= 0 (`Law.shear_stiffness`; for a law W(I1_bar) that is W' <= 0, in any
    mode): an element that gets there cannot recover. The stress stops rising earlier than this, see
    `instability_stretch`. The search covers uniaxial tension and compression, which have the
    smallest and the largest I2_bar of all deformations of one I1_bar, and planar tension.
    """

    def smallest(I1: np.ndarray) -> np.ndarray:
        # The positive roots of l^3 - I1 l + 2 = 0, and of l^2 + 1 + l^-2 = I1.
        angle = np.arccos(np.maximum(-((3.0 / I1) ** 1.5), -1.0)) / 3.0
        tension, compression = (
            2.0 * np.sqrt(I1 / 3.0) * np.cos(angle - shift) for shift in (0.0, 2.0 * np.pi / 3.0)
        )
        planar = np.sqrt(0.5 * (I1 - 1.0 + np.sqrt((I1 - 3.0) * (I1 + 1.0))))
        paths = ((UNIAXIAL, tension), (UNIAXIAL, compression), (PLANAR, planar))
        return np.min(
            [law.shear_stiffness(mode.squared_stretches(stretch)) for mode, stretch in paths],
            axis=0,
        )

    return _first_not_positive(smallest, np.linspace(3.0, largest_I1, GRID))


def _first_not_positive(
    function: Callable[[np.ndarray], np.ndarray], points: np.ndarray
) -> float | None:
    """Return the first of `points` (in order) with `function` <= 0, refined, or None."""
    first = None
    for _ in range(1 + REFINEMENTS):
        bad = np.flatnonzero(function(points) <= 0.0)
        if len(bad) == 0:
            return first
        first = float(points[bad[0]])
        points = np.linspace(points[max(bad[0] - 1, 0)], first, GRID)
    return first
