"""Runs of studies: all cases that are not stored yet, or the trials of an optimisation.

In Python they are started from `softsim.Study`.
"""

import sys
import time
from collections.abc import Collection, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import mean
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
import polars
from rich.console import Console

from softsim.compute.machine import choose, chosen_device, device_of_trials, processor_count
from softsim.errors import ClusterError, SceneError, SoftsimError
from softsim.output.folder import CASES, RunFolder, StudyRecord
from softsim.report.figures import duration
from softsim.scene.text import nearest
from softsim.study.cases import DONE, LOST, PRUNED, Case, Program, case_key, resolved
from softsim.study.loading import LoadedStudy, load_study, study_from
from softsim.study.schema import Goal, Objective
from softsim.sweep.engine import WorkerPool, completed, pool_for
from softsim.sweep.job import (
    NOTHING_LEFT,
    WALL_TIME,
    Job,
    Outcome,
    Simulate,
    StudyTable,
    history_of,
    kept_ledger,
    record_of,
    simulate,
    told_size,
)
from softsim.units import count_text

if TYPE_CHECKING:  # optuna is for those who optimise
    from softsim.sweep.optimisation import Descent

# -------------------------------------------------------------------------------------------------
# Cases that cannot run, found before anything runs: scenes are read and models are built.

LONGEST = 15.0
"""Seconds of wall time after which the remaining cases are left unchecked."""

MOST_REPORTED = 10
"""Cases that cannot run that are named one by one."""


def refusals(jobs: Sequence[Job], device: str, longest: float = LONGEST) -> Iterator[str]:
    """Yield a line for each case that cannot run, and one that sums them up.

    Nothing is yielded where all cases can run. The checks end after `longest` seconds; the last
    line then says how many cases were checked.

    Parameters
    ----------
    jobs : sequence of Job
        Cases that are about to run.
    device : str
        auto, cpu or cuda.
    longest : float
        Wall time [s].
    """
    began, checked, refused = time.monotonic(), 0, 0
    for job in jobs:
        if checked and time.monotonic() - began > longest:
            break
        checked += 1
        try:
            _check(job, device)
        except SoftsimError as error:
            refused += 1
            if refused <= MOST_REPORTED:
                values = ", ".join(f"{name} {value}" for name, value in job.case.values.items())
                reason = " ".join(error.message.split())
                yield f"case {job.case.number} cannot run ({values}): {reason}"
    if refused or checked < len(jobs):
        yield (
            f"{refused} of the {checked} cases checked cannot run"
            + f"; {len(jobs) - checked} were not checked, to save time" * (checked < len(jobs))
        )


def _check(job: Job, device: str) -> None:
    """Raise SoftsimError if a case cannot run; of an application's model the scene is checked."""
    loaded = resolved(job.case)
    if job.case.source.program is None:
        from softsim.run.scenes import ready_model  # Taichi is imported from here on

        ready_model(loaded, choose(chosen_device(device), "1"))


def sweep(
    study: LoadedStudy,
    folder: Path,
    pool: AbstractContextManager[WorkerPool],
    device: str = "auto",
    batch: int = 1,
    again: Collection[str] = (LOST, PRUNED),
    console: Console | None = None,
    simulate: Simulate = simulate,
) -> polars.DataFrame:
    """Run all cases that are not stored in `folder` yet; return and store the table.

    Parameters
    ----------
    study : LoadedStudy
        The study.
    folder : Path
        Folder of the study.
    pool : context manager of WorkerPool
        `local_pool(workers)` or `remote_pool(address, folder)`; it starts if there is work.
    device : {"auto", "cpu", "cuda"}
        Device of the computation.
    batch : int
        Number of cases that a worker runs at once.
    again : collection of str
        Statuses of stored cases that are run again.
    console : rich.console.Console, optional
        Console for progress.
    simulate : callable
        Function that runs cases.

    Returns
    -------
    polars.DataFrame
        One row for each case.

    Raises
    ------
    SceneError
        The study has no design.
    ClusterError
        The workers do not respond.
    OutputError
        The folder cannot be written.
    Interrupted
        The process received SIGINT or SIGTERM. After each of these the same call continues.
    """
    console = console or Console()
    RunFolder(folder / CASES)  # is made here, or refused
    table, record = StudyTable.of(study), record_of(study, study.case_count)
    with kept_ledger(folder, record, table, console) as ledger:
        rounds = table.open_rounds(study, folder, device, again)
        waiting, left = next(rounds, NOTHING_LEFT)
        console.print(told_size(study, len(table.rows) - len(waiting)))
        for line in refusals(waiting, device):
            console.print(line, highlight=False, markup=False, soft_wrap=True)
        ledger.begin(left)
        if waiting:
            with pool as workers:
                while waiting:
                    ledger.progress.expect(left)
                    for ended in completed(
                        waiting, workers, again, batch, ledger.keep_up, simulate
                    ):
                        ledger.note(*ended)
                    waiting, left = next(rounds, NOTHING_LEFT)
    return table.frame()


