"""Follower pressure on facets, and its reaction on the rigid body that closes the chamber.

Corner forces are p times the gradient of the enclosed volume (elements/geometry.py). On a closed
chamber the resultant force and moment vanish; a body that closes the chamber receives the opposite
of the forces on the facets.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import index_field, real_field
from softsim.compute.nodes import PARTS, Nodes, parts_of
from softsim.compute.term import Pass, PerScenario, Stage, WorkingTerm
from softsim.elements.geometry import Facets, Geometry
from softsim.loads.air_line import AirLine
from softsim.loads.drive import AddedGas, AddedVolume, ControlledPressure, Scheduled
from softsim.loads.load import Load
from softsim.rigid.frame import RigidBodies

Filling = AddedVolume | AddedGas | AirLine
"""Pressure sources that depend on the volume of their chamber."""
Drive = Scheduled | ControlledPressure | AirLine

OPEN = -1


@dataclass(frozen=True, eq=False)
class FollowerPressure(Load):
    """Follower pressure on `facets` (k, corners).

    lids: further facets, without pressure, that close the surface. body: number of the rigid body
    that closes the chamber, or None. geometry: of the facets. area: of the facets at rest [m^2].
    """

    name: PerScenario[str]
    facets: np.ndarray
    lids: np.ndarray
    geometry: Geometry
    drive: Drive
    body: int | None
    area: PerScenario[float]

    def term(
        self, alike: Sequence["FollowerPressure"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "FollowerPressureTerm":
        facets, lids = (self.geometry.facets(nodes, f) for f in (self.facets, self.lids))
        drives: list[Any] = [load.drive for load in alike]
        body = OPEN if self.body is None else self.body
        return FollowerPressureTerm(nodes, rigid_bodies, facets, lids, drives, body)

    @property
    def last_change(self) -> float:
        return self.drive.last_change

    def time_scaled(self, factor: float) -> "FollowerPressure":
        return replace(self, drive=self.drive.time_scaled(factor))

    def remark(self, points: np.ndarray) -> str:
        """Return the highest value of the pressure source and the area at rest on which it acts."""
        return f"{self.drive.peak}, on {1e6 * self.area:.4g} mm^2 at rest"

    def volume(self, x: np.ndarray) -> float:
        """Return the enclosed volume [m^3] with all nodes at x (n, d)."""
        return self.geometry.enclosed_volume(x, np.concatenate([self.facets, self.lids]))


class FollowerPressureTerm(WorkingTerm):
    """Kernel class that applies a follower pressure to facets.

    facets: of elements/geometry.py. lids: further facets, without pressure, that close the surface
    to a volume. drives: pressure source of each scenario. body: number of the rigid body that
    closes the chamber, or `OPEN`.
    """

    def __init__(
        self,
        nodes: Nodes,
        rigid_bodies: RigidBodies,
        facets: Facets,
        lids: Facets,
        drives: list[Any],
        body: int = OPEN,
    ) -> None:
        self.nodes, self.rigid_bodies, self.body = nodes, rigid_bodies, body
        self.facets, self.lids = facets, lids
        self.drives, self.source = drives, drives[0].source(drives)
        super().__init__(nodes.scenarios, facets.count)
        self.corners = facets.corners
        self.pressure = real_field(np.zeros(nodes.scenarios))
        self.volume = real_field(np.zeros(nodes.scenarios))
        self.volume_part = real_field(np.zeros((nodes.scenarios, PARTS)))
        self.facet_part = index_field(parts_of([facets.count]))
        self.lid_part = index_field(parts_of([lids.count]))
        self.first_slot = nodes.corner_forces.reserve(facets.corner_nodes)
        if body != OPEN:
            rigid_bodies.react(body, self.first_slot, facets.corner_nodes.ravel())

    def follow(self, scenario: int, drive: Any) -> None:
        """Replace the pressure source of a scenario by another of the same kind."""
        self.source.follow(scenario, drive)
        self.drives[scenario] = drive

    def passes(self) -> dict[Stage, list[Pass]]:
        parts = PARTS if self.source.asks_volume else 0
        return {
            Stage.MOVE: [Pass("loads", parts, (self.measure_volume,))],
            Stage.PRESS: [Pass("loads", 1, (self.follow_source,))],
            Stage.STRESS: [Pass("loads", int(self.count), (self.push_facets,))],
        }

    def state_fields(self) -> dict[str, ti.Field]:
        of_chamber = {"pressure": self.pressure, "volume": self.volume}
        return super().state_fields() | of_chamber | self.source.state_fields()

    @ti.func
    def measure_volume(self, s, part, t, dt):
        """Compute the volume enclosed by a part of the facets and the lids."""
        volume = ti.cast(0.0, backend.real)
        for k in range(self.facet_part[part], self.facet_part[part + 1]):
            volume += self.facets.volume(s, k)
        for k in range(self.lid_part[part], self.lid_part[part + 1]):
            volume += self.lids.volume(s, k)
        self.volume_part[s, part] = volume

    @ti.func
    def follow_source(self, s, i, t, dt):
        """Update the pressure, which may depend on the enclosed volume."""
        if ti.static(self.source.asks_volume):
            volume = ti.cast(0.0, backend.real)
            for part in range(PARTS):
                volume += self.volume_part[s, part]
            self.volume[s] = volume
        self.pressure[s] = self.source.pressure(s, t, self.volume[s])

    @ti.func
    def push_facets(self, s, i, t, dt):
        """Write p dV/dx on each corner of facet i and add the work of this increment."""
        forces = self.pressure[s] * self.facets.unit_forces(s, i)
        for c in ti.static(range(self.corners)):
            a = self.facets.node[i, c]
            force = ti.Vector.zero(backend.real, self.nodes.dimension)
            for k in ti.static(range(self.nodes.dimension)):
                force[k] = forces[c, k]
            # The slot still holds the force of the last increment: work by the trapezoidal rule.
            slot = self.first_slot + self.corners * i + c
            before = self.nodes.corner_forces.read(s, slot)
            self.nodes.corner_forces.write(s, slot, force)
            velocity = self.nodes.velocity[s, a]
            if ti.static(self.body != OPEN):
                velocity -= self.rigid_bodies.velocity_at(s, self.body, self.nodes.position[s, a])
            self.work[s, i] = self.work[s, i] + 0.5 * dt * (before + force).dot(velocity)
