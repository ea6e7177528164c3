"""Content of a run folder for its report."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from softsim.errors import OutputError
from softsim.output.fields import Frames, read_frames
from softsim.output.folder import HISTORY, RESULTS, read_summary
from softsim.output.history import read_history, read_units
from softsim.output.travel import has, without_radius
from softsim.report.snapshots import is_axisymmetric


@dataclass(frozen=True)
class Recorded:
    """Recorded run.

    history: columns (rows,) with their units; frames: None if the run wrote no fields; summary:
    empty if there is none yet.
    """

    history: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    frames: Frames | None
    summary: Mapping[str, Any]

    @property
    def layout(self) -> Mapping[str, Any] | None:
        """Report of a run along a pipe if its frames can be located in the pipe, otherwise None."""
        shows = self.frames is not None and "path" in self.frames.described and len(self.frames) > 0
        return self.summary.get("layout") if shows and has(self.history, "arc_length") else None


def recorded(folder: Path) -> Recorded:
    """Open a run folder.

    Raises OutputError if the history is missing or empty, or a file is damaged.
    """
    history, units = dict(read_history(folder / HISTORY)), read_units(folder / HISTORY)
    if len(history["time"]) == 0:
        raise OutputError(
            f"{folder / HISTORY} has no rows yet, so there is nothing to draw",
            hint="the run was stopped before its first sample: run longer, or reduce "
            "output.history_interval",
        )
    frames = read_frames(folder / RESULTS) if (folder / RESULTS).exists() else None
    if frames is not None and is_axisymmetric(frames):
        history = without_radius(history)
    return Recorded(history, units, frames, read_summary(folder))
