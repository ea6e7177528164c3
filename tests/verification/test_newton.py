"""Equilibria by Newton's method: convergence, limit points by arc length, refusals, friction.

The sphere is that of shells.py: its pressure rises to a limit point and falls again, as the closed
form of closed_forms.sphere_inflation says.
"""

import io
import os
import signal

import closed_forms
import numpy as np
import pytest
from rich.console import Console
from scipy.integrate import quad
from scipy.optimize import minimize_scalar
from shells import INNER, OUTER, SPHERE, half_section

from softsim.errors import Interrupted, StabilityError

RUBBER = (36e3,)


def exact_pressure(stretch):
    """Pressure [Pa] of the sphere at an inner radius of `stretch` times INNER."""
    return closed_forms.sphere_inflation(stretch * INNER, INNER, OUTER, RUBBER).pressure


LARGEST = -minimize_scalar(lambda s: -exact_pressure(s), bounds=(1.2, 1.8)).fun

AIR = f"""
loads: {{air: {{kind: follower_pressure, facets: [shell.chamber],
              profile: {{kind: table, points: [[0 s, 0 Pa], [20 ms, {1.05 * LARGEST} Pa]]}}}}}}
time: {{end: 20 ms, procedure: static}}
"""

PRESSED_BLOCK = """
bodies:
  block: {mesh: {generator: block, length: 8 mm, height: 4 mm, element_size: 1 mm},
          formulation: plane_strain, thickness: 5 mm, material: rubber, position: [0 mm, 0 mm]}
materials: {rubber: {law: neo_hooke, C10: 36 kPa, density: 1000 kg/m^3}}
environment:
  gravity: 0 m/s^2
  walls: {floor: {kind: plane, point: [0 mm, -0.02 mm], normal: [0, 1]}}
contact: {friction_coefficient: 0.5}
conditions:
  press: {kind: prescribed, nodes: block.top, direction: y,
          displacement: {kind: constant, value: -0.4 mm, ramp: 10 ms}}
  push: {kind: prescribed, nodes: block.top, direction: x,
         displacement: {kind: table, points: [[0 s, 0 mm], [10 ms, 0 mm], [20 ms, 3 mm]]}}
time: {end: 20 ms, procedure: static}
output: {history_interval: 1 ms}
"""


