"""Motion of a chain: its positions and velocities over time, energies, work and measures."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from softsim.chain.chain import Chain
from softsim.chain.ground import touching
from softsim.chain.integrators import INTEGRATORS
from softsim.chain.vectors import dot, size
from softsim.scene.chain import Time

UNSETTLED = 0.1
"""Deviation of the mean speed over a turn, over the speed, up to which a chain is settled."""

OVERSAMPLING = 4
"""Number of frequencies per 1 / duration, a quarter of a peak's width with a Hann window."""

LEAST_TURNS = 10
"""Least turns of the motor in the second half of a run for reporting speeds and frequencies."""

STEADY = ("speed", "least_speed", "greatest_speed", "settling_time", "contact_shares",
          "dominant_frequencies")  # fmt: skip
"""Measures of the second half of a run, reported if it is long enough."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of a chain over time.

    times: (rows,) [s], evenly spaced. p, v: positions and velocities of the nodes, (rows, n, d) [m,
    m/s].
    """

    chain: Chain
    times: np.ndarray
    p: np.ndarray
    v: np.ndarray

    @cached_property
    def works(self) -> dict[str, np.ndarray]:
        """Work so far of each force without an energy, by name (rows,) [J]."""
        return {
            name: cumulative_trapezoid(
                self.chain.power(name, self.times, self.p, self.v), self.times, initial=0.0
            )
            for name in self.chain.workers
        }

    @cached_property
    def energies(self) -> dict[str, np.ndarray]:
        """Kinetic and stored energies, by name (rows,) [J]."""
        stored = {name: force.energy(self.p) for name, force in self.chain.stores.items()}
        return {"kinetic": self.chain.kinetic_energy(self.v), **stored}

    @property
    def energy_error(self) -> float:
        """Largest error of the energy balance over the largest work or change of an energy [-]."""
        energies = np.array(list(self.energies.values()))
        works = np.array(list(self.works.values()))
        energy = energies.sum(axis=0)
        error = energy - energy[0] - works.sum(axis=0)
        largest = max(float(np.abs(works).max()), float(np.ptp(energies, axis=1).max()))
        return float(np.abs(error).max()) / largest if largest else 0.0

    @property
    def late(self) -> slice:
        """Rows of the second half."""
        return slice(len(self.times) // 2, None)

    @cached_property
    def centre(self) -> np.ndarray:
        """Centre of the heads (rows, d) [m], in space the midpoint of both motors."""
        return self.p[:, self.chain.heads].mean(axis=1)

    @cached_property
    def heading(self) -> np.ndarray:
        """Mean forward unit vector of the heads (rows, d)."""
        ahead = self.chain.motors.lattice.headings(self.p)[:, self.chain.heads].mean(axis=1)
        return ahead / size(ahead)[:, None]

    @cached_property
    def way(self) -> np.ndarray:
        """Forward path length of the centre, backward motion subtracted (rows,) [m]."""
        mean = 0.5 * (self.heading[1:] + self.heading[:-1])
        steps = dot(np.diff(self.centre, axis=0), mean)
        return np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def forward_velocity(self) -> np.ndarray:
        """Forward velocity of the centre (rows,) [m/s]."""
        return dot(self.v[:, self.chain.heads].mean(axis=1), self.heading)

    @property
    def speed(self) -> float:
        """Mean forward speed of the centre in the second half [m/s]."""
        t, way = self.times[self.late], self.way[self.late]
        return float((way[-1] - way[0]) / (t[-1] - t[0]))

    def settling_time(self, turn: float) -> float:
        """Return the time [s] after which the mean speed over one turn stays near the speed.

        turn [s]: duration of one turn of the motor. Near: within UNSETTLED times the speed. NaN if
        the time is not in the first half.
        """
        rows = max(round(turn / self.times[1]), 1)
        means = (self.way[rows:] - self.way[:-rows]) / self.times[rows]
        off = np.flatnonzero(np.abs(means - self.speed) > UNSETTLED * abs(self.speed))
        settled = rows + off[-1] + 1 if len(off) else 0
        return float(self.times[settled]) if settled < self.late.start else np.nan

    @property
    def contact_shares(self) -> np.ndarray:
        """Fraction of the second half in which each node touches the ground (n,) [-]."""
        return touching(self.p[self.late]).mean(axis=0)

    @property
    def dominant_frequencies(self) -> np.ndarray:
        """Dominant frequency of the vertical motion of each node in the second half (n,) [Hz]."""
        z = self.p[self.late][..., -1]
        swing = (z - z.mean(axis=0)) * np.hanning(len(z))[:, None]
        padded = OVERSAMPLING * len(z)
        power = np.abs(np.fft.rfft(swing, padded, axis=0))
        return np.fft.rfftfreq(padded, self.times[1])[power.argmax(axis=0)]


def simulate(chain: Chain, time: Time) -> Motion:
    """Return the motion of a chain from rest. Raises StabilityError if integration fails."""
    steps = round(time.end / time.increment)
    times = np.linspace(0.0, steps * time.increment, steps + 1)
    states = INTEGRATORS[time.integrator](chain.rates, times, chain.at_rest())
    return Motion(chain, times, states[:, 0], states[:, 1])


def measures(motion: Motion) -> dict[str, Any]:
    """Return the measures of a motion for the summary, in SI units; NaN if undefined."""
    chain = motion.chain
    turn = chain.motors.longest_turn
    z = motion.p[:, chain.heads, -1]
    steady: dict[str, Any] = dict.fromkeys(STEADY, np.nan)
    if motion.times[-1] >= 2.0 * LEAST_TURNS * turn:
        velocity = motion.forward_velocity[motion.late]
        steady = {
            "speed": motion.speed,
            "least_speed": float(velocity.min()),
            "greatest_speed": float(velocity.max()),
            "settling_time": motion.settling_time(turn),
            "contact_shares": motion.contact_shares,
            "dominant_frequencies": motion.dominant_frequencies,
        }
    return {
        "motor_force": float(chain.motors.forces.max()),
        "head_displacement": float(motion.way[-1]),
        **steady,
        "head_height": float(z.max()),
        "head_depth": float(-z.min()),
        "energy_error": motion.energy_error,
        "length_error": float(np.abs(chain.links.errors(motion.p)).max()),
    }
