"""Relaxation of Maxwell branches; those that are slow against the time step relax less often.

A branch may be held for n increments of dt, in which its viscous strain stays and its stress is
that of a spring, and then relax by all of them at once, h = n dt, towards the strain at a time
before the present one (elements/material_points.py):
    A <- e A + (1 - e) C_bar^-1(t - phi dt),    e = exp(-h / tau).
Of a slow motion the A that forces meet lags behind C_bar^-1 by h e / (1 - e) for the relaxing,
(h - dt) / 2 for the holding and phi dt. phi is such that all this is tau, as it should be: about
1/2, and next to nothing where tau is much shorter than the step. What is left is of second order,
below 1 % of the complex modulus at 10 kHz with steps of 8 us and the branches of Dragon Skin; of
the loss modulus alone 0.5 % are lacking at 5 kHz and 2 % at 10 kHz, with phi = 0 and n = 1 17 %.

A branch is held for MOST_HELD increments at most, which is short against every motion that a mesh
resolves, and for TAU_SHARE of its relaxation time. Nothing is dissipated while it is held. If the
time step changes while it is held, it then relaxes by n of the new steps.
"""

import numpy as np
import taichi as ti

from softsim import fields
from softsim.fields import index_field, real_field

MOST_HELD = 8  # increments
TAU_SHARE = 1 / 8


class Relaxation:
    """Schedule of the branches with these relaxation times [s], in each scenario.

    due [s, k]: 1 if branch k relaxes in the current increment. share [s, k]: fraction 1 - e by
    which it relaxes. behind [s, k]: phi, the steps before now of the strain towards which it
    relaxes.
    """

    def __init__(self, times: np.ndarray, scenarios: int) -> None:
        self.times = times
        shape = (scenarios, len(times))
        self.holds = index_field(np.ones(shape, dtype=int))  # increments
        self.held, self.due = (index_field(np.zeros(shape, dtype=int)) for _ in range(2))
        self.share, self.behind = (real_field(np.zeros(shape)) for _ in range(2))

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        return {"branch_held": self.held, "branch_due": self.due}

    def set_time_increment(self, scenario: int, dt: float) -> None:
        """Set the time step [s] of a scenario; infinite: all branches relax at once."""
        steps = self.times / dt  # in a relaxation time
        n = np.clip(TAU_SHARE * steps, 1, MOST_HELD).astype(int)
        with np.errstate(divide="ignore"):
            x = n / steps
        behind = steps - n / np.expm1(x) - 0.5 * (n - 1)
        for field, values in (
            (self.holds, n), (self.share, -np.expm1(-x)), (self.behind, behind),
        ):  # fmt: skip
            fields.write_row(field, scenario, values)

    @ti.func
    def tick(self, s, i, t, dt):
        """Find the branches that are due in the increment that begins."""
        for k in range(ti.static(len(self.times))):
            held = self.held[s, k] * (1 - self.due[s, k]) + 1
            self.held[s, k] = held
            self.due[s, k] = ti.cast(held >= self.holds[s, k], ti.i32)
