"""Static run by Newton's method: a block is a load step, and every row shows an equilibrium."""

from typing import Any

import numpy as np

from softsim.errors import StabilityError
from softsim.run.course import INSPECTIONS, KERNEL, Run
from softsim.run.gradient import asked_parameters, derivatives
from softsim.solver.energy import Energies
from softsim.solver.guards import refuse_broken_elements
from softsim.statics.forces import TRIAL_DURATION, StaticForces
from softsim.statics.newton import ArcSteps, Equilibrium, LoadSteps, Newton, NoEquilibriumError

ADVICE = (
    "beyond a limit point a pressure or a force has no equilibrium nearby: drive the chamber by "
    "added_volume, follow the curve by time.control: arc_length, or find a state far away by "
    "time.method: relaxation"
)


class StaticRun(Run):
    """Run of a static procedure by Newton's method."""

    def prepare(self) -> None:
        assert self.model.relaxation is not None
        self.forces = StaticForces(self.scenario.solver)
        self.newton = Newton(self.forces, self.model.relaxation.tolerance)
        self.steps = LoadSteps(self.newton)
        self.worst_share = 0.0
        self.parameters = asked_parameters(self.files.loaded)

    @property
    def iterations(self) -> list[int]:
        """Numbers of Newton iterations of all load steps so far."""
        return self.steps.iterations

    def _advance(self) -> Equilibrium:
        return self.steps.advance(self._next_due(), self._report)

    def next_block(self) -> int:
        """Find the next equilibrium; return 0, as no increment is left to compute."""
        begin = self.scenario.time
        with self.clock.spending_on(KERNEL), np.errstate(over="ignore", invalid="ignore"):
            try:
                equilibrium = self._advance()
            except NoEquilibriumError as error:
                raise self._at_limit(error, begin) from None
            except StabilityError:
                self.files.write_failed_frame(self.scenario)
                raise
        self.worst_share = max(self.worst_share, equilibrium.unbalanced_share)
        self.progress.time_increment = self.scenario.time - begin
        self.reader.update()
        return 0

    def _at_limit(self, error: NoEquilibriumError, begin: float) -> StabilityError:
        """Return the error of a run that cannot go on, with the last converged state."""
        self.files.write_failed_frame(self.scenario)
        reached = f"; the last equilibrium is at t = {begin:.6g} s{self._pressures()}"
        return StabilityError(f"{error}{reached}", ADVICE)

    def _pressures(self) -> str:
        """Return the pressures of all chambers in the last equilibrium, as a part of a sentence."""
        terms = {load.name: self.scenario.term_of(load) for load in self.model.pressures}
        values = {name: float(self.scenario.read(term.pressure)) for name, term in terms.items()}
        found = [f"{name} at {1e-3 * value:.4g} kPa" for name, value in values.items()]
        return f", with {', '.join(found)}" if found else ""

    def _report(self, iteration: int, share: float) -> None:
        step = len(self.iterations) + 1
        self.show(f"load step {step}, iteration {iteration}, unbalanced {share:.1e}")

    def _next_due(self) -> float:
        """Return the load time [s] of the next row, frame or end."""
        progress, now = self.progress, self.scenario.time
        due = [d for d in (progress.next_history, progress.next_frame) if d > now * (1 + 1e-12)]
        return min([*due, self.model.end_time])

    def _increments_to(self, due: float) -> int:
        return 0 if self.scenario.time >= due * (1.0 - 1e-12) else 1

    def _interval(self) -> float:
        return TRIAL_DURATION  # impulses are those of the last load step alone

    def _is_done(self) -> bool:
        return self.has_reached_end()

    def _look(self) -> None:
        """Do nothing: a static run has no stable step."""

    def _inspect(self) -> None:
        self._refuse_broken_elements()

    def _refuse_energy_error(self, error: float, energies: Energies) -> None:
        if error > self.model.energy_error_limit:  # of the work alone: forces balance
            self.files.warn(
                {
                    "external work": f"the energy balance is off by {100.0 * error:.3g} %: load "
                    "steps are too long to sum up the external work, or the body has jumped to "
                    "another equilibrium; the forces balance. Shorten output.history_interval if "
                    "you need the work"
                }
            )

    def write_due(self) -> None:
        has_new_row = self.row_is_due
        super().write_due()
        if has_new_row and self._needs_derivatives():
            of_columns = derivatives(self, self.parameters)
            self.progress.derivatives.append({"time": self.scenario.time, "of": of_columns})

    def _needs_derivatives(self) -> bool:
        """Return True if the row just written is the last up to a time at which they are asked."""
        asked, now = self.output.derivatives, self.scenario.time
        if asked is None:
            return False
        following = np.inf if self.has_reached_end() else self.progress.next_history
        times = np.array(asked.at or (self.model.end_time,)) * (1.0 + 1e-9)
        return bool(((now <= times) & (times < following)).any())

    def finish(self) -> None:
        """Warn if the last equilibrium is unstable, and set the outcome."""
        with self.clock.spending_on(INSPECTIONS):
            self.files.warn(self._instability())
        super().finish()

    def _instability(self) -> dict[str, str]:
        self.newton.renew(self.forces.start)
        assert self.newton.factors is not None
        count = self.newton.factors.negative_pivots
        if count <= 0:
            return {}
        modes = "one mode" if count == 1 else f"{count} modes"
        return {
            "unstable equilibrium": f"the equilibrium at the end is unstable in {modes}: Newton's "
            "method follows such a path, a body leaves it; find a stable state by time.method: "
            "relaxation, and the modes by `softsim modes`"
        }

    def solution(self) -> dict[str, Any]:
        """Return what Newton's method needed, for the summary."""
        found = {"derivatives": self.progress.derivatives} if self.output.derivatives else {}
        return found | {
            "load_steps": len(self.iterations),
            "newton_iterations": sum(self.iterations),
            "factorisations": self.newton.factorisations,
            "largest_unbalanced_share": self.worst_share,
        }


class PathRun(StaticRun):
    """Static run along the path of equilibria, through limit points, by the arc-length method.

    The clock adds up the load time that the path covers in either direction.
    """

    def prepare(self) -> None:
        solver = self.scenario.solver
        solver.load_times = solver.times.copy()
        super().prepare()
        self.path = ArcSteps(self.newton, self.model.end_time)

    @property
    def iterations(self) -> list[int]:
        return self.path.iterations

    def _advance(self) -> Equilibrium:
        passed, pressures = len(self.path.limit_points), self._pressures()
        equilibrium = self.path.advance(self._report)
        refuse_broken_elements(self.model, equilibrium.at.x, self.scenario.time)
        for point in self.path.limit_points[passed:]:
            kind = "largest" if point.is_largest else "smallest"
            self.files.tell(
                f"limit point: the load is {kind} near t = {point.load_time:.6g} s{pressures}"
            )
        return equilibrium

    def _increments_to(self, due: float) -> int:
        return 0  # every equilibrium is a row and a frame

    def _is_done(self) -> bool:
        return self.path.is_complete

    def path_readings(self) -> dict[str, np.ndarray]:
        """Return the load time [s] and the number of unstable modes of the last equilibrium."""
        factors = self.newton.factors
        unstable = 0 if factors is None else factors.negative_pivots
        return {
            "load_time": np.array([self.forces.time]),
            "unstable_modes": np.array([unstable]),
        }

    def solution(self) -> dict[str, Any]:
        points = [
            {"load_time": point.load_time, "is_largest": point.is_largest}
            for point in self.path.limit_points
        ]
        return super().solution() | {"limit_points": points}
