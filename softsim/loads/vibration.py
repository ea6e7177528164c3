"""Forces of a vibration motor: an eccentric mass, or a sinusoid of given amplitude.

An eccentric mass m_e at radius r_e pulls with m_e r_e omega^2 towards where it is. A motor that
turns about the section's normal z shows its whole rotating vector, one that turns about the
pipe's axis x (in the plane across the section) shows its y part only; in space both show all of
it. Its weight m_e g belongs to the mass of the body.

The speed rises smoothly: omega(t) = 2 pi f (3 u^2 - 2 u^3) with u = t / spin_up, whose integral
gives the angle in closed form, and the force rises with omega^2.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class RotorData:
    """Force cos(angle) `cosine` + sin(angle) `sine`, both (d,) [N] at full speed.

    frequency [Hz], spin_up [s], phase: the angle at t = 0 [rad].
    """

    cosine: np.ndarray
    sine: np.ndarray
    frequency: float
    spin_up: float
    phase: float


def eccentric_mass(
    mass: float,
    radius: float,
    frequency: float,
    rotation_axis: str,
    spin_up: float,
    phase: float,
    dimension: int,
) -> RotorData:
    """The rotor of an eccentric mass [kg] at a radius [m]; rotation_axis: "x" or "z".

    A model of two dimensions sees the x and y parts of its force.
    """
    amplitude = mass * radius * (2.0 * np.pi * frequency) ** 2
    x, y, z = np.eye(3)[:, :dimension]
    cosine, sine = {"x": (y, z), "z": (x, y)}[rotation_axis]
    return RotorData(amplitude * cosine, amplitude * sine, frequency, spin_up, phase)


def sinusoidal_force(
    amplitude: float, direction: np.ndarray, frequency: float, spin_up: float, phase: float
) -> RotorData:
    """amplitude [N] along `direction` times the sine of the angle."""
    unit = np.asarray(direction) / np.linalg.norm(direction)
    return RotorData(np.zeros(2), amplitude * unit, frequency, spin_up, phase)
