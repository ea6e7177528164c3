"""Cables that run through eyelets in bodies and are pulled: tendon-driven fingers, grippers.

The cable has no mass and slides through its eyelets without friction, so its tension T is constant
along its length. An eyelet lies in an element and follows its corners with the shape functions
N_aj,

    x_a = sum_j N_aj x_j,

or is fixed in space. With the length L = sum_a |x_(a+1) - x_a| and the unit vectors t_a from one
eyelet to the next, the force on each eyelet is

    f_a = T (t_a - t_(a-1)) = -T dL/dx_a,    f_j = sum_a N_aj f_a,

which preserves force and moment (as in SOFA's CableConstraint). A winch draws in the length p,
against which the cable stretches by e, or applies a tension S that does not depend on the length:

    T = k e + S,    e = max(0, L - L_0 + p).

The energy k e^2 / 2 is stored (ALLSE), the winch's work is int k e dp - int S dL. A cable never
pushes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import Number, index_field, once, real_field, vector_field
from softsim.compute.nodes import Nodes
from softsim.compute.term import Pass, PerScenario, Samples, Stage, WorkingTerm
from softsim.loads.load import Load, LoadTargets, over_time
from softsim.loads.profile import Profile, ProfileTable, over_the_run
from softsim.rigid import RigidBodies
from softsim.scene.loads import PulledCableSpec
from softsim.scene.names import in_mm
from softsim.scene.text import Keys
from softsim.structures.fibre import in_bodies, refuse_all_around
from softsim.structures.structure import NodalStiffness, Structure


@dataclass(frozen=True, eq=False)
class PulledCable(Load, Structure):
    """Cable through k eyelets: a structure that a winch loads.

    corners (k, c): corners of the element around each eyelet, numbered in the model. weights (k,
    c): shape functions there; zero for an eyelet that is fixed in space, whose position is its row
    of anchors (k, d) [m], which is zero for the others. rest_length: L_0 [m]. stiffness: k [N/m].
    pull: p [m over s], tension: S [N over s]; one of the two is zero.
    """

    name: str
    corners: np.ndarray
    weights: np.ndarray
    anchors: PerScenario[np.ndarray]
    rest_length: PerScenario[float]
    stiffness: PerScenario[float]
    pull: PerScenario[Profile]
    tension: PerScenario[Profile]
    kind: ClassVar[str] = "pulled cable"

    @property
    def title(self) -> str:
        return f"cable '{self.name}'"

    @property
    def columns(self) -> dict[str, str]:
        return {f"{self.name}_tension": "N", f"{self.name}_drawn_in": "m"}

    def term(
        self, scenarios: Sequence["PulledCable"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "PulledCableTerm":
        return PulledCableTerm(nodes, scenarios)

    @property
    def largest_force(self) -> float:
        """Largest prescribed tension [N]."""
        return float(self.tension.values.max())

    def time_scaled(self, factor: float) -> "PulledCable":
        pull, tension = (course.time_scaled(factor) for course in (self.pull, self.tension))
        return replace(self, pull=pull, tension=tension)

    def largest_tension(self, length: float) -> float:
        """Return the largest tension T [N] at any time for this length [m]."""
        elongation = max(0.0, length - self.rest_length + float(self.pull.values.max()))
        return self.stiffness * elongation + float(self.tension.values.max())

    def places(self, x: np.ndarray) -> np.ndarray:
        """Return the positions of the eyelets (k, d) [m] with all nodes at x (n, d) [m]."""
        return self.anchors + np.einsum("kc,kcd->kd", self.weights, x[self.corners])

    def lines(self, x: np.ndarray) -> dict[str, list[np.ndarray]]:
        return {"fibres": [self.places(x)]}

    def stiffness_bound(self, x: np.ndarray) -> list[NodalStiffness]:
        """Return the transverse stiffness of the pieces between eyelets, with the nodes at x.

        A piece of the length l has at most T / l B B^T, where B are the weights of its nodes in
        x_b - x_a and T is the largest tension that the winch ever produces at this length.
        """
        lengths = np.linalg.norm(np.diff(self.places(x), axis=0), axis=1)
        across = self.largest_tension(float(lengths.sum())) / lengths
        pieces = np.concatenate([self.corners[:-1], self.corners[1:]], axis=1).T
        B = np.concatenate([-self.weights[:-1], self.weights[1:]], axis=1).T
        return [NodalStiffness(self.title, pieces, across * B[:, None] * B)]

    def stiffness_roots(self, x: np.ndarray) -> list[np.ndarray]:
        """Return sqrt(k) dL/dx (n, d) [(N/m)^1/2]: a slack cable counts as taut."""
        return [np.sqrt(self.stiffness) * self.length_gradient(x)]

    def length_gradient(self, x: np.ndarray) -> np.ndarray:
        """Return dL/dx (n, d) [-]."""
        ways = np.diff(self.places(x), axis=0)
        t = ways / np.linalg.norm(ways, axis=1)[:, None]
        nothing = np.zeros((1, t.shape[1]))
        of_eyelets = np.concatenate([nothing, t]) - np.concatenate([t, nothing])
        gradient = np.zeros_like(x)
        np.add.at(gradient, self.corners, self.weights[:, :, None] * of_eyelets[:, None])
        return gradient


class PulledCableTerm(WorkingTerm):
    """Kernel class of a cable in its eyelets.

    Fields (scenarios,) of the last increment: elongation e [m]; drawn_in, L_0 + e - L [m], by which
    the unstretched length between the ends has decreased; held, the tension S [N]; impulse [N s] of
    T since last cleared.
    """

    def __init__(self, nodes: Nodes, cables: Sequence[PulledCable]) -> None:
        super().__init__(nodes.scenarios, 1)
        first = cables[0]
        self.nodes, self.columns = nodes, list(first.columns)
        self.eyelets, self.corner_count = Number(len(first.corners)), first.corners.shape[1]
        self.node, self.weight = index_field(first.corners), real_field(first.weights)
        self.anchor = vector_field(np.stack([cable.anchors for cable in cables]))
        self.rest_length = real_field(np.array([cable.rest_length for cable in cables]))
        self.stiffness = real_field(np.array([cable.stiffness for cable in cables]))
        self.pull_course = ProfileTable([cable.pull for cable in cables])
        self.tension_course = ProfileTable([cable.tension for cable in cables])
        self.first_slot = nodes.corner_forces.reserve(first.corners)
        nothing = np.zeros(nodes.scenarios)
        self.elongation, self.drawn_in, self.held, self.impulse = (
            real_field(nothing) for _ in range(4)
        )

    def passes(self) -> dict[Stage, list[Pass]]:
        return {Stage.MOVE: [Pass("cables", 1, (self.pull,))]}

    def state_fields(self) -> dict[str, ti.Field]:
        names = ("elongation", "drawn_in", "held", "impulse")
        return super().state_fields() | {name: getattr(self, name) for name in names}

    def impulses(self) -> list[ti.Field]:
        return [self.impulse]

    def sampled(self) -> list[ti.Field]:
        return [self.impulse, self.drawn_in]

    def readings(self, samples: Samples) -> dict[str, np.ndarray]:
        """Return the mean tension [N] and the present drawn-in length [m]."""
        tension = samples.mean(samples.read(self.impulse))
        return dict(zip(self.columns, (tension, samples.read(self.drawn_in)), strict=True))

    @ti.func
    def place(self, s, a):
        """Return the position of eyelet a (d) [m]."""
        place = self.anchor[s, a]
        for c in range(self.corner_count):
            place += self.weight[a, c] * self.nodes.position[s, self.node[a, c]]
        return place

    @ti.func
    def pull(self, s, i, t, dt):
        """Write the forces of the cable on the nodes of its eyelets."""
        longer = -self.rest_length[s]  # L - L_0
        for a in range(self.eyelets.read() - 1):
            longer += (self.place(s, a + 1) - self.place(s, a)).norm()
        stretched = ti.cast(0.0, backend.real)
        if self.stiffness[s] > 0.0:  # a winch that keeps a tension lets nothing stretch
            stretched = ti.max(stretched, longer + self.pull_course.at(s, t))
        held = self.tension_course.at(s, t)
        self._book(s, stretched, stretched - longer, held)
        tension = self.stiffness[s] * stretched + held
        self.impulse[s] = self.impulse[s] + tension * dt
        behind = ti.Vector.zero(backend.real, self.nodes.dimension)  # t_(a-1)
        for a in range(self.eyelets.read()):
            ahead = ti.Vector.zero(backend.real, self.nodes.dimension)
            if a < self.eyelets.read() - 1:
                ahead = (self.place(s, a + 1) - self.place(s, a)).normalized()
            force = tension * (ahead - behind)
            for c in range(self.corner_count):
                slot = self.first_slot + self.corner_count * a + c
                self.nodes.corner_forces.write(s, slot, self.weight[a, c] * force)
            behind = ahead

    @ti.func
    def _book(self, s, stretched, drawn_in, held):
        """Add the work of the winch by the trapezoidal rule, consistent with central differences.

        For the spring k e it is k e dp = k e d(drawn in): where these differ, the cable is slack.
        """
        spring = 0.5 * self.stiffness[s] * (self.elongation[s] + stretched)
        way = drawn_in - self.drawn_in[s]
        shortened = way - (stretched - self.elongation[s])  # -dL
        self.work[s, 0] = self.work[s, 0] + spring * way + 0.5 * (self.held[s] + held) * shortened
        self.elongation[s], self.drawn_in[s], self.held[s] = stretched, drawn_in, held

    @ti.func
    def stored_energy(self, s, part):
        """Return k e^2 / 2 [J]."""
        return once(part) * 0.5 * self.stiffness[s] * self.elongation[s] * self.elongation[s]


# -------------------------------------------------------------------------------------------------
# Pulled cables of a scene.


# Of a cable's length: eyelets that are no farther from each other are at one place.
SAME_PLACE = 1e-6


def pulled_cable(loaded: LoadTargets, load: PulledCableSpec, keys: Keys) -> PulledCable:
    """Return a cable through eyelets."""
    names = loaded.names
    refuse_all_around(names, "a cable", keys)
    places = np.array(
        [names.vector(place, (*keys, "eyelets", k)) for k, place in enumerate(load.eyelets)]
    )
    corners, weights = in_bodies(names, places, load.tolerance, (*keys, "eyelets"))
    anchors = np.zeros_like(places)
    if load.pulled_from is not None:
        anchor = names.vector(load.pulled_from, (*keys, "pulled_from"))
        corners, weights = (np.pad(rows, ((1, 0), (0, 0))) for rows in (corners, weights))
        anchors = np.concatenate([anchor[None], anchors])
    pull, tension = driven(loaded, load, keys)
    cable = PulledCable(
        name=str(keys[-1]), corners=corners, weights=weights, anchors=anchors, rest_length=0.0,
        stiffness=load.stiffness or 0.0, pull=pull, tension=tension,
    )  # fmt: skip
    held = cable.places(loaded.points)
    pieces = np.linalg.norm(np.diff(held, axis=0), axis=1)
    shortest = int(np.argmin(pieces))
    if pieces[shortest] <= SAME_PLACE * pieces.sum():
        at_anchor = load.pulled_from is not None and shortest == 0
        raise names.loaded.error(
            (*keys, "pulled_from" if at_anchor else "eyelets"),
            f"two successive points of '{keys[-1]}' are at the same place, {in_mm(held[shortest])}",
            "leave one of them out",
        )
    return replace(cable, rest_length=float(pieces.sum()))


def driven(loaded: LoadTargets, load: PulledCableSpec, keys: Keys) -> tuple[Profile, Profile]:
    """Return the drawn-in length [m] of a cable and its tension [N] over time [s] of the whole run.

    The one that the scene does not give is zero.
    """
    names = loaded.names
    key, given = "profile", None
    for name, values in (
        ("pull_profile", load.pull_profile), ("tension_profile", load.tension_profile)
    ):  # fmt: skip
        if values is not None:
            key, given = name, over_the_run(names, values, keys)
    course = over_time(loaded, load, keys) if given is None else given
    if (course.values < 0.0).any():
        raise names.loaded.error(
            (*keys, key),
            f"falls to {course.values.min():.4g}: a cable can only pull",
            "use values of at least 0",
        )
    pull = 1.0 if key == "pull_profile" else load.pull or 0.0
    tension = 1.0 if key == "tension_profile" else load.tension or 0.0
    return course.times_factor(pull), course.times_factor(tension)
