"""Optimisations of a formula: the optimum, what is stored, what fails, what survives a kill."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from statistics import median

import pytest
import trial_stand_ins
from polars.testing import assert_frame_equal
from trial_stand_ins import distance, optimized

from softsim.errors import OutputError, SceneError
from softsim.output.folder import read_study, read_table
from softsim.study.cases import DONE, FAILED

STUDY = """
scene: block.yaml
factors:
  gravity: {key: environment.gravity, range: [0 m/s^2, 20 m/s^2]}
  slope: {key: environment.inclination, range: [0 deg, 80 deg], count: 41}
measures:
  away: {of: body_displacement, unit: mm}
optimize: {minimize: away, trials: 10}
"""
WALL_TIME = "wall_time [s]"


@pytest.fixture
def search_file(study_file):
    """A study of a formula's minimum."""
    study_file.write_text(STUDY)
    return study_file


def test_trials_come_from_the_command_or_the_file(search_file, tmp_path):
    search_file.write_text(STUDY.replace(", trials: 10", ""))
    table, _ = optimized(search_file, tmp_path / "out", count=2)
    assert len(table) == 2
    with pytest.raises(SceneError, match="number of trials is missing"):
        optimized(search_file, tmp_path / "out", count=None)


def test_the_optimum_is_found(search_file, tmp_path):
    table, said = optimized(search_file, tmp_path / "out", count=60)
    assert table["case"].to_list() == list(range(1, 61))
    assert "60 trials, 0 of them stored" in said
    values = table.rename({"gravity [m/s^2]": "gravity", "slope [deg]": "slope"}).to_dicts()
    away = table["away [mm]"].to_list()
    assert away == pytest.approx([distance(row) for row in values])
    assert min(away) < 0.3
    assert median(away[-20:]) < 0.2 * median(away[:10])  # it has learnt where to look
    assert all(row["slope"] % 2.0 == 0.0 for row in values)
    record = read_study(tmp_path / "out")
    assert (record.status, record.case_count, record.goal.measure) == ("done", 60, "away")
    assert_frame_equal(table, read_table(tmp_path / "out"))


def test_a_kill_loses_no_trial(search_file, tmp_path):
    """What goes on after it is what would have been without it."""
    whole, _ = optimized(search_file, tmp_path / "whole")
    killed = subprocess.run(
        [sys.executable, trial_stand_ins.__file__, search_file, tmp_path / "out"],
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])},
    )
    assert killed.returncode == -signal.SIGKILL
    parts, said = optimized(search_file, tmp_path / "out")
    assert "10 trials, 3 of them stored" in said
    assert_frame_equal(whole.drop(WALL_TIME), parts.drop(WALL_TIME))
    more, said = optimized(search_file, tmp_path / "out", count=12)
    assert "12 trials, 10 of them stored" in said
    assert_frame_equal(more.head(10), parts)
    same, _ = optimized(search_file, tmp_path / "out", trial_stand_ins.deadly, count=12)
    assert_frame_equal(same, more)


def test_trials_that_fail_do_not_end_it(search_file, tmp_path):
    table, _ = optimized(search_file, tmp_path / "out", trial_stand_ins.faulty)
    assert table["status"].to_list() == [DONE, FAILED, *[DONE] * 8]
    assert table["reason"][1] == "too fast" and table["away [mm]"][2] is None
    same, said = optimized(search_file, tmp_path / "out")
    assert "10 of them stored" in said
    assert_frame_equal(same, table)


def test_references_are_matched(search_file, tmp_path):
    """Where the formula is 4 mm, which it is on an ellipse."""
    search_file.write_text(
        STUDY.replace("minimize: away", "match: {away: 4 mm}, scale: {away: 0.5 mm}")
    )
    table, _ = optimized(search_file, tmp_path / "out", count=40)
    mismatch = ((table["away [mm]"] - 4.0) / 0.5) ** 2
    assert table["mismatch"].to_list() == pytest.approx(mismatch.to_list())
    assert table["mismatch"].min() < 4.0 < 10.0 < table["mismatch"].head(8).min()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("20 m/s^2", "30 m/s^2", "trials.journal was started with other factors"),
        ("minimize", "maximize", "was started with other goal"),
        ("scene:", "set: {time.end: 9 ms}\nscene:", "trial 1 in"),
    ],
)
def test_trials_of_another_optimisation_are_refused(search_file, tmp_path, old, new, message):
    optimized(search_file, tmp_path / "out", count=1)
    search_file.write_text(STUDY.replace(old, new))
    with pytest.raises(OutputError, match=message) as caught:
        optimized(search_file, tmp_path / "out")
    assert "--out" in caught.value.hint


@pytest.mark.parametrize(
    ("old", "new", "place", "message"),
    [
        ("minimize: away", "minimize: far", ":8:22", "there is no measure 'far'"),
        ("minimize: away", "match: {away: 3 kPa}", ":8:26", "kPa"),
        ("minimize: away", "match: {away: 0 mm}", ":8:26", "must be greater than 0"),
        ("trials", "scale: {away: 1 mm}, trials", ":8:11", "away is not matched"),
        ("minimize", "maximize: away, minimize", ":8:11", "needs one of maximize, minimize"),
    ],
)
def test_what_makes_no_optimisation_is_refused(search_file, tmp_path, old, new, place, message):
    search_file.write_text(STUDY.replace(old, new))
    with pytest.raises(SceneError) as caught:
        optimized(search_file, tmp_path / "out")
    assert message in str(caught.value)
    if place is not None:
        assert str(caught.value.location).endswith(place)


def test_a_study_that_seeks_nothing_is_refused(search_file, tmp_path):
    text = STUDY.replace("m/s^2]", "m/s^2], count: 3")
    search_file.write_text(text.replace("optimize: {minimize: away, trials: 10}", ""))
    with pytest.raises(SceneError, match="has no objective") as caught:
        optimized(search_file, tmp_path / "out")
    assert "maximize: away" in caught.value.hint


def test_nothing_to_choose_is_refused(search_file, tmp_path):
    text = STUDY.replace("range: [0 m/s^2, 20 m/s^2]", "values: [3 m/s^2]")
    text = text.replace("range: [0 deg, 80 deg], count: 41", "values: [3 deg]")
    search_file.write_text(text)
    with pytest.raises(SceneError, match="nothing to optimize"):
        optimized(search_file, tmp_path / "out")
