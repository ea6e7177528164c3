"""The figure of all steps of a run."""

import json
from pathlib import Path

import numpy as np
import pytest
from browsers import Browser
from matplotlib.figure import Figure
from matplotlib.image import imread

from softsim.output.folder import HISTORY, SUMMARY
from softsim.output.history import History
from softsim.report.figures import draw_steps, joined, recorded_steps, steps_diagram
from softsim.report.page.charts import chart_of
from softsim.report.page.run import write_steps_page
from softsim.report.png import draw_panels

UNITS = {"time": "s", "body_y": "m", "wall_force_normal": "N"}
NAMES = ("press", "hold", "let_go")


def write_step(folder: Path, times: np.ndarray, extra: dict[str, str]) -> None:
    """A step that falls by 1 mm a second, with pressure where it has a column of it."""
    folder.mkdir()
    history = History(folder / HISTORY, UNITS | extra)
    for number, time in enumerate(times):
        more = {name: 5e3 * float(time) for name in extra}
        force = 2.0 if number else 0.0  # a mean, and there is nothing before the first row
        history.append({"time": time, "body_y": -1e-3 * time, "wall_force_normal": force, **more})
    history.close()
    summary = {"status": "done", "simulated_time": times[-1], "wall_time": 2.0}
    (folder / SUMMARY).write_text(json.dumps(summary))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of three steps, the first one static, the last one without pressure."""
    static = {"pressure": "Pa", "unbalanced_share": "-"}
    write_step(tmp_path / "1_press", np.linspace(0.0, 1.0, 11), static)
    write_step(tmp_path / "2_hold", np.linspace(1.0, 1.5, 11), {"pressure": "Pa"})
    write_step(tmp_path / "3_let_go", np.linspace(1.5, 4.0, 11), {})
    steps = [{"name": name, "folder": f"{n}_{name}"} for n, name in enumerate(NAMES, 1)]
    (tmp_path / SUMMARY).write_text(json.dumps({"steps": steps}))
    return tmp_path


def test_histories_are_put_together(folder: Path) -> None:
    history = joined([run.history for run in recorded_steps(folder).values()])
    time = history["time"]
    assert len(time) == 11 + 10 + 10 and (np.diff(time) > 0.0).all()
    np.testing.assert_array_equal(history["body_y"], -1e-3 * time)
    assert (history["wall_force_normal"][1:] == 2.0).all()
    assert (np.isnan(history["pressure"]) == (time > 1.5)).all()
    assert "unbalanced_share" not in history


def test_the_bounds_of_the_steps_are_drawn_and_named(folder: Path) -> None:
    diagram = steps_diagram(recorded_steps(folder))
    assert diagram is not None and diagram.bounds == (1.0, 1.5) and diagram.span == (0.0, 4.0)
    names = diagram.panels[-1].left
    assert names.scale.labels == NAMES[::-1]
    spans = {NAMES[2 - int(line.y[0])]: tuple(line.x) for line in names.series}
    assert spans == {"press": (0.0, 1.0), "hold": (1.0, 1.5), "let_go": (1.5, 4.0)}

    grid = Figure().subplots(len(diagram.panels), squeeze=False)[:, 0]
    draw_panels(list(grid), diagram)
    for axes in grid:
        upright = [line.get_xdata()[0] for line in axes.lines if np.ptp(line.get_xdata()) == 0.0]
        assert upright == [1.0, 1.5]
    lines = [shape for shape in chart_of(diagram).layout["shapes"] if shape["type"] == "line"]
    assert [line["x0"] for line in lines] == [line["x1"] for line in lines] == [1.0, 1.5]


def test_the_figure_shows_the_steps_that_have_begun(folder: Path) -> None:
    """A step that has not may have the history of an earlier course."""
    (folder / "3_let_go" / SUMMARY).unlink()
    diagram = steps_diagram(recorded_steps(folder))
    assert diagram is not None and diagram.span == (0.0, 1.5)
    figure = draw_steps(folder)
    assert figure == folder / "steps.png"
    assert imread(figure).std() > 0.05

    for name in ("1_press", "2_hold"):
        (folder / name / SUMMARY).unlink()
    assert draw_steps(folder) is None and not figure.exists()


def test_only_static_steps_count_the_time_of_their_loads(folder: Path) -> None:
    runs = recorded_steps(folder)
    diagram = steps_diagram(runs)
    assert diagram is not None and "static" in diagram.x.title
    del runs["press"]
    diagram = steps_diagram(runs)
    assert diagram is not None and diagram.x.title == "time [s]"


def test_the_page_leads_to_those_of_the_steps(folder: Path, browser: Browser) -> None:
    (folder / "3_let_go" / SUMMARY).unlink()
    browser.open(write_steps_page(folder))
    assert browser.complaints() == [] and browser.requests() == []
    links = "return [...document.querySelectorAll('a')].map((a) => a.getAttribute('href'))"
    assert browser.run(links) == ["1_press/report.html", "2_hold/report.html"]
    said = "return [...document.querySelectorAll('main .state')].map((p) => p.innerText)"
    ends = [f"done: simulated {time} s in 2.0 s" for time in ("1", "1.5")]
    assert browser.run(said) == [*ends, "not begun"]
    drawn = "return document.querySelectorAll('.scatterlayer path.js-line').length"
    assert browser.run(drawn) == 2 + 1 + 2  # body and pressure, wall force, a line for each step
