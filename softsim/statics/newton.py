"""Newton's method for equilibrium R(q, t) = 0 at a load time t, and paths of equilibria.

Each iteration solves K dq = R by GMRES. The product K v is exact: a central difference of R along
v, with everything that exerts force. The factors of an assembled tangent precondition it; they are
renewed when GMRES takes long (modified Newton without its slow convergence).
A line search halves dq until the next Newton step is shorter (natural monotonicity).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from softsim.errors import StabilityError
from softsim.solver.guards import refuse_broken_elements
from softsim.statics.forces import Configuration, StaticForces
from softsim.statics.tangent import Factors, Stiffness, Tangent, named_motion

MOST_ITERATIONS = 25
"""Newton iterations of a load step, after which it is repeated with half its length."""

PRODUCTS_PER_ASSEMBLY = 0.4
"""Products K v of a Newton step, over those that an assembly of the tangent costs, after which the
tangent is assembled and factorised anew."""

MOST_KRYLOV = 120
"""Largest number of iterations of GMRES for a Newton step."""

MOST_HALVINGS = 8
"""Halvings of a Newton step in the line search."""

LONGEST_DIFFERENCE, SHORTEST_DIFFERENCE = 0.1, 1e-4
"""Largest displacement in a difference K v, over that of an assembled column: the first unless
Newton's step is short.

A node that is closer than this to the surface that it touches has the mean stiffness of both sides.
"""

DIFFERENCE_OVER_STEP = 0.01
"""Largest displacement in a difference K v over that of Newton's step."""

LEAST_FORCE_STRAIN = 1e-6
"""Strain of a body whose internal forces are the least with which unbalanced ones are compared."""

ROUNDED_OVER_EPSILON = 1e6
"""Displacement by which the force of round-off is measured, over the round-off of coordinates."""

SLOW_CONVERGENCE = 0.3
"""Ratio of unbalanced forces after and before an iteration. If it is larger, convergence is slow,
and equilibrium within the required tolerance is accepted."""

SOUGHT_OVER_REQUIRED = 1e-3
"""Unbalanced force that is sought, over solver.equilibrium_tolerance, which is what is required."""

ROUND_OFF = 0.1
"""Share of unbalanced forces at the start below which they are not applied step by step."""

PRESCRIBED_PART = 1e3
"""Prescribed motion in a difference of forces, over the displacement of an assembled column."""

SHORTEST_STEP = 2.0**-12
"""Shortest load step over the one that is asked for, below which the run stops."""


OnIteration = Callable[[int, float], None]
"""Function called before each iteration with its number and the unbalanced share."""


class NoEquilibriumError(StabilityError):
    """Newton's method did not converge at a load time."""


class LooseError(StabilityError):
    """A load acts along a rigid motion that nothing resists."""


