"""Two chains side by side in space against conservation, symmetry, the plane's and closed forms."""

import numpy as np
import pytest

from softsim.apps.chain.motion import Motion, fixed_steps, simulate
from softsim.apps.chain.running import build_chain
from softsim.apps.chain.scene import load_chain

pytestmark = pytest.mark.physics  # whole motions

FREE = (
    "motor.eccentricity=0 mm", "drag=0 N*s/m", "friction.coefficient=0", "limbs.thrust_ratio=0",
    "limbs.damping=0 N*s/m", "gravity=0 m/s^2", "backbone.bending=joint",
)  # fmt: skip
MIRROR = np.array([1.0, -1.0, 1.0])


def chain(*overrides):
    return build_chain(load_chain("leafbot_x5", overrides))


def moved(which, start, end, steps):
    times = np.linspace(0.0, end, steps + 1)
    states = fixed_steps(which.rates, times, start)
    return Motion(which, times, states[:, 0], states[:, 1])


def driven(*overrides):
    loaded = load_chain("leafbot_x5", ["time.end=0.1 s", *overrides])
    return simulate(build_chain(loaded), loaded.scene.time)


def thrown(which, seed=1):
    """A state far above the ground: it turns about all three axes, bends and is twisted."""
    start = which.at_rest()
    middle = start[0].mean(axis=0)
    start[1] = np.cross([3.0, -5.0, 8.0], start[0] - middle)
    start[1] += [0.2, -0.1, 0.3]
    start[1, :, 2] += 0.3 * np.random.default_rng(seed).uniform(-1.0, 1.0, which.node_count)
    start[0, :, 2] += 1.0
    return start


def test_a_free_robot_keeps_momentum_and_energy_and_its_lengths(record_verification):
    which = chain(*FREE)
    motion = moved(which, thrown(which), 0.1, 1000)
    momentum = which.masses @ motion.v
    turning = np.einsum("n,rnx->rx", which.masses, np.cross(motion.p, motion.v))
    ahead = which.motors.lattice.headings(motion.p)[:, 0]
    assert np.ptp(np.arctan2(ahead[:, 1], ahead[:, 0])) > 0.5
    left, right = motion.p[:, :2], motion.p[:, 5:7]
    tilts = [(side[:, 0] - side[:, 1])[:, 2] for side in (left, right)]
    assert np.ptp(tilts[0] - tilts[1]) > 1e-3  # it twists
    assert np.abs(momentum - momentum[0]).max() < 1e-12 * np.linalg.norm(momentum[0])
    off = np.abs(turning - turning[0]).max() / np.linalg.norm(turning[0])
    record_verification("two chains, turning of a free robot, off by", 0.0, off)
    assert off < 1e-6
    assert motion.energy_error < 1e-5
    assert np.abs(which.links.errors(motion.p)).max() < 1e-7


def test_its_steps_are_of_order_four(record_verification):
    which = chain(*FREE)
    ends = [moved(which, thrown(which), 0.02, steps).p[-1] for steps in (100, 200, 400, 800)]
    errors = [np.abs(one - ends[-1]).max() for one in ends[:-1]]
    order = np.log2(errors[0] / errors[1])
    record_verification("two chains, free robot after 0.02 s, 200 steps [m]", 0.0, errors[1], order)
    assert order == pytest.approx(4.0, abs=0.4)


@pytest.mark.parametrize("place", ["rear", "middle", "front"])
def test_the_left_motor_alone_mirrors_the_right_one_alone(place, record_verification):
    """To round-off: neither the lattice nor a force prefers a side."""
    given = (f"motor.place={place}", "limbs.thrust=all", "wave_tension=0.4 N")
    left, right = (driven(*given, f"sides.running={side}") for side in ("left", "right"))
    mirrored = right.p[:, [*range(5, 10), *range(5)]] * MIRROR
    off = np.abs(left.p - mirrored).max()
    record_verification(f"two chains, {place} motors, left and right mirrored [m]", 0.0, off)
    assert np.ptp(left.centre[:, 1]) > 1e-6
    assert off < 1e-14


@pytest.mark.parametrize("load", ["weight", "normal_force"])
def test_two_equal_motors_move_both_sides_as_the_chain_in_the_plane(load, record_verification):
    given = (f"friction.load={load}", "motor.place=front", "rows.under_head=2", "limbs.thrust=all",
             "wave_tension=0.4 N")  # fmt: skip
    both, plane = driven(*given), driven(*given, "sides=null")
    assert plane.p.shape[1:] == (4, 2) and np.ptp(plane.centre[:, 0]) > 1e-3
    record_verification(
        f"two chains, way of the plane's, friction of the {load} [m]", plane.way[-1], both.way[-1]
    )
    for side, y in ((both.p[:, :4], 0.015), (both.p[:, 4:], -0.015)):
        assert np.abs(side[..., [0, 2]] - plane.p).max() < 1e-14
        assert np.abs(side[..., 1] - y).max() < 1e-14


def test_a_sliding_robot_is_stopped_in_its_direction(record_verification):
    """After v^2 / (2 mu g), wherever it slides to: friction is one vector, not one of each axis."""
    which = chain("motor.eccentricity=0 mm", "drag=0 N*s/m", "limbs.thrust_ratio=0",
                  "limbs.damping=5 N*s/m", "friction.coefficient=0.2")  # fmt: skip
    start = which.at_rest()
    start[0, :, 2] = -9.81 * which.masses / which.stores["limbs"].stiffnesses
    start[1] = [0.15, -0.2, 0.0]
    motion = moved(which, start, 0.15, 1500)
    way = motion.centre[-1] - motion.centre[0]
    exact = 0.25**2 / (2.0 * 0.2 * 9.81)
    record_verification("two chains, slide until they stop [m]", exact, np.linalg.norm(way))
    assert way[:2] == pytest.approx([0.6 * exact, -0.8 * exact], rel=0.01)
    assert np.linalg.norm(motion.v[-1], axis=-1).max() < 1e-3
