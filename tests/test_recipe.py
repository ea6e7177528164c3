"""Recipes of docs/developers/recipes.md: a load and a structure that no file of softsim names.

The load is viscous drag -c v on a rigid body. Alone it slows a body down as v0 exp(-c t / m); the
dissipated energy is m v0^2/2 (1 - exp(-2 c t / m)). The structure is a spring between two nodes
with the force k e + k_3 e^3.
"""

import dataclasses
from typing import ClassVar

import numpy as np
import pytest

SCENE = """
bodies:
  far: {mesh: {generator: block, length: 1 mm, height: 1 mm, element_size: 1 mm},
        formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10, fixed: [surface]}
rigid_bodies: {slider: {mass: 2 g, inertia: 1 g*mm^2, initial_velocity: [0.3 m/s, 0 m/s]}}
environment: {gravity: 0 m/s^2}
time: {end: 1 s}
"""
MASS, SPEED = 2e-3, 0.3


def drag_load(coefficients):
    """The load's own file, for scenarios with these c [N s/m]."""
    import taichi as ti

    from softsim.compute import backend
    from softsim.compute.fields import once, real_field
    from softsim.compute.term import PerScenario, Term
    from softsim.loads.load import Load

    @dataclasses.dataclass(frozen=True, eq=False)
    class Drag(Load):
        coefficient: PerScenario[float]
        columns: ClassVar[dict[str, str]] = {"drag": "N"}

        def term(self, scenarios, nodes, rigid_bodies):
            return DragTerm(rigid_bodies, np.array([load.coefficient for load in scenarios]))

    class DragTerm(Term):
        def __init__(self, rigid_bodies, coefficients):
            self.rigid_bodies = rigid_bodies
            self.coefficient = real_field(coefficients)
            self.dissipation, self.force = (real_field(np.zeros(len(coefficients))) for _ in "df")

        def pulls(self):
            return [self.pull]

        def state_fields(self):
            return {"dissipation": self.dissipation, "force": self.force}

        def sampled(self):
            return [self.force]

        def readings(self, samples):
            return {"drag": samples.read(self.force)}

        @ti.func
        def pull(self, s, i, t, dt):
            v = self.rigid_bodies.velocity[s, 0]
            force = -self.coefficient[s] * v
            self.rigid_bodies.hold(s, 0, force)
            self.dissipation[s] = self.dissipation[s] - 0.5 * dt * (self.force[s] + force[0]) * v[0]
            self.force[s] = force[0]

        @ti.func
        def dissipated_energy(self, s, part):
            return once(part) * ti.Vector([ti.cast(0.0, backend.real), self.dissipation[s]])

    return [Drag(c) for c in coefficients]


@pytest.mark.starts(1)
def test_a_load_of_ones_own(build, fresh_taichi):
    """In two scenarios; checkpoint, energy and history know it."""
    from softsim.output.observation import Observer, columns
    from softsim.solver.energy import EnergyBalance, EnergyReader
    from softsim.solver.explicit import ExplicitSolver

    plain, coefficients = build(SCENE), (0.01, 0.04)
    models = [dataclasses.replace(plain, loads=(load,)) for load in drag_load(coefficients)]
    assert models[0].can_share(models[1])
    assert columns(models[0])["drag"] == "N"
    solver = ExplicitSolver(models)
    solver.begin(1e-5)
    reader = EnergyReader(solver)
    balances = [EnergyBalance.starting(reader.read(s), models[s]) for s in range(2)]
    solver.advance(10_000)
    reader.update()
    for s, c in enumerate(coefficients):
        decay = np.exp(-c * solver.times[s] / MASS)
        seen = Observer(solver.scenario(s), reader, balances[s]).observe(1e-2)
        assert seen.row["drag"] == pytest.approx(-c * SPEED * decay, rel=1e-3)
        lost = 0.5 * MASS * SPEED**2 * (1.0 - decay**2)
        assert seen.energies.viscous_dissipation == pytest.approx(lost, rel=1e-3)
        assert seen.row["energy_error"] < 1e-3
    assert {"loads/0/dissipation", "loads/0/force"} <= solver.state().keys()


