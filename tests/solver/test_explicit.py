"""The integrator: order, stability, scenarios, launches."""

from dataclasses import astuple

import numpy as np
import pytest

from softsim.solver import increments
from softsim.solver.increments import Span
from softsim.solver.stable_step import stable_step

STRIP = """
bodies:
  strip: {mesh: {generator: block, length: 10 mm, height: 1 mm, element_size: 0.5 mm},
          formulation: plane_strain, thickness: 1 mm, material: rubber, fixed: [left]}
materials:
  rubber: {law: yeoh, C10: 36 kPa, density: 1000 kg/m^3}
environment: {walls: {floor: {kind: plane, point: [0 mm, -0.2 mm]}}}
contact: {friction_coefficient: 0.4}
time: {end: 1 s}
"""


def test_runs_repeat_to_the_bit(build, start):
    model = build(STRIP)
    first = start(model)
    first.advance(3000)
    x = first.positions()
    again = start(model)
    again.advance(3000)
    np.testing.assert_array_equal(x, again.positions())


def test_scenarios_side_by_side_are_those_alone(build, start):
    """Each scenario of a batch goes as its own run does, to round-off: they are two kernels, and
    fast_math lets the compiler order each one's arithmetic.
    """
    models = [build(STRIP, f"contact.friction_coefficient={mu}") for mu in (0.0, 0.4, 0.8)]
    batch = start(*models)
    batch.advance(1000)
    together = batch.positions()
    assert not np.array_equal(together[0], together[2])
    for k, model in enumerate(models):
        alone = start(model)
        alone.advance(1000)
        size = np.ptp(model.points, axis=0).max()
        np.testing.assert_allclose(alone.positions()[0], together[k], rtol=0.0, atol=1e-12 * size)


@pytest.mark.physics
def test_meshes_of_about_the_same_size_share_their_kernels(build, tmp_path):
    """Taichi writes what it has compiled when it is started anew."""
    from softsim.compute import backend
    from softsim.solver.energy import EnergyReader
    from softsim.solver.explicit import ExplicitSolver

    kept = []
    for length in ("12 mm", "14 mm"):
        model = build(STRIP, f"bodies.strip.mesh.length={length}")
        backend.start("cpu", cache=tmp_path / "kernels")
        solver = ExplicitSolver([model])
        solver.begin(1e-6)
        solver.advance(1)
        EnergyReader(solver).update()
        backend.start("cpu", cache=tmp_path / "kernels")
        kept.append((model.element_count, len(list((tmp_path / "kernels").rglob("*.tic")))))
    (small, compiled), (large, in_all) = kept
    assert small < large and compiled == in_all > 0


STRIPS = """
bodies:
  skin: {mesh: {generator: pfr_section, free_length: 6 mm, inner_diameter: 4 mm,
                outer_diameter: 6 mm, spikes_per_strip: 1, root_thickness: 2 mm,
                spike_height: 2 mm, element_size: 0.5 mm},
         formulation: ring_section, thickness: 3 mm, sector: 90 deg, rings: skin,
         material: dragon_skin_10}
rigid_bodies:
  frame: {mass: 1 g, inertia: 10 g*mm^2, tied: [skin.knots], initial_angular_velocity: 50 rad/s}
loads:
  air: {kind: follower_pressure, facets: [skin.chamber], reacts_on: frame,
        profile: {kind: constant, value: 5 kPa}}
time: {end: 1 s}
"""
# The frame is lower than the chamber: where a gap is exactly zero, round-off decides which nodes
# feel the dampers of contact in the first increment.
SPACE = """
bodies:
  skin: {mesh: {generator: pfr_solid, rows: 0, element_size: 1 mm},
         formulation: solid, material: dragon_skin_10}
rigid_bodies:
  frame: {mass: 8 g, inertia: 1 kg*mm^2, tied: [skin.knots], supports: [skin.chamber],
          outline: {length: 33 mm, height: 14.9 mm}, initial_angular_velocity: 20 rad/s}
environment: {walls: {pipe: {kind: pipe, diameter: 18 mm}}}
loads:
  air: {kind: added_gas, facets: [skin.chamber], reacts_on: frame, dead_volume: 2 ml,
        profile: {kind: smooth_step, value: 3 mg, duration: 3 ms}}
time: {end: 1 s}
"""
RING = """
bodies:
  ring: {mesh: {generator: pfr_meridian, element_size: 0.5 mm}, formulation: axisymmetric,
         material: dragon_skin_10, fixed: [end_low]}
conditions:
  pull: {kind: prescribed, nodes: ring.end_high, direction: y,
         displacement: {kind: ramp, value: 1 mm, duration: 4 ms}}
time: {end: 1 s, procedure: static}
"""
# Sections and bodies in space take long to compile; a plane section is launched below too, where
# scenarios rest.
SLOW = [pytest.param(text, marks=pytest.mark.slow) for text in (STRIP, STRIPS, SPACE)]
MODELS = [*SLOW, RING]
KINDS = ["plane", "section of rings", "space", "ring, static"]


