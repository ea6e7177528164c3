"""Time integration: periods, free fall, energy over a million increments, answers that no longer
depend on the step.

Central differences give a vibration of frequency w the period T (w dt/2) / asin(w dt/2), shorter
by the share (w dt)^2/24 to the lowest order.
"""

import numpy as np
import pytest

SHEAR_MODULUS, KAPPA = 72e3, 20.0 * 72e3

MATERIAL = """
materials: {rubber: {law: neo_hooke, C10: 36 kPa, density: 1000 kg/m^3}}
environment: {gravity: 0 m/s^2}
solver: {bulk_viscosity: 0}
time: {end: 1 s}
"""


def begin_again(solver, memory, step):
    """Take the state of t = 0 and start with this step [s]."""
    solver.restore(memory, 0.0, 0, step)
    solver.begin(step)


def crossing_times(t, u):
    """Times at which u changes its sign, linear in between."""
    k = np.flatnonzero(u[:-1] * u[1:] < 0.0)
    return t[k] - u[k] * (t[k + 1] - t[k]) / (u[k + 1] - u[k])


SPRING = """
bodies:
  spring: {mesh: {generator: block, length: 1 mm, height: 1 mm, element_size: 1 mm},
           formulation: plane_strain, thickness: 1 mm, material: rubber, fixed: [bottom]}
conditions:
  guide: {kind: fixed, nodes: spring.top, directions: [x]}
  load: {kind: point_mass, nodes: spring.top, mass: 10 g}
  push: {kind: initial_velocity, nodes: spring.top, velocity: [0 mm/s, 0.1 mm/s]}
""" + MATERIAL.replace("1000 kg/m^3", "1 kg/m^3")


def test_period_of_a_mass_on_a_spring(build, fresh_taichi, record_verification):
    """Two triangles that can only be stretched are a spring of (kappa + 4 mu/3) b l/h; without mass
    of their own (1e-7 of the load) they carry it as one degree of freedom.

    The amplitude of 1e-5 of the height keeps it linear. Over twenty periods the crossings of the
    straight line between samples are off by (w dt)^3/15 rad at most, 1e-4 of the time at 0.6.
    """
    from softsim.solver.explicit import ExplicitSolver

    model = build(SPRING)
    top = model.bodies[0].node_sets["top"]
    stiffness = (KAPPA + 4.0 / 3.0 * SHEAR_MODULUS) * 1e-3
    omega = np.sqrt(stiffness / model.mass[top].sum())
    exact = 2.0 * np.pi / omega
    solver = ExplicitSolver([model])
    memory = solver.state()
    errors = []
    for angle in (0.6, 0.3, 0.15):
        step = angle / omega
        begin_again(solver, memory, step)
        u = []
        for _ in range(int(20.5 * exact / step)):
            solver.advance(1)
            u.append((solver.positions()[0] - model.points)[top, 1].mean())
        times = crossing_times(step * np.arange(1, len(u) + 1), np.array(u))
        period = 2.0 * np.diff(times).mean()
        errors.append(period / exact - 1.0)
        assert errors[-1] == pytest.approx(0.5 * angle / np.arcsin(0.5 * angle) - 1.0, abs=1e-4)
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    record_verification("period [s], mass on a spring, w dt = 0.15", exact, period, orders[1])
    assert orders == pytest.approx(2.0, abs=0.1)


BAR = (
    """
bodies:
  bar: {mesh: {generator: block, length: 4 mm, height: 1 mm, element_size: 0.5 mm},
        formulation: plane_strain, thickness: 1 mm, material: rubber, fixed: [left]}
conditions:
  load: {kind: point_mass, nodes: bar.right, mass: 400 mg}
  guide: {kind: fixed, nodes: bar.right, directions: [y]}
"""
    + MATERIAL
)


