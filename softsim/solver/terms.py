"""From the frozen model to Taichi: the stages of passes that make one increment.

A pass is a function of (scenario, index, time, increment) and how many indices it has. They
come in stages; an increment is the stages read from top to bottom: drift, forces, kick.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti

from softsim.contact.deformable_surface import DeformableSurface
from softsim.contact.distance_grid import DistanceGrid
from softsim.contact.gridded_walls import GriddedObstacle
from softsim.contact.half_spaces import HalfSpaces
from softsim.contact.list_sizes import margin_and_room
from softsim.contact.neighbour_lists import NeighbourLists
from softsim.contact.path_obstacle import PathObstacle
from softsim.contact.pipe_path import PipePath
from softsim.contact.round_pipes import RoundPipes
from softsim.contact.self_contact import SelfContact
from softsim.contact.surface_contact import SurfaceContact
from softsim.contact.walls import FlatObstacle, RoundObstacle
from softsim.elements import geometry
from softsim.elements.axisymmetric import Axisymmetric
from softsim.elements.plane_strain import PlaneStrain
from softsim.elements.ring_section import RingSection
from softsim.elements.tetrahedra import Tetrahedra
from softsim.loads.axial_relief import AxialRelief
from softsim.loads.chamber import SOURCES
from softsim.loads.facets import PlaneFacets, RevolvedFacets, RingFacets, TriangleFacets
from softsim.loads.gravity import RisingGravity
from softsim.loads.nodal import NodalForce
from softsim.loads.prescribed import PrescribedMotion
from softsim.loads.pressure import OPEN, FollowerPressure
from softsim.loads.rigid_force import RigidForce
from softsim.loads.rotor import Rotor
from softsim.loads.table import ProfileTable
from softsim.loads.tendon import Tendon
from softsim.loads.tether import Tether
from softsim.model import LOCAL_DAMPING, BallShape, ContactData, CylinderShape, Model
from softsim.nodes import PARTS, Nodes
from softsim.rigid.frame import RigidBodies
from softsim.rigid.outline import Ball, Cylinder
from softsim.solver.chatter import return_time

ELEMENTS = {
    geometry.PlaneStrain: PlaneStrain,
    geometry.Axisymmetric: Axisymmetric,
    geometry.RingSection: RingSection,
    geometry.Solid: Tetrahedra,
}
FACETS: dict[type, Any] = {
    geometry.PlaneStrain: PlaneFacets,
    geometry.Axisymmetric: RevolvedFacets,
    geometry.RingSection: RingFacets,
    geometry.Solid: TriangleFacets,
}
WALLS: dict[type, Any] = {
    HalfSpaces: FlatObstacle,
    RoundPipes: RoundObstacle,
    PipePath: PathObstacle,
    DistanceGrid: GriddedObstacle,
}
OUTLINES: dict[type, Any] = {CylinderShape: Cylinder, BallShape: Ball}


@dataclass(frozen=True)
class Pass:
    """Work on `count` indices: each of `functions` (s, i, t, dt), in order; `phase` names its cost.

    What a function reads from an earlier one of its pass, it reads at its own index.
    """

    phase: str
    count: int
    functions: tuple[Callable[..., None], ...]


Stage = list[Pass]
"""Passes that do not need each other's results: they may run side by side."""


