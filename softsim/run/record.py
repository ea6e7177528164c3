"""Records of a run: the files of a folder, or memory alone."""

import logging
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike
from rich.console import Console

from softsim.compute import backend
from softsim.compute.machine import Choice
from softsim.errors import OutputError
from softsim.loads.pressure_control import ControlState
from softsim.model import Model
from softsim.output import folder as files
from softsim.output.fields import FieldWriter, Frame, read_frames
from softsim.output.folder import Checkpoint, RunFolder, read_checkpoint, write_checkpoint
from softsim.output.history import TIME, History, read_history, table
from softsim.output.observation import columns, description, frame, mesh_of
from softsim.scene.loading import LoadedScene
from softsim.solver.explicit import Scenario
from softsim.solver.guards import strain_warnings
from softsim.solver.stable_step import StableStepSchedule

log = logging.getLogger("softsim")

LONGEST_GATHERING = 1.0
"""Longest time [s of wall time] for which rows and frames are gathered before they are written."""

CHANGED_BY_HAND = "changed by hand"
"""Start of the kinds of warnings about loads changed by hand, which later steps inherit."""


@dataclass
class Progress:
    """Progress of a run, besides the solver's state: times [s], energies [J], counts.

    time_increment: the step in use [s]. row_count, frame_count: entries of the run's files when the
    checkpoint was written. warnings: kind -> text of the run's warnings so far.

    Of the callbacks: schedule and told_step, the stable step [s] that was reported last, of
    StableSteps; next_history, last_history, initial_balance, largest_energy and
    largest_energy_error of Rows; next_frame of FrameOutput; control, the state of a controlled
    pressure, of Feedback; derivatives, with their times, of RowDerivatives. StopConditions are
    rebuilt from the rows.
    """

    schedule: StableStepSchedule
    time: float = 0.0
    increment_count: int = 0
    time_increment: float = 0.0
    told_step: float = 0.0
    next_history: float = 0.0
    next_frame: float = 0.0
    last_history: float = -1.0  # before the first row
    initial_balance: float = 0.0
    largest_energy: float = 0.0
    largest_energy_error: float = 0.0
    wall_time: float = 0.0
    row_count: int = 0
    frame_count: int = 0
    control: ControlState | None = None
    warnings: dict[str, str] = field(default_factory=dict)
    derivatives: list[dict[str, Any]] = field(default_factory=list)

    @classmethod
    def written(cls, numbers: dict[str, Any]) -> "Progress":
        """Return the progress from the numbers that `dataclasses.asdict` made of it."""
        schedule = StableStepSchedule(**numbers["schedule"])
        control = numbers["control"]
        state = None if control is None else ControlState.written(control)
        return cls(**{**numbers, "schedule": schedule, "control": state})


class HistoryRows(Protocol):
    """Rows of a history."""

    def append(self, rows: Mapping[str, ArrayLike]) -> None:
        """Append rows: numbers (rows,) of each column, or one."""


class Record:
    """Record of a run, by default without frames and without a log of its own.

    Warnings and messages go to the package's log and to the console.

    loaded, model: scene, and the model built from it. path: run folder, or scene file. history: its
    rows. summary: as it was written last. warnings: kind -> text of all warnings so far, in order
    of occurrence.
    """

    history: HistoryRows

    def __init__(self, loaded: LoadedScene, model: Model, path: Path, console: Console) -> None:
        self.loaded, self.model, self.path, self.console = loaded, model, path, console
        self.summary: dict[str, Any] = {}
        self.warnings: dict[str, str] = {}

    @contextmanager
    def logged(self) -> Iterator[None]:
        """Write the messages logged in the block to this run's log, if it has one."""
        yield

    def warn(self, warnings: Mapping[str, str]) -> None:
        """Log and show warnings (kind -> text), the first of each kind only; the summary lists
        them.
        """
        for kind, text in warnings.items():
            if kind not in self.warnings:
                self.warnings[kind] = text
                log.warning(text)
                self.console.print(f"warning: {text}", highlight=False, markup=False)

    def tell(self, text: str) -> None:
        """Log and show a message."""
        log.info(text)
        self.console.print(text, highlight=False)

    def write_frame(self, scenario: Scenario) -> None:
        """Write the current fields."""

    def write_failed_frame(self, scenario: Scenario) -> None:
        """Write the fields at which a guard stops the run."""

    def write_checkpoint(
        self, scenario: Scenario, progress: Progress, inspected: np.ndarray
    ) -> None:
        """Store the full state; inspected: nodal positions (n, d) [m] at the last inspection."""
        raise NotImplementedError  # no ABC: its other methods may stay empty

    def write_end(self, scenario: Scenario, progress: Progress, inspected: np.ndarray) -> None:
        """Store the state at the end of the run, from which a later step continues."""
        self.write_checkpoint(scenario, progress, inspected)

    def write_summary(self, summary: dict[str, Any]) -> None:
        """Store the summary."""
        self.summary = summary

    def rows(self) -> dict[str, np.ndarray]:
        """Return the rows of the history so far (column -> array)."""
        raise NotImplementedError  # no ABC: its other methods may stay empty

    def close(self) -> None:
        """Close the record."""


