"""Fig 4.12 of the thesis: which rows of spikes touch the pipe at the highest pressure.

Of the runs of `propulsion_force` at 192 Hz, nine cases. The number of rows is the median while the
pressure is highest; which ones is seen in a frame of that time, as in the figure's photographs.
Digitised points: pipe_mm, highest_kPa, rows.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from softsim.report.style import INK, QUIET, drawing
from validation import propulsion_force
from validation.cases import Case, Outcomes
from validation.command import command
from validation.digitised import Points, deviation
from validation.motion import NAN
from validation.propulsion_force import LOOK, label
from validation.script import Script
from validation.statements import CONTACT_ROWS
from validation.thesis import BEST_FREQUENCY, HIGHEST, HIGHESTS, PIPES
from validation.touch import ROWS, rows_touching
from validation.verdicts import Row, between, judged, row, shown

NAME = "contact_rows"
EXPECTED = {30: (4, 4), 36: (2, 3), 41: (2, 3)}
"""Pipe [mm] -> least and most rows of the thesis."""

CONDITIONS = tuple((pipe, highest) for pipe in PIPES for highest in HIGHESTS)


def cases() -> list[Case]:
    """One a pipe and pressure."""
    return [propulsion_force.case(pipe, BEST_FREQUENCY, highest) for pipe, highest in CONDITIONS]


def name_of(pipe: int, highest: float) -> str:
    """The name of a case."""
    return label(pipe, BEST_FREQUENCY, highest)


def counts(outcomes: Outcomes, pipe: int) -> np.ndarray:
    """Rows that touch, at each of HIGHESTS (3,)."""
    return np.array([outcomes[name_of(pipe, p)].number("rows_at_highest") for p in HIGHESTS])


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """How many in each pipe; 23 kPa like 26 kPa."""
    found = {pipe: counts(outcomes, pipe) for pipe in PIPES}
    for pipe, highest in CONDITIONS:
        least, most = EXPECTED[pipe]
        count = found[pipe][HIGHESTS.index(highest)]
        claim = f"rows that touch at {highest:g} kPa; {pipe} mm pipe"
        finding = between(count, least, most)
        yield row(CONTACT_ROWS, claim, expected(pipe), finding, [outcomes[name_of(pipe, highest)]])
    for pipe in PIPES:
        low, high = (float(count) for count in found[pipe][-2:])
        same = judged(low == high, f"{shown(high)} against {shown(low)}", low, high)
        behind = [outcomes[name_of(pipe, highest)] for highest in HIGHESTS[-2:]]
        yield row(
            CONTACT_ROWS, f"as many rows at 26 as at 23 kPa; {pipe} mm pipe", "equal", same, behind
        )
    if points is not None:
        computed = [
            found[int(pipe)][HIGHESTS.index(p)] if (pipe, p) in CONDITIONS else NAN
            for pipe, p in zip(points["pipe_mm"], points["highest_kPa"], strict=True)
        ]
        finding = deviation(np.array(computed), points["rows"], points["spread"], "rows")
        yield row(CONTACT_ROWS, "Fig 4.12: rows", "digitised points", finding, outcomes.values())


def expected(pipe: int) -> str:
    """How many rows the thesis saw."""
    least, most = EXPECTED[pipe]
    return f"{least}" if least == most else f"{least} to {most}"


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Five squares a case, filled where the row touches, as the inset of the thesis's figure."""
    digitised = {}
    if points is not None:
        places = zip(points["pipe_mm"], points["highest_kPa"], strict=True)
        digitised = dict(zip(places, points["rows"], strict=True))
    with drawing(path, 2.6) as figure:
        panels = figure.subplots(len(PIPES), len(HIGHESTS))
        for axes, (pipe, highest) in zip(panels.flat, CONDITIONS, strict=True):
            outcome = outcomes[name_of(pipe, highest)]
            draw_squares(axes, rows_touching(outcome, LOOK))
            told = f"median: {shown(outcome.number('rows_at_highest'))}"
            if (pipe, highest) in digitised:
                told += f", thesis, digitised: {digitised[pipe, highest]:g}"
            axes.set_title(told, fontsize=8, color=QUIET)
        for axes, highest in zip(panels[-1], HIGHESTS, strict=True):
            axes.set_xlabel(f"{highest:g} kPa")
        for axes, pipe in zip(panels[:, 0], PIPES, strict=True):
            axes.set_ylabel(f"{pipe} mm pipe\nthesis: {expected(pipe)}", fontsize=8)


def draw_squares(axes: Axes, touching: np.ndarray | None) -> None:
    """A square a row of spikes, the first at the right, where the robot's front is.

    touching: (5,); None leaves the squares unknown, drawn dashed.
    """
    for number, name in enumerate(ROWS):
        place = len(ROWS) - 1 - number
        filled = touching is not None and touching[number]
        axes.add_patch(
            Rectangle(
                (place + 0.15, 0.15), 0.7, 0.7, edgecolor=INK, linewidth=0.8,
                facecolor=INK if filled else "none", linestyle="--" if touching is None else "-",
            )
        )  # fmt: skip
        axes.annotate(
            name, (place + 0.5, 0.5), ha="center", va="center", fontsize=7,
            color="white" if filled else QUIET,
        )  # fmt: skip
    axes.set(xlim=(0.0, len(ROWS)), ylim=(0.0, 1.0), xticks=[], yticks=[], aspect="equal")
    axes.spines[:].set_visible(False)


SCRIPT = Script(
    name=NAME,
    figure="Fig 4.12",
    about=(
        "Rows of spikes that touch the pipe at the highest pressure, of the runs for Fig 4.11 at "
        "192 Hz: the median number while the pressure is highest, and which ones at one moment of "
        f"it, {LOOK:g} s; j1 is in front. A row touches where one of its spikes does, above or "
        "below; one that the motor shakes off the wall and back may be off at that moment. Claims: "
        "four in the 30 mm pipe, two to three in the 36 and 41 mm pipes; as many at 23 as at 26 "
        "kPa."
    ),
    cases=cases,
    quick=(propulsion_force.label(36, BEST_FREQUENCY, HIGHEST),),
    rows=rows,
    draw=draw,
    columns=("pipe_mm", "highest_kPa", "rows"),
)

if __name__ == "__main__":
    command([SCRIPT])