def optimize(
    study: LoadedStudy,
    folder: Path,
    pool: AbstractContextManager[WorkerPool],
    device: str = "auto",
    count: int | None = None,
    console: Console | None = None,
    simulate: Simulate = simulate,
) -> polars.DataFrame:
    """Run trials of an optimisation until there are `count`; return their table.

    The table is also stored in `folder`; its cases have the numbers of the trials. A trial whose
    run fails, or does not find the measure, is ignored by the optimiser.

    Parameters
    ----------
    study, folder, pool, device, console, simulate
        As for `sweep`.
    count : int, optional
        Number of trials. Default: that of the study.

    Returns
    -------
    polars.DataFrame
        One row for each trial.

    Raises
    ------
    SceneError
        The study has no objective, or nothing varies in it.
    OutputError
        The folder holds another optimisation, or cannot be written.
    ClusterError
        The workers do not respond.
    Interrupted
        The process received SIGINT or SIGTERM. The same call continues with the trials in
        progress.
    """
    from softsim.sweep.optimisation import Descent, TrialJobs, Trials  # imports optuna

    objective, goal, count = asked(study, count)
    console = console or Console()
    RunFolder(folder / CASES)  # is made here, or refused
    column = next(measure for measure in study.measures if measure.name == goal.measure)
    if objective.method == "gradient":
        descent = Descent(study, column, goal.sense)
        return descend(descent, folder, pool, device, count, console, simulate)
    table = StudyTable(study.factors, study.measures)

    def note(job: Job, outcome: Outcome) -> None:
        value = None
        if outcome.status == DONE:
            value = column.value(outcome.summary, history_of(job, [column]))
        trials.tell(job.case.number, value, outcome.status == PRUNED)
        ledger.note(job, outcome)

    def jobs() -> Iterator[Job]:
        for trial in trials.to_run(count):
            case = study.case(trial.number, trial.values)
            try:
                yield plan.job(case)
            except SceneError as error:
                note(*plan.refused(case, error))

    with kept_ledger(folder, record_of_trials(study, count), table, console) as ledger:
        trials = Trials(folder, study.search_space, column, goal.sense, objective.seed)
        plan = TrialJobs(folder.resolve(), column, objective.prune, device, study.study.keep)
        for trial in trials.ended():
            table.note(*plan.stored(study.case(trial.number, trial.values)))
        console.print(f"{count} trials, {len(table.rows)} of them stored")
        ledger.begin(max(0, count - len(table.rows)))
        if trials.is_open(count):
            with pool as workers:
                for ended in completed(jobs(), workers, (LOST,), 1, ledger.keep_up, simulate):
                    note(*ended)
    return table.frame()


def record_of_trials(study: LoadedStudy, count: int) -> StudyRecord:
    """Return the record of an optimisation with `count` trials."""
    plots = study.plots if study.study.plots else ()
    return replace(record_of(study, count), repeats=1, plots=plots, bisection=None)


def descend(
    descent: "Descent",
    folder: Path,
    pool: AbstractContextManager[WorkerPool],
    device: str,
    count: int,
    console: Console,
    simulate: Simulate,
) -> polars.DataFrame:
    """Run trials by derivatives, `count` at most; return their table, as `optimize`."""
    from softsim.sweep.optimisation import SearchEndedError

    study, column = descent.study, descent.column
    table = StudyTable(study.factors, study.measures)
    known: dict[bytes, tuple[float, np.ndarray]] = {}
    console.print(f"at most {count} trials, one after the other")
    with kept_ledger(folder, record_of_trials(study, count), table, console) as ledger:
        ledger.begin(count)

        def evaluate(x: np.ndarray) -> tuple[float, np.ndarray]:
            if x.tobytes() in known:
                return known[x.tobytes()]
            if len(table.rows) == count:
                raise SearchEndedError(f"not converged within {count} trials: --trials allows more")
            case = descent.case(len(table.rows) + 1, x)
            key = case_key(resolved(case))
            job = Job(case, key, folder.resolve() / CASES / key, device, study.study.keep)
            for ended, outcome in completed(
                iter([job]), workers, (LOST,), 1, ledger.keep_up, simulate
            ):
                ledger.note(ended, outcome)
                if outcome.status != DONE:
                    raise SearchEndedError(f"trial {case.number} failed: {outcome.reason}")
                history = history_of(ended, [column])
                known[x.tobytes()] = descent.value(x, outcome.summary, history)
            return known[x.tobytes()]

        with pool as workers:
            reason = descent.minimise(evaluate, count)
        ledger.progress.expect(0)
    console.print(f"{len(table.rows)} trials, {reason}", highlight=False)
    return table.frame()


