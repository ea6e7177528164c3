"""Mode 2 of the thesis, pressure only (4.2.1.2): speed over the deflation rate.

Two cycles in the 30 mm pipe, without the motor; the second is looked at, since the first begins
with the robot at rest on the bottom. Digitised points: rate_kPa_s, speed_mm_s (the thesis has no
such figure; a measurement of one's own fits here).
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from softsim.report.style import BLUE, INK, QUIET, WALL, drawing
from validation import deflation_rate
from validation.air import deflation
from validation.cases import THINNED, Case, Outcomes
from validation.command import command
from validation.digitised import Points, deviation
from validation.motion import MILLI, NAN, falls
from validation.script import Script
from validation.statements import MODE2_RATE, MODE2_SPEED, MODE2_STEP
from validation.thesis import BEST_RATE
from validation.verdicts import (
    Row,
    above,
    at_most_share,
    more_than,
    row,
    shown_list,
    within_factor,
)

NAME = "mode2_speed"
RATES = (2.0, 6.0, 10.0, 12.0, 15.0)  # kPa/s
STEPPING = (10.0, 12.0, 15.0)  # kPa/s, at which a cycle brings a net displacement
LOWEST = 2.0  # kPa, at which no spike touches
SPEED, FACTOR = 0.5, 2.0  # mm/s, "approximately"
FAR = 1 / 3  # of the speed of Mode 3, which "far outweighs" this one (4.2.1.3)
MODE3 = deflation_rate.case(30, BEST_RATE)


def label(rate: float) -> str:
    """The name of a case."""
    return f"{rate:g} kPa/s"


def cases() -> list[Case]:
    """One a rate, and Mode 3 in the same pipe."""
    found = [
        Case(label(rate), "pfr_mode2.yaml", (*deflation(rate, LOWEST, 2), *THINNED))
        for rate in RATES
    ]
    return [*found, MODE3]


def steps(outcomes: Outcomes) -> np.ndarray:
    """Displacement of the second cycle, at each of RATES [mm]."""
    return MILLI * np.array([_second(outcomes, label(rate))[0] for rate in RATES])


def speeds(outcomes: Outcomes) -> np.ndarray:
    """Mean speed over the second cycle, at each of RATES [mm/s]."""
    return MILLI * np.array([_second(outcomes, label(rate))[1] for rate in RATES])


def _second(outcomes: Outcomes, name: str) -> tuple[float, float]:
    """Displacement [m] and mean speed [m/s] of the second cycle."""
    cycles = falls(outcomes[name].history)
    if len(cycles) < 2:
        return NAN, NAN
    return cycles[1].before + cycles[1].displacement, cycles[1].mean_speed


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """A step a cycle at 10 to 15 kPa/s, about 0.5 mm/s, less at 2; far slower than Mode 3."""
    step, speed = steps(outcomes), speeds(outcomes)
    stepping = [RATES.index(rate) for rate in STEPPING]
    behind = [outcomes[label(rate)] for rate in STEPPING]
    for rate in STEPPING:
        forward = above(float(step[RATES.index(rate)]), 0.0, "mm")
        claim = f"a net step forward a cycle at {rate:g} kPa/s"
        yield row(MODE2_STEP, claim, "above 0 mm", forward, [outcomes[label(rate)]])
    mean = within_factor(float(speed[stepping].mean()), SPEED, FACTOR, "mm/s")
    mean = replace(mean, computed=f"{mean.computed}, mean of {shown_list(speed[stepping])}")
    reference = f"{SPEED:g} mm/s within a factor of {FACTOR:g}"
    yield row(MODE2_SPEED, "mean speed at 10 to 15 kPa/s", reference, mean, behind)
    less = more_than(float(step[stepping].min()), float(step[0]), "mm")
    claim = "a smaller step at 2 kPa/s than at any of 10 to 15 kPa/s"
    yield row(MODE2_RATE, claim, "smaller", less, [outcomes[label(RATES[0])], *behind])
    mode3 = falls(outcomes[MODE3.name].history)
    speed3 = MILLI * mode3[0].mean_speed if mode3 else NAN
    far = at_most_share(float(speed[stepping].max()), speed3, FAR)
    reference = f"below {100 * FAR:.0f} % of Mode 3's speed"
    claim = "far slower than Mode 3 in the same pipe"
    yield row(MODE2_SPEED, claim, reference, far, [*behind, outcomes[MODE3.name]])
    if points is not None:
        there = np.interp(points["rate_kPa_s"], RATES, speed, left=np.nan, right=np.nan)
        finding = deviation(there, points["speed_mm_s"], points["spread"], "mm/s")
        yield row(MODE2_SPEED, "speed over rate", "digitised points", finding, outcomes.values())


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Displacement and speed over rate."""
    with drawing(path, 2.8) as figure:
        left, right = figure.subplots(1, 2)
        for axes in (left, right):
            axes.axhline(0.0, color=QUIET, linewidth=0.7)
            axes.axvspan(
                STEPPING[0], STEPPING[-1], color=WALL, zorder=0, label="thesis: steps here"
            )
            axes.set(xlabel="deflation rate [kPa/s]", xlim=(0.0, 16.0))
        left.plot(RATES, steps(outcomes), color=BLUE, marker="o", label="simulation")
        right.plot(RATES, speeds(outcomes), color=BLUE, marker="o", label="simulation")
        right.plot(
            [STEPPING[0], STEPPING[-1]], [SPEED, SPEED], color=INK, linestyle="--",
            label="thesis: about 0.5 mm/s",
        )  # fmt: skip
        if points is not None:
            right.errorbar(
                points["rate_kPa_s"], points["speed_mm_s"], points["spread"], color=INK,
                marker="s", linestyle="none", label="digitised",
            )  # fmt: skip
        left.set_ylabel("displacement of a cycle [mm]")
        right.set_ylabel("mean speed [mm/s]")
        right.legend(loc="best")


SCRIPT = Script(
    name=NAME,
    figure="section 4.2.1.2, Fig 4.6 C",
    about=(
        "Mode 2, pressure only, in the 30 mm pipe: displacement and mean speed of the second of "
        "two cycles between 23 and 2 kPa. Claims: a net step forward at 10 to 15 kPa/s, about "
        "0.5 mm/s, smaller at 2 kPa/s; far slower than Mode 3. The speed depends on the time of "
        "the inflation, which the thesis does not give."
    ),
    cases=cases,
    quick=(label(12.0),),
    rows=rows,
    draw=draw,
    columns=("rate_kPa_s", "speed_mm_s"),
)

if __name__ == "__main__":
    command([SCRIPT])
