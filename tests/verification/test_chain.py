"""A chain of masses on springs against closed forms, conservation and the order of its steps."""

import numpy as np
import pytest

from softsim.apps.chain.motion import Motion, adaptive_steps, fixed_steps
from softsim.apps.chain.running import build_chain
from softsim.apps.chain.scene import load_chain

pytestmark = pytest.mark.physics  # whole motions

OFF = ("motor.eccentricity=0 mm", "drag=0 N*s/m", "friction.coefficient=0")
FREE = (*OFF, "limbs.damping=0 N*s/m", "limbs.thrust_ratio=0")
PENDULUM = (*FREE, "rows.count=3")  # of head and one row: two nodes


def chain(*overrides, name="leafbot5"):
    return build_chain(load_chain(name, overrides))


def moved(which, start, end, steps):
    times = np.linspace(0.0, end, steps + 1)
    states = fixed_steps(which.rates, times, start)
    return Motion(which, times, states[:, 0], states[:, 1])


def kicked(which, height, speed, seed=1):
    """A state above the ground whose nodes have random velocities that stretch no link."""
    start = which.at_rest()
    start[0, :, -1] += height
    start[1, :, -1] = speed * np.random.default_rng(seed).uniform(-1.0, 1.0, which.node_count)
    return start


@pytest.mark.parametrize("bending", ["tilt", "joint"])
def test_energy_is_conserved(bending):
    """In the air to the order of the steps; across contacts, where stiffness jumps, to order 2."""
    which = chain(*FREE, f"backbone.bending={bending}", "slope=5 deg")
    assert moved(which, kicked(which, 1.0, 0.5), 0.05, 500).energy_error < 1e-6
    coarse, fine = (moved(which, kicked(which, 3e-4, 0.1), 0.3, n) for n in (1500, 3000))
    assert 0.1 < (fine.p[..., -1] < 0.0).mean() < 0.9
    assert fine.energy_error < min(1e-4, coarse.energy_error / 3.5)


def test_works_are_what_the_energy_gains():
    """To order 2, where no force jumps: they are summed by trapezoids."""
    which = chain(
        "slope=5 deg", "wave_tension=0.4 N", "limbs.thrust=all", "friction.load=normal_force"
    )
    coarse, fine = (moved(which, which.at_rest(), 0.1, n) for n in (500, 1000))
    assert fine.works["friction"][-1] < 0.0 < fine.works["motor"][-1]
    assert fine.energy_error < min(1e-4, coarse.energy_error / 3.5)


def test_a_free_chain_keeps_its_momentum():
    which = chain(*FREE, "gravity=0 m/s^2", "backbone.bending=joint")
    motion = moved(which, kicked(which, 1.0, 0.5), 0.1, 1000)
    momentum = which.masses @ motion.v
    turning = turning_of(motion.p, motion.v)
    assert np.ptp(tilt(motion.p)) > 0.3
    assert np.abs(momentum - momentum[0]).max() < 1e-12 * np.linalg.norm(momentum[0])
    assert np.ptp(turning @ which.masses) < 1e-6 * np.ptp(turning[:, 0] * 2.6e-3)


def turning_of(p, v):
    """p x v of each node in the plane, from x to z (..., n)."""
    return p[..., 0] * v[..., 1] - p[..., 1] * v[..., 0]


def tilt(p):
    """Of the first link (...) [rad]."""
    d = p[..., 0, :] - p[..., 1, :]
    return np.arctan2(d[..., 1], d[..., 0])


def test_bending_by_tilt_turns_a_free_chain():
    """It is held by the horizon: angular momentum is not kept."""
    which = chain(*FREE, "gravity=0 m/s^2")
    motion = moved(which, kicked(which, 1.0, 0.5), 0.1, 1000)
    centre = motion.p - (which.masses @ motion.p / which.masses.sum())[:, None]
    turning = turning_of(centre, motion.v) @ which.masses
    assert np.ptp(turning) > 0.5 * np.abs(turning[0])


def pendulum(angle):
    """Two nodes and a link that is tilted by `angle` [rad], far above the ground."""
    which = chain(*PENDULUM)
    (length,) = which.links.lattice.lengths
    start = np.zeros((2, 2, 2))
    start[0] = [0.0, 1.0]
    start[0, 0] += length * np.array([np.cos(angle), np.sin(angle)])
    return which, start


