"""The dominant frequency of motions that are sums of known sines, at rows of uneven spacing."""

from types import SimpleNamespace

import numpy as np
import pytest

from softsim.analysis.catalogue import LEAST_AMPLITUDE, RecordedRun, dominant_frequency
from softsim.analysis.travel import strongest
from softsim.scene.measures import Part

MOTOR = SimpleNamespace(frequency=192.0, spin_up=0.05)


def rows(end=3.0, interval=2e-3, jitter=0.0):
    """Times [s] of rows, off their even spacing by up to `jitter` of it."""
    t = np.arange(0.0, end, interval)
    return t + jitter * interval * np.random.default_rng(3).uniform(-0.5, 0.5, len(t))


def sine(t, frequency, amplitude=50e-6):
    return amplitude * np.sin(2.0 * np.pi * frequency * t + 0.7)


@pytest.mark.parametrize("jitter", [0.0, 0.005, 0.05])
@pytest.mark.parametrize("frequency", [63.37, 191.4])
def test_a_sine_on_a_drift(frequency, jitter):
    """A sine beside a drift of 20 mm/s, curved a little, and a weaker sine at half its frequency.

    Beside its peak a Hann window leaves of another line, or of the parabola, (1 / (f T))^3: 5e-5
    of what is at most 10 times as large, which shifts the peak by less than a hundredth of 1/T.
    """
    t = rows(1.0, jitter=jitter)
    y = sine(t, frequency) + sine(t, 0.5 * frequency, 20e-6) + 20e-3 * t + 1e-3 * t**2
    found = strongest(t, y, 10.0, 250.0)
    assert found.frequency == pytest.approx(frequency, abs=0.01)
    assert found.amplitude == pytest.approx(50e-6, rel=0.01)


def frame(t, y, motors=(MOTOR,)):
    """A run whose frame moves along y."""
    return RecordedRun({"time": t, "frame_x": 0.0 * t, "frame_y": y}, {Part.FRAME}, motors=motors)


def test_the_last_second_counts():
    """It bounced at half the frequency before, and the motor had to spin up."""
    t = rows()
    y = np.where(t < 1.9, sine(t, 96.0, 1e-3), sine(t, 192.0))
    assert dominant_frequency(frame(t, y)) == pytest.approx(192.0, abs=0.01)


def test_the_way_of_the_pressure_is_no_vibration():
    """A sag of a millimetre within the second, far more than the vibration."""
    t = rows()
    y = sine(t, 192.0) - 1e-3 * np.maximum(t - 2.4, 0.0) ** 2
    assert dominant_frequency(frame(t, y)) == pytest.approx(192.0, abs=0.01)


@pytest.mark.parametrize("larger, other", [("y", "z"), ("z", "y")])
def test_in_space_the_larger_swing_counts(larger, other):
    t = rows()
    history = {
        "time": t,
        f"frame_{larger}": sine(t, 192.0),
        f"frame_{other}": sine(t, 96, 2e-5),
    }
    run = RecordedRun(history, {Part.FRAME, Part.Z}, motors=[MOTOR])
    assert dominant_frequency(run) == pytest.approx(192.0, abs=0.01)


@pytest.mark.parametrize(
    "interval, is_told",
    [(2.0e-3, True), (2.6e-3, True), (2.61e-3, False), (5.0e-3, False)],  # two rows in 5.2 ms
)
def test_too_few_rows_a_turn_tell_nothing(interval, is_told):
    t = rows(interval=interval)
    found = dominant_frequency(frame(t, sine(t, 100.0)))
    assert (found is not None) is is_told


@pytest.mark.parametrize(
    "end, is_told", [(0.05 + 19.0 / 192.0, False), (0.05 + 22.0 / 192.0, True)]
)
def test_a_motor_that_has_hardly_run_tells_nothing(end, is_told):
    t = rows(end)
    found = dominant_frequency(frame(t, sine(t, 192.0)))
    assert (found is not None) is is_told


@pytest.mark.parametrize("share, is_told", [(0.0, False), (0.9, False), (1.1, True)])
def test_a_frame_that_stands_still_does_not_vibrate(share, is_told):
    t = rows()
    found = dominant_frequency(frame(t, sine(t, 192.0, share * LEAST_AMPLITUDE)))
    assert (found is not None) is is_told


def test_without_a_motor_there_is_none():
    t = rows()
    assert dominant_frequency(frame(t, sine(t, 192.0), motors=())) is None
