"""The recipe of docs/developers/recipes.md: a load that nothing but its own file knows.

Viscous drag -c v on a rigid body. Alone it slows a body down as v0 exp(-c t / m); what it takes is
dissipated, m v0^2/2 (1 - exp(-2 c t / m)).
"""

import dataclasses
from typing import ClassVar

import numpy as np
import pytest

from softsim.compute import fields

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

        def term(self, alike, nodes, rigid_bodies):
            return DragTerm(rigid_bodies, np.array([load.coefficient for load in alike]))

    class DragTerm(Term):
        def __init__(self, rigid_bodies, coefficients):
            self.rigid_bodies = rigid_bodies
            self.coefficient = real_field(coefficients)
            self.dissipation, self.force = (real_field(np.zeros(len(coefficients))) for _ in "df")

        def pulls(self):
            return [self.pull]

        def state_fields(self):
            return {"dissipation": self.dissipation, "force": self.force}

        def readings(self, scenario, interval):
            return {"drag": float(fields.read(self.force)[scenario])}

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
