"""Self-contact of a model alone, without its elements: for tests of its forces."""

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.nodes import PARTS
from softsim.solver.explicit import ExplicitSolver

# Two blocks, half a millimetre of air between them, their nodes not opposite each other.
PLANE = """
bodies:
  lower: {mesh: {generator: block, length: 8 mm, height: 2 mm, element_size: 1 mm},
          formulation: plane_strain, thickness: 5 mm, material: soft}
  upper: {mesh: {generator: block, length: 6 mm, height: 2 mm, element_size: 1 mm},
          formulation: plane_strain, thickness: 5 mm, material: soft,
          position: [0.3 mm, 2.5 mm]}
materials: {soft: {law: yeoh, C10: 36 kPa, density: 1000 kg/m^3}}
environment: {gravity: 0 m/s^2}
contact: {self_contact: [lower, upper], friction_coefficient: 0.4, damping_ratio: 0.1}
time: {end: 1 s}
"""
SPACE = (
    PLANE.replace("length: 8 mm", "length: 4 mm")
    .replace("length: 6 mm", "length: 2 mm")
    .replace("generator: block", "generator: box, width: 2 mm")
    .replace("formulation: plane_strain, thickness: 5 mm", "formulation: solid")
    .replace("[0.3 mm, 2.5 mm]", "[1.3 mm, 2.5 mm, 0.4 mm]")
)


@ti.data_oriented
class SurfaceRig:
    """A model whose nodes are put somewhere, and what its surfaces then do to each other."""

    def __init__(self, model) -> None:
        self.model = model
        self.terms = ExplicitSolver([model]).terms
        self.contact = self.terms.self_contacts[0]
        self.lists = self.contact.lists

    def place(self, x, v=None, dt=1e-12):
        """Forces (n, d) [N] with all nodes at x (n, d) [m] and velocities v [m/s]."""
        nodes = self.terms.nodes
        fields.write(nodes.position, np.ascontiguousarray(x[None]))
        fields.write(nodes.velocity, np.zeros((1, *x.shape)) if v is None else v[None])
        fields.write(self.lists.due, 0.0)  # nodes are put anywhere, without a velocity
        self._find(dt)
        members = self.model.self_contact.nodes
        slots = slice(self.contact.first_slot, self.contact.first_slot + len(members))
        forces = np.zeros_like(x)
        for k, component in enumerate(nodes.corner_forces.component):
            forces[members, k] = fields.read(component)[0, slots]
        return forces

    def energy(self) -> float:
        """Energy in the springs and of adhesion [J]."""
        return self._stored()

    @ti.kernel
    def _stored(self) -> ti.f64:
        total = 0.0
        for _ in range(1):
            for part in range(backend.device().parts):
                total += self.contact.stored_energy(0, part)
        return total

    @property
    def facets(self):
        """Facet that each point touches (k,), or -1."""
        return fields.read(self.contact.facet)[0]

    @ti.kernel
    def _find(self, dt: ti.f64):
        for p in range(PARTS):
            self.lists.watch(0, p, 0.0, dt)
        for p in range(1):
            self.lists.sort(0, p, 0.0, dt)
        for p in range(PARTS):
            self.lists.find_facets(0, p, 0.0, dt)
            self.contact.push(0, p, 0.0, dt)
        for p in range(1):
            self.lists.find_nodes(0, p, 0.0, dt)
        for p in range(PARTS):
            self.contact.gather_facet_reactions(0, p, 0.0, dt)


def pressed_together(model, depth):
    """Places with the upper body moved down until it is `depth` [m] inside the lower one."""
    x = model.points.copy()
    x[model.bodies[1].nodes, 1] -= 0.5e-3 + depth
    return x


def crumpled(model, depth):
    """The same with every node off its place, so that the facets are no longer in line."""
    noise = np.random.default_rng(3).standard_normal(model.points.shape)
    return pressed_together(model, depth) + 0.15 * depth * noise
