"""Taichi terms of a model, and the stages of passes that compute their forces.

Passes of a stage may run in parallel; `Stage` (compute/term.py) orders the stages. The integrator
(explicit.py) adds those that move nodes and bodies.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import taichi as ti

from softsim.compute.mass_scaling import ScaledNodes
from softsim.compute.nodes import Nodes
from softsim.compute.term import Pass, Stage, Term
from softsim.contact.adhesion import Adhesion
from softsim.contact.corner_contact import CornerContact, CornerSurface
from softsim.contact.deformable_surface import DeformableSurface
from softsim.contact.forces import WallFriction
from softsim.contact.neighbour_lists import NeighbourLists, margin_and_room
from softsim.contact.self_contact import SelfContact
from softsim.contact.surface_contact import ContactData, SurfaceContact
from softsim.contact.wall import FixedFrame, Obstacle, OffsetWall, Wall
from softsim.elements.geometry import joined_regions
from softsim.model import LOCAL_DAMPING, CornerData, Model
from softsim.rigid import BodyFrame, RigidBodies
from softsim.solver.guards import return_time

Passes = list[Pass]
"""Passes of one stage, which do not need each other's results and may run in parallel."""

WallContact = SurfaceContact | CornerContact
"""Contact of nodes with a wall, or of the corners of a wall with facets."""


