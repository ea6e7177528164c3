"""Rigid bodies with six degrees of freedom: Euler's top, steady force, a frame in a soft skin.

Every scene needs a meshed body: a soft box far away keeps the rigid one company.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

COMPANY = """
bodies:
  far: {mesh: {generator: box, length: 100 mm, height: 100 mm, width: 100 mm, element_size: 100 mm},
        formulation: solid, material: soft, position: [1 m, 1 m, 1 m]}
materials: {soft: {law: neo_hooke, C10: 10 Pa, density: 1000 kg/m^3}}
environment: {gravity: 0 m/s^2}
time: {end: 10 s}
"""


@pytest.fixture
def lone(build, cpu):
    """A solver for COMPANY and a rigid body that turns with `omega`, with steps of dt."""
    from softsim.solver.explicit import ExplicitSolver
    from softsim.solver.time_step import stable_increment

    def solver_for(text, dt, omega=(0.0, 0.0, 0.0)):
        model = build(COMPANY + text)
        assert dt < stable_increment(model, model.points).value
        (body,) = model.rigid_bodies
        turning = replace(body, angular_velocity=np.array(omega, dtype=float))
        solver = ExplicitSolver([replace(model, rigid_bodies=(turning,))])
        solver.begin(dt)
        return solver

    return solver_for


def orientation(solver):
    """R (3, 3), and omega in space [rad/s], both at the time of the positions."""
    bodies = solver.terms.rigid_bodies
    R = bodies.rotation.to_numpy()[0, 0]
    L = bodies.angular_momentum.to_numpy()[0, 0]
    return R, R @ bodies.inverse_inertia.to_numpy()[0] @ R.T @ L


# Free tumbling ------------------------------------------------------------------------------------

INERTIA = np.array([1e-6, 2e-6, 3e-6])
SPIN = np.array([0.2, 20.0, 0.3])  # near the middle axis, where it flips over
TUMBLING = """
rigid_bodies: {body: {mass: 5 g, inertia: [1 kg*mm^2, 2 kg*mm^2, 3 kg*mm^2]}}
"""


def euler_top(duration):
    """R and omega in space after `duration` by Euler's equations in body axes, to 1e-12."""

    def slopes(_, y):
        omega, q = y[:3], y[3:]
        turning = (INERTIA[[1, 2, 0]] - INERTIA[[2, 0, 1]]) / INERTIA
        alpha = turning * omega[[1, 2, 0]] * omega[[2, 0, 1]]
        w, v = q[0], q[1:]
        return [*alpha, -0.5 * v @ omega, *(0.5 * (w * omega + np.cross(v, omega)))]

    start = [*SPIN, 1.0, 0.0, 0.0, 0.0]
    y = solve_ivp(slopes, (0.0, duration), start, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    R = Rotation.from_quat([*y[4:], y[3]]).as_matrix()
    return R, R @ y[:3]


def test_tumbling(lone, record_verification):
    """A body spun about its middle axis flips over; attitude, omega and energy to O(dt^2).

    Angular momentum stays to round-off. Halving the step divides each error by 4, give or take
    what the fourth order adds: 0.1 in the order.
    """
    duration, steps = 2.0, np.array([1e-3, 0.5e-3, 0.25e-3])
    R_exact, omega_exact = euler_top(duration)
    energy = 0.5 * INERTIA @ SPIN**2
    errors = []
    for dt in steps:
        solver = lone(TUMBLING, dt, SPIN)
        lowest, drift = 1.0, 0.0
        for _ in range(100):
            solver.advance(round(duration / dt) // 100)
            R, omega = orientation(solver)
            L = solver.terms.rigid_bodies.angular_momentum.to_numpy()[0, 0]
            # Round-off: nothing adds to it in free flight.
            np.testing.assert_allclose(L, INERTIA * SPIN, rtol=0.0, atol=1e-15 * np.abs(L).max())
            lowest = min(lowest, R[1, 1])
            drift = max(drift, abs(0.5 * omega @ L / energy - 1.0))
            np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)
        assert lowest < -0.9  # it did flip over
        angle = Rotation.from_matrix(R @ R_exact.T).magnitude()
        errors.append([angle, np.linalg.norm(omega - omega_exact) / 20.0, drift])
    errors = np.array(errors)
    orders = np.log2(errors[:-1] / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.1)
    for name, error, order in zip(("attitude [rad]", "omega", "energy"), errors[-1], orders[-1],
                                  strict=True):  # fmt: skip
        record_verification(f"tumbling body, 0.25 ms: error of {name}", 0.0, error, order)


def test_top_precesses(lone, record_verification):
    """A free symmetric top: its axis turns about L at |L| / I_1, its body about the axis.

    Both turns of a step are made about omega of its middle, predicted from its start: the scheme is
    of second order, so the rate's relative error falls by 4 with half the step.
    """
    I1, I3 = 1e-6, 1.8e-6
    spin = np.array([6.0, 0.0, 10.0])
    L = np.array([I1, I1, I3]) * spin
    exact = np.linalg.norm(L) / I1
    text = """
rigid_bodies: {top: {mass: 5 g, inertia: [1 kg*mm^2, 1 kg*mm^2, 1.8 kg*mm^2]}}
"""
    up = L / np.linalg.norm(L)
    across = np.cross(up, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    frame = np.array([across, np.cross(up, across)])
    errors = []
    for dt in (1e-3, 0.5e-3):
        solver = lone(text, dt, spin)
        angles, tilts = [], []
        for _ in range(100):
            solver.advance(round(1.0 / dt) // 100)
            axis = orientation(solver)[0][:, 2]
            angles.append(np.arctan2(*(frame @ axis)[::-1]))
            tilts.append(axis @ up)
        turned = np.unwrap(angles)
        rate = (turned[-1] - turned[0]) / (0.99 * solver.time)
        errors.append([rate / exact - 1.0, np.abs(np.array(tilts) / up[2] - 1.0).max()])
    order = np.log2(np.abs(errors[0]) / np.abs(errors[1]))
    # One turn of the axis in 0.33 s, 332 steps of 19 mrad: (19e-3)^2 = 4e-4 of it at most.
    assert abs(errors[0][0]) < (exact * 1e-3) ** 2
    np.testing.assert_allclose(order, 2.0, atol=0.1)
    record_verification(
        "symmetric top, 0.5 ms: precession [rad/s]", exact, exact * (1.0 + errors[1][0]), order[0]
    )


# Force and torque ---------------------------------------------------------------------------------


def test_steady_force(lone, record_verification):
    """x = F t^2 / (2 m) exactly: central differences are exact for a constant acceleration. What is
    not free stays.
    """
    text = """
rigid_bodies: {body: {mass: 5 g, inertia: 1 kg*mm^2, free: [x, z, rotation]}}
loads: {push: {kind: rigid_force, acts_on: body, force: [0.3 N, 0.2 N, -0.1 N]}}
"""
    solver = lone(text, 1e-3)
    solver.advance(1000)
    centre = solver.terms.rigid_bodies.centre.to_numpy()[0, 0]
    exact = np.array([0.3, 0.0, -0.1]) / 5e-3 / 2.0
    # Round-off of a thousand additions.
    np.testing.assert_allclose(centre, exact, rtol=1e-12)
    record_verification("steady force on a body in space: x [m]", exact[0], centre[0])
