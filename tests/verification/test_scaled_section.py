"""A section whose depth, masses and forces are all scaled by one number moves as if nothing were.

m a = f, with every f of elements, pressure and contact proportional to the depth. So the thesis's
plane model (scenes/pfr_36mm_literal.yaml), whose force is 1/186 of the motor's, needs its depth and
mass scaled alike, and then says the same as the section of full depth. Both are given the same
step, for the automatic one is found by iterations, whose round-off is another on each processor;
what differs is the round-off of about 1,500 increments, each 1e-16 of the position or a few times
that, which vibration makes grow no faster than contact does, tenfold in 50 increments of contact.
There is none yet within the first 10 ms.
"""

import io
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

LITERAL = Path(__file__).parents[2] / "scenes" / "pfr_36mm_literal.yaml"
SCALE = 186.0


def test_depth_mass_and_force_scaled_alike_change_nothing(tmp_path, kernel_cache, monkeypatch):
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run

    whole = [
        f"bodies.skin.thickness={0.0376 * SCALE} mm",
        f"rigid_bodies.frame.mass={0.0459 * SCALE} g",
        f"rigid_bodies.frame.inertia={0.00538 * SCALE} kg*mm^2",
        f"loads.motor.amplitude={0.0077 * SCALE} N",
    ]
    histories = [
        run(
            LITERAL,
            ["time.end=10 ms", "time.increment=6 us", "output.history_interval=1 ms", *overrides],
            tmp_path / name,
            "cpu",
            console=Console(file=io.StringIO()),
        ).history
        for name, overrides in (("scaled", []), ("whole", whole))
    ]
    scaled, full = histories
    np.testing.assert_allclose(scaled["time"], full["time"], rtol=1e-12)
    for column in ("frame_y", "body_x", "body_y"):
        size = np.abs(full[column]).max()
        np.testing.assert_allclose(scaled[column], full[column], atol=1e-9 * size)
    assert full["kinetic_energy"][-1] == pytest.approx(
        SCALE * scaled["kinetic_energy"][-1], rel=1e-9
    )
    assert np.ptp(full["frame_y"]) > 1e-6  # it shakes