@pytest.fixture
def run(kernel_cache, monkeypatch, write_scene, tmp_path):
    """Run a scene text, and the shell that it names, quietly on the CPU."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run as run_scene

    def quiet(text, *overrides, shell=None, out="out", resume=False):
        if shell is not None:
            shell.write(tmp_path / "shell.inp")
        console = Console(file=io.StringIO())
        scene = write_scene(text)
        return run_scene(scene, overrides, tmp_path / out, "cpu", resume=resume, console=console)

    return quiet


def test_arc_length_follows_a_sphere_through_its_limit_point(run, record_verification):
    """The largest pressure to the mesh's error, of second order; then a falling branch.

    The stretches at the limit point lie between those of two rows, so that its pressure is missed
    by the square of a step. One mode is unstable beyond it under a pressure, none before.
    """
    options = ("time.control=arc_length", "time.reach={column: inner_x, above: 7 mm}")
    coarse, h = (
        run(SPHERE + AIR, *options, shell=half_section(rows), out=str(rows)).history
        for rows in (2, 4)
    )
    allowed = 1.25 / 3.0 * abs(coarse["pressure"].max() - h["pressure"].max())
    stretch = 1.0 + h["inner_x"] / INNER
    exact = [exact_pressure(s) for s in stretch[1:]]
    np.testing.assert_allclose(h["pressure"][1:], exact, atol=allowed, rtol=4e-3)
    record_verification("limit pressure of a sphere, arc length", LARGEST, h["pressure"].max())
    assert abs(h["pressure"].max() - LARGEST) < allowed + 5e-4 * LARGEST
    assert stretch[-1] > 1.8
    top = int(np.argmax(h["pressure"]))
    assert np.all(h["unstable_modes"][: top - 1] == 0)
    assert np.all(h["unstable_modes"][top + 2 :] == 1)
    assert np.all(np.diff(h["load_time"])[top + 1 :] < 0.0)


OTHER_LAWS = {
    "mooney_rivlin": (
        "law: mooney_rivlin, C10: 34 kPa, C01: 2 kPa",
        lambda s: 34e3 * (s**-4 + 2.0 * s**2 - 3.0) + 2e3 * (s**4 + 2.0 * s**-2 - 3.0),
    ),
    "ogden": (
        "law: ogden, mu: [50 kPa, 20 kPa], alpha: [1.8, 2.4]",
        lambda s: sum(
            2.0 * mu / alpha**2 * (s ** (-2.0 * alpha) + 2.0 * s**alpha - 3.0)
            for mu, alpha in ((50e3, 1.8), (20e3, 2.4))
        ),
    ),
}
"""Material of a scene, and its W over the stretch of a membrane, stretches s^-2, s, s."""


@pytest.mark.physics
@pytest.mark.parametrize("law, energy", OTHER_LAWS.values(), ids=OTHER_LAWS)
def test_other_laws_beyond_their_limit_point(run, record_verification, law, energy):
    """The pressure of an incompressible sphere is the integral of W'(s) / (s^3 - 1) from the
    stretch of its outer to that of its inner surface.
    """

    def slope(s):
        return (energy(s + 1e-5) - energy(s - 1e-5)) / 2e-5

    def exact(stretch):
        outside = np.cbrt((OUTER**3 + INNER**3 * (stretch**3 - 1.0)) / OUTER**3)
        return quad(lambda s: slope(s) / (s**3 - 1.0), outside, stretch)[0]

    largest = max(exact(s) for s in np.linspace(1.1, 2.2, 200))
    text = (SPHERE + AIR).replace(f"{1.05 * LARGEST} Pa", f"{1.05 * largest} Pa")
    text = text.replace("law: neo_hooke, C10: 36 kPa", f"{law}, bulk_modulus: 20 MPa")
    options = ("time.control=arc_length", "time.reach={column: inner_x, above: 7 mm}")
    h = run(text, *options, shell=half_section(4)).history
    stretch = 1.0 + h["inner_x"] / INNER
    np.testing.assert_allclose(
        h["pressure"][1:], [exact(s) for s in stretch[1:]], rtol=4e-3, atol=2e-3 * largest
    )
    name = law.split()[1].strip(",")
    record_verification(f"limit pressure of a sphere, {name}", largest, h["pressure"].max())
    assert h["pressure"].max() == pytest.approx(largest, rel=3e-3)
    assert stretch[-1] > 1.8 and h["pressure"][-1] < 0.99 * largest


def test_a_pressure_beyond_the_limit_point_is_refused_with_the_last_equilibrium(run):
    """The error names the pressure that was reached, below the largest one, and the remedy."""
    with pytest.raises(StabilityError) as stopped:
        run(SPHERE + AIR, shell=half_section(4))
    assert stopped.value.exit_code == 3
    assert "the last equilibrium" in stopped.value.message
    reached = float(stopped.value.message.rsplit("air at ", 1)[1].split()[0])
    assert 0.98 * LARGEST < 1e3 * reached < 1.003 * LARGEST
    assert "arc_length" in stopped.value.hint


def test_the_method_does_not_matter(run):
    """Newton's method and relaxation find the same pressure of a liquid beyond the limit point."""
    water = AIR.replace("follower_pressure", "added_volume").replace("0 Pa", "0 ml")
    text = SPHERE + water.replace(f"{1.05 * LARGEST} Pa", "6 ml")
    found = [
        run(text, f"time.method={method}", shell=half_section(2), out=method).history
        for method in ("newton", "relaxation")
    ]
    for column in ("pressure", "inner_x", "outer_x", "internal_energy"):
        ends = [h[column][-1] for h in found]
        assert ends[0] == pytest.approx(ends[1], rel=1e-4)