BLOCKS = """
bodies:
  held: {mesh: {generator: block, length: 2 mm, height: 2 mm, element_size: 2 mm},
         formulation: plane_strain, thickness: 2 mm, material: dragon_skin_10, fixed: [left]}
  free: {mesh: {generator: block, length: 2 mm, height: 2 mm, element_size: 2 mm},
         formulation: plane_strain, thickness: 2 mm, material: dragon_skin_10,
         position: [6 mm, 0 mm]}
environment: {gravity: 0 m/s^2}
time: {end: 1 s}
"""
NODES, LINEAR, CUBIC = (1, 4), 1e5, 4e10  # N/m, N/m^3


def cubic_spring(length):
    """Return the structure: everything that its own file would hold."""
    import scipy.sparse as sp
    import taichi as ti

    from softsim.compute import backend
    from softsim.compute.fields import once, real_field
    from softsim.compute.term import Pass, Stage, Term
    from softsim.structures.structure import NodalStiffness, Structure

    @dataclasses.dataclass(frozen=True, eq=False)
    class Spring(Structure):
        name: str
        ends: np.ndarray
        length: float
        kind: ClassVar[str] = "spring"
        columns: ClassVar[dict[str, str]] = {"spring_force": "N"}

        @property
        def title(self):
            return f"spring '{self.name}'"

        def term(self, scenarios, nodes, rigid_bodies):
            return SpringTerm(nodes, self)

        def elongation(self, x):
            first, second = self.ends
            return np.linalg.norm(x[second] - x[first]) - self.length

        def stiffness_bound(self, x):
            stiffness = LINEAR + 3.0 * CUBIC * self.elongation(x) ** 2  # that across is less
            apart = np.array([[1.0, -1.0], [-1.0, 1.0]])[:, :, None]
            return [NodalStiffness(self.title, self.ends[:, None], stiffness * apart)]

        def shape_measures(self, x):
            return np.array([3.0 * CUBIC * self.elongation(x) ** 2 / LINEAR])

        def rest_stiffness(self, points):
            t = np.zeros(points.shape)
            t[self.ends[1]] = (points[self.ends[1]] - points[self.ends[0]]) / self.length
            t[self.ends[0]] = -t[self.ends[1]]
            column = sp.csr_matrix(t.reshape(-1, 1))
            return (LINEAR * column @ column.T).tocsr()

        def lines(self, x):
            return {"fibres": [x[self.ends]]}

        def description(self):
            return {self.title: f"{self.length * 1e3:.4g} mm"}

        def warnings(self, points):
            return {"spring": "this spring is very stiff"}

    class SpringTerm(Term):
        def __init__(self, nodes, spring):
            self.nodes, self.ends, self.length = nodes, tuple(map(int, spring.ends)), spring.length
            self.first_slot = nodes.corner_forces.reserve(spring.ends[None])
            self.impulse = real_field(np.zeros(nodes.scenarios))

        def passes(self):
            return {Stage.MOVE: [Pass("springs", 1, (self.pull,))]}

        def state_fields(self):
            return {"impulse": self.impulse}

        def impulses(self):
            return [self.impulse]

        def sampled(self):
            return [self.impulse]

        def readings(self, samples):
            return {"spring_force": samples.mean(samples.read(self.impulse))}

        @ti.func
        def vector(self, s):
            return self.nodes.position[s, self.ends[1]] - self.nodes.position[s, self.ends[0]]

        @ti.func
        def pull(self, s, i, t, dt):
            e = self.vector(s).norm() - self.length
            tension = LINEAR * e + CUBIC * e * e * e
            force = tension * self.vector(s).normalized()
            self.nodes.corner_forces.write(s, self.first_slot, force)
            self.nodes.corner_forces.write(s, self.first_slot + 1, -force)
            self.impulse[s] = self.impulse[s] + tension * dt

        @ti.func
        def stored_energy(self, s, part):
            e = self.vector(s).norm() - self.length
            energy = 0.5 * LINEAR * e * e + 0.25 * CUBIC * e * e * e * e
            return ti.cast(once(part), backend.real) * energy

    return Spring("link", np.array(NODES), length)