def test_period_of_a_mass_on_a_bar(build, start, record_verification):
    """Stiffness from the static procedure, period from a dynamic one of the same mesh.

    Rayleigh's quotient of the static displacement u under the force F, F.u / (u.m.u), is the
    lowest w^2 but for the square of what the shapes differ by: the bar's own mass, a hundredth of
    the load. Strains of 1e-5 keep it linear, (w dt)^2/24 is 1e-7. The starting push, not of the
    shape of the mode, adds faster vibrations of a hundredth of the amplitude, which shift single
    crossings by 2e-3 rad, ten half periods by 2e-3 / (10 pi) of the time.
    """
    from softsim.solver.energy import unbalanced_share

    force = 4e-6
    load = f"loads: {{pull: {{kind: nodal_force, nodes: bar.right, force: [{force} N, 0 N]}}}}\n"
    model = build(BAR + load, "time.procedure=static", "solver.bulk_viscosity=0.06")
    solver = start(model)
    scenario = solver.scenario(0)
    solver.advance(20000)
    while unbalanced_share(scenario) > 1e-8:
        assert solver.increment_count < 100_000
        solver.advance(2000)
    u = solver.positions()[0] - model.points
    right = model.bodies[0].node_sets["right"]
    omega = np.sqrt(force * u[right, 0].mean() / (model.mass[:, None] * u**2).sum())
    exact = 2.0 * np.pi / omega

    push = "  push: {kind: initial_velocity, nodes: bar.right, velocity: [20 um/s, 0 m/s]}\n"
    model = build(BAR.replace("conditions:\n", "conditions:\n" + push))
    solver = start(model)
    t, seen = [], []
    while solver.time < 5.6 * exact:
        solver.advance(10)
        t.append(solver.time)
        seen.append((solver.positions()[0] - model.points)[right, 0].mean())
    times = crossing_times(np.array(t), np.array(seen))
    assert len(times) == 11
    assert max(seen) < 1e-5 * 4e-3 * 2.0
    period = 2.0 * (times[-1] - times[0]) / 10.0
    record_verification("period [s], point mass on a bar", exact, period)
    assert period == pytest.approx(exact, rel=2e-4)


FALLING = {
    "plane_strain": "{generator: block, length: 2 mm, height: 1 mm, element_size: 1 mm}",
    "axisymmetric": "{generator: block, length: 2 mm, height: 1 mm, element_size: 1 mm}",
    "solid": "{generator: box, length: 2 mm, height: 1 mm, width: 1 mm, element_size: 1 mm}",
}


@pytest.mark.parametrize("formulation", list(FALLING))
def test_free_fall(build, start, record_verification, formulation):
    """Thrown up at 0.1 m/s: v t - g t^2/2 to round-off, which the elements' own stresses limit;
    across, nothing moves. A ring falls along its axis.
    """
    thick = ", thickness: 1 mm" if formulation == "plane_strain" else ""
    velocity = "0 m/s, 0.1 m/s" + (", 0 m/s" if formulation == "solid" else "")
    model = build(
        f"bodies: {{b: {{mesh: {FALLING[formulation]}, formulation: {formulation}{thick},\n"
        f"  position: [3 mm, 0 mm], material: rubber, initial_velocity: [{velocity}]}}}}\n"
        + MATERIAL.replace("0 m/s^2", "9.81 m/s^2")
    )
    solver = start(model)
    solver.advance(3000)
    moved = solver.positions()[0] - model.points
    exact = 0.1 * solver.time - 0.5 * 9.81 * solver.time**2
    record_verification(f"free fall [m], {formulation}", exact, moved[:, 1].mean())
    np.testing.assert_allclose(moved[:, 1], exact, rtol=1e-9)
    across = np.delete(moved, 1, axis=1)
    assert np.abs(across).max() < 1e-9 * abs(exact)


@pytest.mark.slow
def test_energy_over_a_million_increments(build, start, record_verification):
    """A block thrown at a twentieth of the wave speed, held at its end, no damping: the energy
    swings with the step but goes nowhere.

    Central differences keep an energy near the true one for ever (they are symplectic), so early
    and late means agree to what a mean over a thousandth of the run leaves of the swing.
    """
    from softsim.solver.energy import EnergyReader

    model = build(
        "bodies: {b: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm},\n"
        "  formulation: plane_strain, thickness: 1 mm, material: rubber, fixed: [left],\n"
        "  initial_velocity: [0 m/s, 0.5 m/s]}}\n" + MATERIAL
    )
    assert model.element_count == 16
    solver = start(model)
    reader = EnergyReader(solver)
    initial = reader.read().balance
    assert initial == pytest.approx(reader.read().kinetic)

    def mean_energy():
        seen = []
        for _ in range(200):
            solver.advance(50)
            seen.append(reader.read().balance)
        return np.mean(seen)

    early = mean_energy()
    solver.advance(980_000)
    late = mean_energy()
    assert solver.increment_count == 1_000_000
    assert np.isfinite(late)
    record_verification("energy [J] after a million increments", early, late)
    assert late == pytest.approx(early, rel=1e-3)
    # A mode of frequency w swings by (w dt/2)^2 of its energy; nearly all is in slow modes.
    assert early == pytest.approx(initial, rel=0.05)


