"""Tendon from a rigid body to a force gauge far away: a spring that pulls and never pushes.

With u the displacement of the body's centre of mass, d the unit vector towards the gauge and s the
slack, the elongation is e = -u.d - s (the gauge is so far away that d does not turn). If e > 0, the
tendon pulls the body with T = k e along d, otherwise it is slack. Its energy k e^2/2 is stored, as
that of springs in ABAQUS: in the internal energy (ALLSE), not in the external work.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import once, real_field, vector_field
from softsim.compute.nodes import Nodes
from softsim.compute.samples import Samples
from softsim.compute.term import PerScenario, Term
from softsim.loads.load import Load, LoadTargets, RigidSpring
from softsim.rigid import RigidBodies, freedom
from softsim.scene.loads import TendonSpec
from softsim.scene.text import Keys


@dataclass(frozen=True, eq=False)
class Tendon(Load):
    """Tendon on rigid body number `body` towards the unit vector `direction` (d,).

    It pulls with `stiffness` [N/m] once `slack` [m] is used up. The history records its tension as
    `pull`, averaged over the interval, as a gauge would show it.
    """

    body: int
    stiffness: PerScenario[float]
    direction: PerScenario[np.ndarray]
    slack: PerScenario[float]

    @property
    def columns(self) -> dict[str, str]:
        return {"pull": "N"}

    def term(
        self, scenarios: Sequence["Tendon"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "TendonTerm":
        return TendonTerm(
            rigid_bodies, self.body, np.array([tendon.stiffness for tendon in scenarios]),
            np.stack([tendon.direction for tendon in scenarios]),
            np.array([tendon.slack for tendon in scenarios]),
        )  # fmt: skip

    def springs(self, centres: np.ndarray, gravity: float) -> list[RigidSpring]:
        """Return the stiffness of the taut tendon along a line; it adds none against rotation."""
        return [RigidSpring("tendon", self.body, self.stiffness, goes_taut=True)]


class TendonTerm(Term):
    """Kernel class of a tendon on rigid body number `body`.

    stiffness: k (scenarios,) [N/m]. directions: d (scenarios, dimension). slack: s (scenarios,)
    [m]. Its `impulse` (scenarios,) [N s] is the integral of T since it was last cleared.
    """

    def __init__(
        self,
        rigid_bodies: RigidBodies,
        body: int,
        stiffness: np.ndarray,
        directions: np.ndarray,
        slack: np.ndarray,
    ) -> None:
        self.rigid_bodies, self.body = rigid_bodies, body
        self.stiffness, self.slack = real_field(stiffness), real_field(slack)
        self.direction = vector_field(directions)
        self.impulse = real_field(np.zeros(len(stiffness)))

    def pulls(self) -> list[Callable[..., None]]:
        return [self.pull]

    def state_fields(self) -> dict[str, ti.Field]:
        return {"impulse": self.impulse}

    def impulses(self) -> list[ti.Field]:
        return [self.impulse]

    def sampled(self) -> list[ti.Field]:
        return [self.impulse]

    def readings(self, samples: Samples) -> dict[str, np.ndarray]:
        """Return the mean tension [N]."""
        return {"pull": samples.mean(samples.read(self.impulse))}

    @ti.func
    def elongation(self, s):
        """Return e [m] of a taut tendon, else zero."""
        u = self.rigid_bodies.displacement(s, self.body)
        return ti.max(-u.dot(self.direction[s]) - self.slack[s], ti.cast(0.0, backend.real))

    @ti.func
    def pull(self, s, i, t, dt):
        """Pull the body towards the gauge with k e."""
        tension = self.stiffness[s] * self.elongation(s)
        self.rigid_bodies.hold(s, self.body, tension * self.direction[s])
        self.impulse[s] = self.impulse[s] + tension * dt

    @ti.func
    def stored_energy(self, s, part):
        """Return k e^2 / 2 [J]."""
        e = self.elongation(s)
        return once(part) * 0.5 * self.stiffness[s] * e * e


def tendon(loaded: LoadTargets, load: TendonSpec, keys: Keys) -> Tendon:
    """Return a tendon that holds a rigid body."""
    names = loaded.names
    body = names.rigid_number(load.acts_on, (*keys, "acts_on"))
    direction = names.vector(load.direction, (*keys, "direction"))
    free = np.array(freedom(names, load.acts_on)[: names.dimension])
    if not direction[free].any():
        raise names.loaded.error(
            (*keys, "direction"),
            f"'{load.acts_on}' cannot move along {list(load.direction)}, so the tendon could "
            "never become taut",
            f"free this direction (rigid_bodies.{load.acts_on}.free), or change the direction of "
            "the tendon",
        )
    return Tendon(body, load.stiffness, direction / np.linalg.norm(direction), load.slack)
