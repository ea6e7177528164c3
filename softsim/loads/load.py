"""Base class of the loads of a model, and what those of a scene are built from."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from softsim.compute.nodes import Nodes
from softsim.compute.term import Term
from softsim.elements.geometry import Region
from softsim.elements.hoop import RingSection
from softsim.loads.profile import Profile, over_the_run, smooth_rise
from softsim.rigid import RigidBodies
from softsim.scene import loads as scene_loads
from softsim.scene.names import MeshedBody, Names, in_mm
from softsim.scene.text import Keys

L = TypeVar("L", bound="Load")


@dataclass(frozen=True)
class RigidSpring:
    """Largest stiffness that a load adds to rigid body number `body`.

    stiffness [N/m]: along a line. turning [N m/rad]: against rotation. kind: the kind of load, for
    messages. goes_taut: True if the stiffness sets in suddenly, after a slack. The stable step
    counts the other end as fixed: a spring between two rigid bodies is to be given for each of
    them, with twice its stiffness.
    """

    kind: str
    body: int
    stiffness: float
    turning: float = 0.0
    goes_taut: bool = False


@dataclass(frozen=True, eq=False)
class Load(ABC):
    """Load of one scenario.

    Fields that are not marked `PerScenario` (softsim/compute/term.py) are equal in all scenarios of
    a solver. A load without a spring or a time history keeps the default methods.
    """

    @property
    def columns(self) -> dict[str, str]:
        """Columns that its term adds to the history -> unit.

        If several loads have the same columns, the first one writes them.
        """
        return {}

    @abstractmethod
    def term(self, scenarios: Sequence[Any], nodes: Nodes, rigid_bodies: RigidBodies) -> Term:
        """Return the kernel class of the load.

        scenarios: this load in every scenario, this one first.
        """

    def springs(self, centres: np.ndarray, gravity: float) -> list[RigidSpring]:
        """Return the stiffness that the load adds to rigid bodies under `gravity` [m/s^2].

        centres: centres of mass of the rigid bodies at rest (bodies, d) [m].
        """
        return []

    def remark(self, points: np.ndarray) -> str:
        """Return text on the built load, such as the area that it acts on, for its description.

        points: all nodes at rest (n, d) [m].
        """
        return ""

    @property
    def largest_force(self) -> float:
        """Largest force [N] that the load prescribes; 0 if the force depends on what it acts on."""
        return 0.0

    @property
    def last_change(self) -> float:
        """Time [s] at which the time history of the load ends; 0 without one."""
        return 0.0

    def time_scaled(self, factor: float) -> "Load":
        """Return the load with its time history `factor` times as fast."""
        return self


# -------------------------------------------------------------------------------------------------
# What loads of a scene are built from.


@dataclass(frozen=True)
class LoadTargets:
    """Bodies and nodes on which loads act.

    regions: of each body, by its name. points (n, d) [m], mass (n,) [kg] and is_free (n, d): of all
    nodes. tied: nodes tied to each rigid body. total_mass [kg]: of everything in the model.
    """

    names: Names
    regions: Mapping[str, Sequence[Region]]
    points: np.ndarray
    mass: np.ndarray
    is_free: np.ndarray
    tied: list[np.ndarray]
    total_mass: float


def sized(
    loaded: LoadTargets,
    load: scene_loads.OverTime | scene_loads.Directed[Any],
    full: str,
    keys: Keys,
) -> tuple[np.ndarray, Profile]:
    """Return the vector of a load and the factor of it over time [s] of the whole run.

    The vector is the load's full value, at the key `full`, or the unit vector along its direction,
    and the profile has the value then.
    """
    names = loaded.names
    if isinstance(load, scene_loads.OverTime):
        return names.vector(getattr(load, full), (*keys, full)), over_time(loaded, load, keys)
    direction = names.vector(load.direction, (*keys, "direction"))
    return direction / np.linalg.norm(direction), over_the_run(names, load.profile, keys)


def over_time(loaded: LoadTargets, load: scene_loads.OverTime, keys: Keys) -> Profile:
    """Return the factor of a load over time [s] of the whole run."""
    if load.profile is None:
        return smooth_rise(load.ramp).delayed(loaded.names.beginning.of(keys))
    return over_the_run(loaded.names, load.profile, keys)


def joined_facets(names: Names, references: tuple[str, ...], keys: Keys) -> np.ndarray:
    """Return the facets (k, corners) of the named sets.

    Raises SceneError if one of them is in more than one set.
    """
    facets = np.concatenate(
        [names.facet_set(f, (*keys, "facets", k)) for k, f in enumerate(references)]
    )
    _, counts = np.unique(facets, axis=0, return_counts=True)
    if counts.max() > 1:
        raise names.loaded.error(
            (*keys, "facets"),
            f"{int((counts > 1).sum())} facet(s) are in more than one of these sets: the "
            "load would act on them twice",
            "name each part of the surface once",
        )
    owners = {f.partition(".")[0] for f in references}
    for owner in owners:
        refuse_single_parts(names, facets, names.bodies[owner], (*keys, "facets"))
    return facets


def refuse_single_parts(names: Names, facets: np.ndarray, body: MeshedBody, keys: Keys) -> None:
    """Raise SceneError if facets of a ring section have nodes that belong to no ring.

    In a ring section pressure and traction act on rings: only they enclose a volume.
    """
    if not isinstance(body.geometry, RingSection):
        return
    round_nodes = body.first_node + body.mesh.cells[body.geometry.is_ring]
    single = np.setdiff1d(facets[body.has_nodes(facets)], round_nodes)
    if len(single):
        place = in_mm(body.mesh.points[single[0] - body.first_node])
        raise names.loaded.error(
            keys,
            f"the facets include a node at {place} that belongs to no ring, so they do not "
            "enclose a volume",
            "name facets of the rings only, such as those of the chamber",
        )
