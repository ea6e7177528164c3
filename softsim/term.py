"""A term: whatever exerts force, as the solver meets it.

The solver asks all terms the same: the passes of an increment, the fields that a checkpoint keeps,
energies and work, what the history reads. Term answers each with nothing; a term overrides what it
has.

A class whose functions (ti.func) kernels call is a plain class. ti.data_oriented is for those that
have kernels of their own: each look at an attribute of such an object takes a microsecond.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import taichi as ti

from softsim import backend, fields
from softsim.fields import Number, real_field


class Stage(IntEnum):
    """When a pass runs. Passes of a stage do not need each other's results and may run side by
    side; each stage begins where the one before has ended.
    """

    STEER = 0  # velocities that are prescribed; then everything drifts
    FOLLOW = 1  # places and velocities of nodes that are tied to facets
    MEASURE = 2  # gravity of now, lengths that elements ask for
    MOVE = 3  # deformation; forces that follow from places and velocities alone
    PRESS = 4  # pressures, from volumes
    STRESS = 5  # forces, from deformation and pressures
    LIST = 6  # who touches whom among surfaces
    GATHER = 7  # forces on facets, from the nodes that touch them
    PULL = 8  # forces on what STRESS has strained beside the corners
    HAND_OVER = 9  # what acts on tied nodes, onto the corners of their facets


@dataclass(frozen=True)
class Pass:
    """Work on `count` indices: each of `functions` (s, i, t, dt), in order; `phase` names its cost.

    What a function reads from an earlier one of its pass, it reads at its own index.
    """

    phase: str
    count: int
    functions: tuple[Callable[..., None], ...]


class Term:
    """What exerts force."""

    def passes(self) -> dict[Stage, list[Pass]]:
        """Of an increment."""
        return {}

    def pulls(self) -> list[Callable[..., None]]:
        """Functions (s, i, t, dt) that add to the loads on rigid bodies, in stage MOVE, one after
        another.
        """
        return []

    def state_fields(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        return {}

    def set_time_increment(self, scenario: int, dt: float) -> None:
        """Take the time step [s] of a scenario; infinite: what relaxes has relaxed."""

    def forget_work(self) -> None:
        """Begin the books of work anew."""

    def forget_dissipation(self, scenario: int) -> None:
        """Begin the books of dissipation anew in a scenario."""

    def impulses(self) -> list[ti.Field]:
        """Fields (scenarios, ...) that are summed over the interval between two rows of the
        history, and begin anew with each.
        """
        return []

    def readings(self, scenario: int, interval: float) -> dict[str, float]:
        """Columns of the history now, `interval` [s] after impulses were cleared."""
        return {}

    @ti.func
    def stored_energy(self, s, part):
        """Of springs and materials [J]: what a part of the sum has (`Number.first`, `once`)."""
        return ti.cast(0.0, backend.real)

    @ti.func
    def dissipated_energy(self, s, part):
        """Dissipated so far by friction, and by viscosity and damping [J]."""
        return ti.Vector([0.0, 0.0])

    @ti.func
    def work_done(self, s, dt, part):
        """Work on the bodies so far [J], up to the time of their positions."""
        return ti.cast(0.0, backend.real)


class WorkingTerm(Term):
    """A term that books the `work` (scenarios, count) [J] of its own forces, index by index."""

    def __init__(self, scenarios: int, count: int) -> None:
        self.count = Number(count)
        self.work = real_field(np.zeros((scenarios, count)))

    def state_fields(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        return {"work": self.work}

    def forget_work(self) -> None:
        """No work is done before the first increment."""
        fields.write(self.work, 0.0)

    @ti.func
    def work_done(self, s, dt, part):
        """Work so far [J]."""
        total = ti.cast(0.0, backend.real)
        for i in range(self.count.first(part), self.count.first(part + 1)):
            total += self.work[s, i]
        return total