class Terms:
    """All Taichi objects of a model; `models`: its scenarios (one mesh, different parameters)."""

    def __init__(self, models: list[Model]) -> None:
        model, scenarios = models[0], len(models)
        scaling = model.mass_scaling
        self.nodes = (Nodes if scaling is None else partial(ScaledNodes, scaling))(
            np.broadcast_to(model.points, (scenarios, *model.points.shape)),
            np.stack([m.velocity for m in models]),
            model.mass,
            model.is_free,
            np.stack([m.starting_gravity for m in models]),
            np.array([0.0 if m.relaxation is None else LOCAL_DAMPING for m in models]),
            any(m.relaxation is not None or m.settling is not None for m in models),
        )
        self.rigid_bodies = RigidBodies(self.nodes, list(model.rigid_bodies), model.points)
        self.elements = [
            r.geometry.elements(self.nodes, r, model.bulk_viscosity)
            for r in joined_regions(model.regions, model.points)
        ]
        self.structures = [
            of_scenarios[0].term(of_scenarios, self.nodes, self.rigid_bodies)
            for of_scenarios in zip(*(m.structures for m in models), strict=True)
        ]
        self.loads = [
            of_scenarios[0].term(of_scenarios, self.nodes, self.rigid_bodies)
            for of_scenarios in zip(*(m.loads for m in models), strict=True)
        ]
        by_name = dict(zip(model.named_loads, self.loads, strict=False))
        for load in self.loads:
            load.connect(by_name)
        self.friction_memory = np.array([m.friction_memory for m in models])
        self.slip_length = np.array([m.friction_slip_length for m in models])
        self.return_times = np.array([return_time(m) for m in models])
        self.node_contacts: list[SurfaceContact] = []  # of the bodies' nodes, one for each wall
        self.corner_contacts: list[CornerContact] = []
        self.frames: list[FixedFrame] = []  # of the walls, some of which move
        self.contacts_by_wall = self._contacts_by_wall(models)
        self.supports = self._supports(models)
        self.structure_contacts = self._structure_contacts(models)
        self.self_contacts = self._self_contacts(models)
        ties = [m.ties for m in models]
        self.ties = (  # their slots are the last
            [model.ties.term(ties, self.nodes, self.rigid_bodies)] if len(model.ties.nodes) else []
        )
        self.nodes.corner_forces.allocate(scenarios, int(self.nodes.count))
        self.rigid_bodies.allocate()
        for tie in self.ties:
            tie.find_slots()

    def _contact(
        self, data: ContactData, obstacle: Obstacle, frame: FixedFrame, friction: list[float],
        adhesions: Sequence[Adhesion] = (),
    ) -> SurfaceContact:  # fmt: skip
        return SurfaceContact(
            self.nodes, data.nodes, obstacle, frame, data.penalty, self._friction(friction),
            self.return_times, adhesions,
        )  # fmt: skip

    def _friction(self, coefficients: list[float]) -> WallFriction:
        return WallFriction(np.array(coefficients), self.friction_memory, self.slip_length)

    def _contacts_by_wall(self, models: list[Model]) -> list[list[WallContact]]:
        contact, friction = models[0].contact, [m.contact.friction_coefficient for m in models]
        if len(contact.nodes) == 0:
            return []
        result: list[list[WallContact]] = []
        for number, walls in enumerate(zip(*(m.walls for m in models), strict=True)):
            of_scenarios = [m.adhesions[number] for m in models]  # all None, or none
            adhesions = [adhesion for adhesion in of_scenarios if adhesion is not None]
            of_nodes = self._wall_contact(models[0], contact, walls, friction, adhesions)
            self.node_contacts.append(of_nodes)
            result.append([of_nodes])
            if models[0].corners is not None and any(len(wall.corners()) for wall in walls):
                of_corners = self._corner_contact(
                    models[0].corners, contact, walls, of_nodes.frame, friction
                )
                self.corner_contacts.append(of_corners)
                result[-1].append(of_corners)
        return result

    def _wall_contact(
        self, model: Model, contact: ContactData, walls: Sequence[Wall], friction: list[float],
        adhesions: Sequence[Adhesion] = (),
    ) -> SurfaceContact:  # fmt: skip
        obstacle = walls[0].obstacle(walls, model.points[contact.nodes])
        frame = walls[0].frame(walls)
        self.frames.append(frame)
        return self._contact(contact, obstacle, frame, friction, adhesions)

    def _corner_contact(
        self, data: CornerData, contact: ContactData, walls: Sequence[Wall], frame: FixedFrame,
        friction: list[float],
    ) -> CornerContact:  # fmt: skip
        corners = [wall.corners() for wall in walls]
        surface = CornerSurface(self.nodes, data.facets, data.facet_size, frame, corners)
        margin, longest, room = margin_and_room(data.facet_size, self.nodes.dimension)
        lists = NeighbourLists(surface, margin, longest, room * int(np.ceil(data.together)))
        return CornerContact(surface, lists, contact.nodes, data.penalty, self._friction(friction))

    def _structure_contacts(self, models: list[Model]) -> list[SurfaceContact]:
        """Return the contact of each structure with each wall."""
        result = []
        for of_scenarios in zip(*(m.structures for m in models), strict=True):
            contacts = [c for c in (one.wall_contact for one in of_scenarios) if c is not None]
            if not contacts:
                continue
            friction = [contact.friction_coefficient for contact in contacts]
            for walls in zip(*(m.walls for m in models), strict=True):
                offset = [OffsetWall(wall, of_scenarios[0].radius) for wall in walls]
                result.append(self._wall_contact(models[0], contacts[0], offset, friction))
        return result

    def _supports(self, models: list[Model]) -> list[SurfaceContact]:
        supports = []
        for outlines in zip(*(m.outlines for m in models), strict=True):
            outline = outlines[0]
            if outline.support is None:
                continue
            friction = [o.support.friction_coefficient for o in outlines if o.support is not None]
            origin, places = self.rigid_bodies.rest_centre[outline.body], outline.support.nodes
            shapes = [replace(o.shape, centre=o.shape.centre - origin) for o in outlines]
            obstacle = shapes[0].obstacle(shapes, models[0].points[places] - origin)
            frame = BodyFrame(self.rigid_bodies, outline.body)
            contact = self._contact(outline.support, obstacle, frame, friction)
            self.rigid_bodies.react(outline.body, contact.first_slot, outline.support.nodes)
            supports.append(contact)
        return supports

    def _self_contacts(self, models: list[Model]) -> list[SelfContact]:
        data = models[0].self_contact
        if data is None:
            return []
        of_scenarios = [m.self_contact for m in models if m.self_contact]
        friction = [each.friction_coefficient for each in of_scenarios]
        adhesions = [each.adhesion for each in of_scenarios if each.adhesion is not None]
        surface = DeformableSurface(self.nodes, data)
        lists = NeighbourLists(surface, *margin_and_room(data.facet_size, self.nodes.dimension))
        return [
            SelfContact(surface, lists, data.nodes, data.penalty, np.array(friction), adhesions)
        ]

    @property
    def wall_contacts(self) -> list[WallContact]:
        """Contact of the bodies' surfaces with walls: of nodes, and of the walls' corners."""
        return [contact for of_wall in self.contacts_by_wall for contact in of_wall]

    @property
    def contacts(self) -> list[WallContact]:
        """Contact with walls, then with rigid outlines, then of structures with walls."""
        return [*self.wall_contacts, *self.supports, *self.structure_contacts]

    @property
    def listing(self) -> list[SelfContact]:
        """Contact that uses neighbour lists."""
        return [*self.corner_contacts, *self.self_contacts]

    @property
    def inner(self) -> list[Term]:
        """Terms whose stored energy is internal: elements, structures and loads."""
        return [*self.elements, *self.structures, *self.loads]

    @property
    def touching(self) -> list[Term]:
        """Contact of all kinds, whose stored energy is contact energy."""
        return [*self.contacts, *self.self_contacts]

    @property
    def everything(self) -> list[Term]:
        """All terms that exert or transfer forces."""
        return [*self.inner, *self.touching, *self.ties]

    def force_stages(self) -> list[Passes]:
        """Return the stages that compute every force at the new positions.

        Each force has slots of its own; loads on rigid bodies are added one after another.
        """
        stages = {stage: self.passes_of(stage) for stage in Stage if stage is not Stage.STEER}
        pulls = tuple(pull for load in self.loads for pull in load.pulls())
        if pulls:
            stages[Stage.MOVE].append(Pass("loads", 1, pulls))
        return filled(*stages.values())

    def passes_of(self, stage: Stage) -> Passes:
        """Return the passes of all terms in a stage."""
        return [p for term in self.everything for p in term.passes().get(stage, [])]

    def state_fields(self) -> dict[str, ti.Field]:
        """Return all fields that a checkpoint stores, by a path-like name."""
        owners: dict[str, Any] = {"nodes": self.nodes, "rigid_bodies": self.rigid_bodies}
        for name in ("elements", "structures", "loads", "contacts", "self_contacts"):
            owners |= {f"{name}/{k}": term for k, term in enumerate(getattr(self, name))}
        return {
            f"{owner}/{name}": field
            for owner, term in owners.items()
            for name, field in term.state_fields().items()
        }


def filled(*stages: Passes) -> list[Passes]:
    """Return the stages without empty passes, and without stages that have only empty ones."""
    kept = [[p for p in stage if p.count] for stage in stages]
    return [stage for stage in kept if stage]