def asked(study: LoadedStudy, count: int | None) -> tuple[Objective, Goal, int]:
    """Return the objective of a study and the number of trials, `count` if it is given.

    Raises SceneError if one of them is missing, or if nothing varies.
    """
    objective, goal = study.study.optimize, study.goal
    if objective is None or goal is None:
        raise SceneError(
            f"{study.path}: the study has no objective",
            f"add optimize: {{maximize: {study.measures[0].name}, trials: 40}}",
        )
    if all(isinstance(space, tuple) and len(space) == 1 for space in study.search_space.values()):
        raise SceneError(
            "no factor has more than one value: there is nothing to optimize",
            "give a factor a range, or several values",
            nearest(study.tree, ("factors",))[0].key_origin,
        )
    count = count or objective.trials
    if count is None:
        raise SceneError(
            "the number of trials is missing",
            "write trials: 40 under optimize, or add --trials 40",
            nearest(study.tree, ("optimize",))[0].key_origin,
        )
    return objective, goal, count


class Study:
    """Parameter study: a scene, factors that vary, and measures that are collected from each run.

    Parameters
    ----------
    file : Path or str, optional
        Path of a study file.
    overrides : sequence of str
        Values that override those of the scene in all cases: "time.end=3 s". Only for a file.
    **keys
        Keys of a study instead of a file: `scene`, `factors`, `measures` and so on. Scene files
        are relative to the working folder, quantities are texts with units: "0.4 kPa".

    Attributes
    ----------
    loaded : LoadedStudy
        The validated study.

    Raises
    ------
    SceneError
        It is not a valid study. The error holds the place in the file.

    Notes
    -----
    `run` and `optimize` start processes that import the script from which they are called. A
    script therefore has to call them under `if __name__ == "__main__":`. In a notebook this is not
    needed.

    Examples
    --------
    >>> from softsim import Study
    >>> study = Study(
    ...     scene="block.yaml",
    ...     factors={"pressure": {"key": "loads.air.profile.value", "values": ["2 kPa", "4 kPa"]}},
    ...     measures={"displacement": {"of": "body_displacement_y", "unit": "um"}},
    ... )
    >>> [case.values for case in study.cases]
    [{'pressure': 2.0}, {'pressure': 4.0}]
    >>> table = study.run("runs/pressures", workers=1)
    >>> table["status"].to_list()
    ['done', 'done']
    >>> bool((table["displacement [um]"] < 0.0).all())  # downwards
    True
    """

    def __init__(
        self, file: Path | str | None = None, overrides: Sequence[str] = (), **keys: Any
    ) -> None:
        if (file is None) == (not keys) or (keys and overrides):
            raise TypeError(
                "give either a study file with overrides, or keys: scene, set, factors, measures "
                "..."
            )
        self.loaded = study_from(keys, Path()) if file is None else load_study(file, overrides)

    @property
    def cases(self) -> list[Case]:
        """All cases in the order of the table; for a bisection the first ones."""
        return self.loaded.cases()

    def run(
        self,
        out: Path | str | None = None,
        workers: int | None = None,
        scheduler: str | None = None,
        device: str = "auto",
        batch: int = 1,
    ) -> polars.DataFrame:
        """Run all cases that are not stored yet and return the table.

        Parameters
        ----------
        out : Path or str, optional
            Folder of the study. Default: `runs/` and the name of the study.
        workers : int, optional
            Number of processes. Default: one for each core.
        scheduler : str, optional
            Address of a dask scheduler, whose workers share the disk, instead of local processes.
        device : {"auto", "cpu", "cuda"}
            Device of the computation.
        batch : int
            Number of cases that a worker runs at once.

        Returns
        -------
        polars.DataFrame
            One row for each case: factors, measures, status.

        Raises
        ------
        SceneError
            A case is not a valid scene.
        ClusterError, OutputError, DeviceError
            Workers, folder or device are not available.
        Interrupted
            The process received SIGINT or SIGTERM. The same call continues.
        """
        folder = Path(out or Path("runs") / self.loaded.path.stem)
        pool = _pool(folder, device, workers, scheduler)
        return sweep(self.loaded, folder, pool, device, batch)

    def optimize(
        self,
        out: Path | str | None = None,
        workers: int | None = None,
        scheduler: str | None = None,
        device: str = "auto",
        trials: int | None = None,
    ) -> polars.DataFrame:
        """Optimise the objective under the key `optimize` of the study and return the table.

        Parameters
        ----------
        out : Path or str, optional
            Folder of the optimisation. Default: `runs/STUDY_optimum`.
        workers, scheduler
            As for `run`.
        device : {"auto", "cpu", "cuda"}
            Device of the computation; "auto" is the CPU.
        trials : int, optional
            Total number of trials. Default: that of the study.

        Returns
        -------
        polars.DataFrame
            One row for each trial.

        Raises
        ------
        SoftsimError
            As from `run`.
        """
        folder = Path(out or Path("runs") / f"{self.loaded.path.stem}_optimum")
        taken = device_of_trials(device)
        pool = _pool(folder, taken, workers, scheduler)
        return optimize(self.loaded, folder, pool, taken, trials)

    def report(self, out: Path | str | None = None) -> Path:
        """Draw the figures and write report.html from the results that a folder holds so far.

        Parameters
        ----------
        out : Path or str, optional
            Folder of `run` or `optimize`. Default: `runs/` and the name of the study.

        Returns
        -------
        Path
            Path of the report.

        Raises
        ------
        OutputError
            The folder holds no study.
        """
        from softsim.report.study.plots import draw_study, write_study_page  # imports matplotlib

        folder = Path(out or Path("runs") / self.loaded.path.stem)
        draw_study(folder)
        return write_study_page(folder)


