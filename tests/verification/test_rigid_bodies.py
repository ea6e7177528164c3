"""Rigid bodies with six degrees of freedom: Euler's top, steady force, a frame in a soft skin."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from softsim.compute import fields

# A scene needs a meshed body: a soft box far away. Its own stable step is 40 ms.
BODIES = """
bodies:
  far: {mesh: {generator: box, length: 100 mm, height: 100 mm, width: 100 mm, element_size: 100 mm},
        formulation: solid, material: soft, position: [1 m, 1 m, 1 m]}
materials: {soft: {law: neo_hooke, C10: 10 Pa, density: 1000 kg/m^3}}
rigid_bodies:
  tumbler: {mass: 5 g, inertia: [1 kg*mm^2, 2 kg*mm^2, 3 kg*mm^2]}
  top: {mass: 5 g, inertia: [1 kg*mm^2, 1 kg*mm^2, 1.8 kg*mm^2]}
  pushed: {mass: 5 g, inertia: 1 kg*mm^2, free: [x, z, rotation]}
loads: {push: {kind: rigid_force, acts_on: pushed, force: [0.3 N, 0.2 N, -0.1 N]}}
environment: {gravity: 0 m/s^2}
time: {end: 1 s}
"""
TUMBLER_INERTIA, TOP_INERTIA = np.array([1e-6, 2e-6, 3e-6]), np.array([1e-6, 1e-6, 1.8e-6])
SPINS = {
    "tumbler": np.array([0.2, 20.0, 0.3]),  # near the middle axis, where it flips over
    "top": np.array([6.0, 0.0, 10.0]),
    "pushed": np.zeros(3),
}
STEPS = (0.5e-3, 0.25e-3)
TIMES = np.linspace(0.0, 1.0, 51)


@dataclass(frozen=True)
class Flight:
    """Of all bodies at TIMES: rotation (51, bodies, 3, 3), angular momentum [kg m^2/s] and angular
    velocity [rad/s] in space, centre [m] (51, bodies, 3).
    """

    rotation: np.ndarray
    momentum: np.ndarray
    omega: np.ndarray
    centre: np.ndarray


@pytest.fixture(scope="module")
def flights(kernel_cache, tmp_path_factory):
    """The flight of BODIES with each of the STEPS."""
    from pathlib import Path

    from softsim.builder import build_model
    from softsim.compute import backend
    from softsim.scene.loading import load_scene
    from softsim.solver.explicit import ExplicitSolver
    from softsim.solver.stable_step import stable_step

    scene = tmp_path_factory.mktemp("bodies") / "scene.yaml"
    scene.write_text(BODIES, encoding="utf-8")
    model = build_model(load_scene(scene))
    assert max(STEPS) < stable_step(model, model.points).value
    # A scene knows spins about z only.
    spun = tuple(replace(b, angular_velocity=SPINS[b.name]) for b in model.rigid_bodies)
    backend.start("cpu", cache=Path(kernel_cache))
    solver = ExplicitSolver([replace(model, rigid_bodies=spun)])
    bodies, initial = solver.terms.rigid_bodies, solver.state()
    inverse_inertia = fields.read(bodies.inverse_inertia)
    result = []
    for dt in STEPS:
        solver.restore(initial, 0.0, 0, dt)
        solver.begin(dt)
        rows = []
        for t in TIMES:
            solver.advance(round((t - solver.time) / dt))
            R, L = fields.read(bodies.rotation)[0], fields.read(bodies.angular_momentum)[0]
            omega = np.einsum("bij,bjk,blk,bl->bi", R, inverse_inertia, R, L)
            rows.append([R, L, omega, fields.read(bodies.centre)[0]])
        result.append(Flight(*(np.array(column) for column in zip(*rows, strict=True))))
    return result


# Free turning -------------------------------------------------------------------------------------


def euler_top(inertia, spin, duration):
    """R and omega in space after `duration` by Euler's equations in body axes, to 1e-12."""

    def slopes(_, y):
        omega, w, v = y[:3], y[3], y[4:]
        moments = inertia[[1, 2, 0]] - inertia[[2, 0, 1]]
        alpha = moments / inertia * omega[[1, 2, 0]] * omega[[2, 0, 1]]
        return [*alpha, -0.5 * v @ omega, *(0.5 * (w * omega + np.cross(v, omega)))]

    start = [*spin, 1.0, 0.0, 0.0, 0.0]
    y = solve_ivp(slopes, (0.0, duration), start, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    R = Rotation.from_quat([*y[4:], y[3]]).as_matrix()
    return R, R @ y[:3]


def test_tumbling(flights, record_verification):
    """A body spun about its middle axis flips over; attitude, omega and energy to O(dt^2).

    Halving the step divides each error by 4, give or take what the third order adds, a tenth of the
    order. (The third order drifts and leads after some flips, as the unstable middle lets every
    error grow; so the comparison is half-way through the second one.)
    """
    end = np.searchsorted(TIMES, 0.6 - 1e-9)
    spin = SPINS["tumbler"]
    R_exact, omega_exact = euler_top(TUMBLER_INERTIA, spin, TIMES[end])
    energy = 0.5 * TUMBLER_INERTIA @ spin**2
    errors = []
    for flight in flights:
        R, L, omega = (a[:, 0] for a in (flight.rotation, flight.momentum, flight.omega))
        assert R[:, 1, 1].min() < -0.99  # it did flip over
        drift = 0.5 * np.einsum("ti,ti->t", omega, L)[: end + 1] / energy - 1.0
        angle = Rotation.from_matrix(R[end] @ R_exact.T).magnitude()
        spin_error = np.linalg.norm(omega[end] - omega_exact) / np.linalg.norm(spin)
        errors.append([angle, spin_error, np.abs(drift).max()])
    orders = np.log2(np.divide(*errors))
    np.testing.assert_allclose(orders, 2.0, atol=0.1)
    # A step turns by 20 rad/s dt and is off by the cube of that at most; 12 rad of such steps.
    assert errors[0][0] < 20.0 * TIMES[end] * (20.0 * STEPS[0]) ** 2
    names = ("attitude [rad]", "omega over 20 rad/s", "energy, relative")
    for name, error, order in zip(names, errors[1], orders, strict=True):
        record_verification(f"tumbling body, 0.25 ms: error of {name}", 0.0, error, order)


def test_free_turning_keeps_angular_momentum(flights, record_verification):
    """To the last bit, as no torque adds to it; and rotations stay rotations to round-off."""
    for flight in flights:
        L = flight.momentum[:, :2]
        exact = [TUMBLER_INERTIA * SPINS["tumbler"], TOP_INERTIA * SPINS["top"]]
        change = np.abs(L - exact).max() / np.abs(exact).max()
        assert change < 1e-15
        R = flight.rotation
        assert np.abs(np.einsum("tbij,tbkj->tbik", R, R) - np.eye(3)).max() < 1e-14
    record_verification("free bodies: change of angular momentum, relative", 0.0, change)


def test_top_precesses(flights, record_verification):
    """A free symmetric top: its axis turns about L at |L| / I_1 and keeps its tilt.

    Both are of second order at least: half the step, a quarter of the error.
    """
    L = TOP_INERTIA * SPINS["top"]
    exact = np.linalg.norm(L) / TOP_INERTIA[0]
    up = L / np.linalg.norm(L)
    across = np.cross(up, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    errors = []
    for flight in flights:
        axis = flight.rotation[:, 1, :, 2]
        turned = np.unwrap(np.arctan2(axis @ np.cross(up, across), axis @ across))
        rate = (turned[-1] - turned[0]) / TIMES[-1]
        errors.append([abs(rate / exact - 1.0), np.abs(axis @ up - up[2]).max()])
    order, order_of_tilt = np.log2(np.divide(*errors))
    # A step of 0.5 ms turns the axis by 9.5 mrad: of each turn it misses the square at most.
    assert errors[0][0] < (exact * STEPS[0]) ** 2
    assert order == pytest.approx(2.0, abs=0.1)
    assert order_of_tilt > 1.9
    record_verification("symmetric top, 0.25 ms: precession [rad/s]", exact, rate, order)


def test_steady_force(flights, record_verification):
    """x = F t^2 / (2 m) at every step: central differences are exact for a constant acceleration.
    What is not free stays.
    """
    exact = 0.5 * TIMES[:, None] ** 2 * np.array([0.3, 0.0, -0.1]) / 5e-3
    for flight in flights:
        centre = flight.centre[:, 2]
        # Round-off of thousands of additions.
        np.testing.assert_allclose(centre, exact, rtol=1e-11, atol=1e-15)
    record_verification("steady force on a body in space: x [m]", exact[-1, 0], centre[-1, 0])


# A frame in a soft skin ---------------------------------------------------------------------------

ROBOT = """
bodies:
  skin: {mesh: {generator: pfr_solid, rows: 0, element_size: 3 mm,
                # no spikes, but the generator wants them thicker than its elements
                spikes_around: 4, root_thickness: 4 mm, tip_thickness: 4 mm, spike_width: 4 mm,
                spike_height: 3 mm, lean: 0 mm},
         formulation: solid, material: dragon_skin_10,
         initial_velocity: [0.3 m/s, 0.1 m/s, -0.2 m/s]}
rigid_bodies:
  frame: {mass: 8.8 g, inertia: [0.4 kg*mm^2, 1 kg*mm^2, 0.8 kg*mm^2], tied: [skin.knots],
          center: [1 mm, 0.3 mm, 0.2 mm], initial_velocity: [0 m/s, 0.2 m/s, 0.1 m/s],
          initial_angular_velocity: 20 rad/s, outline: {length: 26 mm, height: 14.2 mm},
          supports: [skin.chamber], support_friction_coefficient: 0.4}
environment: {gravity: 0 m/s^2}
loads:
  air: {kind: follower_pressure, facets: [skin.chamber], reacts_on: frame,
        profile: {kind: constant, value: 1 kPa, ramp: 20 ms}}
time: {end: 1 s}
"""


def momenta(solver):
    """Linear and angular momentum about the origin (3,), at half steps as the scheme keeps them."""
    model, terms = solver.models[0], solver.terms
    free = model.is_free.all(axis=1)
    m, x = model.mass[free], solver.positions()[0][free]
    v = fields.read(terms.nodes.velocity)[0][free]
    bodies = terms.rigid_bodies
    M, X = fields.read(bodies.mass)[0], fields.read(bodies.centre)[0, 0]
    V = fields.read(bodies.velocity)[0, 0]
    angular = m @ np.cross(x, v) + M * np.cross(X, V)
    return m @ v + M * V, angular + fields.read(bodies.angular_momentum)[0, 0]


def test_frame_and_skin_keep_momenta(build, start, record_verification):
    """A robot in space that inflates, vibrates and tumbles freely: pressure in its closed chamber,
    what the skin does to the knots and the rubbing on the frame's outline are inner forces, so both
    momenta stay, but for round-off: 4000 increments of 2e-16.
    """
    solver = start(build(ROBOT))
    before = momenta(solver)
    solver.advance(4000)
    after = momenta(solver)
    terms = solver.terms
    assert fields.read(terms.supports[0].friction_dissipation).sum() > 0.0
    assert np.abs(fields.read(terms.rigid_bodies.rotation) - np.eye(3)).max() > 0.3
    assert fields.read(terms.elements[0].pressure.J).std() > 1e-4  # the skin works
    for name, old, new in zip(("linear", "angular"), before, after, strict=True):
        change = np.linalg.norm(new - old) / np.linalg.norm(old)
        assert change < 1e-12
        record_verification(f"robot in space, {name} momentum: relative change", 0.0, change)
