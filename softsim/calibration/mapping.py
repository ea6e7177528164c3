"""The pressure on a plane section that stands for a pressure in space."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from softsim.calibration.curves import WallCurve
from softsim.errors import CalibrationError

FORCE_SHARE = 0.5
"""Force on the section's walls over that around the body in space: n/2 spikes of n."""

POINTS = 201
"""Pressures of a fit, evenly spaced: a robot whose air leaves at a constant rate spends as much
time at each."""


@dataclass(frozen=True)
class Mapping:
    """Pressures that press each spike alike, and the line q = factor (p - offset) through them.

    pressure p (k,) and section_pressure q (k,) [Pa]: matched ones, from the touch of the body in
    space to the highest pressure that both reached. factor [-], offset [Pa].
    """

    pressure: np.ndarray
    section_pressure: np.ndarray
    factor: float
    offset: float

    def line(self, pressure: np.ndarray) -> np.ndarray:
        """Pressure on the section [Pa] at pressures [Pa], as a scene's factor and offset give."""
        return self.factor * np.maximum(pressure - self.offset, 0.0)

    @property
    def largest_deviation(self) -> float:
        """Largest distance of a matched pressure from the line [Pa], on the section."""
        return float(np.abs(self.line(self.pressure) - self.section_pressure).max())


def matched(reference: WallCurve, section: WallCurve, thickness_ratio: float = 1.0) -> Mapping:
    """Pressures at which the section's walls feel FORCE_SHARE of what the reference's do.

    The line is the least-squares one with a factor and an offset not below zero, which is what a
    scene can say. thickness_ratio: thickness of the section that it is for over that of `section`;
    its force is proportional to it.

    Raises
    ------
    CalibrationError: no contact, or the section reaches no force that the reference has.
    """
    share = FORCE_SHARE / thickness_ratio
    strongest = float(section.force.max())
    reached = reference.pressure_at(np.array([strongest / share]))[0]
    end = reference.highest if np.isnan(reached) else float(reached)
    if not end > reference.touch:
        raise CalibrationError(
            f"the wall force of the section is at most {strongest:.3g} N: less than {share:.3g} "
            "of that of the reference at first contact",
            "raise the pressure of the section (--highest), or its thickness",
        )
    pressure = np.linspace(reference.touch, end, POINTS)
    due = np.minimum(share * reference.force_at(pressure), strongest)
    on_section = section.pressure_at(due)
    # q = factor p - c with c = factor offset: linear in both, neither below zero.
    (factor, c), _ = nnls(np.column_stack([pressure, -np.ones(POINTS)]), on_section)
    return Mapping(pressure, on_section, float(factor), float(c / factor))
