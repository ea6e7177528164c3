"""The books of contact: a rigid body that swings on its springs and slides to a stop.

Its contacts never open, so every force is linear in the increment and the trapezoidal rule exact.
Central differences then keep the balance but for half a kick at either end: kinetic energy changes
by the trapezoidal work and (f_n^2 - f_0^2) dt^2 / 8 m, to round-off.
"""

import numpy as np
import pytest

from softsim.compute import fields

MASS = 10e-3
SCENE = f"""
bodies:
  far: {{mesh: {{generator: block, length: 100 mm, height: 100 mm, element_size: 100 mm}},
        formulation: plane_strain, thickness: 1 mm, material: soft, position: [1 m, 1 m],
        fixed: [surface]}}
materials: {{soft: {{law: neo_hooke, C10: 1 kPa, density: 100 kg/m^3}}}}
rigid_bodies:
  slider: {{mass: {MASS} kg, inertia: 1 kg*mm^2, center: [0 mm, 10 mm], free: [x, y],
           outline: {{length: 40 mm, height: 20 mm}}, initial_velocity: [50 mm/s, 10 mm/s]}}
environment: {{walls: {{floor: {{kind: plane}}}}}}
contact: {{penalty_stiffness: 1 N/mm, damping_ratio: 0.3, friction_coefficient: 0.4}}
time: {{end: 1 s, settle: 10 s}}
"""


@pytest.mark.parametrize(
    "overrides",
    [
        [],
        ["contact.damping_ratio=1.0"],
        ["contact.tangential_damping_fraction=0"],
        ["contact.friction_memory=5 ms"],
        ["contact.tangential_stiffness_ratio=0.2", "contact.damping_ratio=0.05"],
    ],
    ids=lambda given: given[0].removeprefix("contact.") if given else "default",
)
def test_friction_and_dashpots_are_booked_exactly(build, start_settled, overrides):
    from softsim.solver.energy import EnergyReader

    model = build(SCENE, *overrides)
    solver = start_settled(model)
    solver.change_time_increment(0.3 * solver.time_increment)
    reader, bodies = EnergyReader(solver), solver.terms.rigid_bodies
    walls = solver.terms.wall_contacts[0]

    def state():
        return reader.read(), fields.read(bodies.force)[0, 0]

    start, first_force = state()
    factor = solver.time_increment**2 / (8.0 * MASS)
    for _ in range(60):
        solver.advance(20)
        now, force = state()
        missed = factor * (force @ force - first_force @ first_force)
        assert now.balance - start.balance == pytest.approx(missed, abs=1e-12 * start.kinetic)
        assert fields.read(walls.normal_force)[0].max() > 0.0
    assert now.friction_dissipation > 0.5 * start.kinetic
    assert now.viscous_dissipation > 0.0
    assert fields.read(walls.damping_dissipation).min() >= 0.0
    assert np.all(fields.read(walls.friction_dissipation) >= 0.0)
