"""The table of a study: a row a case, filled as cases end."""

from collections.abc import Iterable, Sequence
from typing import Any

import polars

from softsim.study.axes import Axis, column
from softsim.study.cases import WAITING, Case, Value
from softsim.study.measures import MeasureColumn
from softsim.sweep.job import Job, Outcome

VERDICT = ("layout", "verdict")
"""Where the summary of a layout's run says whether the robot passed."""


class StudyTable:
    """Rows of cases, in the order of their numbers. Columns: see `softsim.output.study_folder`."""

    def __init__(self, factors: Sequence[Axis], measures: Sequence[MeasureColumn]) -> None:
        self.factors, self.measures = factors, measures
        self.rows: dict[int, dict[str, Any]] = {}

    def add_waiting(self, jobs: Iterable[Job]) -> None:
        """A row for each job that has not ended yet."""
        for job in jobs:
            self.note(job, Outcome(job.key, WAITING))

    def note(self, job: Job, outcome: Outcome) -> None:
        """Fill in the row of a job."""
        self.rows[job.case.number] = {
            "case": job.case.number,
            **self._factor_values(job.case),
            **{m.column: m.value(outcome.summary) for m in self.measures},
            "verdict": outcome.summary.get(VERDICT[0], {}).get(VERDICT[1]),
            "status": outcome.status,
            "reason": outcome.reason or None,
            column("wall_time", "s"): outcome.wall_time or None,
            "key": outcome.key,
        }

    def _factor_values(self, case: Case) -> dict[str, Value]:
        return {factor.column: case.values[factor.name] for factor in self.factors}

    def frame(self) -> polars.DataFrame:
        """The table as it is now; without the column of verdicts where there are none."""
        rows = [self.rows[number] for number in sorted(self.rows)]
        frame = polars.DataFrame(rows, schema=self._schema(), orient="row")
        has_verdicts = frame["verdict"].is_not_null().any()
        return frame if has_verdicts else frame.drop("verdict")

    def _schema(self) -> dict[str, Any]:
        """Column -> type, in their order."""
        axes = [*self.factors, *self.measures]
        return {
            "case": polars.Int64,
            **{axis.column: polars.String if axis.is_label else polars.Float64 for axis in axes},
            "verdict": polars.String,
            "status": polars.String,
            "reason": polars.String,
            column("wall_time", "s"): polars.Float64,
            "key": polars.String,
        }
