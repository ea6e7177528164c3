"""What a run leaves in its folder while it goes on: log, history, frames, checkpoint, summary."""

import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from typing import Any

import numpy as np
from rich.console import Console

from softsim import backend
from softsim.model import Model
from softsim.output import folder as files
from softsim.output.checkpoint import Checkpoint, write_checkpoint
from softsim.output.fields import FieldWriter
from softsim.output.folder import RunFolder
from softsim.output.history import History, read_history
from softsim.output.observation import columns, description, frame, mesh_of
from softsim.output.progress import Progress
from softsim.scene.loading import LoadedScene
from softsim.solver.guards import strain_warnings
from softsim.solver.scenario import Scenario

log = logging.getLogger("softsim")


class Recording:
    """The files of a run that begins; what an earlier one left in the folder goes.

    loaded, model: the scene and what was built from it. summary: as it was written last.
    Raises OutputError if the disk refuses.
    """

    def __init__(
        self, loaded: LoadedScene, model: Model, target: RunFolder, console: Console
    ) -> None:
        self._belong_to(loaded, model, target, console)
        for stale in (files.CHECKPOINT, files.SUMMARY, files.LOG):
            (self.path / stale).unlink(missing_ok=True)
        target.write_text_atomic(files.SCENE, loaded.resolved())
        self.history = History(self.path / files.HISTORY, columns(model))
        self.fields = FieldWriter(self.path / files.RESULTS, *mesh_of(model))
        self.fields.describe(**description(model, loaded.scene.title))

    @classmethod
    def resumed(
        cls, loaded: LoadedScene, model: Model, target: RunFolder, console: Console, time: float
    ) -> "Recording":
        """Go on with the files of a stopped run, from `time` [s] on."""
        recording = cls.__new__(cls)
        recording._belong_to(loaded, model, target, console)
        path = target.path
        recording.history = History.resumed(path / files.HISTORY, columns(model), time)
        recording.fields = FieldWriter.resumed(path / files.RESULTS, time)
        return recording

    def _belong_to(
        self, loaded: LoadedScene, model: Model, target: RunFolder, console: Console
    ) -> None:
        self.loaded, self.model, self.target, self.console = loaded, model, target, console
        self.path = target.path
        self.summary: dict[str, Any] = {}
        self.warned: set[str] = set()
        self.log_file = logging.FileHandler(self.path / files.LOG, delay=True)
        self.log_file.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))

    @contextmanager
    def logged(self) -> Iterator[None]:
        """What is logged in the block goes into this run's log: others may run in between."""
        log.setLevel(logging.INFO)
        log.addHandler(self.log_file)
        try:
            yield
        finally:
            log.removeHandler(self.log_file)
            self.log_file.close()

    def warn(self, warnings: Mapping[str, str]) -> None:
        """Into the log and onto the console, each kind once."""
        for kind, text in warnings.items():
            if kind not in self.warned:
                self.warned.add(kind)
                log.warning(text)
                self.console.print(f"warning: {text}", highlight=False)

    def write_frame(self, scenario: Scenario) -> None:
        """The fields of this moment, unless they are there, and what is doubtful about them."""
        if scenario.time > self.fields.last_time:
            now = frame(scenario)
            self.fields.append(scenario.time, now.point_data, now.cell_data, now.extra)
            self.warn(strain_warnings(self.model, scenario.positions(), scenario.time))

    def write_checkpoint(self, scenario: Scenario, progress: Progress) -> None:
        """The full state, from which --resume goes on."""
        scene, device = self.loaded.scene.model_dump_json(), backend.device().name
        content = Checkpoint(scenario.memory(), asdict(progress), scene, device)
        write_checkpoint(self.path / files.CHECKPOINT, content)

    def write_summary(self, summary: dict[str, Any]) -> None:
        """Replace summary.json."""
        self.summary = summary
        self.target.write_json_atomic(files.SUMMARY, summary)

    def rows(self) -> dict[str, np.ndarray]:
        """The history so far (column -> array)."""
        return read_history(self.path / files.HISTORY)

    def close(self) -> None:
        """Let go of the files."""
        self.history.close()