def _pool(
    folder: Path, device: str, workers: int | None, scheduler: str | None
) -> AbstractContextManager[WorkerPool]:
    if scheduler is None:
        refuse_unguarded_script()
    return pool_for(folder, device, workers, scheduler)


def refuse_unguarded_script() -> None:
    """Raise ClusterError for a main script that every process would run again.

    A new process runs the main script once more, except what is guarded by `__name__`.
    """
    script = getattr(sys.modules["__main__"], "__file__", None)
    if script is None or not Path(script).is_file():
        return
    if "__main__" not in Path(script).read_text(encoding="utf-8", errors="replace"):
        raise ClusterError(
            f"{script} would start this study again in each of its worker processes",
            hint='call it under  if __name__ == "__main__":',
        )


# -------------------------------------------------------------------------------------------------
# Estimated cost of the cases of a study, from stored cases, a short trial run, or one case.


@dataclass(frozen=True)
class Cost:
    """Estimated cost of a case.

    seconds: time on one core or one graphics card. basis: what the estimate rests on. is_bound:
    True for an upper bound.
    """

    seconds: float
    basis: str
    is_bound: bool


def cost_line(each: Cost, runs: int, device: str, workers: int | None) -> str:
    """Return a line with the total cost of the runs."""
    alone = chosen_device(device) == "cuda"
    count = workers or (1 if alone else processor_count())
    most, place = "at most " * each.is_bound, "GPU hours" if alone else "core hours"
    hours = runs * each.seconds / 3600.0
    return (
        f"cost {most or 'about '}{hours:.3g} {place}, {hours / count:.3g} h with "
        f"{count_text(count, 'worker')}: {count_text(runs, 'run')} of {most}"
        f"{duration(each.seconds)}, {each.basis}"
    )


def stored_cost(frame: polars.DataFrame) -> Cost | None:
    """Return the mean cost of the stored cases; None where there are none."""
    times = frame.filter(polars.col("status") == DONE)[WALL_TIME].drop_nulls().to_list()
    if not times:
        return None
    span = f"{duration(min(times))} to {duration(max(times))}"
    basis = (
        f"the mean of {count_text(len(times), 'case')} stored, {span}; other cases may take longer"
    )
    return Cost(mean(times), basis, False)


def cost_in_pilot(job: Job, device: str) -> Cost:
    """Return the cost of a finite element case, estimated by a short trial run.

    Raises SoftsimError where the scene is invalid or a guard stops the trial.
    """
    from softsim.run.pilot import predicted_duration  # Taichi is imported from here on
    from softsim.run.scenes import ready_model

    choice, loaded = choose(chosen_device(device), "1"), resolved(job.case)
    began = time.perf_counter()
    model = ready_model(loaded, choice)
    built_in = time.perf_counter() - began
    found = predicted_duration(loaded, model, choice)
    steps = "load steps" if model.takes_load_steps else "increments"
    basis = (
        f"{found.increment_count:.3g} {steps} each, estimated from a short trial run of case "
        f"{job.case.number} over {100.0 * found.covered:.0f} % of its load history, alone on "
        "this machine and with its steps; less if a verdict ends a run early"
    )
    return Cost(built_in + found.prepared + found.loop, basis, True)


def cost_by_running(job: Job, program: Program) -> Cost:
    """Return the cost of a case, which a program runs; SoftsimError where it cannot run."""
    with TemporaryDirectory() as folder:
        began = time.perf_counter()
        program(resolved(job.case), Path(folder))
        seconds = time.perf_counter() - began
    return Cost(seconds, f"measured by running case {job.case.number}", False)


def estimated_cost(job: Job, device: str) -> Cost:
    """Return the estimated cost of a case; SoftsimError where it cannot run."""
    program = job.case.source.program
    return cost_in_pilot(job, device) if program is None else cost_by_running(job, program)