def test_convergence_is_quadratic(build, start):
    """The share of unbalanced forces is squared, up to a factor, from one iteration to the next."""
    from softsim.statics.forces import StaticForces
    from softsim.statics.newton import Newton

    text = PRESSED_BLOCK.replace("[0 mm, -0.02 mm]", "[0 mm, -9 mm]")
    solver = start(build(text, "bodies.block.fixed=[bottom]"))
    forces = StaticForces(solver)
    newton = Newton(forces, 1e-6)
    shares = []
    found = newton.find(forces.steer(10e-3), lambda k, share: shares.append(share))
    shares.append(found.unbalanced_share)
    rates = np.log(shares[2:]) / np.log(shares[1:-1])
    assert len(shares) >= 4
    assert rates.max() > 1.6
    assert found.unbalanced_share < 1e-9


def test_friction_is_a_return_mapping(run):
    """A block is pressed on the floor and pushed: it slides at mu N, whatever the load steps."""
    ends = []
    for interval in ("1 ms", "5 ms"):
        results = run(PRESSED_BLOCK, f"output.history_interval={interval}", out=interval[0])
        h = results.history
        assert np.all(h["unbalanced_share"][1:] < 1e-6)
        ends.append((h["wall_force_x"][-1], h["wall_force_y"][-1]))
    for x, y in ends:
        assert y > 0.1
        assert x == pytest.approx(-0.5 * y, rel=1e-6)
    assert ends[0][1] == pytest.approx(ends[1][1], rel=1e-3)


def test_a_trial_leaves_no_trace(build, start):
    """Forces at a state are the same before and after trials far away from it."""
    from softsim.statics.forces import StaticForces
    from softsim.statics.newton import LoadSteps, Newton

    forces = StaticForces(start(build(PRESSED_BLOCK)))
    steps = LoadSteps(Newton(forces, 1e-6))
    while forces.time < 12e-3:
        steps.advance(forces.time + 1e-3)
    here = forces.steer(13e-3)
    before = forces.residual(here)
    rng = np.random.default_rng(0)
    for _ in range(3):
        forces.residual(forces.moved(here, 1e-4 * rng.uniform(-1.0, 1.0, forces.size)))
    # Bulk viscosity remembers the last strain: over so long a time it is all but nothing.
    np.testing.assert_allclose(forces.residual(here), before, atol=1e-11 * forces.inner_force())


def test_going_back_leaves_no_trace(build, start):
    """After a load step that is given up, no field and no work differ from the accepted state."""
    from softsim.statics.forces import StaticForces
    from softsim.statics.newton import LoadSteps, Newton

    forces = StaticForces(start(build(PRESSED_BLOCK)))
    steps = LoadSteps(Newton(forces, 1e-6))
    while forces.time < 12e-3:
        steps.advance(forces.time + 1e-3)
    accepted = forces.solver.state()
    rng = np.random.default_rng(0)
    far = forces.moved(forces.steer(14e-3), 1e-4 * rng.uniform(-1.0, 1.0, forces.size))
    forces.residual(far)
    forces.go_back()
    for name, array in forces.solver.state().items():
        if not name.endswith("impulse"):  # a load step begins with none
            np.testing.assert_array_equal(array, accepted[name], err_msg=name)


def test_less_is_accepted_at_the_last_iteration(build, start, monkeypatch):
    """A thousandth of the tolerance is sought, and the tolerance accepted when time is up."""
    from softsim.statics import newton
    from softsim.statics.forces import StaticForces

    text = PRESSED_BLOCK.replace("[0 mm, -0.02 mm]", "[0 mm, -9 mm]")
    forces = StaticForces(start(build(text, "bodies.block.fixed=[bottom]")))
    method = newton.Newton(forces, 1e-3)
    shares = []
    method.find(forces.steer(10e-3), lambda k, share: shares.append(share))
    enough = next(k for k, share in enumerate(shares) if 1e-6 < share <= 1e-3)
    forces.go_back()
    monkeypatch.setattr(newton, "MOST_ITERATIONS", enough)
    found = newton.Newton(forces, 1e-3).find(forces.steer(10e-3))
    assert len(found.iterations) == enough and 1e-6 < found.unbalanced_share <= 1e-3


