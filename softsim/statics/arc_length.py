"""Arc-length method: a path of equilibria R(q, t) = 0 through limit points of the load.

The load time t is an unknown as well (Riks 1979, Int. J. Solids Struct. 15:529-551). A step begins
along the tangent of the path, dq = w dt with K w = dR/dt, for the distance |dq| = rho; each
correction solves

    K u = R,   K w = dR/dt,   dq = u + w dt,   dq . dq_0 = 0,

so that it stays in the plane that is normal to the first dq_0. At a limit point w becomes infinite
and dt changes its sign. The distance rho follows from the number of iterations of the last step.
"""

from dataclasses import dataclass

import numpy as np

from softsim.statics.forces import Configuration
from softsim.statics.newton import (
    MOST_ITERATIONS,
    Equilibrium,
    Iteration,
    Newton,
    NoEquilibriumError,
    OnIteration,
)

FIRST_STEP = 1.0 / 50.0
"""Load time of the first step over the duration of the loads."""

USUAL_ITERATIONS = 5
"""Iterations of a step with the right distance."""

LARGEST_DISTANCE = 12.0
"""Largest distance of a step over that of the first."""

SMALLEST_DISTANCE = 2.0**-16
"""Smallest distance of a step over that of the first, below which the run stops."""

DIFFERENCE = 1e-6
"""Half the difference of load times of dR/dt, over the duration of the loads."""


@dataclass(frozen=True)
class LimitPoint:
    """Largest or smallest load time [s] on a path, beyond which the path turns back."""

    load_time: float
    is_largest: bool


class ArcSteps:
    """Steps along the path of equilibria of a model, from its loads at the start.

    end: load time [s] at which the loads are complete. limit_points: passed so far. iterations:
    numbers of Newton iterations of all steps so far.
    """

    def __init__(self, newton: Newton, end: float) -> None:
        self.newton, self.forces, self.end = newton, newton.forces, end
        self.duration = end - newton.forces.time
        self.iterations: list[int] = []
        self.limit_points: list[LimitPoint] = []
        self._first: float | None = None
        self._distance = 0.0
        self._along: np.ndarray | None = None
        self._rate = 1.0

    @property
    def is_complete(self) -> bool:
        """True if the loads are complete, or have gone back to those at the start."""
        begin = self.end - self.duration
        return bool(self.iterations) and not begin < self.forces.time < self.end

    def advance(self, on_iteration: OnIteration = lambda k, share: None) -> Equilibrium:
        """Find and accept the next equilibrium on the path.

        Raises NoEquilibriumError if there is none at the smallest distance.
        """
        begin, start = self.forces.time, self.forces.start
        tangent = self._tangent(start)
        if self._first is None:
            self._first = self._distance = (
                FIRST_STEP * self.duration * float(np.linalg.norm(tangent))
            )
        ahead = 1.0 if self._along is None or self._along @ tangent > 0.0 else -1.0
        while True:
            try:
                equilibrium, time = self._tried(begin, start, ahead * tangent, ahead, on_iteration)
                break
            except NoEquilibriumError:
                self.forces.time = begin
                self._distance *= 0.5
                if self._distance < SMALLEST_DISTANCE * self._first:
                    raise
        self.forces.time = time
        self._note_limit(begin, time)
        self._along = self.forces.difference(start, equilibrium.at)
        self.forces.accept(equilibrium.at, abs(time - begin))
        count = max(1, len(equilibrium.iterations))
        self.iterations.append(count)
        self._distance = min(
            self._distance * np.sqrt(USUAL_ITERATIONS / count), LARGEST_DISTANCE * self._first
        )
        return equilibrium

    def _note_limit(self, begin: float, time: float) -> None:
        rate = np.sign(time - begin)
        if rate != self._rate:
            self.limit_points.append(LimitPoint(begin, bool(rate < 0.0)))
            self._rate = rate

    def _tangent(self, at: Configuration) -> np.ndarray:
        """Return w = dq/dt (size,) [m/s] of the path at an equilibrium."""
        self.newton.renew(at)
        return self.newton.solve(at, self._load_rate(at), 1e-6)[0]

    def _load_rate(self, at: Configuration) -> np.ndarray:
        """Return dR/dt (size,) [N/s] by a difference of load times."""
        now, step = self.forces.time, DIFFERENCE * self.duration
        ends = []
        for time in (now - step, now + step):
            self.forces.time = time
            ends.append(self.forces.residual(at))
        self.forces.time = now
        return (ends[1] - ends[0]) / (2.0 * step)

    def _tried(
        self,
        begin: float,
        start: Configuration,
        tangent: np.ndarray,
        ahead: float,
        on_iteration: OnIteration,
    ) -> tuple[Equilibrium, float]:
        """Return the equilibrium at the present distance along the tangent, and its load time."""
        newton, forces = self.newton, self.forces
        first = tangent * (self._distance / float(np.linalg.norm(tangent)))
        time = begin + ahead * self._distance / float(np.linalg.norm(tangent))
        at, iterations = forces.moved(start, first), list[Iteration]()
        if time > self.end:
            forces.time = self.end
            guess = forces.moved(start, (self.end - begin) / (time - begin) * first)
            return newton.find(guess, on_iteration), self.end
        while True:
            forces.time = time
            residual, share = newton.unbalanced(at)
            if newton.is_enough(share, iterations):
                return Equilibrium(at, share, iterations), time
            on_iteration(len(iterations), share)
            if len(iterations) == MOST_ITERATIONS or not share < 1.0:
                raise NoEquilibriumError(
                    f"no equilibrium was found beyond t = {begin:.6g} s of the loads: the "
                    f"unbalanced force is {share:.3g} of the internal forces"
                )
            balancing, krylov = newton.step(at, residual, share)
            along, _ = newton.step(at, self._load_rate(at), share)
            ahead_of_time = float(first @ along)
            change = -float(first @ balancing) / ahead_of_time if ahead_of_time else np.inf
            step = balancing + change * along
            if not np.linalg.norm(step) <= 4.0 * self._distance:
                raise NoEquilibriumError(f"the path is lost beyond t = {begin:.6g} s of the loads")
            at, time = forces.moved(at, step), time + change
            iterations.append(Iteration(share, krylov, 1.0))
