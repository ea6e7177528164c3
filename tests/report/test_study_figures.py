"""What the figures of a study show: design points, the best of them, lines, cells, plots chosen."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import polars
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from study_folders import (
    FRICTION,
    PIPE,
    RATE,
    RATES,
    SOUGHT,
    SPEED,
    grid,
    sampled,
    speed,
    write_bisection,
    write_made_up,
)

from softsim.errors import OutputError
from softsim.report.diagram import Scale
from softsim.report.png import WIDE, along_x
from softsim.report.study.findings import (
    DONE_COUNT,
    FAILED_COUNT,
    SPREAD,
    AxisScale,
    Findings,
    best_in_words,
    boundaries_in_words,
    boundary_maps,
    boundary_table,
)
from softsim.report.study.plots import (
    BAND,
    best_so_far,
    cells_of,
    draw_study,
    drawn_plots,
    edges,
    lines,
    page_context,
    remark,
    remark_on_cells,
)
from softsim.report.style import drawing
from softsim.study.schema import Goal, Plot, StudyAxis

FASTEST = Goal("speed", "maximize")


def findings(folder: Path, *arguments, **options) -> Findings:
    return Findings.read(write_made_up(folder, *arguments, **options))


def failed(rows, *numbers):
    """The rows with the cases of these numbers, from 1, as failed ones."""
    return [
        row | ({"status": "failed"} if number in numbers else {})
        for number, row in enumerate(rows, start=1)
    ]


def test_repeats_become_a_mean_with_its_spread(tmp_path):
    values = iter([1.0, 2.0, 6.0, 5.0, 7.0])
    rows = failed(grid(rate=[1.0, 2.0], repeat=[1, 2, 3]), 5)
    found = findings(tmp_path, [RATE], rows, lambda rate: next(values), noise=0.0, repeats=3)
    points = found.design_points
    assert points["case"].to_list() == [1, 4]
    assert points[SPEED.column].to_list() == pytest.approx([3.0, 6.0])
    assert points[SPREAD + SPEED.column].to_list() == pytest.approx(
        [np.std([1.0, 2.0, 6.0], ddof=1), np.std([5.0, 7.0], ddof=1)]
    )
    assert points[DONE_COUNT].to_list() == [3, 2]
    assert points[FAILED_COUNT].to_list() == [0, 1]


@pytest.mark.parametrize(("sense", "best"), [("maximize", 3), ("minimize", 1)])
def test_the_best_is_the_mean_of_its_repeats(tmp_path, sense, best):
    values = iter([9.0, 1.0, 6.0, 7.0])  # the highest and the lowest single case are of the worst
    rows = grid(rate=[1.0, 2.0], repeat=[1, 2])
    found = findings(
        tmp_path, [RATE], rows, lambda rate: next(values), noise=0.0, goal=Goal("speed", sense)
    )
    assert found.best is not None
    assert found.best.case == best
    assert found.best.value == {3: 6.5, 1: 5.0}[best]
    assert f"case {best}: speed {found.best.value:g} mm/s (mean of 2 cases)" in best_in_words(found)


def test_what_failed_beside_the_best_is_said(tmp_path):
    rows = failed(grid(rate=[1.0, 2.0], friction=[0.4, 0.6], repeat=[1, 2, 3]), 5, 6)
    found = findings(
        tmp_path, [RATE, FRICTION], rows, lambda rate, friction: friction / rate, noise=0.0,
        repeats=3, goal=FASTEST,
    )  # fmt: skip
    assert best_in_words(found).startswith("best case 4: speed 0.6 mm/s (2 more failed) at rate 1")
    x, y = found.scale("rate"), found.scale("friction")
    assert remark_on_cells(found, x, y) == "mean over repeats, without 2 failed cases"


def test_there_is_no_best_without_a_case_or_a_goal(tmp_path):
    rows = grid(rate=RATES)
    assert findings(tmp_path / "a", [RATE], rows).best is None
    none_done = [row | {"status": "failed"} for row in rows]
    found = findings(tmp_path / "b", [RATE], none_done, goal=FASTEST)
    assert found.best is None
    assert best_in_words(found) == ""


def test_a_line_a_pipe_with_a_gap_where_a_case_failed(tmp_path):
    rows = failed(grid(pipe=["30 mm", "36 mm"], rate=RATES), 3)
    found = findings(tmp_path, [PIPE, RATE], rows[::-1])
    narrow = next(
        line
        for level, line in lines(found, found.scale("rate"), found.scale("speed"), PIPE)
        if level == "30 mm"
    )
    assert narrow.x == pytest.approx(RATES)
    expected = [speed(rate, pipe="30 mm") for rate in RATES]
    expected[2] = np.nan
    assert narrow.y == pytest.approx(expected, nan_ok=True)
    assert np.isnan(narrow.band).all()


def test_what_else_varies_makes_lines_of_its_own(tmp_path):
    rows = grid(pipe=["30 mm", "36 mm"], friction=[0.4, 0.6, 0.8], rate=[1.0, 2.0])
    found = findings(tmp_path, [PIPE, FRICTION, RATE], rows)
    drawn = list(lines(found, found.scale("rate"), found.scale("speed"), PIPE))
    assert [level for level, _ in drawn] == ["30 mm"] * 3 + ["36 mm"] * 3
    assert drawn[4][1].y == pytest.approx([speed(1.0, 0.6), speed(2.0, 0.6)])


def test_a_band_is_three_standard_deviations(tmp_path):
    values = iter([1.0, 2.0, 3.0, 8.0])
    found = findings(
        tmp_path, [RATE], grid(rate=[1.0, 2.0], repeat=[1, 2]), lambda rate: next(values),
        noise=0.0, repeats=2,
    )  # fmt: skip
    ((_, line),) = lines(found, found.scale("rate"), found.scale("speed"), None)
    half = BAND * np.array([np.std([1, 2], ddof=1), np.std([3, 8], ddof=1)])
    assert line.band == pytest.approx(np.stack([line.y - half, line.y + half]))


def test_a_share_lies_in_its_interval(tmp_path):
    """Wilson's, between 0 and 1: of 3 of 4 cases from 0.3006 to 0.9544."""
    values = iter([1.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    found = findings(
        tmp_path, [RATE], grid(rate=[1.0, 2.0], repeat=[1, 2, 3, 4]), lambda rate: next(values),
        noise=0.0, repeats=4,
    )  # fmt: skip
    ((_, line),) = lines(found, found.scale("rate"), found.scale("speed"), None)
    assert line.y == pytest.approx([0.75, 0.0])
    assert line.band == pytest.approx(np.array([[0.3006, 0.0], [0.9544, 0.4899]]), abs=1e-4)
    said = remark(found, found.axis("rate"), found.axis("speed"), None)
    assert said == "fraction with its 95 % interval (Wilson) of n = 4 repeats"


@given(
    arrays.arrays(float, st.integers(1, 20), elements=st.floats(1e-3, 1e3), unique=True),
    st.booleans(),
)
def test_levels_lie_in_their_cells(levels, logarithmic):
    levels = np.sort(levels)
    at = edges(levels, logarithmic)
    round_off = 1e-12 * levels
    assert (at[:-1] <= levels + round_off).all()
    assert (levels - round_off <= at[1:]).all()
    assert at[0] < at[-1]
    assert not logarithmic or at[0] > 0.0


def test_cells_are_means_over_what_else_varies(tmp_path):
    rows = grid(pipe=["30 mm", "36 mm"], friction=[0.2, 0.6, 0.65], rate=[1.0, 10.0])
    found = findings(tmp_path, [PIPE, FRICTION, RATE], failed(rows, 3, 9, 4))
    cells = cells_of(found, found.scale("friction"), found.scale("rate"), found.scale("speed"))
    assert cells.columns == pytest.approx([0.2, 0.6, 0.65])
    assert cells.values[0, 0] == pytest.approx(
        0.5 * (speed(1.0, 0.2, "30 mm") + speed(1.0, 0.2, "36 mm"))
    )
    assert np.isnan(cells.values[0, 1])
    assert cells.failed.tolist() == [[False, True, False], [False, False, False]]
    assert cells.values[1, 1] == pytest.approx(speed(10.0, 0.6, "36 mm"))
    assert cells.cases[1].tolist() == [2, 4, 6]


def test_labels_that_begin_with_numbers_are_in_their_order():
    axis = StudyAxis("pipe", is_label=True)
    column = polars.Series(["36 mm", "9 mm", None, "30 mm"])
    scale = AxisScale.of(axis, column)
    assert scale.labels == ("9 mm", "30 mm", "36 mm")
    assert scale.places(column) == pytest.approx([2.0, 0.0, np.nan, 1.0], nan_ok=True)


@given(st.lists(st.one_of(st.just(np.nan), st.floats(-1e6, 1e6)), min_size=1))
def test_the_best_so_far_never_gets_worse(values):
    objective = np.array(values)
    found = best_so_far(objective, "minimize")
    for end in range(1, len(values) + 1):
        known = objective[:end][~np.isnan(objective[:end])]
        assert found[end - 1] == known.min() if len(known) else np.isnan(found[end - 1])


def test_a_sampled_design_has_no_cells_and_no_lines(tmp_path):
    asked = [Plot("heat_map", "rate", "friction", colour="speed"), Plot("curve", "rate", "speed")]
    found = findings(tmp_path, [RATE, FRICTION, PIPE], sampled(30), plots=asked)
    assert drawn_plots(found) == [
        Plot("scatter", "rate", "friction", colour="speed"), Plot("scatter", "rate", "speed"),
    ]  # fmt: skip


def test_all_kinds_are_drawn_and_old_ones_go(tmp_path):
    plots = [
        Plot("curve", "rate", "speed", by="pipe"),
        Plot("heat_map", "rate", "pipe", colour="speed"),
        Plot("scatter", "rate", "speed", colour="pipe"),
    ]
    rows = failed(grid(pipe=["30 mm", "36 mm"], rate=RATES[:4]), 3)
    write_made_up(tmp_path, [PIPE, RATE], rows, plots=plots, goal=FASTEST)
    (tmp_path / "curve_of_another_day.png").write_bytes(b"")
    (tmp_path / "photograph.png").write_bytes(b"")
    drawn = draw_study(tmp_path)
    assert [path.name for path in drawn] == [
        "curve_speed_over_rate_by_pipe.png",
        "heat_map_pipe_over_rate_coloured_by_speed.png",
        "scatter_speed_over_rate_coloured_by_pipe.png",
        "progress.png",
        "factors.png",
    ]
    assert {path.name for path in tmp_path.glob("*.png")} == {
        *(path.name for path in drawn), "photograph.png",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("factors", "rows", "plot"),
    [
        ([RATE], [{"rate": 1.0}], Plot("curve", "rate", "speed")),
        (
            [FRICTION, RATE],
            failed(grid(friction=[0.1, 0.2], rate=[1.0, 2.0]), 1, 2, 3, 4),
            Plot("heat_map", "friction", "rate", colour="speed"),
        ),
        (
            [PIPE, RATE],
            grid(pipe=[f"{d} mm, far too long a label" for d in range(60)], rate=[1.0, 2.0]),
            Plot("curve", "rate", "speed", by="pipe"),
        ),
    ],
    ids=["one case", "all failed", "sixty long labels"],
)
@pytest.mark.physics
def test_awkward_studies_are_drawn_too(tmp_path, factors, rows, plot):
    write_made_up(tmp_path, factors, rows, measures=[SPEED], plots=[plot], goal=FASTEST)
    drawn = draw_study(tmp_path)
    assert [path.name.split("_")[0] for path in drawn[:1]] == [plot.kind.split("_")[0]]
    assert all(path.stat().st_size > 10_000 for path in drawn)


def test_titles_of_panels_side_by_side_do_not_overlap(tmp_path):
    scale = Scale("average deflation rate of the middle chamber [kPa/s]")
    with drawing(tmp_path / "panels.png", height=3.0) as figure:
        panels = figure.subplots(1, 3)
        for axes in panels:
            along_x(axes, scale, WIDE // 3)
        figure.draw_without_rendering()
        boxes = [axes.xaxis.label.get_window_extent() for axes in panels]
    assert all(one.x1 < other.x0 for one, other in pairwise(boxes))


def test_a_plot_of_an_unknown_axis_is_refused(tmp_path):
    write_made_up(tmp_path, [RATE], grid(rate=RATES), plots=[Plot("curve", "rate", "sped")])
    with pytest.raises(
        OutputError, match=r"no factor or measure 'sped' to draw\s+available: rate, speed, travel"
    ):
        draw_study(tmp_path)


def test_a_folder_without_a_study_is_refused(tmp_path):
    with pytest.raises(OutputError, match=r"not the folder of a study: it has no study\.json"):
        draw_study(tmp_path)


def passes(slope, pattern, height, repeat):
    """Five rows get over 14 mm at 30 deg, less where it is steeper, by chance a bit more or less;
    nine rows over all; three rows over nothing but what is half-way.
    """
    if pattern == "3 rows":
        return float(height == 13.0)
    if pattern == "5 rows" and slope == 90.0 and height == 13.0:
        return None
    edge = 14.0 - 0.1 * (slope - 30.0) + (repeat - 1.5)
    return float(pattern == "9 rows" or height < edge)


@pytest.fixture(scope="module")
def bisection_folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("bisected")
    patterns = ["3 rows", "5 rows", "9 rows"]
    return write_bisection(folder, passes, slope=[30.0, 90.0], pattern=patterns)


@pytest.fixture
def bisected(bisection_folder) -> Findings:
    return Findings.read(bisection_folder)


def test_the_table_of_boundaries_tells_where_each_lies(bisected):
    table = boundary_table(bisected, SOUGHT)
    assert table["state"].to_list() == [
        "not monotone", "found", "outside", "not monotone", "undecided", "outside",
    ]  # fmt: skip
    found = table.row(1, named=True)
    assert (found["low [mm]"], found["height [mm]"], found["high [mm]"]) == (13.0, 14.5, 16.0)
    assert found["passed at low"] >= 0.5 > found["passed at high"]
    assert table["height [mm]"].null_count() == 5
    assert table["failed"].to_list() == [0, 0, 0, 0, 4, 0]


def test_boundaries_are_told_in_words(bisected, bisection_folder):
    three, five, nine, *_ = boundaries_in_words(bisected)
    assert three.startswith("slope 30 deg, pattern 3 rows: not monotone: ")
    assert (
        "passed is at least 0.5 up to 13 mm (0.667 in 3 runs), and below it from 16 mm (0 in"
        in five
    )
    assert "at all of 1 mm (1 in 2 runs), 13 mm (1 in 2 runs), 25 mm (1 in 2 runs): no" in nine
    assert page_context(bisected, bisection_folder)["boundaries"][1] == five


def test_a_map_has_a_diagram_a_pattern(bisected):
    three, five, _ = boundary_maps(bisected, SOUGHT)
    line, *levels = five.panels[0].left.series
    assert line.x == pytest.approx([30.0, 90.0])
    assert line.y == pytest.approx([14.5, np.nan], nan_ok=True)
    assert line.band[:, 0] == pytest.approx([13.0, 16.0])
    over, under, untold = levels
    assert sorted(over.y[over.x == 30.0]) == [1.0, 13.0]
    assert sorted(under.y[under.x == 30.0]) == [16.0, 19.0, 25.0]
    assert (untold.x.tolist(), untold.y.tolist()) == ([90.0], [13.0])
    assert np.isnan(three.panels[0].left.series[0].y).all()
    assert five.x.title == "slope of the ramp [deg], pattern 5 rows"


def test_the_map_of_a_bisection_alone_is_drawn(tmp_path):
    folder = write_bisection(tmp_path, lambda height, repeat: float(height > 7.0))
    assert [path.name for path in draw_study(folder)] == ["boundary_map.png"]
    (row,) = polars.read_csv(folder / "boundaries.csv").to_dicts()
    assert row["in words"].startswith("passed is below 0.5 up to 7 mm (0 in 3 runs), and not below")
