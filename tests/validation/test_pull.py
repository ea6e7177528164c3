"""Force and noise of a pull whose answers are known."""

import numpy as np
import pytest

from validation.pull import pull_of

RISE, HOLD, FALL = 0.5, 0.2, 2.0  # s
HIGHEST, LOWEST = 23e3, 11e3  # Pa
FORCE, SWING, FREQUENCY = 2.0, 0.3, 100.0  # N, N, Hz
STEP = 2e-3  # s: five samples a period, ten periods a window, so that its mean is nothing


def history(noisy: float):
    """A force that goes as the pressure, with a swing once that has fallen to `noisy` [Pa]; the
    robot lands with a blow in the beginning.
    """
    t = np.arange(0.0, RISE + HOLD + FALL + 1e-9, STEP)
    fall = np.clip((t - RISE - HOLD) / FALL, 0.0, 1.0)
    pressure = np.minimum(HIGHEST * t / RISE, HIGHEST - (HIGHEST - LOWEST) * fall)
    pull = FORCE * pressure / HIGHEST
    pull += SWING * np.sin(2.0 * np.pi * FREQUENCY * t) * ((pressure <= noisy) & (fall > 0.0))
    pull[20:22] += 3.0 * FORCE
    return {"time": t, "pressure": pressure, "pull": pull, "frame_x": 0.0 * t}


def test_force_is_the_running_mean():
    """The blow, 2 of the 25 rows of a window, counts for 2 x 6 N / 25, less than the plateau."""
    assert pull_of(history(0.0)).peak == pytest.approx(FORCE, rel=1e-12)


def test_noise_is_where_it_swings():
    """In the last third of the fall, 11 to 15 kPa, and in nothing else."""
    pull = pull_of(history(15e3))
    assert pull.scatter_falling(2 / 3, 1.0) == pytest.approx(SWING / np.sqrt(2.0), rel=1e-2)
    assert pull.scatter_falling(0.0, 1 / 3) < 1e-9
    assert pull.scatter_inflating < 1e-9  # the blow comes before the upper half of the range
    # The running scatter passes a tenth of the swing within half a window, 25 ms at 6 kPa/s.
    assert pull.noisy_from(0.1 * SWING) == pytest.approx(15e3, abs=6e3 * 0.025)


def test_never_noisy_is_noisy_at_the_end():
    assert pull_of(history(0.0)).noisy_from(0.1 * SWING) == LOWEST


def test_a_failed_run_has_no_pull():
    assert pull_of({}) is None
