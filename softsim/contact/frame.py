"""Axes in which a surface stands still, as contact asks for them: here those of space."""

from typing import Any

import taichi as ti

from softsim import backend
from softsim.term import Pass, Stage


class FixedFrame:
    """The axes of space. A frame that moves says where, and what work its motion does."""

    def carry(self, contact: Any) -> None:
        """Note the contact of the surfaces, whose forces do work where the frame moves."""

    def passes(self) -> dict[Stage, list[Pass]]:
        """What moves the frame in an increment."""
        return {}

    def state_fields(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        return {}

    def forget_work(self) -> None:
        """Begin the books of work anew."""

    def readings(self, scenario: int, interval: float) -> dict[str, float]:
        """Columns of the history now, `interval` [s] after impulses were cleared."""
        return {}

    @ti.func
    def work_done(self, s, part):
        """Work of the motion so far [J]."""
        return ti.cast(0.0, backend.real)

    @ti.func
    def local_position(self, s, x):
        """A place x (d) in the frame's axes [m]."""
        return x

    @ti.func
    def relative_velocity(self, s, x, v):
        """Velocity relative to the frame's point at x, in the frame's axes [m/s]."""
        return v

    @ti.func
    def global_vector(self, s, f):
        """A vector of the frame's axes in space."""
        return f
