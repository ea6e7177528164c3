"""From the frozen model to Taichi: the ordered list of passes that make one increment.

A pass is a function of (scenario, index, time, increment) and how many indices it has. An
increment is the list read from top to bottom: drift, forces, kick.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti

from softsim import backend
from softsim.contact.surface_contact import SurfaceContact
from softsim.contact.walls import StraightWalls
from softsim.elements.plane_strain import PlaneStrainTriangles
from softsim.loads.nodal import NodalForce
from softsim.loads.pressure import OPEN, FollowerPressure
from softsim.loads.rotor import Rotor
from softsim.model import ContactData, Model
from softsim.nodes import Nodes
from softsim.rigid.frame import RigidBodies
from softsim.rigid.outline import Outline


@dataclass(frozen=True)
class Pass:
    """One loop of an increment: `function(s, i, t, dt)` for i < count; `phase` names its cost."""

    phase: str
    count: int
    function: Callable[..., None]


class Terms:
    """All Taichi objects of a model, `models` being its scenarios (one mesh, other parameters)."""

    def __init__(self, models: list[Model]) -> None:
        model, scenarios = models[0], len(models)
        self.nodes = Nodes(
            np.broadcast_to(model.points, (scenarios, *model.points.shape)),
            np.stack([m.velocity for m in models]),
            model.mass,
            model.is_free,
            np.stack([m.gravity for m in models]),
        )
        self.rigid_bodies = RigidBodies(self.nodes, list(model.rigid_bodies), model.points)
        self.bodies = [
            PlaneStrainTriangles(
                self.nodes, b.first_node, b.points, b.cells, b.thickness, b.material,
                model.bulk_viscosity,
            )
            for b in model.bodies
        ]  # fmt: skip
        self.pressures = [
            FollowerPressure(
                self.nodes, self.rigid_bodies, load.facets, load.thickness,
                [m.pressures[k].section_profile for m in models],
                OPEN if load.body is None else load.body,
            )
            for k, load in enumerate(model.pressures)
        ]  # fmt: skip
        self.rotors = [
            Rotor(self.rigid_bodies, load.body, [m.rotors[k].rotor for m in models])
            for k, load in enumerate(model.rotors)
        ]
        self.nodal_forces = [
            NodalForce(
                self.nodes, load.nodes, np.stack([m.nodal_loads[k].force for m in models]),
                load.ramp,
            )
            for k, load in enumerate(model.nodal_loads)
        ]  # fmt: skip
        self.walls = self._wall_contact(models)
        self.supports = self._supports(models)
        self.nodes.corner_forces.allocate(scenarios, self.nodes.count)
        self.rigid_bodies.allocate()

    def _contact(self, data: ContactData, obstacle: Any, friction: list[float]) -> SurfaceContact:
        return SurfaceContact(
            self.nodes, data.nodes, obstacle, data.penalty_stiffness, data.tangential_stiffness,
            data.damping, np.array(friction),
        )  # fmt: skip

    def _wall_contact(self, models: list[Model]) -> SurfaceContact | None:
        model = models[0]
        if len(model.walls.points) == 0 or len(model.contact.nodes) == 0:
            return None
        walls = StraightWalls(
            np.stack([m.walls.points for m in models]), np.stack([m.walls.normals for m in models])
        )
        return self._contact(model.contact, walls, [m.contact.friction_coefficient for m in models])

    def _supports(self, models: list[Model]) -> list[SurfaceContact]:
        supports = []
        for outline in models[0].outlines:
            if outline.support is None:
                continue
            centre = outline.centre - self.rigid_bodies.rest_centre[outline.body]
            obstacle = Outline(self.rigid_bodies, outline.body, outline.half_size, centre)
            friction = [outline.support.friction_coefficient] * len(models)
            contact = self._contact(outline.support, obstacle, friction)
            slots = contact.first_row * backend.lanes() + np.arange(contact.count)
            self.rigid_bodies.react(outline.body, slots, outline.support.nodes)
            supports.append(contact)
        return supports

    @property
    def contacts(self) -> list[SurfaceContact]:
        """Contact with walls, then with rigid outlines."""
        return self.wall_contacts + self.supports

    @property
    def wall_contacts(self) -> list[SurfaceContact]:
        """Contact with walls: one, or none where there are no walls."""
        return [] if self.walls is None else [self.walls]

    @property
    def working_loads(self) -> list[FollowerPressure | NodalForce]:
        """Loads on nodes, which book their own work."""
        return [*self.pressures, *self.nodal_forces]

    def drift_passes(self) -> list[Pass]:
        """Everything moves by dt times its half-step velocity."""
        return [
            Pass("integration", self.nodes.count, self.nodes.drift),
            Pass("integration", self.rigid_bodies.count, self.rigid_bodies.drift),
        ]

    def force_passes(self) -> list[Pass]:
        """Every force at the new positions, each into slots of its own."""
        passes = []
        for body in self.bodies:
            passes += [
                Pass("elements", body.blocks, body.deform),
                Pass("elements", body.node_count, body.press_nodes),
                Pass("elements", body.blocks, body.average_pressure),
                Pass("elements", body.blocks, body.stress_corners),
            ]
        for pressure in self.pressures:
            passes.append(Pass("loads", 1, pressure.follow_profile))
            passes.append(Pass("loads", pressure.count, pressure.push_facets))
        passes += [Pass("loads", rotor.count, rotor.pull) for rotor in self.rotors]
        passes += [Pass("loads", force.count, force.push) for force in self.nodal_forces]
        passes += [Pass("contact", contact.count, contact.push) for contact in self.contacts]
        return passes

    def kick_passes(self) -> list[Pass]:
        """New half-step velocities from the summed forces."""
        return [
            Pass("integration", self.nodes.count, self.nodes.kick),
            Pass("integration", self.rigid_bodies.count, self.rigid_bodies.kick),
        ]

    def shift_passes(self) -> list[Pass]:
        """Move half-step velocities by dt with the last forces: when the step changes."""
        return [
            Pass("integration", self.nodes.count, self.nodes.shift),
            Pass("integration", self.rigid_bodies.count, self.rigid_bodies.shift),
        ]

    def sampled_passes(self) -> list[Pass]:
        """What changes slowly and is booked once in a few increments."""
        return [
            Pass("energy", body.blocks, body.dissipate) for body in self.bodies if body.branch_count
        ]

    def memory(self) -> dict[str, ti.Field]:
        """Every field that a checkpoint keeps, by a path-like name."""
        owners: dict[str, Any] = {"nodes": self.nodes, "rigid_bodies": self.rigid_bodies}
        for name in ("bodies", "pressures", "nodal_forces", "contacts"):
            owners |= {f"{name}/{k}": term for k, term in enumerate(getattr(self, name))}
        return {
            f"{owner}/{name}": field
            for owner, term in owners.items()
            for name, field in term.memory().items()
        }