class Terms:
    """All Taichi objects of a model, `models` being its scenarios (one mesh, other parameters)."""

    def __init__(self, models: list[Model]) -> None:
        model, scenarios = models[0], len(models)
        self.nodes = Nodes(
            np.broadcast_to(model.points, (scenarios, *model.points.shape)),
            np.stack([m.velocity for m in models]),
            model.mass,
            model.is_free,
            np.stack([starting_gravity(m) for m in models]),
            np.array([0.0 if m.relaxation is None else LOCAL_DAMPING for m in models]),
            any(m.relaxation is not None or m.settling is not None for m in models),
        )
        self.rigid_bodies = RigidBodies(self.nodes, list(model.rigid_bodies), model.points)
        self.bodies = [
            ELEMENTS[type(b.geometry)](
                self.nodes, b.first_node, b.geometry, b.points, b.cells, b.material,
                model.bulk_viscosity,
            )
            for b in model.bodies
        ]  # fmt: skip
        self.pressures = [self._pressure(models, k) for k in range(len(model.pressures))]
        self.rotors = [
            Rotor(self.rigid_bodies, load.body, [m.rotors[k].rotor for m in models])
            for k, load in enumerate(model.rotors)
        ]
        self.rigid_forces = [
            RigidForce(
                self.rigid_bodies, load.body, np.stack([m.rigid_loads[k].force for m in models]),
                ProfileTable([m.rigid_loads[k].share for m in models]),
            )
            for k, load in enumerate(model.rigid_loads)
        ]  # fmt: skip
        self.axial_reliefs = [
            AxialRelief(
                self.rigid_bodies,
                relief.body,
                np.array([m.axial_reliefs[k].mass for m in models]),
            )
            for k, relief in enumerate(model.axial_reliefs)
        ]
        self.tendons = [
            Tendon(
                self.rigid_bodies, tendon.body, np.array([m.tendons[k].stiffness for m in models]),
                np.stack([m.tendons[k].direction for m in models]),
                np.array([m.tendons[k].slack for m in models]),
            )
            for k, tendon in enumerate(model.tendons)
        ]  # fmt: skip
        self.tethers = [self._tether(models, k) for k in range(len(model.tethers))]
        self.nodal_forces = [
            NodalForce(
                self.nodes, load.nodes, np.stack([m.nodal_loads[k].force for m in models]),
                ProfileTable([m.nodal_loads[k].share for m in models]),
            )
            for k, load in enumerate(model.nodal_loads)
        ]  # fmt: skip
        self.prescribed = [
            PrescribedMotion(
                self.nodes, motion.nodes, motion.axis,
                ProfileTable([m.prescribed[k].profile for m in models]),
            )
            for k, motion in enumerate(model.prescribed)
        ]  # fmt: skip
        self.friction_memory = np.array([m.friction_memory for m in models])
        self.slip_length = np.array([m.friction_slip_length for m in models])
        self.return_times = np.array([return_time(m) for m in models])
        profiles = [m.gravity_profile for m in models if m.gravity_profile is not None]
        self.rising_gravity = [
            RisingGravity(
                self.nodes, self.rigid_bodies, np.stack([m.gravity for m in models]),
                ProfileTable(profiles),
            )
        ] if profiles else []  # fmt: skip
        self.wall_contacts = self._wall_contacts(models)
        self.supports = self._supports(models)
        self.self_contacts = self._self_contacts(models)
        self.nodes.corner_forces.allocate(scenarios, self.nodes.count)
        self.rigid_bodies.allocate()

    def _contact(self, data: ContactData, obstacle: Any, friction: list[float]) -> SurfaceContact:
        return SurfaceContact(
            self.nodes, data.nodes, obstacle, data.penalty_stiffness, data.tangential_stiffness,
            data.damping, data.tangential_damping, np.array(friction),
            self.friction_memory, self.slip_length, self.return_times,
        )  # fmt: skip

    def _pressure(self, models: list[Model], k: int) -> FollowerPressure:
        load = models[0].pressures[k]
        drives = [m.pressures[k].drive for m in models]
        kind = FACETS[type(load.geometry)]
        facets, lids = (kind(self.nodes, f, load.geometry) for f in (load.facets, load.lids))
        return FollowerPressure(
            self.nodes, self.rigid_bodies, facets, lids, SOURCES[type(drives[0])](drives),
            OPEN if load.body is None else load.body,
        )  # fmt: skip

    def _tether(self, models: list[Model], k: int) -> Tether:
        tethers = [m.tethers[k] for m in models]
        body = tethers[0].body
        return Tether(
            self.rigid_bodies, body,
            np.stack([one.point for one in tethers]) - self.rigid_bodies.rest_centre[body],
            np.array([one.stiffness for one in tethers]),
            np.array([one.drag for one in tethers]),
            np.array([one.carried_mass for one in tethers]),
            np.stack([one.turning_stiffness for one in tethers]),
        )  # fmt: skip

    def _wall_contacts(self, models: list[Model]) -> list[SurfaceContact]:
        contact, friction = models[0].contact, [m.contact.friction_coefficient for m in models]
        if len(contact.nodes) == 0:
            return []
        places = models[0].points[contact.nodes]
        alike = zip(*(m.walls for m in models), strict=True)  # a wall of each scenario
        return [
            self._contact(contact, WALLS[type(walls[0])](walls, places), friction)
            for walls in alike
        ]

    def _supports(self, models: list[Model]) -> list[SurfaceContact]:
        supports = []
        for outlines in zip(*(m.outlines for m in models), strict=True):
            outline = outlines[0]
            if outline.support is None:
                continue
            friction = [o.support.friction_coefficient for o in outlines if o.support is not None]
            centre = outline.centre - self.rigid_bodies.rest_centre[outline.body]
            kind = OUTLINES[type(outline.shape)]
            obstacle = kind(self.rigid_bodies, outline.body, centre, outline.shape)
            contact = self._contact(outline.support, obstacle, friction)
            self.rigid_bodies.react(outline.body, contact.first_slot, outline.support.nodes)
            supports.append(contact)
        return supports

    def _self_contacts(self, models: list[Model]) -> list[SelfContact]:
        data = models[0].self_contact
        if data is None:
            return []
        contact = data.contact
        friction = [m.self_contact.contact.friction_coefficient for m in models if m.self_contact]
        surface = DeformableSurface(
            self.nodes, contact.nodes, data.facets, data.node_size, data.facet_size,
            data.node_part, data.facet_part,
        )  # fmt: skip
        return [
            SelfContact(
                surface, NeighbourLists(surface, *margin_and_room(data.facet_size)), contact.nodes,
                contact.penalty_stiffness, contact.tangential_stiffness, contact.damping,
                contact.tangential_damping, np.array(friction),
            )
        ]  # fmt: skip

    @property
    def contacts(self) -> list[SurfaceContact]:
        """Contact with walls, then with rigid outlines."""
        return self.wall_contacts + self.supports

    @property
    def working_loads(self) -> list[FollowerPressure | NodalForce | PrescribedMotion | Tether]:
        """Loads that book their own work."""
        return [*self.pressures, *self.nodal_forces, *self.prescribed, *self.tethers]

    @property
    def dissipators(self) -> list[Any]:
        """What books the energy that it dissipates."""
        return [*self.bodies, *self.contacts, *self.self_contacts, *self.tethers]

    @property
    def gauges(self) -> list[SurfaceContact | Tendon | Tether]:
        """What sums its impulses up for the history, which clears them."""
        return [*self.wall_contacts, *self.tendons, *self.tethers]

    def drift_stages(self) -> list[Stage]:
        """Everything moves by dt times its half-step velocity."""
        bodies = self.rigid_bodies
        return filled(
            [Pass("loads", motion.count, (motion.steer,)) for motion in self.prescribed],
            [
                Pass("integration", self.nodes.count, (self.nodes.drift,)),
                Pass("integration", bodies.count, (bodies.drift,)),
            ],
            [Pass("integration", bodies.tied_count, (bodies.place_tied,))],
        )

    def force_stages(self) -> list[Stage]:
        """Every force at the new positions, each into slots of its own."""
        rings = [rings for body in self.bodies for rings in body.rings]
        measured = [Pass("elements", r.blocks, (r.measure,)) for r in rings]
        pulled = [Pass("elements", r.blocks, (r.pull,)) for r in rings]
        moved = [Pass("elements", body.blocks, (body.deform,)) for body in self.bodies]
        pressed = [
            Pass("elements", body.pressure.cells_of_node.blocks, (body.press_nodes,))
            for body in self.bodies
        ]
        stressed = [Pass("elements", body.blocks, (body.stress_corners,)) for body in self.bodies]
        for pressure in self.pressures:
            if pressure.source.asks_volume:
                moved.append(Pass("loads", PARTS, (pressure.measure_volume,)))
            pressed.append(Pass("loads", 1, (pressure.follow_source,)))
            stressed.append(Pass("loads", pressure.count, (pressure.push_facets,)))
        for gravity in self.rising_gravity:
            measured.append(Pass("loads", 1, (gravity.follow,)))
            moved.append(Pass("loads", self.nodes.count, (gravity.miss_nodes,)))
            moved.append(Pass("loads", self.rigid_bodies.count, (gravity.miss_bodies,)))
        # Loads on rigid bodies add to each other, one after another.
        pulls = [rotor.pull for rotor in self.rotors] + [load.pull for load in self.rigid_forces]
        pulls += [load.pull for load in self.axial_reliefs]
        pulls += [tendon.pull for tendon in self.tendons]
        pulls += [tether.pull for tether in self.tethers]
        if pulls:
            moved.append(Pass("loads", 1, tuple(pulls)))
        moved += [Pass("loads", force.count, (force.push,)) for force in self.nodal_forces]
        moved += [Pass("contact", contact.count, (contact.push,)) for contact in self.contacts]
        listed: Stage = []
        borne: Stage = []
        for contact in self.self_contacts:
            lists = contact.lists
            moved.append(Pass("contact", PARTS, (lists.watch,)))
            pressed.append(Pass("contact", 1, (lists.sort,)))
            stressed.append(Pass("contact", PARTS, (lists.find_facets, contact.push)))
            listed.append(Pass("contact", 1, (lists.find_nodes,)))
            borne.append(Pass("contact", PARTS, (contact.bear,)))
        return filled(measured, moved, pressed, stressed, listed, borne, pulled)

    def kick_stages(self) -> list[Stage]:
        """New half-step velocities from the summed forces."""
        bodies = self.rigid_bodies
        blocks = self.nodes.corner_forces.of_node.blocks
        return filled(
            [Pass("integration", blocks, (self.nodes.kick,))],
            [Pass("integration", bodies.count * PARTS, (bodies.collect,))],
            [Pass("integration", bodies.count, (bodies.kick,))],
        )

    def shift_stages(self) -> list[Stage]:
        """Move half-step velocities by dt with the last forces: when the step changes."""
        return filled(
            [
                Pass("integration", self.nodes.count, (self.nodes.shift,)),
                Pass("integration", self.rigid_bodies.count, (self.rigid_bodies.shift,)),
            ]
        )

    def memory(self) -> dict[str, ti.Field]:
        """Every field that a checkpoint keeps, by a path-like name."""
        owners: dict[str, Any] = {"nodes": self.nodes, "rigid_bodies": self.rigid_bodies}
        listed = ("bodies", "pressures", "tendons", "tethers", "nodal_forces", "prescribed")
        for name in (*listed, "rising_gravity", "contacts", "self_contacts"):
            owners |= {f"{name}/{k}": term for k, term in enumerate(getattr(self, name))}
        return {
            f"{owner}/{name}": field
            for owner, term in owners.items()
            for name, field in term.memory().items()
        }


def starting_gravity(model: Model) -> np.ndarray:
    """Gravity (d,) [m/s^2] at t = 0."""
    profile = model.gravity_profile
    return model.gravity if profile is None else profile.at(0.0) * model.gravity


def filled(*stages: Stage) -> list[Stage]:
    """The stages without empty passes, and without those that have no other."""
    kept = [[p for p in stage if p.count] for stage in stages]
    return [stage for stage in kept if stage]
