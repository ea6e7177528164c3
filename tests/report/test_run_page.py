"""What the page of a run says, before any browser sees it."""

import gzip
import json
import re
import shutil
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest
from layout_runs import write_layout_run

from softsim.errors import OutputError
from softsim.output.folder import HISTORY, SCENE, RunFolder
from softsim.output.history import History
from softsim.report.page.run import (
    BAD,
    GOOD,
    OPEN,
    expectations,
    run_context,
    setting,
    verdicts,
    write_run_page,
)
from softsim.robots.block import block

DONE = {"status": "done", "simulated_time": 4.0, "wall_time": 100.0, "title": "strip"}


@pytest.fixture
def folder(strip_run: Path, tmp_path: Path) -> Path:
    """A copy of the strip's run, which the test may change."""
    return shutil.copytree(strip_run, tmp_path / "run")


def write_summary(folder: Path, **entries) -> None:
    RunFolder(folder).write_json_atomic("summary.json", DONE | entries)


def test_numbers_are_those_of_the_summary_with_units_for_people(folder: Path) -> None:
    write_summary(folder, frame_displacement=8.1234e-3, mean_speed=2.5e-3, peak_pull=None)
    measures = {line.name: line.value for line in run_context(folder)["measures"]}
    assert measures["frame displacement"] == "8.123 mm"
    assert measures["mean speed"] == "2.5 mm/s"
    assert "peak pull" not in measures


def test_what_a_run_is_not_about_is_not_said(ring_run: Path, folder: Path, tmp_path: Path) -> None:
    ring = shutil.copytree(ring_run, tmp_path / "ring")
    for run in (folder, ring):
        write_summary(run, cycles_done=0, rows_in_contact=0.0, frame_displacement=0.0)
        context = run_context(run)
        assert [line.name for line in context["measures"]] == ["frame displacement"]
        assert [line.name for line in context["computed"]] == ["simulated time", "wall time"]
    assert run_context(folder)["animation"]["what"] == "robot"
    assert run_context(ring)["animation"]["what"] == "body"
    assert "robot" not in write_run_page(ring).read_text("utf-8").partition("<script")[0]


def test_rows_without_a_fraction_of_the_time_are_dashes(folder: Path) -> None:
    """A run that failed at once has no duration."""
    write_summary(folder, row_contact_shares=[None, None])
    assert [line.value for line in run_context(folder)["measures"]] == ["-, - % of the time"]


def test_displacements_and_probes_come_first_and_bookkeeping_is_folded(folder: Path) -> None:
    write_summary(
        folder, energy_error=1e-4, slip_share=0.03, row_contact_shares=[1.0, 0.24],
        body_displacement=-3.5e-3, body_displacement_axis="y", body_displacement_y=-3.5e-3,
        body_displacement_radial=5e-5, body_speed=-2e-3,
        probes={"frame_x": 8e-3}, probes_min={"frame_x": 0.0}, probes_max={"frame_x": 9e-3},
    )  # fmt: skip
    assert [(line.name, line.value) for line in run_context(folder)["measures"]] == [
        ("body displacement", "-3.5 mm in y, 0.05 mm in the mean radius"),
        ("body speed at the end", "-2 mm/s in y"),
        ("frame x", "8 mm at the end, from 0 to 9"),
        ("time in contact, each row", "100, 24 % of the time"),
        ("sliding contact", "3 % of the normal impulse"),
    ]
    found, _, folded = write_run_page(folder).read_text("utf-8").partition("<details")
    assert "energy error" not in found and "energy error" in folded
    assert "acted on sliding nodes" in found  # what the name means


def test_charts_are_those_that_the_history_has_something_for(folder: Path) -> None:
    charts = {chart.title: chart for chart in run_context(folder)["charts"]}
    assert list(charts) == ["Displacement and pressure", "Energies", "Contact with walls"]
    assert all(chart.over_time for chart in charts.values())
    axes = charts["Displacement and pressure"].figure["layout"]
    assert axes["yaxis"]["title"]["text"] == "frame displacement in x [mm]"
    assert axes["yaxis2"]["overlaying"] == "y" and axes["xaxis"]["range"] == [0.0, 4.0]