@dataclass(frozen=True)
class Iteration:
    """Newton iteration: unbalanced over internal forces before it, iterations of GMRES, and the
    fraction of the step that the line search kept.
    """

    unbalanced_share: float
    krylov: int
    fraction: float


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Equilibrium at a load time.

    at: its configuration. unbalanced_share: unbalanced over internal forces [-]. iterations: how it
    was found.
    """

    at: Configuration
    unbalanced_share: float
    iterations: list[Iteration]


class Newton:
    """Newton's method for the forces of a model.

    tolerance: allowed unbalanced over internal forces [-]. mean_force: mean of the internal forces
    [N] of all equilibria so far, with which the unbalanced force of an unloaded body is compared;
    at least those of a strain LEAST_FORCE_STRAIN, and so large that round-off is within tolerance.
    factorisations, products: numbers of factorised tangents and of products K v so far.
    """

    def __init__(self, forces: StaticForces, tolerance: float) -> None:
        self.forces, self.tolerance = forces, tolerance
        self.tangent = Tangent(forces)
        self.factors: Factors | None = None
        self.factorisations = self.products = 0
        self.least_force = max(
            LEAST_FORCE_STRAIN * forces.force_scale, self._round_off() / tolerance
        )
        self.mean_force = self.least_force
        shortest = float(self.tangent.steps.min())
        self._differences = SHORTEST_DIFFERENCE * shortest, LONGEST_DIFFERENCE * shortest
        self._difference = self._differences[1]

    def _round_off(self) -> float:
        """Return the norm of the forces [N] that rounded coordinates exert: K times an arbitrary
        displacement of their round-off.
        """
        forces, start = self.forces, self.forces.start
        rounded = np.finfo(float).eps * np.abs(start.x)[forces.is_free]
        step = np.zeros(forces.size)
        step[: len(rounded)] = np.random.default_rng(0).choice((-1.0, 1.0), len(rounded)) * rounded
        step *= ROUNDED_OVER_EPSILON
        exerted = np.linalg.norm(forces.resisting(start, step)) / ROUNDED_OVER_EPSILON
        forces.go_back()
        return float(exerted)

    def find(
        self, guess: Configuration, on_iteration: OnIteration = lambda k, share: None
    ) -> Equilibrium:
        """Return the equilibrium at the load time of the forces, from a guess.

        Raises NoEquilibriumError.
        """
        at = guess
        iterations: list[Iteration] = []
        residual, share = self.unbalanced(at)
        while not self.is_enough(share, iterations):
            on_iteration(len(iterations), share)
            if len(iterations) == MOST_ITERATIONS or not np.isfinite(share):
                self._refuse(share)
            step, krylov = self.step(at, residual, share)
            closer = self._searched(at, step, residual)
            if closer is None and self._is_old(at):
                self.renew(at)
                continue
            if closer is None:
                if share <= self.tolerance:
                    break
                self._refuse(share)
            assert closer is not None
            is_slow = closer[2] > SLOW_CONVERGENCE * share
            at, residual, share, fraction = closer
            iterations.append(Iteration(share, krylov, fraction))
            if is_slow and share <= self.tolerance:
                break
        return Equilibrium(at, share, iterations)

    def is_enough(self, share: float, iterations: list[Iteration]) -> bool:
        """Return True if an unbalanced share is accepted.

        Until the last iteration SOUGHT_OVER_REQUIRED times the tolerance is sought.
        """
        is_last = len(iterations) == MOST_ITERATIONS
        return share <= (1.0 if is_last else SOUGHT_OVER_REQUIRED) * self.tolerance

    def unbalanced(self, at: Configuration) -> tuple[np.ndarray, float]:
        """Return the residual (size,) [N] and its share of the internal forces at a trial state."""
        residual = self.forces.residual(at)
        size = float(np.linalg.norm(residual))
        reference = max(self.forces.inner_force(), self.mean_force, size)
        return residual, 0.0 if size == 0.0 else size / reference

    def step_length(self, at: Configuration) -> float:
        """Return the length [m] of the Newton step at a trial state, with the last factors."""
        residual, share = self.unbalanced(at)
        if self.factors is None or not np.isfinite(share):
            return float("inf") if not np.isfinite(share) else 0.0
        return float(np.linalg.norm(self.factors.solve(residual)))

    def _refuse(self, share: float) -> None:
        raise NoEquilibriumError(
            f"no equilibrium was found at t = {self.forces.time:.6g} s: the unbalanced force is "
            f"{share:.3g} of the internal forces, required is {self.tolerance:g}"
        )

    def renew(self, at: Configuration) -> None:
        """Assemble and factorise the tangent at a configuration."""
        try:
            stiffness = self.tangent.at(at)
            self._refuse_loose(at, stiffness)
            self.factors = Factors(stiffness)
        except (RuntimeError, np.linalg.LinAlgError):  # a pivot is zero, or an entry not finite
            raise NoEquilibriumError(
                f"the tangent stiffness is singular at t = {self.forces.time:.6g} s"
            ) from None
        self._factored_at = at
        self.factorisations += 1

    def _refuse_loose(self, at: Configuration, stiffness: Stiffness) -> None:
        """Raise LooseError if a load acts along a rigid motion that nothing resists."""
        residual, share = self.unbalanced(at)
        along = stiffness.loose.T @ (stiffness.loose @ residual)
        of_all = float(np.linalg.norm(along) / max(float(np.linalg.norm(residual)), 1e-300))
        if share * of_all > np.sqrt(self.tolerance):
            raise LooseError(
                f"nothing holds the model against {named_motion(self.forces, at, along)}, and "
                f"a load acts along it, at t = {self.forces.time:.6g} s",
                "fix some nodes, let it begin in contact with what carries it, or let it fall "
                "into place by time.method: relaxation",
            )

    def _is_old(self, at: Configuration) -> bool:
        return self._factored_at is not at

    def product(self, at: Configuration, v: np.ndarray) -> np.ndarray:
        """Return K v (size,) [N] by a central difference of the residual along v (size,)."""
        assert self.factors is not None
        largest = float(np.abs(v).max())
        if largest == 0.0:
            return np.zeros_like(v)
        step = self._difference / largest
        self.products += 1
        resisted: np.ndarray = self.forces.resisting(at, step * v) / step
        return resisted + self.factors.stiffness.holding(v)

    def step(self, at: Configuration, residual: np.ndarray, share: float) -> tuple[np.ndarray, int]:
        """Return dq (size,) of K dq = R, and the iterations of GMRES that it took."""
        # In proportion to the share: quadratic convergence, but no further than is asked for.
        accuracy = max(1e-6, min(1e-3, share), 0.1 * SOUGHT_OVER_REQUIRED * self.tolerance / share)
        if self.factors is None:
            self.renew(at)
        assert self.factors is not None
        length = DIFFERENCE_OVER_STEP * float(np.abs(self.factors.solve(residual)).max())
        shortest, longest = self._differences
        self._difference = min(max(length, shortest), longest)
        try:
            return self._solved(at, residual, accuracy)
        finally:
            self._difference = longest

    def _solved(
        self, at: Configuration, residual: np.ndarray, accuracy: float
    ) -> tuple[np.ndarray, int]:
        """Return dq as `step`, with factors that are renewed if they are stale."""
        step, count, is_solved = self.solve(at, residual, accuracy)
        is_stale = count > PRODUCTS_PER_ASSEMBLY * self.tangent.column_count or not is_solved
        if is_stale and self._is_old(at):
            self.renew(at)
            step, count, is_solved = self.solve(at, residual, accuracy)
        return step, count

    def solve(
        self, at: Configuration, force: np.ndarray, accuracy: float
    ) -> tuple[np.ndarray, int, bool]:
        """Solve K u = force (size,) [N] at a configuration by preconditioned GMRES.

        Return u (size,) [m], the number of iterations, and True if the accuracy was reached.
        """
        assert self.factors is not None
        count, size = 0, (self.forces.size, self.forces.size)

        def count_iteration(_: float) -> None:
            nonlocal count
            count += 1

        # Preconditioned on the right, so that GMRES measures the true residual.
        inverse = self.factors.solve
        operator = LinearOperator(size, lambda v: self.product(at, inverse(v)), dtype=float)
        preconditioned, failed = gmres(
            operator, force, rtol=accuracy, restart=MOST_KRYLOV, maxiter=1,
            callback=count_iteration, callback_type="pr_norm",
        )  # fmt: skip
        return inverse(preconditioned), count, failed == 0

    def _searched(
        self, at: Configuration, step: np.ndarray, residual: np.ndarray
    ) -> tuple[Configuration, np.ndarray, float, float] | None:
        """Return the first state along the step from which the next step is shorter, or None.

        Also return its residual, its unbalanced share and the fraction of the step. The next step
        is K^-1 R with the last factors (natural monotonicity test; Deuflhard 2011, Newton Methods
        for Nonlinear Problems, sec. 3.3): in a stiff direction, such as the volume of a chamber
        filled with liquid, |R| would allow very short steps only.
        """
        assert self.factors is not None
        length, fraction = float(np.linalg.norm(self.factors.solve(residual))), 1.0
        for _ in range(MOST_HALVINGS + 1):
            tried = self.forces.moved(at, fraction * step)
            unbalanced, share = self.unbalanced(tried)
            next_length = (
                np.linalg.norm(self.factors.solve(unbalanced)) if np.isfinite(share) else np.inf
            )
            if next_length < (1.0 - 0.1 * fraction) * length:
                return tried, unbalanced, share, fraction
            fraction *= 0.5
        return None


# -------------------------------------------------------------------------------------------------
# Load steps: as long as the rows of the history allow, halved where Newton's method fails.


class LoadSteps:
    """Load steps from equilibrium to equilibrium.

    newton: the method. iterations: numbers of Newton iterations of all steps so far.
    """

    def __init__(self, newton: Newton) -> None:
        self.newton, self.forces = newton, newton.forces
        self.iterations: list[int] = []
        self._allowed = np.inf
        self._last: list[tuple[float, np.ndarray]] = []

    def advance(
        self, until: float, on_iteration: OnIteration = lambda k, share: None
    ) -> Equilibrium:
        """Find and accept the next equilibrium, at a load time of at most `until` [s].

        Raises NoEquilibriumError if there is none after the shortest step; StabilityError if an
        element is turned over or overstretched there, or if nothing holds the model.
        """
        if not self.iterations:
            self._balance_start(on_iteration)
        begin = self.forces.time
        asked = until - begin
        while True:
            step = min(asked, self._allowed)
            if asked < step * (1.0 + 1e-6) or asked - step < 1e-9 * abs(until):
                step = asked
            try:
                equilibrium = self._tried(begin, step, on_iteration)
            except LooseError:
                raise
            except StabilityError:
                self.forces.go_back()
                if step < SHORTEST_STEP * asked:
                    raise
                self._allowed = 0.5 * step
                continue
            self.iterations.append(len(equilibrium.iterations))
            if len(equilibrium.iterations) < MOST_ITERATIONS // 2:
                self._allowed *= 2.0
            return equilibrium

    def _balance_start(self, on_iteration: OnIteration) -> None:
        """Apply the loads that act from the start on, such as the weight, step by step.

        The unbalanced force of the start is withheld in part: R(q) - (1 - s) R_0 = 0, from s = 0
        to 1.
        """
        forces, newton = self.forces, self.newton
        unbalanced, share = newton.unbalanced(forces.start)
        applied, step = 0.0, 1.0
        while share > ROUND_OFF and applied < 1.0:
            forces.withheld = (1.0 - min(1.0, applied + step)) * unbalanced
            try:
                equilibrium = newton.find(forces.start, on_iteration)
            except NoEquilibriumError:
                step *= 0.5
                if step < SHORTEST_STEP:
                    raise
                continue
            finally:
                forces.withheld = np.zeros(forces.size)
            forces.accept(equilibrium.at, 0.0)
            applied, step = min(1.0, applied + step), 2.0 * step

    def _best_guess(self, still: Configuration, step: float) -> Configuration:
        """Return the guess from which Newton's first step is shortest.

        still: free coordinates of the last equilibrium. Further ones follow prescribed motions
        linearly, or continue a line through the last two equilibria and a parabola through the last
        three.
        """
        guesses = [still, *self._following(still)]
        if self._last:
            duration, moved = self._last[-1]
            line = moved * (step / duration)
            guesses.append(self.forces.moved(still, line))
            if len(self._last) == 2:
                earlier, moved_before = self._last[0]
                bend = moved / duration - moved_before / earlier
                bend *= step * (step + duration) / (duration + earlier)
                guesses.append(self.forces.moved(still, line + bend))
        return min(guesses, key=self.newton.step_length)

    def _following(self, still: Configuration) -> list[Configuration]:
        """Return the guess in which free coordinates follow the prescribed ones, K dq = dR, if any.

        dR is the change of the residual by a small part of the prescribed motion, over this part.
        """
        forces, newton = self.forces, self.newton
        start = forces.start
        prescribed_motion = float(np.abs(still.x - start.x).max(initial=0.0))
        if prescribed_motion == 0.0 or not np.array_equal(still.turns, start.turns):
            return []
        if newton.factors is None:
            try:
                newton.renew(start)
            except LooseError:  # the motion may close the contact that holds the model
                return []
        assert newton.factors is not None
        part = min(1.0, PRESCRIBED_PART * float(newton.tangent.steps.min()) / prescribed_motion)
        nearby = replace(
            start,
            x=start.x + part * (still.x - start.x),
            centres=start.centres + part * (still.centres - start.centres),
        )
        change = (forces.residual(nearby) - forces.residual(start)) / part
        return [forces.moved(still, newton.factors.solve(change))]

    def _tried(self, begin: float, step: float, on_iteration: OnIteration) -> Equilibrium:
        forces = self.forces
        before = forces.start
        guess = self._best_guess(forces.steer(begin + step), step)
        equilibrium = self.newton.find(guess, on_iteration)
        at = equilibrium.at
        refuse_broken_elements(forces.model, at.x, forces.time)  # the step is halved
        forces.accept(at, step)
        self._last = [*self._last[-1:], (step, forces.difference(before, at))]
        mean, count = self.newton.mean_force, len(self.iterations)
        now = max(forces.inner_force(), self.newton.least_force)
        self.newton.mean_force = (count * mean + now) / (count + 1)
        return equilibrium


# -------------------------------------------------------------------------------------------------
# Arc-length method: a path of equilibria R(q, t) = 0 through limit points of the load.
#
# The load time t is an unknown as well (Riks 1979, Int. J. Solids Struct. 15:529-551). A step
# begins along the tangent of the path, dq = w dt with K w = dR/dt, for the distance |dq| = rho;
# each correction solves
#
#     K u = R,   K w = dR/dt,   dq = u + w dt,   dq . dq_0 = 0,
#
# so that it stays in the plane that is normal to the first dq_0. At a limit point w becomes
# infinite and dt changes its sign. The distance rho follows from the number of iterations of the
# last step.

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
