"""The motion of a chain: where its nodes were, what the forces did, and the measures of it."""

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
"""Share of the speed by which the mean over a turn differs before the chain has settled."""

OVERSAMPLING = 4
"""Frequencies looked at within 1 / duration, a quarter of a peak's width under a Hann window."""

LEAST_TURNS = 10
"""Of the motor in the half of the run of which speeds and frequencies are told."""

STEADY = ("speed", "least_speed", "greatest_speed", "settling_time", "contact_shares",
          "dominant_frequencies")  # fmt: skip
"""What is told of the second half, where it is long enough."""


@dataclass(frozen=True, eq=False)
class Motion:
    """times: (rows,) [s], evenly spaced. p, v: places and velocities of the nodes, (rows, n, d)."""

    chain: Chain
    times: np.ndarray
    p: np.ndarray
    v: np.ndarray

    @cached_property
    def works(self) -> dict[str, np.ndarray]:
        """What each force without an energy has done so far, by name (rows,) [J]."""
        return {
            name: cumulative_trapezoid(
                self.chain.power(name, self.times, self.p, self.v), self.times, initial=0.0
            )
            for name in self.chain.workers
        }

    @cached_property
    def energies(self) -> dict[str, np.ndarray]:
        """Kinetic and stored, by name (rows,) [J]."""
        stored = {name: force.energy(self.p) for name, force in self.chain.stores.items()}
        return {"kinetic": self.chain.kinetic_energy(self.v), **stored}

    @property
    def energy_error(self) -> float:
        """By how much the energy differs from what the forces did to it, over the largest of the
        works and of the swings of energies [-].
        """
        energies = np.array(list(self.energies.values()))
        works = np.array(list(self.works.values()))
        energy = energies.sum(axis=0)
        error = energy - energy[0] - works.sum(axis=0)
        largest = max(float(np.abs(works).max()), float(np.ptp(energies, axis=1).max()))
        return float(np.abs(error).max()) / largest if largest else 0.0

    @property
    def late(self) -> slice:
        """The rows of the second half."""
        return slice(len(self.times) // 2, None)

    @cached_property
    def centre(self) -> np.ndarray:
        """Of the heads (rows, d) [m]: in space it is between both motors."""
        return self.p[:, self.chain.heads].mean(axis=1)

    @cached_property
    def heading(self) -> np.ndarray:
        """Where the heads look, on the whole (rows, d)."""
        ahead = self.chain.motors.lattice.headings(self.p)[:, self.chain.heads].mean(axis=1)
        return ahead / size(ahead)[:, None]

    @cached_property
    def way(self) -> np.ndarray:
        """How far the centre has come ahead, backwards subtracted (rows,) [m]: x in the plane."""
        mean = 0.5 * (self.heading[1:] + self.heading[:-1])
        steps = dot(np.diff(self.centre, axis=0), mean)
        return np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def forward_velocity(self) -> np.ndarray:
        """Of the centre, ahead (rows,) [m/s]."""
        return dot(self.v[:, self.chain.heads].mean(axis=1), self.heading)

    @property
    def speed(self) -> float:
        """Mean speed of the centre ahead in the second half [m/s]."""
        t, way = self.times[self.late], self.way[self.late]
        return float((way[-1] - way[0]) / (t[-1] - t[0]))

    def settling_time(self, turn: float) -> float:
        """From when on the mean speed over one turn of the motor [s] is within UNSETTLED of the
        speed; NaN where that is not before the second half.
        """
        rows = max(round(turn / self.times[1]), 1)
        means = (self.way[rows:] - self.way[:-rows]) / self.times[rows]
        off = np.flatnonzero(np.abs(means - self.speed) > UNSETTLED * abs(self.speed))
        settled = rows + off[-1] + 1 if len(off) else 0
        return float(self.times[settled]) if settled < self.late.start else np.nan

    @property
    def contact_shares(self) -> np.ndarray:
        """Share of the second half in which each node touches the ground (n,)."""
        return touching(self.p[self.late]).mean(axis=0)

    @property
    def dominant_frequencies(self) -> np.ndarray:
        """The strongest of the motion of each node up and down, in the second half (n,) [Hz]."""
        z = self.p[self.late][..., -1]
        swing = (z - z.mean(axis=0)) * np.hanning(len(z))[:, None]
        padded = OVERSAMPLING * len(z)
        power = np.abs(np.fft.rfft(swing, padded, axis=0))
        return np.fft.rfftfreq(padded, self.times[1])[power.argmax(axis=0)]


def simulate(chain: Chain, time: Time) -> Motion:
    """The motion of a chain from rest. StabilityError: it cannot be followed."""
    steps = round(time.end / time.increment)
    times = np.linspace(0.0, steps * time.increment, steps + 1)
    states = INTEGRATORS[time.integrator](chain.rates, times, chain.at_rest())
    return Motion(chain, times, states[:, 0], states[:, 1])


def measures(motion: Motion) -> dict[str, Any]:
    """What a summary tells of a motion, SI units; NaN where nothing can be told."""
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