class KeptRows:
    """Rows of a history in memory, with the columns `names`."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self.names = names
        self.kept: list[tuple[float, ...]] = []

    def append(self, rows: Mapping[str, ArrayLike]) -> None:
        """Append rows: numbers (rows,) of each column, or one."""
        self.kept.extend(map(tuple, table(rows, self.names).tolist()))

    @property
    def last(self) -> dict[str, float]:
        """Latest row."""
        return dict(zip(self.names, self.kept[-1], strict=True))

    def columns(self) -> dict[str, np.ndarray]:
        """Return the rows so far (column -> array)."""
        table = np.array(self.kept, dtype=float).reshape(-1, len(self.names))
        return dict(zip(self.names, table.T, strict=True))


class MemoryRecord(Record):
    """Record of a run in memory: the rows of its history and its last checkpoint, no frames.

    warnings: those that were logged already, a dict that runs of one batch share.
    """

    def __init__(
        self, loaded: LoadedScene, model: Model, warnings: dict[str, str] | None = None
    ) -> None:
        super().__init__(loaded, model, loaded.path, Console(quiet=True))
        self.history: KeptRows = KeptRows(tuple(columns(model)))
        self.warnings = {} if warnings is None else warnings

    def write_checkpoint(
        self, scenario: Scenario, progress: Progress, inspected: np.ndarray
    ) -> None:
        progress.row_count = len(self.history.kept)
        self.checkpoint = Checkpoint(
            scenario.state(), asdict(progress), inspected, "", backend.device().name
        )

    def rows(self) -> dict[str, np.ndarray]:
        return self.history.columns()


# -------------------------------------------------------------------------------------------------
# The files of a run: log, history, frames, checkpoint, summary.

STARTING = "starting"
"""Status in the summary of a run until its first increment."""


class RunLog(logging.Handler):
    """Handler that appends each line to a file. Raises OutputError if the disk refuses, where
    logging's own would print a traceback or leave an open file behind.
    """

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path = path
        self.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))

    def emit(self, record: logging.LogRecord) -> None:
        """Append the line of a record."""
        with files.explained(self.path), self.path.open("a", encoding="utf-8") as stream:
            stream.write(self.format(record) + "\n")


class RunFiles(Record):
    """The files of a run: log, history, frames, checkpoint, summary.

    resumed_at: time [s] from which the files of a stopped run are continued; None: what an earlier
    run left in the folder is removed. gathered: frames that are not written yet.

    Raises OutputError if the disk refuses, or if there are no files to continue.
    """

    def __init__(
        self,
        loaded: LoadedScene,
        model: Model,
        target: RunFolder,
        console: Console,
        resumed_at: float | None = None,
    ) -> None:
        super().__init__(loaded, model, target.path, console)
        self.target = target
        self.file_digests = loaded.file_digests()  # of the files that the model was just built from
        self.gathered: list[Frame] = []
        self.frames_written_at = -np.inf
        if resumed_at is None:
            for stale in (files.CHECKPOINT, files.SUMMARY, files.LOG):
                (self.path / stale).unlink(missing_ok=True)
        target.write_text_atomic(files.SCENE, loaded.resolved())
        self.history: History = History(self.path / files.HISTORY, columns(model), resumed_at)
        self.open_fields(resumed_at)
        log.setLevel(logging.INFO)
        self.log_file = RunLog(self.path / files.LOG)
        with self.logged():
            log.info("%s: %s", loaded.path, "starts" if resumed_at is None else "is resumed")
        if resumed_at is None:
            self.write_summary(
                {"status": STARTING, "scene": str(loaded.path), "title": loaded.scene.title}
            )

    @property
    def frame_count(self) -> int:
        """Number of frames written."""
        return self.fields.frame_count

    def open_fields(self, resumed_at: float | None) -> None:
        """Open the file of the frames, for those after `resumed_at` [s]; None: from the start."""
        self.fields = FieldWriter(self.path / files.RESULTS, *mesh_of(self.model), resumed_at)
        if resumed_at is None:
            self.fields.describe(**description(self.model, self.loaded.scene.title))

    @contextmanager
    def logged(self) -> Iterator[None]:
        """Write the messages logged in the block to this run's log: runs may alternate."""
        log.addHandler(self.log_file)
        try:
            yield
        finally:
            log.removeHandler(self.log_file)

    def write_frame(self, scenario: Scenario) -> None:
        """Write the current fields, unless already written, and warnings about their strains.

        Frames that follow one another quickly are gathered, as opening the file takes longer than
        writing a small frame.
        """
        last = self.gathered[-1].time if self.gathered else self.fields.last_time
        if scenario.time > last:
            self.gathered.append(frame(scenario, self.loaded.scene.output.fields))
            if time.monotonic() - self.frames_written_at > LONGEST_GATHERING:
                self.write_gathered()
            self.warn(strain_warnings(self.model, scenario.positions(), scenario.time))

    def write_gathered(self) -> None:
        """Write the frames gathered so far."""
        gathered, self.gathered = self.gathered, []
        if gathered:
            self.fields.extend(gathered)
            self.frames_written_at = time.monotonic()

    def write_failed_frame(self, scenario: Scenario) -> None:
        """Write the fields at which a guard stops the run."""
        self.write_frame(scenario)
        self.write_gathered()

    def write_checkpoint(
        self, scenario: Scenario, progress: Progress, inspected: np.ndarray
    ) -> None:
        """Write the full state, from which --resume continues, after the rows before it.

        inspected: places of the nodes (n, d) [m] at the last inspection.
        """
        self.history.save()
        self.write_gathered()
        progress.row_count, progress.frame_count = self.history.row_count, self.frame_count
        scene, device = self.loaded.scene.model_dump_json(), backend.device().name
        content = Checkpoint(
            scenario.state(), asdict(progress), inspected, scene, device, self.file_digests
        )
        write_checkpoint(self.path / files.CHECKPOINT, content)

    def write_summary(self, summary: dict[str, Any]) -> None:
        """Replace summary.json."""
        super().write_summary(summary)
        self.target.write_json_atomic(files.SUMMARY, summary)

    def rows(self) -> dict[str, np.ndarray]:
        return read_history(self.path / files.HISTORY)

    def close(self) -> None:
        """Write what was gathered, and close the files."""
        try:
            self.write_gathered()
        finally:
            self.history.close()