@pytest.mark.parametrize("text", MODELS, ids=KINDS)
def test_launches_give_the_answer_of_the_serial_kernel(build, start, monkeypatch, text):
    """The launch sequence of a GPU, run on the CPU: same passes, same order, same result. Several
    increments a call take minutes to compile; a strip has them below.

    To round-off: fast_math lets the compiler order sums as suits the loop around them. (Under local
    damping, which turns with the sign of a velocity, round-off grows tenfold in 50 increments.)
    """
    monkeypatch.setattr(increments, "LAUNCHED_TOGETHER", 1)
    model = build(text)
    solver = start(model)
    begun, dt = solver.state(), solver.time_increment
    solver.advance(163)
    x = solver.positions()
    solver.restore(begun, 0.0, 0, dt)
    solver.kernels.by_launches([Span(163, 0.0, dt, drift=dt, kick=dt)])
    size = np.ptp(model.points, axis=0).max()
    np.testing.assert_allclose(x, solver.positions(), rtol=0.0, atol=1e-12 * size)
    assert np.abs(x - model.points).max() > 1e-4 * size  # something moved


@pytest.mark.parametrize("text", [STRIP, STRIPS, SPACE], ids=KINDS[:3])
def test_a_card_gives_the_answer_of_the_processor(build, restart, text):
    """By teams and by launches, which give the same bits; of two scenarios one rests at last."""
    from softsim.compute.machine import cuda_device_count
    from softsim.solver.energy import EnergyReader
    from softsim.solver.explicit import ExplicitSolver

    if cuda_device_count() == 0:
        pytest.skip("this machine has no CUDA device")
    model = build(text)
    dt = 0.9 * stable_step(model, model.points).value

    def after(device, is_small):
        restart(device=device)
        solver = ExplicitSolver([model, model])
        solver.kernels.is_small = is_small
        solver.begin(dt)
        solver.advance(np.array([163, 600]))
        return solver.positions(), EnergyReader(solver).read(1)

    x, energies = after("cpu", False)
    by_teams, found = after("cuda", True)
    size = np.ptp(model.points, axis=0).max()
    np.testing.assert_allclose(by_teams, x, rtol=0.0, atol=1e-11 * size)
    books = np.array(astuple(energies))
    np.testing.assert_allclose(astuple(found), books, rtol=1e-7, atol=1e-12 * books.max())
    by_launches, _ = after("cuda", False)
    np.testing.assert_array_equal(by_teams, by_launches)


