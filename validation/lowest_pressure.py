"""Fig 6.6 D to I of the thesis: the lowest pressure P_M3^S, in level and in vertical pipes.

Mode 3 at 192 Hz, from 23 kPa on the gauge, through the air line: all pressures are those of the
gauge. A cycle that ends at a higher pressure is the same motion, ended earlier. So one run a pipe,
down to the lowest of its pressures, shows them all:
- level (D to F): displacement down to P_M3^S of Table 6.2, and to 2, 4 and 6 kPa more;
- vertical (G to I), down to 3 kPa below the pressure at which the thesis's robot just holds.
  Nothing holds the robot before its spikes touch, so gravity begins when it is full.
Displacements count from where the pressure begins to fall.
Digitised points: pipe_mm, inclination_deg, lowest_kPa, displacement_mm.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from softsim.report.style import INK, QUIET, drawing
from validation.air import FULL, deflation_on_gauge
from validation.cases import THINNED, Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points, deviation
from validation.motion import LEAST, MILLI, NAN, Fall, falls
from validation.pipes import LOOKS
from validation.script import Script
from validation.slope import standing
from validation.statements import CLIMBS, HOLDS, LOWEST_LEVEL
from validation.thesis import (
    BEST_RATE,
    EFFECTIVE_RATE,
    LOWEST,
    LOWEST_SPREAD,
    LOWEST_VERTICAL,
    PIPES,
)
from validation.verdicts import (
    UNKNOWN,
    Finding,
    Row,
    above,
    at_most_share,
    below,
    row,
    shown_list,
    within,
)
from validation.verdicts import falls as decreases

NAME = "lowest_pressure"
SCENE = "pfr_mode3_air_line.yaml"
LATE = f"{{kind: table, points: [[0 s, 0], [{FULL - 0.3:g} s, 0], [{FULL - 0.1:g} s, 1]]}}"
HIGHER = (0.0, 2.0, 4.0, 6.0)  # kPa above P_M3^S, in a level pipe
LIMITED = 0.5  # share of the displacement that is left where P_M3^S is set too high
LOWER = 3.0  # kPa below the pressure that holds in a vertical pipe
DROPPED = 5.0  # mm, a spike's height: more has no recoil to explain it
FALLEN = 20.0  # mm, the lowest height that is drawn


def level(pipe: int) -> Case:
    """Return the case of a level pipe [mm]."""
    return at_the_line(f"{pipe} mm, level", pipe, BEST_RATE, LOWEST[pipe])


def vertical(pipe: int) -> Case:
    """Return the case of a vertical pipe [mm], upwards."""
    lowest = LOWEST_VERTICAL[pipe] - LOWER
    held = (*standing(90), "time.settle=null", f"environment.gravity_profile={LATE}")
    return at_the_line(f"{pipe} mm, vertical", pipe, EFFECTIVE_RATE[pipe], lowest, held)


def at_the_line(
    name: str, pipe: int, rate: float, lowest: float, more: tuple[str, ...] = ()
) -> Case:
    """Return the case of a cycle through the air line, pressures [kPa] on the gauge."""
    walls = f"environment.walls={{pipe: {{kind: pipe, diameter: {pipe} mm}}}}"
    return Case(name, SCENE, (walls, *deflation_on_gauge(rate, lowest), *more, *THINNED))


def cases() -> list[Case]:
    """Two a pipe."""
    return [make(pipe) for make in (level, vertical) for pipe in PIPES]


def fall_of(outcome: Outcome) -> Fall | None:
    """The fall of the pressure; None of a run that failed."""
    cycles = falls(outcome.history)
    return cycles[0] if cycles else None


def displacement(fall: Fall | None, lowest: float) -> float:
    """Down to a pressure [kPa], in mm."""
    return NAN if fall is None else MILLI * fall.displacement_above(1e3 * lowest)


def loss(fall: Fall | None, lowest: float) -> float:
    """How far below its highest place the robot is at a pressure [kPa], in mm."""
    if fall is None:
        return NAN
    there = fall.displacement_above(1e3 * lowest)
    so_far = fall.pressure[fall.began :] >= 1e3 * lowest
    highest = (fall.x[fall.began :][so_far]).max() - fall.x[fall.began]
    return MILLI * float(highest - there)


def holding_pressure(fall: Fall | None) -> float:
    """The lowest pressure [kPa] at which the robot still is at its highest place, but for what the
    recoil of its spikes explains; NaN where it never drops.
    """
    if fall is None:
        return NAN
    x = fall.x[fall.began :]
    if MILLI * (x.max() - x[-1]) <= DROPPED:
        return NAN
    held = np.flatnonzero(MILLI * (x.max() - x) <= DROPPED)
    return 1e-3 * float(fall.pressure[fall.began + held[-1]])


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Level: room for motion. Vertical: climbs, holds, drops."""
    for pipe in PIPES:
        yield from level_rows(outcomes[level(pipe).name], pipe)
    for pipe in PIPES:
        yield from vertical_rows(outcomes[vertical(pipe).name], pipe)
    if points is not None:
        computed = [
            at(outcomes, pipe, angle, lowest)
            for pipe, angle, lowest in zip(
                points["pipe_mm"], points["inclination_deg"], points["lowest_kPa"], strict=True
            )
        ]
        there, spread = points["displacement_mm"], points["spread"]
        finding = deviation(np.array(computed), there, spread, "mm")
        claim = "Fig 6.6: displacement down to the lowest pressure"
        yield row(LOWEST_LEVEL, claim, "digitised points", finding, outcomes.values())