class FramelessFiles(RunFiles):
    """Files of a run without frames: fields are written only if it fails; no state at its end."""

    @property
    def frame_count(self) -> int:
        """Number of frames that a resumed run must find: none."""
        return 0

    def open_fields(self, resumed_at: float | None) -> None:
        """Remove the frames of an earlier run."""
        (self.path / files.RESULTS).unlink(missing_ok=True)

    def write_end(self, scenario: Scenario, progress: Progress, inspected: np.ndarray) -> None:
        """Do nothing: nobody continues from the end of this run."""

    def write_frame(self, scenario: Scenario) -> None:
        """Write the warnings about the strains of a frame."""
        self.warn(strain_warnings(self.model, scenario.positions(), scenario.time))

    def write_failed_frame(self, scenario: Scenario) -> None:
        """Write the fields at which a guard stops the run."""
        super().open_fields(None)
        super().write_frame(scenario)


def fitting_checkpoint(loaded: LoadedScene, target: RunFolder, choice: Choice) -> Checkpoint:
    """Return the checkpoint in a run folder.

    Raises OutputError where there is none, it is of another scene or device, or the history or the
    frames do not reach up to it.
    """
    path = target.path
    checkpoint = read_checkpoint(path / files.CHECKPOINT)
    mismatch = checkpoint.mismatch(loaded)
    if mismatch:
        raise OutputError(
            f"the checkpoint in {path} {mismatch}",
            hint=f"compare the scene with {path / files.SCENE}, or run without --resume",
        )
    if not choice.allows(checkpoint.device):
        raise OutputError(
            f"the checkpoint in {path} was computed on {checkpoint.device}, this run uses "
            f"{choice.device}: the resumed run would not give identical results",
            hint=f"resume with --device {checkpoint.device}",
        )
    progress = Progress.written(checkpoint.progress)
    rows = read_history(path / files.HISTORY)[TIME]
    _refuse_hole(path / files.HISTORY, rows, progress.time, progress.row_count)
    if progress.frame_count:
        frames = read_frames(path / files.RESULTS).times
        _refuse_hole(path / files.RESULTS, frames, progress.time, progress.frame_count)
    return checkpoint


def _refuse_hole(file: Path, times: np.ndarray, reached: float, count: int) -> None:
    """Raise OutputError if fewer than `count` of the times (n,) [s] in a file are up to the
    checkpoint's, `reached` [s].
    """
    found = times[times <= reached]
    if len(found) < count:
        latest = f", the latest of t = {found[-1]:.6g} s" if len(found) else ""
        raise OutputError(
            f"{file} has {len(found)} of {count} entries up to the checkpoint at t = "
            f"{reached:.6g} s{latest}: a resumed run would leave a gap",
            hint=f"restore the complete file, or remove {files.CHECKPOINT} to start the run from "
            "the beginning",
        )
