"""Fig 4.8 of the thesis: speed over the motor's frequency in Mode 1, vibration only.

The robot stands in a level pipe as wide as itself (4.2.1.1, 4.2.2). The speed is the mean over the
second half of two seconds. Digitised points: frequency_Hz, speed_mm_s.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from softsim.report.style import BLUE, INK, QUIET, drawing
from validation.cases import THINNED, Case, Outcomes
from validation.command import command
from validation.digitised import Points, deviation
from validation.motion import MILLI, speed_after
from validation.script import Script
from validation.statements import MODE1_BEST, MODE1_FORWARD, MODE1_SLOW
from validation.thesis import FREQUENCIES as NAMED
from validation.verdicts import Row, below, highest_at, row, some_above

NAME = "mode1_speed"
FREQUENCIES = (32, 48, 64, 96, 137, 160, 192)  # Hz
BEST = 64  # Hz
SLOW = 5.0  # mm/s, not reached at 192 Hz (6.3.1)
SETTLED = 0.5  # share of the run after which the speed is taken


def cases() -> list[Case]:
    """One a frequency."""
    return [
        Case(
            label(f), "pfr_mode1.yaml", (f"loads.motor.frequency={f} Hz", "time.end=2 s", *THINNED)
        )
        for f in FREQUENCIES
    ]


def label(frequency: int) -> str:
    """The name of a case."""
    return f"{frequency} Hz"


def speeds(outcomes: Outcomes) -> np.ndarray:
    """Speed at each of FREQUENCIES [mm/s]."""
    histories = (outcomes[label(f)].history for f in FREQUENCIES)
    return np.array([MILLI * speed_after(history, SETTLED) for history in histories])


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """A best frequency below 192 Hz, at 64 Hz; slow at 192 Hz; forward."""
    found, behind = speeds(outcomes), list(outcomes.values())
    names = [label(f) for f in FREQUENCIES]
    before = some_above(found[:-1], float(found[-1]), "mm/s")
    claim = "there is a best frequency below 192 Hz"
    yield row(MODE1_BEST, claim, "faster than at 192 Hz", before, behind)
    best = highest_at(names, found, [label(BEST)], "mm/s")
    yield row(MODE1_BEST, "fastest at 64 Hz, of all frequencies here", "64 Hz", best, behind)
    of_named = [FREQUENCIES.index(f) for f in NAMED]
    best = highest_at([names[k] for k in of_named], found[of_named], [label(BEST)], "mm/s")
    claim = f"fastest at 64 Hz, of the thesis's {', '.join(map(str, NAMED))} Hz"
    yield row(MODE1_BEST, claim, "64 Hz", best, [outcomes[names[k]] for k in of_named])
    at_best = some_above(found, 0.0, "mm/s")
    yield row(MODE1_FORWARD, "forward at its best frequency", "above 0 mm/s", at_best, behind)
    last = below(abs(float(found[-1])), SLOW, "mm/s")
    yield row(MODE1_SLOW, "slow at 192 Hz", f"below {SLOW:g} mm/s", last, [outcomes[names[-1]]])
    if points is not None:
        there = np.interp(points["frequency_Hz"], FREQUENCIES, found, left=np.nan, right=np.nan)
        finding = deviation(there, points["speed_mm_s"], points["spread"], "mm/s")
        yield row(MODE1_BEST, "Fig 4.8: speed over frequency", "digitised points", finding, behind)


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Speed over frequency."""
    with drawing(path, 3.0) as figure:
        axes = figure.subplots()
        axes.axhline(0.0, color=QUIET, linewidth=0.7)
        axes.plot([192], [SLOW], color=INK, marker="v", linestyle="none",
                  label="thesis: slower than this at 192 Hz")  # fmt: skip
        axes.axvline(BEST, color=QUIET, linewidth=0.7, linestyle="--", label="thesis: fastest here")
        axes.plot(FREQUENCIES, speeds(outcomes), color=BLUE, marker="o", label="simulation")
        if points is not None:
            axes.errorbar(
                points["frequency_Hz"], points["speed_mm_s"], points["spread"], color=INK,
                marker="s", linestyle="none", label="thesis, digitised",
            )  # fmt: skip
        axes.set(xlabel="frequency of the motor [Hz]", ylabel="mean speed [mm/s]")
        figure.legend(loc="outside upper center", ncols=4)


SCRIPT = Script(
    name=NAME,
    figure="Fig 4.8",
    about=(
        "Mode 1, vibration only, in a level pipe as wide as the robot: mean speed over the second "
        "half of two seconds. Claims: a best frequency below 192 Hz, at 64 Hz; below 5 mm/s at "
        "192 Hz; forward."
    ),
    cases=cases,
    quick=(label(BEST), label(192)),
    rows=rows,
    draw=draw,
    columns=("frequency_Hz", "speed_mm_s"),
)

if __name__ == "__main__":
    command([SCRIPT])
