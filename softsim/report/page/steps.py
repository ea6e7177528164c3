"""Page of a run in steps: the end of each with a link to its page, and all steps over time."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from softsim.output.folder import SCENE, read_summary
from softsim.report.page.charts import chart_of
from softsim.report.page.run import resolved_scene
from softsim.report.page.verdicts import OPEN, Verdict, verdicts
from softsim.report.page.writing import PAGE, write_page
from softsim.report.recorded import Recorded
from softsim.report.steps import recorded_steps, steps_diagram


def write_steps_page(folder: Path) -> Path:
    """Write report.html of a folder of steps, from its files alone.

    Raises OutputError if a history has no rows, a file is damaged, or the file cannot be written.
    """
    page, whole, runs = folder / PAGE, read_summary(folder), recorded_steps(folder)
    diagram = steps_diagram(runs)
    context = {
        "title": whole.get("title") or folder.name,
        "steps": [told(step, folder, runs.get(step["name"])) for step in whole["steps"]],
        "chart": None if diagram is None else chart_of(diagram),
    }
    write_page("steps.html", context, page)
    return page


def told(step: Mapping[str, Any], folder: Path, run: Recorded | None) -> dict[str, Any]:
    """Return the name of a step, its page if it has started, and how it ended."""
    if run is None:
        return {"name": step["name"], "page": None, "verdicts": [Verdict(OPEN, "not begun")]}
    _, scene = resolved_scene(folder / step["folder"] / SCENE)
    page = f"{step['folder']}/{PAGE}"  # of letters, digits, _ and -
    said = list(verdicts(run.summary, scene))
    return {"name": step["name"], "page": page, "verdicts": said}