def test_scenarios_rest_when_they_have_done_their_own(build, restart):
    """Other steps and numbers of increments side by side, by launches and one after another."""
    from softsim.solver.explicit import ExplicitSolver

    steps, counts = np.array([3e-6, 4e-6]), np.array([37, 80])
    models = [build(STRIP, f"contact.friction_coefficient={mu}") for mu in (0.0, 0.8)]

    def begun(models, steps):
        restart()
        solver = ExplicitSolver(models)
        solver.begin(steps)
        return solver

    together = begun(models, steps)
    together.advance(counts)
    np.testing.assert_allclose(together.times, counts * steps)
    x, size = together.positions(), np.ptp(models[0].points, axis=0).max()
    launched = begun(models, steps)
    launched.kernels.by_launches(
        [
            Span(int(count), 0.0, dt, drift=dt, kick=dt)
            for count, dt in zip(counts, steps, strict=True)
        ]
    )
    np.testing.assert_allclose(x, launched.positions(), rtol=0.0, atol=1e-12 * size)
    for s, model in enumerate(models):
        alone = begun([model], float(steps[s]))
        alone.advance(int(counts[s]))
        np.testing.assert_allclose(x[s], alone.positions()[0], rtol=0.0, atol=1e-12 * size)


@pytest.mark.parametrize("text", MODELS, ids=KINDS)
def test_workers_give_the_bits_of_one(build, restart, text):
    """One thread by itself or two side by side: each number is summed in the same order."""
    from softsim.compute.machine import processor_count
    from softsim.solver.explicit import ExplicitSolver

    if processor_count() == 1:
        pytest.skip("one processor")
    restart(threads=2, device="cpu")
    model = build(text)
    dt = 0.9 * stable_step(model, model.points).value
    solver = ExplicitSolver([model])
    solver.begin(dt)
    begun, found = solver.state(), []
    for workers in (0, 1, 2):
        solver.restore(begun, 0.0, 0, dt)
        span = Span(16, 0.0, dt, drift=dt, kick=dt)
        if workers:
            solver.kernels.together(0, span, workers)
        else:
            solver.kernels.alone(0, span)
        found.append(solver.state())
    for other in found[1:]:
        for name, array in found[0].items():
            np.testing.assert_array_equal(other[name], array, err_msg=name)


def test_period_error_is_of_second_order(build, restart):
    """Free vibration without contact: halving the step quarters the difference to a fine one."""
    from softsim.solver.explicit import ExplicitSolver

    model = build(STRIP, "environment.walls={}", "solver.bulk_viscosity=0")
    ends, span = [], 5e-3
    coarse = 0.8 * stable_step(model, model.points).value
    count = int(np.ceil(span / coarse))
    for refinement in (1, 2, 8):
        restart()
        solver = ExplicitSolver([model])
        solver.begin(span / (count * refinement))
        solver.advance(count * refinement)
        ends.append(solver.positions()[0][:, 1])
    ratio = np.abs(ends[0] - ends[2]).max() / np.abs(ends[1] - ends[2]).max()
    # (1 - 1/64) / (1/4 - 1/64) = 4.2 for second order.
    assert ratio == pytest.approx(4.2, rel=0.1)


def test_above_the_stable_step_it_blows_up(build, start):
    """The estimate is a bound, and no wasteful one: three times it is unstable."""
    model = build(STRIP, "environment.walls={}")
    for share, stable in ((0.99, True), (3.0, False)):
        solver = start(model, share=share)
        solver.advance(3000)
        x = solver.positions()[0]
        assert bool(np.isfinite(x).all() and np.abs(x).max() < 0.1) is stable


def test_a_changed_step_keeps_second_order(build, start):
    """Velocities move to the new half step: the answer stays that of a fixed small step."""
    model = build(STRIP, "environment.walls={}", "solver.bulk_viscosity=0")
    solver = start(model, share=0.8)
    step = solver.time_increment
    solver.advance(500)
    solver.change_time_increment(0.5 * step)
    solver.advance(1000)
    changed = solver.positions()
    fine = start(model, share=0.1)
    fine.advance(round(solver.time / fine.time_increment))
    reference = fine.positions()
    fixed = start(model, share=0.8)
    fixed.advance(1000)
    assert np.abs(changed - reference).max() < np.abs(fixed.positions() - reference).max()