def test_a_vibrating_signal_is_thinned_to_its_mean_and_band(folder: Path) -> None:
    band, mean = run_context(folder)["charts"][0].traces[:2]  # of 4001 rows
    assert len(mean["x"]) == 1000
    high, low = np.reshape(band["y"], (2, 1000))
    swing = high - low[::-1]
    assert np.all(swing >= 0.0)
    assert swing.max() > 0.05  # the vibration, 0.1 mm, seen in bins of four rows
    assert mean["y"][-1] == pytest.approx(8.0, abs=0.1)


def test_readings_are_the_history_at_the_times_of_the_frames(folder: Path) -> None:
    animation = run_context(folder)["animation"]
    pressure, place = animation["readings"]
    assert (pressure["name"], pressure["unit"]) == ("air pressure", "kPa")
    assert np.interp(1.0, animation["times"], pressure["values"]) == pytest.approx(5.0)
    assert (place["name"], place["unit"]) == ("displacement in x", "mm")
    assert place["values"][-1] == pytest.approx(8.0, abs=0.2)


def test_a_layout_has_its_verdict_its_segments_and_its_way(tmp_path: Path) -> None:
    write_layout_run(tmp_path, block(30e-3, 8e-3, 4e-3), 0.151, wedged=True)
    context = run_context(tmp_path)
    report = json.loads((tmp_path / "summary.json").read_text())["layout"]
    assert report["sentence"] in [verdict.words for verdict in context["verdicts"]]
    assert len(context["segments"].rows) == len(report["segments"])
    assert "Path through the layout" in [chart.title for chart in context["charts"]]


def test_a_run_without_frames_has_no_animation(folder: Path) -> None:
    (folder / "results.vtkhdf").unlink()
    assert run_context(folder)["animation"] is None
    assert 'id="player"' not in write_run_page(folder).read_text("utf-8")


