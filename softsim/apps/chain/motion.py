"""Motion of a chain: its positions and velocities over time, energies, work and measures."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid, solve_ivp

from softsim.analysis.travel import curvature, running_mean
from softsim.apps.chain.mechanics import Chain, dot, size, touching
from softsim.apps.chain.scene import ChainTimeSpec
from softsim.errors import StabilityError

# -------------------------------------------------------------------------------------------------
# Time integration of y' = rates(t, y).

Rates = Callable[[float, np.ndarray], np.ndarray]

REAL_STABILITY = 2.78
"""Largest increment times decay rate for which the classical Runge-Kutta method is stable (Hairer,
Wanner, *Solving Ordinary Differential Equations II*, IV.2)."""

RELATIVE, ABSOLUTE = 1e-6, 1e-9
"""Relative [-] and absolute [m, m/s] error of an adaptive step."""


def fixed_steps(rates: Rates, times: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Return the states (steps + 1, ...) at evenly spaced times by the Runge-Kutta method RK4.

    The order is 4 between changes of contact, and 1 across them, where forces jump.

    Raises
    ------
    StabilityError
        The states become infinite.
    """
    states = np.empty((len(times), *start.shape), start.dtype)
    states[0] = y = start
    h = times[1] - times[0]
    with np.errstate(over="ignore", invalid="ignore"):  # told below
        for step, t in enumerate(times[:-1].tolist(), 1):
            k1 = rates(t, y)
            k2 = rates(t + 0.5 * h, y + 0.5 * h * k1)
            k3 = rates(t + 0.5 * h, y + 0.5 * h * k2)
            k4 = rates(t + h, y + h * k3)
            states[step] = y = y + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    if not np.isfinite(states[-1]).all():
        lost = times[np.flatnonzero(~np.isfinite(states).reshape(len(times), -1).all(axis=1))[0]]
        raise StabilityError(
            f"the motion of the chain became infinite at {lost:.4g} s",
            "reduce time.increment, or reduce the motor force",
        )
    return states


def adaptive_steps(rates: Rates, times: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Return the states (rows, ...) at some times by the Dormand-Prince pair of order 5 and 4.

    This is the method of MATLAB's ode45, which the thesis uses.

    Raises
    ------
    StabilityError
        The step becomes too small.
    """

    def flat(t: float, y: np.ndarray) -> np.ndarray:
        return rates(t, y.reshape(start.shape)).ravel()

    found = solve_ivp(
        flat, (times[0], times[-1]), start.ravel(), method="RK45", t_eval=times,
        rtol=RELATIVE, atol=ABSOLUTE, max_step=10.0 * (times[1] - times[0]),
    )  # fmt: skip
    if not found.success:
        raise StabilityError(
            f"the integration of the chain stopped at {found.t[-1]:.4g} s: {found.message}"
        )
    return found.y.T.reshape(len(times), *start.shape)


INTEGRATORS = {"fixed": fixed_steps, "adaptive": adaptive_steps}


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


def simulate(chain: Chain, time: ChainTimeSpec) -> Motion:
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


# -------------------------------------------------------------------------------------------------
# Path of a chain over the ground: its curvature and turning rate.


def track_measures(motion: Motion) -> dict[str, Any]:
    """Return the measures of a path for the summary, in SI units; NaN if the run is too short."""
    turn = motion.chain.motors.longest_turn
    forward, sideways = motion.centre[-1, :2] - motion.centre[0, :2]
    told = {"forward_displacement": float(forward), "sideways_displacement": float(sideways)}
    if motion.times[-1] < 2.0 * LEAST_TURNS * turn:
        return {"curvature": np.nan, "turning_rate": np.nan, **told}
    t, heading = motion.times[motion.late], yaw(motion)[motion.late]
    return {
        "curvature": curvature(smoothed(motion, turn)),
        "turning_rate": float((heading[-1] - heading[0]) / (t[-1] - t[0])),
        **told,
    }


def yaw(motion: Motion) -> np.ndarray:
    """Return the angle of the heading from x, positive to the left (rows,) [rad]."""
    return np.unwrap(np.arctan2(motion.heading[:, 1], motion.heading[:, 0]))


def smoothed(motion: Motion, turn: float) -> np.ndarray:
    """Return the running mean over a turn of the centre in the second half (rows, 2) [m]."""
    rows = max(round(turn / motion.times[1]), 1)
    return running_mean(motion.centre[motion.late, :2], rows)
