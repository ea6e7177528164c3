"""Fig 6.7 of the thesis: mean speed in pipes inclined by 0 to 90 degrees.

Mode 3 at 192 Hz with the most effective parameters (Table 6.2). Motion happens while the pressure
falls (6.3.1): the speed is the displacement of that time over the time of the whole cycle.
The level runs in two pipes are those of `deflation_rate`. The thesis does not say at which angles
it measured.
Digitised points: pipe_mm, angle_deg, speed_mm_s.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from softsim.report.style import INK, QUIET, drawing
from validation.cases import THINNED, Case, Outcomes
from validation.command import command
from validation.deflation_rate import case as level
from validation.digitised import Points, deviation
from validation.motion import MILLI, NAN, History, falls
from validation.pipes import LOOKS
from validation.script import Script
from validation.slope import SLACK, upwards
from validation.statements import CLIMBS, STEEPER, WIDER
from validation.thesis import EFFECTIVE_RATE, LOWEST, PIPES
from validation.verdicts import Row, above, row
from validation.verdicts import falls as decreases

NAME = "inclination"
ANGLES = (0, 45, 90)  # degrees


def label(pipe: int, angle: int) -> str:
    """The name of a case."""
    return f"{pipe} mm, {angle} deg"


def case(pipe: int, angle: int) -> Case:
    """One cycle upwards in a pipe [mm] at an angle [deg]."""
    if angle == 0:
        return replace(level(pipe, EFFECTIVE_RATE[pipe]), name=label(pipe, angle))
    overrides = (*upwards(pipe, angle, LOWEST[pipe]), *THINNED)
    return Case(label(pipe, angle), f"pfr_{pipe}mm.yaml", overrides)


def cases() -> list[Case]:
    """One a pipe and angle."""
    return [case(pipe, angle) for pipe in PIPES for angle in ANGLES]


def speed(history: History, pipe: int) -> float:
    """Mean over the cycle down to P_M3^S of the pipe [mm/s]."""
    cycles = falls(history)
    return MILLI * cycles[0].speed_above(1e3 * LOWEST[pipe]) if cycles else NAN


def speeds(outcomes: Outcomes, pipe: int) -> np.ndarray:
    """At each of ANGLES [mm/s]."""
    return np.array([speed(outcomes[label(pipe, a)].history, pipe) for a in ANGLES])


def climbed(outcomes: Outcomes, pipe: int) -> np.ndarray:
    """Speeds [mm/s] at each of ANGLES; NaN of a robot that fell: it has the speed of its fall."""
    fell = [has_fallen(outcomes[label(pipe, angle)].history) for angle in ANGLES]
    return np.where(fell, NAN, speeds(outcomes, pipe))


def until_it_fell(outcomes: Outcomes, pipe: int) -> np.ndarray:
    """Speeds [mm/s] at ANGLES up to the first at which it fell: beyond there is nothing to tell."""
    fell = [has_fallen(outcomes[label(pipe, angle)].history) for angle in ANGLES]
    end = fell.index(True) + 1 if any(fell) else len(ANGLES)
    return speeds(outcomes, pipe)[:end]


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Up a vertical pipe; slower the steeper; slower in larger pipes."""
    found = {pipe: speeds(outcomes, pipe) for pipe in PIPES}
    for pipe in PIPES:
        up = above(float(found[pipe][-1]), 0.0, "mm/s")
        claim = f"climbs a vertical pipe; {pipe} mm pipe"
        yield row(CLIMBS, claim, "above 0 mm/s", up, [outcomes[label(pipe, ANGLES[-1])]])
    degrees = ", ".join(map(str, ANGLES))
    for pipe in PIPES:
        behind = [outcomes[label(pipe, angle)] for angle in ANGLES]
        claim = f"slower the steeper, {degrees} deg; {pipe} mm pipe"
        yield row(STEEPER, claim, "falls", decreases(until_it_fell(outcomes, pipe), "mm/s"), behind)
    for number, angle in enumerate(ANGLES):
        behind = [outcomes[label(pipe, angle)] for pipe in PIPES]
        larger = decreases([climbed(outcomes, pipe)[number] for pipe in PIPES], "mm/s")
        claim = f"slower in larger pipes, {', '.join(map(str, PIPES))} mm; {angle} deg"
        yield row(WIDER, claim, "falls", larger, behind)
    if points is not None:
        nothing = np.full(len(ANGLES), NAN)
        computed = [
            np.interp(angle, ANGLES, found.get(int(pipe), nothing), left=NAN, right=NAN)
            for pipe, angle in zip(points["pipe_mm"], points["angle_deg"], strict=True)
        ]
        finding = deviation(np.array(computed), points["speed_mm_s"], points["spread"], "mm/s")
        claim = "Fig 6.7: speed over angle"
        yield row(STEEPER, claim, "digitised points", finding, outcomes.values())


def remarks(outcomes: Outcomes) -> Iterator[str]:
    """Where it fell: there the speed is that of the fall to the end of its line."""
    fell = [name for name, outcome in outcomes.items() if has_fallen(outcome.history)]
    if fell:
        yield (
            f"It lost the wall and fell until its line caught it: {', '.join(fell)}. The speed of "
            "these says nothing else."
        )


def has_fallen(history: History) -> bool:
    """By half of its line or more."""
    cycles = falls(history)
    return bool(cycles) and float(cycles[0].x[0] - cycles[0].x.min()) > 0.5e-3 * SLACK


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Speed over angle, a curve a pipe."""
    with drawing(path, 3.0) as figure:
        axes = figure.subplots()
        axes.axhline(0.0, color=QUIET, linewidth=0.7)
        for pipe, look in LOOKS.items():
            axes.plot(ANGLES, speeds(outcomes, pipe), label=f"{pipe} mm pipe", **look)
            if points is not None:
                at = points["pipe_mm"] == pipe
                axes.errorbar(
                    points["angle_deg"][at], points["speed_mm_s"][at], points["spread"][at],
                    linestyle="none", marker=look["marker"], mfc="none", color=look["color"],
                    ecolor=INK, label=f"thesis, digitised, {pipe} mm",
                )  # fmt: skip
        axes.set_xticks(ANGLES)
        axes.set(xlabel="inclination of the pipe [deg]", ylabel="mean speed of a cycle [mm/s]")
        axes.legend()


SCRIPT = Script(
    name=NAME,
    figure="Fig 6.7",
    about=(
        "Mode 3 with the most effective parameters (Table 6.2) in inclined pipes: displacement "
        "while the pressure falls to P_M3^S, over the time of the cycle. Claims: it climbs a "
        "vertical pipe; slower the steeper; slower in larger pipes. Of a single cycle: what the "
        "next inflation takes back, if it does, is not in it."
    ),
    cases=cases,
    quick=(label(36, 0),),
    rows=rows,
    draw=draw,
    columns=("pipe_mm", "angle_deg", "speed_mm_s"),
    remarks=remarks,
)

if __name__ == "__main__":
    command([SCRIPT])