def test_a_folder_without_history_is_named(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"cannot read the history .*history\.csv"):
        write_run_page(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_warnings_stand_in_a_bar_above_the_verdict(folder: Path) -> None:
    write_summary(folder)
    assert 'class="warnings"' not in write_run_page(folder).read_text("utf-8")
    write_summary(folder, warnings=["at 0.1 s hourglass modes hold > 5 %", "contact chatters"])
    header = re.findall("<header>.*</header>", write_run_page(folder).read_text("utf-8"), re.S)[0]
    bar, _, verdict = header.partition('<p class="state')
    assert "2 warnings" in bar and "hourglass modes hold &gt; 5 %" in bar
    assert verdict.startswith(' open">done, with 2 warnings')


TITLE = """<script>alert(1)</script> & "x" '</script>"""


def test_text_is_escaped_wherever_it_stands(folder: Path) -> None:
    write_summary(folder, title=TITLE, scene=TITLE, status="aborted", failure=TITLE)
    (folder / SCENE).write_text(f"title: '{TITLE.replace(chr(39), '')}'  # <b>scene</b>:1\n")
    text = write_run_page(folder).read_text("utf-8")
    assert "alert(1)</script>" not in text and "<b>scene" not in text
    assert text.count("&lt;script&gt;alert(1)&lt;/script&gt; &amp; &#34;x&#34;") == 5


def test_names_in_charts_are_escaped(tmp_path: Path) -> None:
    history = History(tmp_path / HISTORY, {"time": "s", "</script><b>": "N"})
    for time in (0.0, 1.0):
        history.append({"time": time, "</script><b>": time})
    history.close()
    text = write_run_page(tmp_path).read_text("utf-8")
    packed = re.findall("data-packed>([^<]*)<", text)
    charts = "".join(gzip.decompress(b64decode(one)).decode("utf-8") for one in packed)
    assert "</script><b>" not in text + charts
    assert r"\u003c/script\u003e\u003cb\u003e" in charts


def test_marks_of_writing_directions_are_shown_as_what_they_are(tmp_path: Path) -> None:
    name = "p\u202egnp.exe\u200f"
    history = History(tmp_path / HISTORY, {"time": "s", name: "N"})
    for time in (0.0, 1.0):
        history.append({"time": time, name: time})
    history.close()
    write_summary(tmp_path, title=name)
    text = write_run_page(tmp_path).read_text("utf-8")
    packed = re.findall("data-packed>([^<]*)<", text)
    charts = [json.loads(gzip.decompress(b64decode(one))) for one in packed]
    assert "\u202e" not in text + str(charts) and "\u200f" not in text + str(charts)
    assert text.count(r"<title>p\u202egnp.exe\u200f</title>") == 1
    assert r"p\u202egnp.exe\u200f" in {trace["name"] for c in charts for trace in c["data"]}


def test_the_page_is_one_small_file_that_has_all_it_needs(folder: Path) -> None:
    text = write_run_page(folder).read_text("utf-8")
    assert '<link rel="stylesheet"' not in text and "<script src" not in text
    assert len(text) < 1e6
    (packed,) = re.findall('id="plotly">([^<]*)<', text)
    plotly = gzip.decompress(b64decode(packed)).decode("utf-8")
    assert "plotly.js v" in plotly[:50] and "licensed under the MIT license" in plotly[:200]
    assert all(kind in plotly for kind in ("mesh3d", "scatter3d", "heatmap", "parcoords"))


EXPECT = {"expect": {"passes": None, "mean_speed": {"min": "1 mm/s", "max": None}}}


@pytest.mark.parametrize(
    ("summary", "scene", "kinds", "said"),
    [
        (DONE, {}, [GOOD], "4 s in 1 min 40 s"),
        (DONE, EXPECT, [GOOD, GOOD], "expectations of the scene met: mean speed min 1 mm/s"),
        (DONE | {"failure": "not as expected"}, EXPECT, [GOOD, BAD], "not as expected"),
        ({"status": "aborted", "failure": "element 7 inverted"}, {}, [BAD], "element 7 inverted"),
        (DONE | {"warnings": ["a", "b"]}, {}, [OPEN], "done, with 2 warnings: simulated"),
        (DONE | {"warnings": ["a"]}, EXPECT, [OPEN, OPEN], "expectations of the scene met"),
        (
            DONE | {"warnings": ["a"], "layout": {"verdict": "passed", "sentence": "passed: 9 mm"}},
            {},
            [OPEN, OPEN],
            "passed: 9 mm",
        ),
        ({"status": "aborted"}, EXPECT, [BAD], "run.log"),
        ({"status": "interrupted"}, EXPECT, [OPEN], "--resume"),
        ({}, {}, [OPEN], "not finished"),
        (
            DONE | {"layout": {"verdict": "stuck", "sentence": "stuck in 2"}},
            {},
            [GOOD, BAD],
            "in 2",
        ),
    ],
)
def test_verdicts(summary, scene, kinds, said) -> None:
    found = list(verdicts(summary, scene))
    assert [verdict.kind for verdict in found] == kinds
    assert said in found[-1].words


def test_expectations_of_a_layout() -> None:
    assert list(expectations({"passes": True})) == ["the robot passes"]
    assert list(expectations({"passes": False})) == ["the robot gets stuck"]


@pytest.mark.parametrize(
    ("line", "parts"),
    [
        ("  end: 3 s  # scene.yaml:4", ("  end: 3 s", "scene.yaml:4")),
        ("time:", ("time:", "")),
        ('title: "a  # b"  # default', ('title: "a  # b"', "default")),
    ],
)
def test_a_setting_and_its_origin(line: str, parts: tuple[str, str]) -> None:
    assert setting(line) == parts