def level_rows(outcome: Outcome, pipe: int) -> Iterator[Row]:
    """The higher P_M3^S is set, the less is left."""
    fall = fall_of(outcome)
    lowest = [LOWEST[pipe] + more for more in HIGHER]
    found = [displacement(fall, pressure) for pressure in lowest]
    where = f"level {pipe} mm pipe"
    claim = f"less the higher P_M3^S, {shown_list(lowest, 'kPa')}; {where}"
    yield row(LOWEST_LEVEL, claim, "falls", decreases(found, "mm"), [outcome])
    left = at_most_share(found[-1], found[0], LIMITED)
    claim = f"P_M3^S set too high, {lowest[-1]:g} kPa, limits the motion; {where}"
    reference = f"below {100 * LIMITED:g} % of that down to {lowest[0]:g} kPa"
    yield row(LOWEST_LEVEL, claim, reference, left, [outcome])


def vertical_rows(outcome: Outcome, pipe: int) -> Iterator[Row]:
    """Climbs down to the thesis's pressure, holds there, drops below; where it lets go."""
    fall, lowest = fall_of(outcome), LOWEST_VERTICAL[pipe]
    where = f"vertical {pipe} mm pipe"
    up = above(displacement(fall, lowest), 0.0, "mm")
    claim = f"climbs while the pressure falls to {lowest:g} kPa; {where}"
    yield row(CLIMBS, claim, "above 0 mm", up, [outcome])
    holds = below(loss(fall, lowest), MILLI * LEAST, "mm")
    claim = f"holds at {lowest:g} kPa: loses no height; {where}"
    yield row(HOLDS, claim, f"below {MILLI * LEAST:g} mm", holds, [outcome])
    drops = above(loss(fall, lowest - LOWER), DROPPED, "mm")
    if loss(fall, lowest) > DROPPED:
        drops = Finding("fell before", UNKNOWN)
    claim = f"falls below that: height lost down to {lowest - LOWER:g} kPa; {where}"
    yield row(HOLDS, claim, f"above {DROPPED:g} mm", drops, [outcome])
    found = within(holding_pressure(fall), lowest, LOWEST_SPREAD, "kPa")
    reference = f"{lowest:g} kPa within {100 * LOWEST_SPREAD:g} %"
    yield row(HOLDS, f"lowest pressure that holds; {where}", reference, found, [outcome])


def at(outcomes: Outcomes, pipe: float, angle: float, lowest: float) -> float:
    """Displacement [mm] of a digitised point; NaN beyond what was run."""
    makers = {0.0: level, 90.0: vertical}
    if pipe not in PIPES or angle not in makers:
        return NAN
    fall = fall_of(outcomes[makers[angle](int(pipe)).name])
    reaches = fall is not None and fall.pressure[-1] <= 1e3 * lowest
    return displacement(fall, lowest) if reaches else NAN


def curve(fall: Fall | None) -> tuple[np.ndarray, np.ndarray]:
    """Pressure [kPa] and displacement [mm] while it falls; empty of a run that failed."""
    if fall is None:
        return np.empty(0), np.empty(0)
    x = fall.x[fall.began :]
    return 1e-3 * fall.pressure[fall.began :], MILLI * (x - x[0])


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Displacement over the falling pressure, level and vertical."""
    with drawing(path, 3.4) as figure:
        panels = figure.subplots(1, 2)
        sides = ((level, 0.0, LOWEST), (vertical, 90.0, LOWEST_VERTICAL))
        for axes, (make, angle, lowest) in zip(panels, sides, strict=True):
            axes.axhline(0.0, color=QUIET, linewidth=0.7)
            for pipe, look in LOOKS.items():
                colour = look["color"]
                axes.axvline(lowest[pipe], color=colour, linewidth=0.8, linestyle="--")
                fall = fall_of(outcomes[make(pipe).name])
                axes.plot(*curve(fall), color=colour, label=f"{pipe} mm pipe")
                if points is not None:
                    at_point = (points["pipe_mm"] == pipe) & (points["inclination_deg"] == angle)
                    axes.errorbar(
                        points["lowest_kPa"][at_point], points["displacement_mm"][at_point],
                        points["spread"][at_point], linestyle="none", marker=look["marker"],
                        mfc="none", color=colour, ecolor=INK,
                        label=f"thesis, digitised, {pipe} mm" if at_point.any() else None,
                    )  # fmt: skip
            axes.plot([], [], color=QUIET, linewidth=0.8, linestyle="--", label="thesis: P_M3^S")
            axes.invert_xaxis()
            axes.set_xlabel("pressure on the gauge, falling [kPa]")
        panels[0].set(title="level", ylabel="displacement [mm]")
        # A robot that lets go falls out of the picture.
        climbed = [NAN, *(displacement(fall_of(outcomes[vertical(p).name]), 0.0) for p in PIPES)]
        if np.nanmin([0.0, *climbed]) < -FALLEN:
            panels[1].set_ylim(bottom=-FALLEN)
        panels[1].set(title="vertical", ylabel="height [mm]")
        panels[0].legend()


SCRIPT = Script(
    name=NAME,
    figure="Fig 6.6 D to I",
    about=(
        "The lowest pressure P_M3^S on the gauge, through 2 m of tube: displacement while it falls "
        "at the rate of Table 6.2 (1.3 kPa/s in the level pipes), over the pressure it falls to. A "
        "cycle that ends "
        "higher is the same motion, ended earlier, so a run a pipe shows them all. Claims: level, "
        "the higher P_M3^S the less motion; vertical, it climbs and holds down to 9, 12, 13 kPa "
        "in the 30, 36, 41 mm pipe and falls below."
    ),
    cases=cases,
    quick=(level(36).name,),
    rows=rows,
    draw=draw,
    columns=("pipe_mm", "inclination_deg", "lowest_kPa", "displacement_mm"),
)

if __name__ == "__main__":
    command([SCRIPT])
