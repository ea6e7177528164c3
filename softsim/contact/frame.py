"""Axes in which a wall or an outline is at rest, as contact needs them: here those of space."""

from typing import Any

import taichi as ti

from softsim import backend
from softsim.term import Pass, Stage


class FixedFrame:
    """Axes of space; the base class of frames that move.

    A moving frame defines its motion and the work that it does.
    """

    def carry(self, contact: Any) -> None:
        """Register the contact whose forces do work when the frame moves."""

    def passes(self) -> dict[Stage, list[Pass]]:
        """Return the passes of an increment that move the frame."""
        return {}

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        return {}

    def forget_work(self) -> None:
        """Set the work of the motion to zero."""

    def readings(self, scenario: int, interval: float) -> dict[str, float]:
        """Return the columns of the history now, `interval` [s] after impulses were cleared."""
        return {}

    @ti.func
    def work_done(self, s, part):
        """Return the work of the motion so far [J]."""
        return ti.cast(0.0, backend.real)

    @ti.func
    def local_position(self, s, x):
        """Return a position x (d) [m] in the frame's axes."""
        return x

    @ti.func
    def relative_velocity(self, s, x, v):
        """Return the velocity [m/s] relative to the frame's point at x, in the frame's axes."""
        return v

    @ti.func
    def global_vector(self, s, f):
        """Return a vector of the frame's axes in the axes of space."""
        return f
