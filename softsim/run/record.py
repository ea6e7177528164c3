"""Records of a run: the files of a folder (files.py), or memory alone."""

import logging
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from rich.console import Console

from softsim import backend
from softsim.model import Model
from softsim.output.checkpoint import Checkpoint
from softsim.output.observation import columns
from softsim.output.progress import Progress
from softsim.scene.loading import LoadedScene
from softsim.solver.explicit import Scenario

log = logging.getLogger("softsim")


class Rows(Protocol):
    """Rows of a history."""

    def append(self, row: Mapping[str, float]) -> None:
        """Append one row: a number for each column."""


class Record(Protocol):
    """Record of a run.

    loaded, model: its scene, and the model built from it. warnings: kind -> text of all warnings so
    far, in order of occurrence.
    """

    @property
    def loaded(self) -> LoadedScene: ...
    @property
    def model(self) -> Model: ...
    @property
    def console(self) -> Console: ...
    @property
    def path(self) -> Path: ...
    @property
    def history(self) -> Rows: ...

    summary: dict[str, Any]
    warnings: dict[str, str]

    def logged(self) -> AbstractContextManager[None]:
        """Write the messages logged in the block to this run's log."""

    def warn(self, warnings: Mapping[str, str]) -> None:
        """Record warnings (kind -> text), the first of each kind only."""

    def tell(self, text: str) -> None:
        """Log a message."""

    def write_frame(self, scenario: Scenario) -> None:
        """Write the current fields."""

    def write_failed_frame(self, scenario: Scenario) -> None:
        """Write the fields at which a guard stops the run."""

    def write_checkpoint(
        self, scenario: Scenario, progress: Progress, inspected: np.ndarray
    ) -> None:
        """Store the full state; inspected: nodal positions (n, d) [m] at the last inspection."""

    def write_summary(self, summary: dict[str, Any]) -> None:
        """Store the summary."""

    def rows(self) -> dict[str, np.ndarray]:
        """Return the rows of the history so far (column -> array)."""

    def close(self) -> None:
        """Close the record."""


class KeptRows:
    """Rows of a history in memory, with the columns `names`."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self.names = names
        self.kept: list[tuple[float, ...]] = []

    def append(self, row: Mapping[str, float]) -> None:
        """Append one row: a number for each column."""
        self.kept.append(tuple(row[name] for name in self.names))

    @property
    def last(self) -> dict[str, float]:
        """Latest row."""
        return dict(zip(self.names, self.kept[-1], strict=True))

    def columns(self) -> dict[str, np.ndarray]:
        """Return the rows so far (column -> array)."""
        table = np.array(self.kept, dtype=float).reshape(-1, len(self.names))
        return dict(zip(self.names, table.T, strict=True))


class Memory:
    """Record of a run in memory: the rows of its history and its last checkpoint, no frames.

    Messages of the run go to the package's log.
    """

    def __init__(self, loaded: LoadedScene, model: Model) -> None:
        self.loaded, self.model, self.path = loaded, model, loaded.path
        self.console = Console(quiet=True)
        self.history = KeptRows(tuple(columns(model)))
        self.summary: dict[str, Any] = {}
        self.warnings: dict[str, str] = {}

    @contextmanager
    def logged(self) -> Iterator[None]:
        """Do nothing: messages go to the package's log."""
        yield

    def warn(self, warnings: Mapping[str, str]) -> None:
        """Log warnings (kind -> text), the first of each kind only."""
        for kind, text in warnings.items():
            if kind not in self.warnings:
                self.warnings[kind] = text
                log.warning(text)

    def tell(self, text: str) -> None:
        """Log a message."""
        log.info(text)

    def write_frame(self, scenario: Scenario) -> None:
        """Do nothing: the fields stay in memory."""

    def write_failed_frame(self, scenario: Scenario) -> None:
        """Do nothing: the fields stay in memory."""

    def write_checkpoint(
        self, scenario: Scenario, progress: Progress, inspected: np.ndarray
    ) -> None:
        """Store the full state; inspected: nodal positions (n, d) [m] at the last inspection."""
        progress.row_count = len(self.history.kept)
        self.checkpoint = Checkpoint(
            scenario.state(), asdict(progress), inspected, "", backend.device().name
        )

    def write_summary(self, summary: dict[str, Any]) -> None:
        """Store the summary."""
        self.summary = summary

    def rows(self) -> dict[str, np.ndarray]:
        """Return the rows of the history so far (column -> array)."""
        return self.history.columns()

    def close(self) -> None:
        """Do nothing: no file is open."""
