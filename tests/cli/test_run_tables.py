"""Tables that commands on a scene print."""

import io

from rich.console import Console

from softsim.cli.run_tables import summary_table, wall_time_table
from softsim.report.figures import segments

SEGMENT = {
    "segment": 1, "what": "straight 70 mm", "start": 0.0, "end": 0.07, "entered": 0.0, "left": 2.5,
    "mean_speed": 0.018, "rows_in_contact": 3.0, "most_rows_in_contact": 4.0,
    "least_clearance": 2.5e-3,
}  # fmt: skip
AHEAD = {"segment": 2, "what": "bend -180 deg, radius 60 mm", "start": 0.07, "end": 0.1642} | (
    dict.fromkeys([*SEGMENT][4:])
)


def lines(report) -> list[str]:
    console = Console(file=io.StringIO(), width=80)
    console.print(segments(report))
    return console.file.getvalue().splitlines()


def test_a_row_a_segment():
    shown = lines({"segments": [SEGMENT, AHEAD], "exits": ["end"]})
    assert not any("…" in line for line in shown)  # it fits into 80 columns
    first, second = (
        next(" ".join(line.split()) for line in shown if line.startswith(f" {number} "))
        for number in (1, 2)
    )
    assert first == "1 straight 70 mm 0 70 0.00 2.50 18.0 4 2.50"
    assert second == "2 bend -180 deg, radius 60 mm 70 164"  # in one line of 80


def test_cycles_without_motion_are_told() -> None:
    summary = {"onset_pressure": [14.2e3, None], "mean_speed": 0.0123, "peak_pull": None}
    out = io.StringIO()
    Console(file=out, width=100).print(summary_table(summary, {}))
    lines = {line.strip()[:14]: " ".join(line.split()[2:]) for line in out.getvalue().splitlines()}
    assert lines == {"onset pressure": "14.2 kPa, no motion", "mean speed    ": "12.3 mm/s"}


def test_what_was_found_comes_before_how_and_warnings_before_both() -> None:
    summary = {"increments": 7, "probes": {"tip_x": 2e-18, "tip_y": 2e-3}, "warnings": ["a", "b"]}
    out = io.StringIO()
    Console(file=out, width=100).print(summary_table(summary, {"tip_x": "m", "tip_y": "m"}))
    lines = [" ".join(line.split()) for line in out.getvalue().splitlines()]
    assert lines == [
        "warnings 2, listed in summary.json and run.log", "tip x 0 mm", "tip y 2 mm", "increments 7"
    ]  # fmt: skip


def test_the_parts_of_the_wall_time_and_their_shares():
    out = io.StringIO()
    Console(file=out, width=80).print(wall_time_table({"kernel": 9.0, "rows": 1.0}))
    rows = [" ".join(line.split()) for line in out.getvalue().splitlines()[2:]]
    assert rows == ["kernel 9.00 s 90.0 %", "rows 1.00 s 10.0 %", "whole 10.00 s 100.0 %"]