def closed_form(which, angle, times):
    """psi = psi0 cos(w t), w^2 = k / (mu L^2) with the reduced mass mu, however large psi0; the
    centre of mass falls freely.
    """
    (length,), (head, rear) = which.links.lattice.lengths, which.masses
    reduced = head * rear / (head + rear)
    swing = np.sqrt(0.002 / (reduced * length**2))
    link = length * np.exp(1j * angle * np.cos(swing * times))
    centre = 1j + head / (head + rear) * length * np.exp(1j * angle) - 0.5j * 9.81 * times**2
    both = np.stack([centre + rear / (head + rear) * link, centre - head / (head + rear) * link], 1)
    return np.stack([both.real, both.imag], -1)


@pytest.mark.parametrize("angle", [0.1, 1.2])
def test_a_pendulum_of_two_nodes_swings_as_its_closed_form(angle, record_verification):
    which, start = pendulum(angle)
    motion = moved(which, start, 0.2, 2000)
    exact = closed_form(which, angle, motion.times)
    tilts = [float(tilt(p[-1])) for p in (exact, motion.p)]
    record_verification(f"chain, pendulum tilted by {angle} rad, after 0.2 s [rad]", *tilts)
    assert np.abs(motion.p - exact).max() < 1e-6 * which.links.lattice.lengths[0]
    assert np.abs(which.links.errors(motion.p)).max() < 1e-6 * which.links.lattice.lengths[0]


def test_fixed_steps_are_of_order_four(record_verification):
    which, start = pendulum(1.2)
    errors = []
    for steps in (200, 400, 800):
        motion = moved(which, start, 0.05, steps)
        errors.append(np.abs(motion.p[-1] - closed_form(which, 1.2, motion.times)[-1]).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    record_verification("chain, pendulum after 0.05 s, 800 steps [m]", 0.0, errors[-1], orders[-1])
    assert orders == pytest.approx(4.0, abs=0.3)


def test_adaptive_steps_find_the_pendulum_too():
    which, start = pendulum(1.2)
    times = np.linspace(0.0, 0.05, 501)
    states = adaptive_steps(which.rates, times, start)
    assert np.abs(states[:, 0] - closed_form(which, 1.2, times)).max() < 1e-6


@pytest.mark.parametrize("bending", ["tilt", "joint"])
def test_a_damped_chain_sags_on_its_springs(bending, record_verification):
    """As the linear equations of small angles say; bending makes nodes share."""
    which = chain(*OFF, "limbs.thrust_ratio=0", f"backbone.bending={bending}", "masses.head=10 g")
    motion = moved(which, which.at_rest(), 0.2, 1000)
    exact, found = _sag(which, bending), motion.p[-1, :, 1]
    record_verification(f"chain, sag of the head, bending {bending} [m]", exact[0], found[0])
    assert found == pytest.approx(exact, rel=1e-4)


def _sag(which, bending):
    tilts = (np.eye(3, 4) - np.eye(3, 4, k=1)) / which.links.lattice.lengths[:, None]
    angles = tilts if bending == "tilt" else tilts[:-1] - tilts[1:]
    springs = np.diag(which.stores["limbs"].stiffnesses)
    return np.linalg.solve(springs + 0.002 * angles.T @ angles, -9.81 * which.masses)


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_a_chain_slides_down_a_slope(friction, record_verification):
    """With g (sin - mu cos): all nodes lie on the ground."""
    slope = np.radians(20.0)
    which = chain(*OFF, "limbs.thrust_ratio=0", "slope=20 deg", f"friction.coefficient={friction}")
    motion = moved(which, which.at_rest(), 0.2, 1000)
    pulled = (motion.v[-1, 0, 0] - motion.v[-501, 0, 0]) / 0.1
    exact = -9.81 * (np.sin(slope) - friction * np.cos(slope))
    record_verification(f"chain, slides at friction {friction} [m/s^2]", exact, pulled)
    assert pulled == pytest.approx(exact, rel=1e-3)


def test_a_block_below_the_friction_angle_creeps_only():
    which = chain(*OFF, "limbs.thrust_ratio=0", "slope=20 deg", "friction.coefficient=0.7")
    motion = moved(which, which.at_rest(), 0.2, 1000)
    crept = -1e-3 * np.arctanh(np.tan(np.radians(20.0)) / 0.7)  # where tanh is in balance
    assert motion.v[-1, :, 0] == pytest.approx(crept, rel=1e-2)
