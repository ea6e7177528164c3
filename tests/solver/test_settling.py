"""A settled start: what has come to rest before t = 0, and what has not happened before it."""

import io

import numpy as np
import pytest
from rich.console import Console

from softsim.compute import fields
from softsim.errors import SceneError, StabilityError

INCLINE = """
bodies:
  block: {mesh: {generator: block, length: 10 mm, height: 6 mm, element_size: 2 mm},
          formulation: plane_strain, thickness: 10 mm, material: dragon_skin_30,
          position: [0 mm, 0.1 mm]}
environment: {inclination: 15 deg, walls: {floor: {kind: plane}}}
loads:
  push: {kind: nodal_force, nodes: block.top, force: [0 mN, 0 mN]}
time: {end: 1 s, settle: 1 s}
"""
PUSHED, THROWN = 1, 2  # numbers of scenarios
PUSH, SPEED = 20e-3, 0.05  # N, m/s


@pytest.fixture
def blocks(build, start_settled):
    """A block alone, one that is pushed from t = 0 on, one that starts with a velocity."""
    return start_settled(
        build(INCLINE),
        build(INCLINE, f"loads.push.force=[{PUSH} N, 0 N]"),
        build(INCLINE, f"bodies.block.initial_velocity=[{SPEED} m/s, 0 m/s]"),
    )


@pytest.mark.starts(1)
def test_a_block_above_an_incline_settles(blocks):
    """At t = 0 forces balance, nothing moves, books are empty, and so it stays."""
    from softsim.solver.energy import EnergyReader, unbalanced_share

    solver, reader = blocks, EnergyReader(blocks)
    model = solver.models[0]
    weight = model.mass.sum() * np.linalg.norm(model.gravity)
    assert solver.time == 0.0
    assert unbalanced_share(solver.scenario(0)) <= 1e-6
    settled = solver.positions()[0]
    assert settled[model.bodies[0].node_sets["bottom"], 1].max() < 0.0
    energies = reader.read()
    assert energies.internal > 0.0
    assert energies.friction_dissipation == 0.0
    assert abs(energies.viscous_dissipation) < 1e-6 * energies.internal  # round-off of ln det A
    # It would fall by 0.1 mm; a millionth of that energy is what may move.
    tiny = 1e-6 * weight * 0.1e-3
    moving, still = [], np.array([1, 0, 0])
    for _ in range(50):
        solver.advance(100 * still)
        moving.append(reader.read().kinetic)
    assert max(moving) < tiny
    assert np.abs(solver.positions()[0] - settled).max() < 1e-8
    # Branches have relaxed: they hold nothing that they could lose.
    assert reader.read().internal == pytest.approx(energies.internal, rel=1e-5)


def test_loads_have_done_nothing_before_zero(blocks):
    """The pushed block stands where the other one does, to the bit, and its load has done no work;
    then it acts, and its books close.
    """
    from softsim.solver.energy import EnergyBalance, EnergyReader

    solver, reader = blocks, EnergyReader(blocks)
    x = solver.positions()
    np.testing.assert_array_equal(x[PUSHED], x[0])
    weight_only, before = reader.read(), reader.read(PUSHED)
    assert before.external_work == weight_only.external_work
    assert before.internal == weight_only.internal
    balance = EnergyBalance.starting(before, solver.models[PUSHED])
    solver.advance(np.array([0, 4000, 0]))
    after = reader.read(PUSHED)
    assert after.external_work > before.external_work
    assert solver.positions()[PUSHED][:, 0].mean() > x[0, :, 0].mean()
    assert balance.error(after) < 0.005


def test_initial_velocities_wait_for_zero(blocks):
    """The thrown block stands where the other one does, and then moves with its velocity, of which
    the first half kick is all that has changed.
    """
    solver = blocks
    x, v = solver.positions(), fields.read(solver.terms.nodes.velocity)[THROWN]
    np.testing.assert_array_equal(x[THROWN], x[0])
    model = solver.models[THROWN]
    mean = model.mass @ v / model.mass.sum()
    assert mean[0] == pytest.approx(SPEED, rel=0.01)
    assert mean[1] == pytest.approx(0.0, abs=0.01 * SPEED)


ROBOT = """
bodies:
  far: {mesh: {generator: block, length: 100 mm, height: 100 mm, element_size: 100 mm},
        formulation: plane_strain, thickness: 1 mm, material: soft, position: [1 m, 0 mm]}
materials: {soft: {law: neo_hooke, C10: 1 kPa, density: 100 kg/m^3}}
rigid_bodies:
  robot: {mass: 10 g, inertia: 1 kg*mm^2, center: [0 mm, 10 mm], free: [x, y],
          outline: {length: 40 mm, height: 20 mm}}
environment: {walls: {floor: {kind: plane}}}
contact: {friction_coefficient: 0, penalty_stiffness: 1 N/mm}
loads:
  walk: {kind: rigid_force, acts_on: robot, force: [50 mN, 0 N]}
  tail: {kind: tether, acts_on: robot, drag: 20 mN, weight: 30 mN}
time: {end: 1 s, settle: 10 s}
"""


def test_a_tether_on_a_settled_body_acts_once(build, start_settled):
    """Its weight is borne by the floor at t = 0, its drag not yet there: forward acts the force
    less what the tether's spring has built up since, across nothing, in the half kick as in the
    increments that follow.
    """
    solver = start_settled(build(ROBOT))
    bodies, step = solver.terms.rigid_bodies, solver.time_increment
    spring, speed, kick = 20e-3 / 0.1e-3, 0.0, 0.5 * step
    for _ in range(3):
        force, velocity, centre, rest = (
            fields.read(read).reshape(-1, 2)[0]
            for read in (bodies.force, bodies.velocity, bodies.centre, bodies.rest)
        )
        forward = 50e-3 - spring * (centre - rest)[0]
        np.testing.assert_allclose(force, [forward, 0.0], rtol=1e-6, atol=1e-8)
        speed += kick * forward / 10e-3
        np.testing.assert_allclose(velocity, [speed, 0.0], rtol=1e-6, atol=1e-6 * speed)
        solver.advance(1)
        kick = step
    normal = fields.read(solver.terms.wall_contacts[0].normal_force).sum()
    far = 100.0 * 0.1 * 0.1 * 1e-3
    assert normal == pytest.approx((10e-3 + far) * 9.81 + 30e-3, rel=1e-3)


def test_a_body_that_slides_without_end_is_refused(
    write_scene, tmp_path, kernel_cache, monkeypatch
):
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run

    scene = write_scene(INCLINE)
    steep = ("environment.inclination=40 deg", "time.settle=50 ms")
    with pytest.raises(StabilityError, match=r"come to rest within the 0\.05 s") as refused:
        run(scene, steep, tmp_path / "out", "cpu", console=Console(file=io.StringIO()))
    assert refused.value.exit_code == 3
    assert "slide" in str(refused.value)


def test_gravity_cannot_rise_after_settling(write_scene):
    from softsim.builder import build_model
    from softsim.scene.loading import load_scene

    rising = INCLINE.replace(
        "environment: {", "environment: {gravity_profile: {kind: ramp, duration: 50 ms}, "
    )
    scene = write_scene(rising)
    line = 1 + rising.splitlines().index(
        next(text for text in rising.splitlines() if "gravity_profile" in text)
    )
    with pytest.raises(SceneError, match=rf"scene\.yaml:{line}") as refused:
        build_model(load_scene(scene))
    assert "the body carries its whole weight" in str(refused.value)
