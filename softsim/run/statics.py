"""Static run by Newton's method: a block is a load step, and every row shows an equilibrium."""

from typing import Any

import numpy as np

from softsim.errors import StabilityError
from softsim.run.callbacks import RowReader, Rows, refuse_broken
from softsim.run.cost import INSPECTIONS, KERNEL
from softsim.run.gradient import asked_parameters, derivatives
from softsim.run.loop import Callback, Run, Stepping
from softsim.solver.guards import refuse_broken_elements
from softsim.statics.forces import TRIAL_DURATION, StaticForces
from softsim.statics.newton import ArcSteps, Equilibrium, LoadSteps, Newton, NoEquilibriumError

ADVICE = (
    "beyond a limit point a pressure or a force has no equilibrium nearby: drive the chamber by "
    "added_volume, follow the curve by time.control: arc_length, or find a state far away by "
    "time.method: relaxation"
)


class LoadStepping(Stepping):
    """Blocks of one load step each, whose equilibrium Newton's method finds."""

    def __init__(self, run: Run) -> None:
        super().__init__(run)
        assert run.model.relaxation is not None
        self.forces = StaticForces(run.scenario.solver)
        self.newton = Newton(self.forces, run.model.relaxation.tolerance)
        self.steps = LoadSteps(self.newton)
        self.worst_share = 0.0

    @property
    def iterations(self) -> list[int]:
        """Numbers of Newton iterations of all load steps so far."""
        return self.steps.iterations

    def next_block(self, longest: float) -> int:
        """Find the next equilibrium; return 0, as no increment is left to compute."""
        begin = self.scenario.time
        with self.run.clock.spending_on(KERNEL), np.errstate(over="ignore", invalid="ignore"):
            try:
                equilibrium = self.advance()
            except NoEquilibriumError as error:
                raise self._at_limit(error, begin) from None
            except StabilityError:
                self.run.files.write_failed_frame(self.scenario)
                raise
        self.worst_share = max(self.worst_share, equilibrium.unbalanced_share)
        return 0

    def advance(self) -> Equilibrium:
        """Return the equilibrium at the load time of the next row or frame, or of the end."""
        progress, now = self.run.progress, self.scenario.time
        due = [d for d in (progress.next_history, progress.next_frame) if d > now * (1 + 1e-12)]
        return self.steps.advance(min([*due, self.model.end_time]), self.show)

    def _at_limit(self, error: NoEquilibriumError, begin: float) -> StabilityError:
        """Return the error of a run that cannot go on, with the last converged state."""
        self.run.files.write_failed_frame(self.scenario)
        reached = f"; the last equilibrium is at t = {begin:.6g} s{self.pressures()}"
        return StabilityError(f"{error}{reached}", ADVICE)

    def pressures(self) -> str:
        """Return the pressures of all chambers in the last equilibrium, as a part of a sentence."""
        terms = {load.name: self.scenario.term_of(load) for load in self.model.pressures}
        values = {name: float(self.scenario.read(term.pressure)) for name, term in terms.items()}
        found = [f"{name} at {1e-3 * value:.4g} kPa" for name, value in values.items()]
        return f", with {', '.join(found)}" if found else ""

    def show(self, iteration: int, share: float) -> None:
        """Show an iteration on the console."""
        step = len(self.iterations) + 1
        self.run.show(f"load step {step}, iteration {iteration}, unbalanced {share:.1e}")

    def increments_to(self, due: float) -> int:
        """Return 0 once the load time [s] is reached, else 1."""
        return 0 if self.scenario.time >= due * (1.0 - 1e-12) else 1

    def contact_time(self) -> float:
        """Return the time [s] of a load step: impulses are those of the last one alone."""
        return TRIAL_DURATION

    def summary(self) -> dict[str, Any]:
        """Return what Newton's method needed, and the derivatives of the scene."""
        asked = self.run.output.derivatives
        found = {"derivatives": self.run.progress.derivatives} if asked else {}
        return found | {
            "load_steps": len(self.iterations),
            "newton_iterations": sum(self.iterations),
            "factorisations": self.newton.factorisations,
            "largest_unbalanced_share": self.worst_share,
        }


