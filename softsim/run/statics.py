"""Static run by Newton's method: a block is a load step, and every row shows an equilibrium."""

import logging
from typing import Any

import numpy as np

from softsim.errors import StabilityError
from softsim.run.course import KERNEL, Run
from softsim.run.record import Progress
from softsim.solver.energy import Energies
from softsim.solver.guards import refuse_broken_elements
from softsim.statics.forces import LONG, StaticForces
from softsim.statics.newton import LoadSteps, Newton, NoEquilibriumError

log = logging.getLogger("softsim")

ADVICE = (
    "beyond a limit point a pressure or a force has no equilibrium nearby: drive the chamber by "
    "added_volume, follow the curve by time.control: arc_length, or find a state far away by "
    "time.method: relaxation"
)


class StaticRun(Run):
    """Run of a static procedure by Newton's method."""

    def _set_out(self, progress: Progress) -> None:
        super()._set_out(progress)
        assert self.model.relaxation is not None
        self.forces = StaticForces(self.scenario.solver)
        self.newton = Newton(self.forces, self.model.relaxation.tolerance)
        self.steps = LoadSteps(self.newton)
        self.worst_share = 0.0

    def next_block(self) -> int:
        """Find the next equilibrium; return 0, as no increment is left to compute."""
        begin = self.scenario.time
        with self.clock.spending_on(KERNEL), np.errstate(over="ignore", invalid="ignore"):
            try:
                found = self.steps.advance(self._next_due(), self._see)
            except NoEquilibriumError as error:
                raise self._at_limit(error, begin) from None
        self.worst_share = max(self.worst_share, found.unbalanced_share)
        self.progress.time_increment = self.scenario.time - begin
        with self._failed_frame_kept():
            refuse_broken_elements(self.model, self.scenario.positions(), self.scenario.time)
        self.reader.update()
        return 0

    def _at_limit(self, error: NoEquilibriumError, begin: float) -> StabilityError:
        """Return the error of a run that cannot go on, with the last converged state."""
        self.files.write_failed_frame(self.scenario)
        row = self.observer.observe(LONG).row
        loads = [
            f"{name} {1e-3 * row[name]:.4g} kPa" for name in row
            if name == "pressure" or name.startswith("pressure_")
        ]  # fmt: skip
        reached = f"; the last equilibrium is at t = {begin:.6g} s" + (
            f", with {', '.join(loads)}" if loads else ""
        )
        return StabilityError(f"{error}{reached}", ADVICE)

    def _see(self, iteration: int, share: float) -> None:
        log.debug("iteration %d: unbalanced share %.3g", iteration, share)

    def _next_due(self) -> float:
        """Return the load time [s] of the next row, frame or end."""
        progress, now = self.progress, self.scenario.time
        due = [d for d in (progress.next_history, progress.next_frame) if d > now * (1 + 1e-12)]
        return min([*due, self.model.end_time])

    def _increments_to(self, due: float) -> int:
        return 0 if self.scenario.time >= due * (1.0 - 1e-12) else 1

    def _interval(self) -> float:
        return LONG  # impulses are those of the last load step alone

    def _is_done(self) -> bool:
        return self.has_reached_end()

    def _look(self) -> None:
        """Do nothing: a static run has no stable step."""

    def _inspect(self) -> None:
        self._refuse_broken_elements()

    def _refuse_energy_error(self, error: float, energies: Energies) -> None:
        """Do nothing: the work is summed over load steps, and its error is theirs."""

    def solution(self) -> dict[str, Any]:
        """Return what Newton's method needed, for the summary."""
        return {
            "load_steps": len(self.steps.iterations),
            "newton_iterations": int(np.sum(self.steps.iterations)),
            "factorisations": self.newton.factorisations,
            "largest_unbalanced_share": self.worst_share,
        }
