"""The line that shows how far a run is."""

import io

import pytest
from rich.console import Console

from softsim.output import console
from softsim.output.console import GoalOutlook, ProgressReport


def test_the_time_to_the_goal_follows_from_the_progress_since_the_display_began():
    outlook = GoalOutlook()
    assert outlook.left(2.0, 0.1) == float("inf")
    assert outlook.left(3.0, 0.1) == float("inf")  # it stands
    assert outlook.left(6.0, 0.3) == pytest.approx(14.0)  # 0.05 a second, 0.7 to go


def test_the_line_counts_to_the_goal_and_not_to_the_time_limit(monkeypatch):
    wall = iter(range(100))
    monkeypatch.setattr(console, "PLAIN_EVERY", 0.0)
    monkeypatch.setattr(console.time, "monotonic", lambda: float(next(wall)))
    shown = io.StringIO()
    report = ProgressReport(Console(file=shown, width=200), 60.0, 0.0, float("nan"))
    for now, share in ((0.0, 0.0), (1.0, 0.2), (2.0, 0.5), (2.5, None)):
        report.update(now, 0.0, 0, float("nan"), share)
    began, early, late, without = shown.getvalue().splitlines()
    assert began.endswith("ETA unknown")
    # The clock, a second later at each reading, is read three times an update.
    assert early.endswith("20 % of the distance, ETA 16 s")
    assert late.endswith("50 % of the distance, ETA 7 s")
    assert "of the distance" not in without and "ETA" in without


def test_a_detail_follows_the_last_state(monkeypatch):
    monkeypatch.setattr(console, "PLAIN_EVERY", 0.0)
    shown = io.StringIO()
    report = ProgressReport(Console(file=shown, width=200), 60.0, 0.0, float("nan"))
    report.update(3.0, 0.0, 0, 1e-7)
    report.show("load step 2, iteration 1, unbalanced 1.0e-03")
    plain, with_detail = shown.getvalue().splitlines()
    assert with_detail == f"{plain}  load step 2, iteration 1, unbalanced 1.0e-03"
