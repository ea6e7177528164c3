"""Page of a run: its end, results, curves, animation and scene."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from softsim.errors import OutputError
from softsim.output.folder import SCENE, WRITTEN_ANEW
from softsim.output.travel import FRAME, displacement, travel_axis, travelling_column, travels
from softsim.report.colours import MILLI
from softsim.report.curves import chamber_pressures, pressurised
from softsim.report.page.animation import animation
from softsim.report.page.charts import chart_of
from softsim.report.page.verdicts import verdicts
from softsim.report.page.writing import PAGE, write_page
from softsim.report.readable import bookkeeping, findings
from softsim.report.recorded import Recorded, recorded
from softsim.report.signals import signals
from softsim.report.table import segments
from softsim.report.way import way

SAID_ABOVE = ("layout",)
"""Entries of the summary that the verdicts at the top of the page already report."""


def write_run_page(folder: Path) -> Path:
    """Write report.html of a run folder, from its files alone.

    Raises OutputError if the history is missing or empty, the results lack the field that the
    scene colours by, a file is damaged, or the file cannot be written.
    """
    page = folder / PAGE
    write_page("run.html", run_context(folder), page)
    return page


def run_context(folder: Path) -> dict[str, Any]:
    """Return the variables of the page of the run in `folder`.

    Raises OutputError as `write_run_page` does.
    """
    run = recorded(folder)
    curves = [] if run.layout is None else [way(run.history, run.layout)]
    curves += signals(run.history, run.units).values()
    text, scene = resolved_scene(folder / SCENE)
    return {
        "title": run.summary.get("title") or folder.name,
        "scene": run.summary.get("scene", ""),
        "warnings": run.summary.get("warnings", []),
        "verdicts": list(verdicts(run.summary, scene)),
        "measures": [
            line for line in findings(run.summary, run.units) if line.name not in SAID_ABOVE
        ],
        "computed": list(bookkeeping(run.summary)),
        "segments": None if run.layout is None else segments(run.layout),
        "layout": run.layout,
        "charts": list(map(chart_of, curves)),
        "animation": animation_of(run),
        "settings": [setting(line) for line in text.splitlines()],
    }


def resolved_scene(file: Path) -> tuple[str, dict[str, Any]]:
    """Return the resolved scene of a run as text and as a dictionary; both empty if there is none.

    Raises OutputError if the file is damaged.
    """
    if not file.is_file():
        return "", {}
    try:
        text = file.read_text("utf-8")
        scene = yaml.safe_load(text)
    except (OSError, UnicodeError, yaml.YAMLError) as error:
        reason = " ".join(str(error).split())
        raise OutputError(f"{file} is damaged: {reason}", WRITTEN_ANEW) from error
    if not isinstance(scene, dict):
        raise OutputError(f"{file} is damaged: it is not a scene", WRITTEN_ANEW)
    return text, scene


def animation_of(run: Recorded) -> dict[str, Any] | None:
    """Return the frames with the readings of the history at each, or None without frames.

    opens_at: the frame that is shown first, the most deformed one, or the last one of a run
    that was aborted. what: "robot" if the history has the displacement of a frame, otherwise
    "body".
    """
    if run.frames is None or len(run.frames) == 0:
        return None
    summary, field = run.summary, run.summary.get("snapshot_field", "stretch")
    shown = animation(run.frames, field, summary.get("failed_element"))
    aborted = summary.get("status") == "aborted"
    opens_at = len(shown["times"]) - 1 if aborted else shown["most_deformed"]
    said = list(readings(run.history, shown["times"]))
    what = "body" if travel_axis(run.history, FRAME) is None else "robot"
    return shown | {"opens_at": opens_at, "readings": said, "what": what}


def readings(history: Mapping[str, np.ndarray], times: np.ndarray) -> Iterator[dict[str, Any]]:
    """Yield pressure and position at the times (f,) [s] of frames: name, unit, values (f,)."""
    columns = {}
    if pressurised(history):
        for name, air in chamber_pressures(history).items():
            columns[name, "kPa"] = air / 1e3
    if "arc_length" in history:
        columns["along the pipe", "mm"] = history["arc_length"] * MILLI
    elif travels(history):
        columns[f"displacement in {travelling_column(history)[-1]}", "mm"] = (
            displacement(history) * MILLI
        )
    for (name, unit), values in columns.items():
        at_frames = np.interp(times, history["time"], values)
        yield {"name": name, "unit": unit, "values": at_frames.round(3)}


def setting(line: str) -> tuple[str, str]:
    """Return a line of the resolved scene and the source of its value."""
    value, mark, origin = line.rpartition("  # ")
    return (value, origin) if mark else (line, "")
