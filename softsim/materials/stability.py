"""Where a law stops being a material: a stress that no longer rises as the stretch does.

This is about the material point, not about structures: a balloon has a limit pressure although the
nominal stress of its rubber rises all the way.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from softsim.materials.laws import Law
from softsim.materials.modes import EQUIBIAXIAL, PLANAR, UNIAXIAL

LARGEST_STRETCH, SMALLEST_STRETCH = 10.0, 0.2
"""As far as `instability_stretch` looks: a robot is hardly ever stretched further."""

# Points looked at, then looked at again between the last good and the first bad one: an
# instability narrower than 1/2000 of the range is not found, and a found one is exact to 1e-9.
GRID = 2000
REFINEMENTS = 3


def instability_stretch(
    law: Law, largest_stretch: float = LARGEST_STRETCH, smallest_stretch: float = SMALLEST_STRETCH
) -> dict[str, float | None]:
    """First stretch at which the incompressible solid's nominal stress stops rising, or None.

    Looked for in uniaxial, equibiaxial and planar tension from 1 up to `largest_stretch`, and in
    uniaxial compression from 1 down to `smallest_stretch`: Drucker's criterion along these paths.
    Keys: "uniaxial tension", "equibiaxial tension", "planar tension", "compression".
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
    """First I1_bar in [3, largest_I1] at which dW/dI1_bar <= 0, or None.

    There the shear stiffness is gone in every mode: an element that gets there has no way back.
    The stress stops rising earlier than this, see `instability_stretch`.
    """
    return _first_not_positive(
        lambda I1: law.energy_slope(I1, law.constants), np.linspace(3.0, largest_I1, GRID)
    )


def _first_not_positive(
    function: Callable[[np.ndarray], np.ndarray], points: np.ndarray
) -> float | None:
    """The first of `points` (in their order) where `function` <= 0, refined; None where > 0."""
    first = None
    for _ in range(1 + REFINEMENTS):
        bad = np.flatnonzero(function(points) <= 0.0)
        if len(bad) == 0:
            return first
        first = float(points[bad[0]])
        points = np.linspace(points[max(bad[0] - 1, 0)], first, GRID)
    return first
