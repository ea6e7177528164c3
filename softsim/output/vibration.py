"""The vibration frequency of a frame, from its history.

Rows of a history are not quite evenly spaced, so the spectrum is Lomb and Scargle's (least squares
of a sine), of the motion less its linear drift, under a Hann window.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from softsim.loads.rotor import Rotor
from softsim.model import Model

# What is looked at: so much of the end of the run [s], if the motor ran steadily all the time, and
# no less than so many of its turns.
LAST, LEAST_TURNS = 1.0, 20
# Slower than this share of the motor's frequency is no vibration but the way of the pressure; a
# frame that bounces may do so once in two or three turns.
SLOWEST = 0.1
# Amplitude [m] below which the frame does not vibrate: a thousandth of what the PFR's motor swings
# it by where nothing holds it, m_e r_e / m = 0.1 mm.
LEAST_AMPLITUDE = 1e-7
# Frequencies looked at within 1 / duration, a quarter of a peak's width under a Hann window.
OVERSAMPLING = 4


@dataclass(frozen=True)
class Peak:
    """Strongest sine of a motion: frequency [Hz], amplitude [m]."""

    frequency: float
    amplitude: float


def strongest(t: np.ndarray, y: np.ndarray, slowest: float, fastest: float) -> Peak:
    """Return the strongest sine between two frequencies [Hz] of positions y [m] at t [s], (rows,).

    A sine faster than half the rate of the rows appears as a slower one.
    """
    from scipy.signal import lombscargle  # slow to import, and asked for at the end of a run

    span = t[-1] - t[0]
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * (t - t[0]) / span)
    swing = window * (y - np.polyval(np.polyfit(t - t[0], y, 1), t - t[0]))

    def power(frequency: float | np.ndarray) -> np.ndarray:
        return np.atleast_1d(lombscargle(t, swing, 2.0 * np.pi * np.atleast_1d(frequency)))

    step = 1.0 / (OVERSAMPLING * span)
    frequencies = np.arange(slowest, fastest, step)
    highest = frequencies[np.argmax(power(frequencies))]
    refined = minimize_scalar(
        lambda frequency: -power(frequency)[0],
        bounds=(highest - step, highest + step),
        method="bounded",
        options={"xatol": 1e-3 * step},
    ).x
    # Of a sine of amplitude a the power is (a sum(window) / 2)^2 / rows.
    amplitude = 2.0 * np.sqrt(len(t) * power(refined)[0]) / window.sum()
    return Peak(float(refined), float(amplitude))


def dominant_frequency(model: Model, history: dict[str, np.ndarray]) -> float | None:
    """Return the transverse vibration frequency [Hz] of the robot's frame at the end of the run.

    The motion is that along y, or in space along y or z, whichever has the larger amplitude. None
    without a motor, if the body does not vibrate, if the motor has not run steadily for
    LEAST_TURNS, or with fewer than two rows a turn, which resolve no frequency.
    """
    motors = model.of_kind(Rotor)
    if not motors:
        return None
    motor, t = motors[0].rotor, history["time"]
    late = (t >= motor.spin_up) & (t >= t[-1] - LAST)
    t = t[late]
    if len(t) < 2 or (t[-1] - t[0]) * motor.frequency < LEAST_TURNS:
        return None
    fastest = 0.5 / float(np.median(np.diff(t)))
    if motor.frequency > fastest:
        return None
    slowest = SLOWEST * motor.frequency
    across = [history[f"frame_{axis}"][late] for axis in "yz"[: model.dimension - 1]]
    peak = max((strongest(t, y, slowest, fastest) for y in across), key=lambda p: p.amplitude)
    return peak.frequency if peak.amplitude >= LEAST_AMPLITUDE else None
