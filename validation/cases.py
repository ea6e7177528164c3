"""Cases: scenes to run, one process a core, each run once however many figures show it.

A case is stored under the digest of what decides its result: the resolved scene, softsim's version
and sources. So scripts share cases, a changed constant runs anew, and a validation that was killed
goes on where it was: from the last checkpoint of what was running.
"""

import hashlib
import io
import json
import multiprocessing
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from importlib.metadata import version
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

import softsim
from softsim.errors import Interrupted, SoftsimError
from softsim.interruption import stop_signals
from softsim.output.folder import CHECKPOINT, HISTORY, SUMMARY
from softsim.output.history import read_history
from softsim.report.figures import draw_all
from softsim.scene.assessment import load_layout
from softsim.scene.loading import LoadedScene, load_scene
from validation.progress import CaseProgress

SCENES = Path(__file__).resolve().parents[1] / "scenes"
DEVICE = "cpu"  # a plane section is too small for a GPU, and there is a core for each case

THINNED = ("output.history_interval=2 ms", "output.frame_interval=1000 s")
"""Overrides of a case of which only the history is looked at: ten samples of each vibration at
64 Hz, three at 192 Hz, and no fields."""

NOT_IN_SUBSET = "not in the quick subset"
FAILURE = "failure.txt"
POLL = 0.5  # s between looks for a signal


@dataclass(frozen=True)
class Case:
    """A scene under `scenes/` with overrides ("time.end=3 s"); `name` is unique in its script."""

    name: str
    scene: str
    overrides: tuple[str, ...] = ()

    @cached_property
    def loaded(self) -> LoadedScene:
        """The scene. Raises SceneError."""
        return load_scene(SCENES / self.scene, self.overrides)

    @cached_property
    def key(self) -> str:
        """What its result is stored under: the same for all cases that ask for the same run.

        The generators make the meshes of all shipped scenes, so no mesh file needs to be looked at.
        """
        parts = (self.loaded.scene.model_dump_json(), version("softsim"), source_digest())
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:20]

    @property
    def simulated_time(self) -> float:
        """How long the run is [s] at most, by which progress is weighed."""
        return self.loaded.scene.time.end

    def draw(self, folder: Path) -> None:
        """Draw what its run, which is done, shows by itself: nothing, its script draws."""


@dataclass(frozen=True)
class LayoutCase(Case):
    """A layout under `scenes/` with a standard robot in it, as `softsim assess` runs it.

    A robot that does not pass is an answer like one that does, no failure.
    """

    robot: str = "pfr"

    @cached_property
    def loaded(self) -> LoadedScene:
        """The layout with its robot. Raises SceneError."""
        return load_layout(SCENES / self.scene, self.robot, self.overrides)

    def draw(self, folder: Path) -> None:
        """The figures that `softsim assess` draws, of which layout.png shows the way."""
        draw_all(folder, self.loaded.scene.output.snapshot_field)


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


@lru_cache(maxsize=1)
def source_digest() -> str:
    """Digest of softsim's sources and the constants that come with it."""
    home = Path(softsim.__file__).parent
    digest = hashlib.sha256()
    for path in sorted(p for p in home.rglob("*") if p.suffix in (".py", ".yaml")):
        digest.update(str(path.relative_to(home)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def run_cases(
    cases: Sequence[Case], out: Path, workers: int, console: Console
) -> dict[str, Outcome]:
    """Run what is not stored under `out`/cases yet; the outcome of each case, by its key.

    workers: processes at a time. A case that fails has its reason as outcome.
    Raises SceneError before anything runs; Interrupted on SIGINT or SIGTERM: calling again goes on.
    """
    distinct = {case.key: case for case in cases}
    missing = [case for case in distinct.values() if not _is_done(_folder(case, out))]
    console.print(f"{len(distinct)} cases, {len(distinct) - len(missing)} of them stored")
    if missing:
        # The longest first: at the end no long one is left alone on one core.
        missing.sort(key=lambda case: -case.simulated_time)
        total = sum(case.simulated_time for case in missing)
        _run_processes(missing, out, workers, CaseProgress(console, total, len(missing)))
    return {key: _outcome(case, _folder(case, out)) for key, case in distinct.items()}


def outcomes_by_name(cases: Iterable[Case], found: Mapping[str, Outcome]) -> dict[str, Outcome]:
    """The outcomes of one script's cases; what was not run says that the subset lacks it."""
    absent = Outcome("", failure=NOT_IN_SUBSET)
    return {case.name: replace(found.get(case.key, absent), name=case.name) for case in cases}


def _run_processes(cases: list[Case], out: Path, workers: int, progress: CaseProgress) -> None:
    """One spawned process a case, since Taichi has one runtime a process."""
    spawn = multiprocessing.get_context("spawn")
    waiting = list(cases)
    running: dict[BaseProcess, Case] = {}
    with stop_signals() as asked:
        while waiting or running:
            if asked:
                _stop(running)
            while waiting and len(running) < workers:
                case = waiting.pop(0)
                folder = _folder(case, out)
                folder.mkdir(parents=True, exist_ok=True)
                (folder / FAILURE).unlink(missing_ok=True)
                process: BaseProcess = spawn.Process(
                    target=_run, args=(case, folder), name=case.name
                )
                process.start()
                running[process] = case
            wait([process.sentinel for process in running], POLL)
            for process in [p for p in running if p.exitcode is not None]:
                case = running.pop(process)
                folder = _folder(case, out)
                if not _is_done(folder) and not (folder / FAILURE).is_file():
                    _write_failure(folder, _unexpected_end(process.exitcode))
                progress.finished(case.name, case.simulated_time, _failure(folder))


def _unexpected_end(code: int | None) -> str:
    if code == Interrupted.exit_code:
        return "stopped by a signal from outside; the same command goes on with it"
    return f"its process ended with code {code}"


def _stop(running: Iterable[BaseProcess]) -> None:
    """Ask all runs to write their checkpoint and end; raise Interrupted."""
    for process in running:
        process.terminate()
    for process in running:
        process.join()
    raise Interrupted("validation stopped", hint="the same command goes on where it was")


def _run(case: Case, folder: Path) -> None:
    """Run a case in this process, and draw it; a failure becomes text beside what was computed."""
    from softsim.run import run  # Taichi is imported in the processes only

    resume = (folder / CHECKPOINT).is_file()
    silent = Console(file=io.StringIO())
    try:
        run(
            case.loaded, (), folder, DEVICE, resume, silent, threads=1,
            profile_after=float("inf"),
        )  # fmt: skip
    except Interrupted:
        raise SystemExit(Interrupted.exit_code) from None
    except SoftsimError as error:
        _write_failure(folder, str(error))
    if _is_done(folder):  # also where it is not as its scene expects
        case.draw(folder)


def _outcome(case: Case, folder: Path) -> Outcome:
    failure = _failure(folder)
    if failure:
        return Outcome(case.name, folder, failure=failure)
    summary = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    return Outcome(case.name, folder, summary, read_history(folder / HISTORY))


def _folder(case: Case, out: Path) -> Path:
    return out / "cases" / case.key


def _is_done(folder: Path) -> bool:
    summary = folder / SUMMARY
    return summary.is_file() and json.loads(summary.read_text(encoding="utf-8"))["status"] == "done"


def _failure(folder: Path) -> str:
    """Why the run is not done; nothing where it is, though it missed what its scene expects."""
    return "" if _is_done(folder) else (folder / FAILURE).read_text(encoding="utf-8")


def _write_failure(folder: Path, reason: str) -> None:
    (folder / FAILURE).write_text(reason, encoding="utf-8")
