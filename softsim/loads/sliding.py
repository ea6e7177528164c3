"""Coulomb friction with memory along a line that turns: the drag of a tether or a cable's end.

A spring k between a point and the object that it drags stretches by ds = e.dx as the point moves by
dx, with the unit vector e along the line. Its stretch is limited to F / k; beyond that the object
slides. The force is -k s e. The work of the point, by the trapezoidal rule like that of the
integrator, minus the energy stored in the spring is dissipated: k (s_0 + s_1)/2 (e.dx - (s_1 -
s_0)) for a line of constant direction.
"""

import numpy as np
import taichi as ti


def longest_stretch(stiffness: np.ndarray, friction: np.ndarray) -> np.ndarray:
    """Return F / k [m]; 0 where the stiffness is zero."""
    slides = stiffness > 0.0
    return np.where(slides, friction / np.where(slides, stiffness, 1.0), 0.0)


@ti.func
def stretched(before, axis_before, axis, way, longest):
    """Return the stretch [m] after a displacement (d) [m] of the point while the line turned."""
    after = before + 0.5 * (axis_before + axis).dot(way)
    return ti.max(-longest, ti.min(longest, after))


@ti.func
def dissipated(stiffness, before, after, axis_before, axis, way):
    """Return the energy [J] dissipated by sliding during the displacement."""
    taken = 0.5 * stiffness * (before * axis_before + after * axis).dot(way)
    return taken - 0.5 * stiffness * (after * after - before * before)