def test_a_body_that_nothing_holds_is_refused(run):
    """Its weight acts along a rigid motion, which the error names."""
    text = PRESSED_BLOCK.split("conditions:")[0].replace("gravity: 0 m/s^2", "gravity: 9.81 m/s^2")
    text += "time: {end: 20 ms, procedure: static}\n"
    with pytest.raises(StabilityError, match="translation along y") as refused:
        run(text, "environment.walls.floor.point=[0 mm, -9 mm]")
    assert "time.method: relaxation" in refused.value.hint


def test_a_body_that_floats_without_load_is_solved(run):
    """Two opposite forces stretch a free block; nothing else moves it."""
    text = PRESSED_BLOCK.split("conditions:")[0].replace("-0.02 mm", "-9 mm")
    text += (
        "loads:\n"
        "  left: {kind: nodal_force, nodes: block.left, force: [-50 mN, 0 N], ramp: 10 ms}\n"
        "  right: {kind: nodal_force, nodes: block.right, force: [50 mN, 0 N], ramp: 10 ms}\n"
        "time: {end: 10 ms, procedure: static}\n"
        "output: {probes: {r: {kind: displacement, nodes: block.right},"
        " l: {kind: displacement, nodes: block.left}}}\n"
    )
    h = run(text).history
    assert h["r_x"][-1] > 1e-5
    assert h["r_x"][-1] == pytest.approx(-h["l_x"][-1], rel=1e-6)


def test_a_thin_body_without_load_is_at_rest(build, start):
    """Coordinates of a wide, thin and nearly incompressible body have round-off that exerts forces:
    they count as balanced.
    """
    from softsim.statics.forces import StaticForces
    from softsim.statics.newton import Newton

    text = PRESSED_BLOCK.replace("length: 8 mm, height: 4 mm", "length: 60 mm, height: 0.2 mm")
    text = text.replace("element_size: 1 mm", "element_size: 0.2 mm").replace("-0.02 mm", "-9 mm")
    text = text.replace("36 kPa,", "36 kPa, poisson_ratio: 0.4995,")
    forces = StaticForces(start(build(text)))
    newton = Newton(forces, 1e-6)
    rounded = np.random.default_rng(1).choice((-1.0, 1.0), forces.size)
    near = forces.moved(forces.start, 1e-16 * rounded)
    assert newton.find(near).unbalanced_share < 1e-6
    assert newton.unbalanced(forces.moved(forces.start, 1e-9 * rounded))[1] > 1e-6


def test_a_resumed_run_finds_the_same_equilibria(run, monkeypatch):
    """SIGTERM, then --resume; to the tolerance, as guesses and factors begin anew."""
    from softsim.statics.newton import LoadSteps

    whole = run(PRESSED_BLOCK, "output.history_interval=0.8 ms", out="whole").history
    advance = LoadSteps.advance

    def advance_and_stop(steps, *arguments):
        found = advance(steps, *arguments)
        if 12e-3 < steps.forces.time < 12.9e-3:
            os.kill(os.getpid(), signal.SIGTERM)
        return found

    with monkeypatch.context() as stopping:
        stopping.setattr(LoadSteps, "advance", advance_and_stop)
        with pytest.raises(Interrupted):
            run(PRESSED_BLOCK, "output.history_interval=0.8 ms", out="parts")
    parts = run(PRESSED_BLOCK, "output.history_interval=0.8 ms", out="parts", resume=True).history
    assert parts["time"][-1] == pytest.approx(whole["time"][-1])
    assert parts["wall_force_y"][-1] == pytest.approx(whole["wall_force_y"][-1], rel=1e-6)