class PathStepping(LoadStepping):
    """Blocks along the path of equilibria, through limit points, by the arc-length method.

    The clock adds up the load time that the path covers in either direction.
    """

    def __init__(self, run: Run) -> None:
        solver = run.scenario.solver
        solver.load_times = solver.times.copy()
        super().__init__(run)
        self.path = ArcSteps(self.newton, self.model.end_time)

    @property
    def iterations(self) -> list[int]:
        return self.path.iterations

    def advance(self) -> Equilibrium:
        """Return the next equilibrium on the path, and report limit points before it."""
        passed, pressures = len(self.path.limit_points), self.pressures()
        equilibrium = self.path.advance(self.show)
        refuse_broken_elements(self.model, equilibrium.at.x, self.scenario.time)
        for point in self.path.limit_points[passed:]:
            kind = "largest" if point.is_largest else "smallest"
            self.run.files.tell(
                f"limit point: the load is {kind} near t = {point.load_time:.6g} s{pressures}"
            )
        return equilibrium

    def increments_to(self, due: float) -> int:
        """Return 0: every equilibrium is a row and a frame."""
        return 0

    def is_complete(self) -> bool:
        """Return True at the end of the path."""
        return self.path.is_complete

    def summary(self) -> dict[str, Any]:
        """Return what Newton's method needed, and the limit points."""
        points = [
            {"load_time": point.load_time, "is_largest": point.is_largest}
            for point in self.path.limit_points
        ]
        return super().summary() | {"limit_points": points}


class Equilibria(RowReader):
    """Columns and checks of the equilibria that load steps have found."""

    def __init__(self, run: Run, stepping: LoadStepping) -> None:
        self.run, self.stepping = run, stepping

    def readings(self, times: np.ndarray) -> dict[str, np.ndarray]:
        """Return the load time [s] and the number of unstable modes, along a path only."""
        relaxation, factors = self.run.model.relaxation, self.stepping.newton.factors
        if relaxation is None or not relaxation.follows_path:
            return {}
        unstable = 0 if factors is None else factors.negative_pivots
        return {
            "load_time": np.array([self.stepping.forces.time]),
            "unstable_modes": np.array([unstable]),
        }

    def act(self) -> None:
        """Warn if the energy balance of a new row is off: of the work alone, as forces balance."""
        rows = self.run.callback(Rows)
        if rows.is_new and rows.energy_error > self.run.model.energy_error_limit:
            self.run.files.warn(
                {
                    "external work": f"the energy balance is off by {100.0 * rows.energy_error:.3g}"
                    " %: load steps are too long to sum up the external work, or the body has "
                    "jumped to another equilibrium; the forces balance. Shorten "
                    "output.history_interval if you need the work"
                }
            )

    def at_end(self) -> None:
        """Warn if the last equilibrium is unstable, and check the elements."""
        with self.run.clock.spending_on(INSPECTIONS):
            self.run.files.warn(self._instability())
            refuse_broken(self.run)

    def _instability(self) -> dict[str, str]:
        newton = self.stepping.newton
        newton.renew(self.stepping.forces.start)
        assert newton.factors is not None
        count = newton.factors.negative_pivots
        if count <= 0:
            return {}
        modes = "one mode" if count == 1 else f"{count} modes"
        return {
            "unstable equilibrium": f"the equilibrium at the end is unstable in {modes}: Newton's "
            "method follows such a path, a body leaves it; find a stable state by time.method: "
            "relaxation, and the modes by `softsim modes`"
        }


class RowDerivatives(Callback):
    """Derivatives of the rows at the times at which the scene asks for them."""

    def __init__(self, run: Run, stepping: LoadStepping, rows: Rows) -> None:
        self.run, self.stepping, self.rows = run, stepping, rows
        self.parameters = asked_parameters(run.files.loaded)

    def act(self) -> None:
        """Compute the derivatives of a new row if they are asked for."""
        if self.rows.is_new and self._are_due():
            of_columns = derivatives(self.stepping, self.rows.observer, self.parameters)
            time = self.run.scenario.time
            self.run.progress.derivatives.append({"time": time, "of": of_columns})

    def _are_due(self) -> bool:
        """Return True if the row just written is the last up to a time at which they are asked."""
        run, asked, now = self.run, self.run.output.derivatives, self.run.scenario.time
        if asked is None:
            return False
        following = np.inf if run.has_reached_end else run.progress.next_history
        times = np.array(asked.at or (run.model.end_time,)) * (1.0 + 1e-9)
        return bool(((now <= times) & (times < following)).any())
