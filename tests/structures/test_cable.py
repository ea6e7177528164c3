"""A cable's forces, energy and stiffness bound, at arbitrary places."""

import numpy as np
import pytest

from softsim.compute import fields
from softsim.rigid import in_space
from softsim.solver.explicit import ExplicitSolver

FAR = """
bodies:
  far: {{mesh: {{generator: {generator}, element_size: 100 mm}},
        formulation: {formulation}, material: soft, position: [1 m, 1 m]}}
materials: {{soft: {{law: neo_hooke, C10: 10 Pa, density: 1000 kg/m^3}}}}
environment: {{gravity: 0 m/s^2}}
time: {{end: 1 s}}
cables:
  tail: {{points: [[0 mm, 0 mm], [60 mm, 0 mm]], segment_length: 10 mm, diameter: 2 mm,
         mass_per_length: 2.4 g/m, stretching_stiffness: 60 N, bending_stiffness: 20 N*mm^2}}
"""
PLANE = FAR.format(
    generator="block, length: 100 mm, height: 100 mm", formulation="plane_strain, thickness: 1 mm"
)
SPACE = FAR.format(
    generator="box, length: 100 mm, height: 100 mm, width: 100 mm", formulation="solid"
)


@pytest.mark.parametrize("scene", [PLANE, SPACE])
def test_forces_are_the_slopes_of_the_energy_and_keep_momentum(build, fresh_taichi, scene):
    """At places off the line by up to a third of a segment: bends of up to 90 deg."""
    from softsim.solver.energy import EnergyReader

    model = build(scene)
    solver = ExplicitSolver([model])
    reader = EnergyReader(solver)
    nodes = model.structures[0].nodes
    random = np.random.default_rng(3)
    x = model.points.copy()
    x[nodes] += random.uniform(-4e-3, 4e-3, x[nodes].shape)

    def energy(places):
        fields.write(solver.terms.nodes.position, places[None])
        reader.update()
        return reader.of_scenario(0).internal

    fields.write(solver.terms.nodes.position, x[None])
    solver.find_forces(1e-6)
    forces = fields.read(solver.terms.nodes.force)[0]
    assert np.abs(forces[nodes].sum(axis=0)).max() < 1e-12 * np.abs(forces).max()
    moments = np.cross(in_space(x[nodes]), in_space(forces[nodes])).sum(axis=0)
    assert np.abs(moments).max() < 1e-12 * np.abs(forces).max()
    for node in nodes:
        for axis in range(model.dimension):
            step = np.zeros_like(x)
            step[node, axis] = 1e-8
            slope = (energy(x + step) - energy(x - step)) / 2e-8
            assert forces[node, axis] == pytest.approx(-slope, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("scene", [PLANE, SPACE])
def test_the_stiffness_bound_holds_however_it_is_bent(build, fresh_taichi, scene):
    """No direction is stiffer than the bound says; straight, the stiffest is nearly as stiff."""
    model = build(scene)
    solver = ExplicitSolver([model])
    (cable,), random = model.structures, np.random.default_rng(5)
    nodes = cable.nodes
    moved = np.eye(len(nodes) * model.dimension).reshape(-1, len(nodes), model.dimension)

    def forces(places):
        fields.write(solver.terms.nodes.position, places[None])
        solver.find_forces(1e-6)
        return fields.read(solver.terms.nodes.force)[0, nodes].ravel()

    def stiffness(x):
        found = []
        for direction in moved:
            step = np.zeros_like(x)
            step[nodes] = 1e-8 * direction
            found.append((forces(x - step) - forces(x + step)) / 2e-8)
        return np.array(found)

    def bound(x):
        whole = np.zeros((len(nodes), len(nodes)))
        for part in cable.stiffness_bound(x):
            for a, row in enumerate(part.nodes - nodes[0]):
                for b, column in enumerate(part.nodes - nodes[0]):
                    np.add.at(whole, (row, column), part.values[a, b])
        return np.kron(whole, np.eye(x.shape[1]))

    scale = cable.spring_stiffness.max()
    for spread in (0.0, 1e-3, 3e-3, 6e-3):
        x = model.points.copy()
        x[cable.nodes] += spread * random.uniform(-1.0, 1.0, x[cable.nodes].shape)
        least = np.linalg.eigvalsh(bound(x) - stiffness(x))[0]
        assert least > -1e-5 * scale
    straight = model.points
    bounded, found = (np.linalg.eigvalsh(m(straight))[-1] for m in (bound, stiffness))
    assert found <= bounded < 1.02 * found