@pytest.mark.starts(1)
def test_a_structure_of_ones_own(build, fresh_taichi):
    """Force, energy, stable step, checkpoint, history, modes, figure and warnings know it."""
    from softsim.cli.run_tables import model_table
    from softsim.compute import fields
    from softsim.output.observation import Observer, columns, description, line_places
    from softsim.solver.energy import EnergyBalance, EnergyReader
    from softsim.solver.explicit import ExplicitSolver
    from softsim.solver.natural_modes import structure_stiffness
    from softsim.solver.plausibility import plausibility_warnings
    from softsim.solver.stable_step import stable_step

    plain = build(BLOCKS)
    points, ends = plain.points, np.array(NODES)
    spring = cubic_spring(float(np.linalg.norm(np.diff(points[ends], axis=0))))
    model = dataclasses.replace(plain, structures=(spring,))
    assert columns(model)["spring_force"] == "N"
    assert plausibility_warnings(model)["spring"] == "this spring is very stiff"
    assert "spring 'link'" in [text for row in model_table(model).rows for text in row]
    np.testing.assert_array_equal(line_places(model, points)["fibres"], points[ends])
    assert description(model, "")["fibre_starts"].tolist() == [0]
    K = structure_stiffness(model, model.bodies[1]).toarray()  # the other end counts as held
    assert K.max() == pytest.approx(LINEAR)
    found = stable_step(model, points)
    assert "spring 'link'" in found.limit and found.value < 0.5 * stable_step(plain, points).value

    solver = ExplicitSolver([model])
    reader = EnergyReader(solver)
    x = points.copy()
    x[model.bodies[1].nodes] += [2e-3, 0.5e-3]

    def energy(places):
        fields.write(solver.terms.nodes.position, places[None])
        solver.find_forces(1e-9)
        return reader.read(0).internal

    slope = np.zeros(x.shape)
    for k, axis in np.ndindex(x.shape):
        step = np.zeros(x.shape)
        step[k, axis] = 1e-9
        slope[k, axis] = (energy(x + step) - energy(x - step)) / 2e-9
    fields.write(solver.terms.nodes.position, x[None])
    solver.find_forces(1e-9)
    forces = fields.read(solver.terms.nodes.force)[0]
    np.testing.assert_allclose(forces[ends[0]], -slope[ends[0]], rtol=1e-6)  # at rest but for it
    assert np.abs(forces.sum(axis=0)).max() < 1e-12 * np.abs(forces).max()

    fields.write(solver.terms.nodes.position, points[None])
    solver.begin(0.2 * found.value)
    velocity = np.zeros((1, *points.shape))
    velocity[0, model.bodies[1].nodes, 0] = 0.1
    fields.write(solver.terms.nodes.velocity, velocity)
    balance = EnergyBalance.starting(reader.read(0), model)
    solver.advance(500)
    state, clock = solver.state(), (solver.time, solver.increment_count)
    assert "structures/0/impulse" in state
    solver.clear_impulses(0)
    solver.advance(1)
    reader.update()
    row = Observer(solver.scenario(0), reader, balance).observe(solver.time - clock[0]).row
    e = spring.elongation(solver.scenario(0).positions())
    assert row["spring_force"] == pytest.approx(LINEAR * e + CUBIC * e**3, rel=1e-6)
    assert row["energy_error"] < 5e-3
    solver.advance(500)
    ahead = solver.state()
    solver.restore(state, *clock, solver.time_increment)
    solver.clear_impulses(0)
    solver.advance(1)
    solver.advance(500)
    for name, array in solver.state().items():
        np.testing.assert_array_equal(array, ahead[name])
