"""Page of a run: its end, results, curves, animation and scene."""

import gzip
import json
from base64 import b64encode
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from jinja2 import Environment, PackageLoader, StrictUndefined

from softsim import __version__
from softsim.analysis.travel import FRAME, displacement, travel_axis, travelling_column, travels
from softsim.errors import OutputError
from softsim.output.folder import SCENE, WRITTEN_ANEW, json_value, read_summary, replacing
from softsim.report import style
from softsim.report.along_pipe import way
from softsim.report.curves import chamber_pressures, pressurised, signals
from softsim.report.diagram import MILLI
from softsim.report.figures import (
    COMPUTED,
    Recorded,
    duration,
    findings,
    recorded,
    recorded_steps,
    segments,
    steps_diagram,
    written,
)
from softsim.report.page.charts import chart_of
from softsim.report.page.robot import animation
from softsim.units import count_text

# -------------------------------------------------------------------------------------------------
# Sentences on how a run ended.

GOOD, BAD, OPEN = "good", "bad", "open"

ENDS = {"passed": GOOD, "stuck": BAD, "unfinished": OPEN}
"""Kind of a verdict by the verdict on a layout."""


@dataclass(frozen=True)
class RunVerdict:
    """Sentence on the result of a run; kind: good, bad or open."""

    kind: str
    words: str


def verdicts(summary: Mapping[str, Any], scene: Mapping[str, Any]) -> Iterator[RunVerdict]:
    """Yield how the run ended, the verdict on a layout, and whether the run is as expected.

    A run with warnings has no verdict "good"; it is "open" instead.

    Parameters
    ----------
    summary : mapping
        Content of summary.json.
    scene : mapping
        The resolved scene.

    Returns
    -------
    iterator of RunVerdict
    """
    status, failure = summary.get("status"), summary.get("failure")
    warned = len(summary.get("warnings", []))
    good = OPEN if warned else GOOD
    if status == "done":
        took = f"{summary['simulated_time']:.4g} s in {duration(summary['wall_time'])}"
        doubt = f", with {count_text(warned, 'warning')}" if warned else ""
        yield RunVerdict(good, f"done{doubt}: simulated {took}")
    elif status == "aborted":
        yield RunVerdict(BAD, f"aborted: {failure or 'by an error that is in run.log'}")
    elif status == "interrupted":
        yield RunVerdict(
            OPEN, "interrupted: results up to the interruption; continue with --resume"
        )
    else:
        yield RunVerdict(OPEN, "not finished: the run is still active, or was killed")
    if "layout" in summary:
        kind = ENDS[summary["layout"]["verdict"]]
        yield RunVerdict(good if kind == GOOD else kind, summary["layout"]["sentence"])
    expected = list(expectations(scene.get("expect") or {}))
    if status == "done" and failure is not None:
        yield RunVerdict(BAD, failure)
    elif status == "done" and expected:
        yield RunVerdict(good, f"expectations of the scene met: {'; '.join(expected)}")


def expectations(expect: Mapping[str, Any]) -> Iterator[str]:
    """Yield the requirements of a scene's `expect` block, item by item."""
    for name, wanted in expect.items():
        if isinstance(wanted, Mapping):
            limits = [f"{word} {value}" for word, value in wanted.items() if value is not None]
            yield f"{name.replace('_', ' ')} {', '.join(limits)}"
        elif name == "exit" and wanted is not None:
            yield f"the robot leaves through the exit '{wanted}'"
        elif wanted is not None:
            yield "the robot passes" if wanted else "the robot gets stuck"


# -------------------------------------------------------------------------------------------------
# Writer of pages: one file with everything that it needs.
#
# It includes plotly.js in compressed form, which the browser unpacks. plotly_js/ has plotly.js with
# the kinds of charts that pages have, and the instructions to make it: compressed it is 0.6 MB,
# with all kinds of charts it would be 2.0 MB. A page works wherever it is moved to, so plotly.js is
# not in a separate file.

PAGE = "report.html"

DIRECTIONS = {
    code: f"\\u{code:04x}"
    for code in (0x061C, 0x200E, 0x200F, *range(0x202A, 0x202F), *range(0x2066, 0x206A))
}
"""Visible replacements of the control characters of writing directions.

These are marks, embeddings, overrides and isolates; unchanged, they could make a name or a path
read differently from what it is (Unicode TR36).
"""


@cache
def plotly_js() -> str:
    """Return plotly.js in compressed form.

    It has the charts scatter, scatter3d, mesh3d, heatmap and parcoords.
    """
    bundle = files("softsim.report.page") / "plotly_js" / "plotly.min.js.gz"
    return b64encode(bundle.read_bytes()).decode("ascii")


def visible(value: Any) -> Any:
    """Return a text with the code points of DIRECTIONS written out, any other value as it is."""
    return value.translate(DIRECTIONS) if isinstance(value, str) else value


def compressed(text: str) -> str:
    """Return a text compressed by gzip and encoded in base64, which unpack.js decodes."""
    return b64encode(gzip.compress(text.encode("utf-8"), mtime=0)).decode("ascii")


def write_page(template: str, context: Mapping[str, Any], path: Path) -> None:
    """Write the page from `template`, a file of templates/ that extends base.html.

    context: the variables of the template; `title` at least. All text in it is escaped. Raises
    OutputError if the file cannot be written.
    """
    text = _environment().get_template(template).render(context, plotly_js=plotly_js())
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8")


def _environment() -> Environment:
    """Return the template environment, which escapes output and rejects undefined names."""
    environment = Environment(
        loader=PackageLoader("softsim.report.page"),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=visible,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.policies["json.dumps_function"] = _compact_json
    environment.globals |= {"style": style, "version": __version__}
    environment.filters["compressed"] = compressed
    return environment


def _compact_json(content: Any, **options: Any) -> str:
    """Return JSON that browsers can read: NaN and infinity, which they reject, become null."""
    text = json.dumps(
        json_value(content), separators=(",", ":"), allow_nan=False, ensure_ascii=False
    )
    return text.translate({code: f"\\{written}" for code, written in DIRECTIONS.items()})


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
        "computed": list(written(run.summary, COMPUTED)),
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


# -------------------------------------------------------------------------------------------------
# Page of a run in steps: the end of each with a link to its page, and all steps over time.


def write_steps_page(folder: Path) -> Path:
    """Write report.html of a folder of steps, from its files alone.

    Raises OutputError if a history has no rows, a file is damaged, or the file cannot be written.
    """
    page, whole, runs = folder / PAGE, read_summary(folder), recorded_steps(folder)
    diagram = steps_diagram(runs)
    context = {
        "title": whole.get("title") or folder.name,
        "steps": [step_row(step, folder, runs.get(step["name"])) for step in whole["steps"]],
        "chart": None if diagram is None else chart_of(diagram),
    }
    write_page("steps.html", context, page)
    return page


def step_row(step: Mapping[str, Any], folder: Path, run: Recorded | None) -> dict[str, Any]:
    """Return the name of a step, its page if it has started, and how it ended."""
    if run is None:
        return {"name": step["name"], "page": None, "verdicts": [RunVerdict(OPEN, "not begun")]}
    _, scene = resolved_scene(folder / step["folder"] / SCENE)
    page = f"{step['folder']}/{PAGE}"  # of letters, digits, _ and -
    said = list(verdicts(run.summary, scene))
    return {"name": step["name"], "page": page, "verdicts": said}
