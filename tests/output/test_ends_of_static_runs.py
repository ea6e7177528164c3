"""A static run's way to its end: a probe that becomes steady, what people see meanwhile."""

import numpy as np
import pytest

from softsim.model import SteadyProbe
from softsim.output.console import SettlingOutlook
from softsim.output.stop_conditions import ProbeAtRest

SINCE, WITHIN = 1.0, 0.01


def end_of(course):
    """When a probe that follows `course` after SINCE, and something else before, ends a run."""
    condition = ProbeAtRest(SteadyProbe("tip", ("tip_x", "tip_y"), WITHIN, SINCE))
    for t in np.arange(0.0, 100.0, 0.05):
        condition.see_row(
            {"time": t, "tip_x": course(t - SINCE) if t >= SINCE else 0.0, "tip_y": 0.0}
        )
        if condition.is_over:
            return t
    return np.inf


@pytest.mark.parametrize(
    "decay",
    [
        lambda t: np.exp(-t / 3.0),
        lambda t: 1.0 / (1.0 + t),
        lambda t: np.exp(-t / 3.0) * np.cos(8.0 * t),
    ],
    ids=["exponential", "slow", "swinging"],
)
def test_a_steady_probe_is_as_near_to_its_end_as_asked(decay):
    end = end_of(lambda t: 2.0 - decay(t))
    assert SINCE < end < 100.0
    assert decay(end - SINCE) <= 1.05 * WITHIN * 2.0


def test_what_goes_on_moving_does_not_end():
    assert end_of(lambda t: t) == np.inf
    assert end_of(lambda t: 1.0 + 0.02 * np.cos(8.0 * t)) == np.inf


def test_the_outlook_tells_pace_and_end():
    """A share that swings and falls tenfold in 4 s."""
    outlook = SettlingOutlook(1e-6)
    assert outlook.describe() == "settling"
    for wall in np.linspace(0.0, 8.0, 81):
        outlook.see(wall, 1e-2 * 10.0 ** (-wall / 4.0) * (1.0 + 0.3 * np.sin(20.0 * wall)))
    assert outlook.time_for_a_tenth == pytest.approx(4.0, rel=0.05)
    assert outlook.describe().startswith(
        "settling: unbalanced force 0.00011, required 1e-06, falls tenfold in 4"
    )


def test_a_share_that_does_not_fall_is_told():
    outlook = SettlingOutlook(1e-6)
    for wall in range(40):
        outlook.see(float(wall), 1e-3 * (1.0 + 1e-3 * wall))
    assert outlook.describe() == "settling: unbalanced force 0.001, required 1e-06, not decreasing"
