"""Cases: scenes to run, one process a core, each run once however many figures show it.

A case is stored under the digest of what decides its result. So scripts share cases, a changed
constant runs anew, and a validation that was killed goes on where it was: from the last checkpoint
of what was running.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from softsim.errors import ExpectationError
from softsim.output.folder import CASES, HISTORY, read_summary
from softsim.output.history import read_history
from softsim.report.figures import draw_all
from softsim.scene.loading import LoadedScene
from softsim.study.cases import DONE, FAILED, LOST, Source, case_key, load_source
from softsim.study.cases import Case as StudyCase
from softsim.sweep.engine import completed, local_pool
from softsim.sweep.job import EVERYTHING, Job, known_outcome, simulate
from softsim.sweep.job import Outcome as Stored
from validation.progress import CaseProgress

SCENES = Path(__file__).resolve().parents[1] / "scenes"
DEVICE = "cpu"  # a plane section is too small for a GPU, and there is a core for each case

THINNED = ("output.history_interval=2 ms", "output.frame_interval=1000 s")
"""Overrides of a case of which only the history is looked at: ten samples of each vibration at
64 Hz, three at 192 Hz, and no fields."""

NOT_IN_SUBSET = "not in the quick subset"
AGAIN = (FAILED, LOST)  # a validation without them is none


@dataclass(frozen=True)
class Case:
    """A scene under `scenes/` with overrides ("time.end=3 s"); `name` is unique in its script."""

    name: str
    scene: str
    overrides: tuple[str, ...] = ()

    @property
    def source(self) -> Source:
        """What it starts from."""
        return Source(SCENES / self.scene)

    @cached_property
    def loaded(self) -> LoadedScene:
        """The scene. Raises SceneError."""
        return load_source(self.source, self.overrides)

    @cached_property
    def key(self) -> str:
        """What its result is stored under: the same for all cases that ask for the same run."""
        return case_key(self.loaded)

    @property
    def simulated_time(self) -> float:
        """How long the run is [s] at most, by which progress is weighed."""
        return self.loaded.scene.time.end


@dataclass(frozen=True)
class LayoutCase(Case):
    """A layout under `scenes/` with a standard robot in it, as `softsim assess` runs it.

    A robot that does not pass is an answer like one that does, no failure.
    """

    robot: str = "pfr"

    @property
    def source(self) -> Source:
        """The layout and the robot."""
        return Source(SCENES / self.scene, self.robot)


@dataclass(frozen=True)
class Outcome:
    """What came of a case: its summary and its history (column -> array), both empty where there
    is a `failure`, the reason in words.
    """

    name: str
    folder: Path | None = None
    summary: Mapping[str, Any] = field(default_factory=dict)
    history: Mapping[str, np.ndarray] = field(default_factory=dict)
    failure: str = ""

    def number(self, key: str) -> float:
        """A number of the summary; NaN where it has none, or the run failed."""
        value = self.summary.get(key)
        return float("nan") if value is None else float(value)

    def numbers(self, key: str) -> np.ndarray:
        """The same for a list of numbers, one a pressure cycle (cycles,)."""
        values = self.summary.get(key) or []
        return np.array([np.nan if value is None else value for value in values], dtype=float)


Outcomes = Mapping[str, Outcome]


def run_cases(
    cases: Sequence[Case], out: Path, workers: int, console: Console
) -> dict[str, Outcome]:
    """Run what is not stored under `out`/cases yet; the outcome of each case, by its key.

    workers: processes at a time. A case that fails has its reason as outcome.
    Raises SceneError before anything runs; Interrupted on SIGINT or SIGTERM: calling again goes on.
    """
    distinct = {case.key: case for case in cases}
    # The longest first: at the end no long one is left alone on one core.
    ordered = sorted(distinct.values(), key=lambda case: -case.simulated_time)
    jobs = [_job(case, out.resolve() / CASES) for case in ordered]
    known = {job.key: known_outcome(job, AGAIN) for job in jobs}
    found = {key: outcome for key, outcome in known.items() if outcome is not None}
    missing = [job for job in jobs if job.key not in found]
    console.print(f"{len(jobs)} cases, {len(jobs) - len(missing)} of them stored")
    if missing:
        (out / CASES).mkdir(parents=True, exist_ok=True)
        total = sum(distinct[job.key].simulated_time for job in missing)
        progress = CaseProgress(console, total, len(missing))
        with local_pool(workers) as pool:
            for job, outcome in completed(missing, pool, AGAIN, simulate=simulate_and_draw):
                case = distinct[job.key]
                found[job.key] = outcome
                progress.finished(case.name, case.simulated_time, _failure(outcome))
    return {job.key: _outcome(distinct[job.key], job, found[job.key]) for job in jobs}


def outcomes_by_name(cases: Iterable[Case], found: Mapping[str, Outcome]) -> dict[str, Outcome]:
    """The outcomes of one script's cases; what was not run says that the subset lacks it."""
    absent = Outcome("", failure=NOT_IN_SUBSET)
    return {case.name: replace(found.get(case.key, absent), name=case.name) for case in cases}


def simulate_and_draw(jobs: Sequence[Job]) -> list[Exception | None]:
    """Run jobs; of a layout the figures that `softsim assess` draws, layout.png shows the way."""
    faults = simulate(jobs)
    for job, fault in zip(jobs, faults, strict=True):
        is_done = fault is None or isinstance(fault, ExpectationError)
        if is_done and job.case.source.robot is not None:
            draw_all(job.folder, read_summary(job.folder)["snapshot_field"])
    return faults


def _job(case: Case, folder: Path) -> Job:
    what = StudyCase(0, case.source, case.overrides)
    return Job(what, case.key, folder / case.key, DEVICE, EVERYTHING)


def _outcome(case: Case, job: Job, stored: Stored) -> Outcome:
    failure = _failure(stored)
    if failure:
        return Outcome(case.name, job.folder, failure=failure)
    return Outcome(case.name, job.folder, stored.summary, read_history(job.folder / HISTORY))


def _failure(stored: Stored) -> str:
    """Why the run is not done; nothing where it is, though it missed what its scene expects."""
    return "" if stored.status == DONE else stored.reason