def test_inflation_does_not_depend_on_the_step(build, fresh_taichi, record_verification):
    """A ring blown up within a millisecond swings about its new radius; the difference to the
    finest step falls with the square.

    A swing of frequency w is off by w t (w dt)^2/24 of its amplitude: breathing, w = sqrt(E/rho)/r
    = 2.7 / ms, for three milliseconds with steps of 10 us, by 3e-4. The millisecond is a whole
    number of steps: a corner of the profile within a step moves the error about. The corner
    strikes up vibrations through the thickness, which only steps of 1 us follow.
    """
    from softsim.solver.explicit import ExplicitSolver
    from softsim.solver.stable_step import stable_step

    model = build(
        "bodies: {ring: {mesh: {generator: block, length: 1 mm, height: 1 mm,"
        " element_size: 0.5 mm},\n"
        "  formulation: axisymmetric, material: rubber, position: [5.5 mm, 0 mm]}}\n"
        "conditions: {bottom: {kind: symmetry, nodes: ring.bottom, normal: y},\n"
        "             top: {kind: symmetry, nodes: ring.top, normal: y}}\n"
        "loads: {air: {kind: follower_pressure, facets: [ring.left],\n"
        "        profile: {kind: constant, value: 4 kPa, ramp: 1 ms}}}\n" + MATERIAL
    )
    inner = model.bodies[0].node_sets["left"]
    assert model.points[inner, 0] == pytest.approx(5e-3)
    count = int(1e-3 / (0.8 * stable_step(model, model.points).value)) // 10 * 10 + 10
    solver = ExplicitSolver([model])
    memory = solver.state()
    histories = []
    for refinement in (1, 8, 16, 64):
        begin_again(solver, memory, 1e-3 / (count * refinement))
        radii = []
        for _ in range(30):  # tenths of a millisecond
            solver.advance(count * refinement // 10)
            radii.append(solver.positions()[0][inner, 0].mean())
        histories.append(np.array(radii))
    off = [np.abs(h - histories[-1]).max() for h in histories[:-1]]
    order = np.log2(off[1] / off[2])
    inflated, finest = (h.max() - 5e-3 for h in histories[:: len(histories) - 1])
    record_verification("inflation [m], step and a 64th of it", finest, inflated, order)
    assert finest > 0.5e-3
    assert off[0] < 1e-3 * finest
    # (1 - 1/64) / (1/4 - 1/64) = 4.2 for second order.
    assert off[1] / off[2] == pytest.approx(4.2, rel=0.1)


def test_work_of_a_prescribed_motion(build, fresh_taichi, record_verification):
    """The end of a block is moved, faster than waves can follow quietly: the work of the support
    is what the block stores and what still moves in it, to the second order of the step.
    """
    from softsim.solver.energy import EnergyReader
    from softsim.solver.explicit import ExplicitSolver
    from softsim.solver.stable_step import stable_step

    s = np.linspace(0.0, 1.0, 65)
    rise = s * s * (3.0 - 2.0 * s)
    points = ", ".join(
        f"[{500 * a:.6f} us, {800 * b:.9f} um]" for a, b in zip(s, rise, strict=True)
    )
    model = build(
        "bodies: {b: {mesh: {generator: block, length: 2 mm, height: 2 mm, element_size: 0.5 mm},\n"
        "  formulation: plane_strain, thickness: 1 mm, material: rubber, fixed: [bottom]}}\n"
        "conditions: {lift: {kind: prescribed, nodes: b.top, direction: y,\n"
        f"  displacement: {{kind: table, points: [{points}]}}}}}}\n" + MATERIAL
    )
    solver = ExplicitSolver([model])
    memory, reader = solver.state(), EnergyReader(solver)
    # Stretched to 1.4 at the end, and more where the waves meet, it needs half the step of rest.
    coarse = 0.45 * stable_step(model, model.points).value
    count = int(1e-3 / coarse) + 1
    errors = []
    for refinement in (1, 2, 4):
        begin_again(solver, memory, 1e-3 / count / refinement)
        solver.advance(count * refinement)
        energies = reader.read()
        stored = energies.internal + energies.kinetic
        errors.append(abs(stored / energies.external_work - 1.0))
    assert energies.kinetic > 1e-3 * energies.internal
    order = np.log2(errors[0] / errors[1])
    work = energies.external_work
    record_verification("work of a prescribed motion [J]", work, stored, order)
    assert errors[0] < 1e-3
    assert errors[2] < 0.35 * errors[1] < 0.35**2 * errors[0]
