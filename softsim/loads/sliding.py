"""Coulomb friction with memory along a line that turns: what a tether or a cable's end drags.

A spring k between a point and what it drags stretches by ds = e.dx as the point moves by dx, with
the unit vector e along the line, and is cut back to F / k: beyond, what it drags slides. The force
is -k s e. What that takes, by the trapezoidal rule as the integrator has it, and the spring does
not store, is dissipated: k (s_0 + s_1)/2 (e.dx - (s_1 - s_0)) where the line stays.
"""

import numpy as np
import taichi as ti


def longest_stretch(stiffness: np.ndarray, friction: np.ndarray) -> np.ndarray:
    """F / k [m]; none without friction."""
    slides = stiffness > 0.0
    return np.where(slides, friction / np.where(slides, stiffness, 1.0), 0.0)


@ti.func
def stretched(before, axis_before, axis, way, longest):
    """The stretch [m] after a way (d) [m] of the point, during which the line turned."""
    after = before + 0.5 * (axis_before + axis).dot(way)
    return ti.max(-longest, ti.min(longest, after))


@ti.func
def dissipated(stiffness, before, after, axis_before, axis, way):
    """Energy [J] that sliding took meanwhile."""
    taken = 0.5 * stiffness * (before * axis_before + after * axis).dot(way)
    return taken - 0.5 * stiffness * (after * after - before * before)
