"""Leafbot with depths, masses and force all scaled by one number moves as the whole one does.

The thesis's limb study shakes its section with 1/49 of the motor's force (App. A, 0.0065 N of
0.318 N at 170 Hz). Of a section whose depths and masses are scaled alike that is the same motion,
as in `test_scaled_section`, here in contact from the start: to round-off with 1/49, and to the last
bit with 1/64, by which a binary number is scaled without any.
"""

import io
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

LEAFBOT = Path(__file__).parents[2] / "scenes" / "leafbot5.yaml"


def scaled(share: float) -> list[str]:
    """What makes the robot of this share of its depths, masses and force."""
    return [
        f"bodies.body.thickness={15 * share!r} mm",
        f"bodies.body.regions.limbs.thickness={4 * share!r} mm",
        f"rigid_bodies.head.mass={1.8 * share!r} g",
        f"rigid_bodies.head.inertia={0.02 * share!r} kg*mm^2",
        f"loads.motor.eccentric_mass={0.082 * share!r} g",
    ]


@pytest.mark.slow
def test_depth_mass_and_force_scaled_alike_change_nothing(tmp_path, kernel_cache, monkeypatch):
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run

    # The same step for all: the automatic one is found by iterations, with round-off of their own.
    moment = ["time.end=40 ms", "time.settle=null", "time.increment=4 us"]
    histories = {
        share: run(
            LEAFBOT,
            [*moment, "output.history_interval=1 ms", *scaled(share)],
            tmp_path / f"{share:.3f}",
            "cpu",
            console=Console(file=io.StringIO()),
        ).history
        for share in (1.0, 1 / 49, 1 / 64)
    }
    whole = histories[1.0]
    assert np.ptp(whole["contact_count"]) >= 3  # it hops
    assert np.ptp(whole["frame_x"]) > 1e-4
    for column in ("frame_x", "frame_y", "frame_angle", "body_x", "body_y"):
        np.testing.assert_array_equal(histories[1 / 64][column], whole[column])
        size = np.abs(whole[column]).max()
        np.testing.assert_allclose(histories[1 / 49][column], whole[column], atol=1e-9 * size)
    for share, history in histories.items():
        assert history["wall_force_y"][1:] == pytest.approx(
            share * whole["wall_force_y"][1:], rel=1e-6, abs=1e-6 * share
        )
