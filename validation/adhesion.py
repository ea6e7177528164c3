"""Adhesion of the spikes to the pipe, in space: which statements agree for which pull-off stress?

Silicone sticks to acrylic. The pull of a spike's edge of 2 mm follows from theory (JKR of a line
contact) only within 2 to 12 mN: an edge radius of 0.2 to 1 mm, E* of 0.5 to 1 MPa, a work of
adhesion of 0.05 to 0.2 J/m^2. So its stress is an uncertain parameter, not fitted: none, the middle
and the upper end of that range. The claims are those of the script `space`.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from softsim.report.style import BLUE, GREEN, ORANGE, drawing
from validation.cases import Case, Outcomes
from validation.command import command
from validation.digitised import Points
from validation.mode1_speed import SETTLED
from validation.motion import MILLI, NAN, falls, speed_after
from validation.script import Listing, Script
from validation.space import (
    SPACE,
    Claim,
    Robot,
    counted,
    cycle,
    draw_falls,
    motion,
    side_by_side,
    vibrating,
    vibration,
)
from validation.thesis import BEST_FREQUENCY, FREQUENCIES, PIPES
from validation.verdicts import TRIAL, VERDICTS, Row, row, shown

NAME = "adhesion"
WORK = 0.1
"""Work of adhesion [J/m^2] of silicone on acrylic, separated at millimetres a second."""

STRESSES = {0.0: BLUE, 2.5: GREEN, 5.0: ORANGE}
"""Pull-off stress [kPa] -> colour."""


def robot(stress: float) -> Robot:
    """Return the robot in space whose spikes have a pull-off stress [kPa]."""
    law = f"work_of_adhesion: {WORK} J/m^2, pull_off_stress: {stress:g} kPa"
    sticky = (f"contact.adhesion={{spikes: {{{law}, surfaces: [skin.spikes]}}}}",)
    overrides = sticky if stress else ()
    return replace(SPACE, name=f"{stress:g} kPa", colour=STRESSES[stress], overrides=overrides)


ROBOTS = [robot(stress) for stress in STRESSES]


def cases() -> list[Case]:
    """Return three cycles and four speeds a robot."""
    return [case for each in ROBOTS for case in cases_of(each)]


def cases_of(robot: Robot) -> Iterator[Case]:
    """Yield all cases of a robot."""
    yield from (cycle(robot, pipe, BEST_FREQUENCY) for pipe in PIPES)
    yield from (vibrating(robot, frequency) for frequency in FREQUENCIES)


def claims(outcomes: Outcomes, robot: Robot) -> Iterator[Claim]:
    """Yield the claims on a robot, in the order of the rows."""
    yield from motion(outcomes, robot)
    yield from vibration(outcomes, robot)


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Yield every claim with adhesion; those without are rows of `space`."""
    for robot in ROBOTS:
        if robot.overrides:
            for statement, claim, reference, found, behind in claims(outcomes, robot):
                yield row(
                    statement, f"pull-off stress {robot.name}: {claim}", reference, found, behind
                )


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """Yield how many claims agree with each stress; claim by claim; displacements and speeds."""
    counts = tuple(counted(robot, claims(outcomes, robot)) for robot in ROBOTS)
    yield Listing("Claims, by pull-off stress", ("pull-off stress", *VERDICTS), counts)
    headings = tuple(robot.name for robot in ROBOTS)
    columns = [claims(outcomes, robot) for robot in ROBOTS]
    yield side_by_side("Claim by claim; + agrees", headings, columns)
    lines = [*displacements(outcomes), *speeds(outcomes)]
    yield Listing("Displacements and speeds", ("quantity", *headings), tuple(lines))


def displacements(outcomes: Outcomes) -> Iterator[tuple[str, ...]]:
    """Yield the displacement of a cycle in each pipe, rising and falling, a robot a column."""
    for pipe in PIPES:
        found = [
            falls(outcomes[cycle(robot, pipe, BEST_FREQUENCY).name].history) for robot in ROBOTS
        ]
        rising = (MILLI * cycles[0].before if cycles else NAN for cycles in found)
        falling = (MILLI * cycles[0].displacement if cycles else NAN for cycles in found)
        yield f"{pipe} mm pipe: while the pressure rises", *(shown(x, "mm") for x in rising)
        yield f"{pipe} mm pipe: while it falls", *(shown(x, "mm") for x in falling)


def speeds(outcomes: Outcomes) -> Iterator[tuple[str, ...]]:
    """Yield the speed in Mode 1 at each frequency, a robot a column."""
    for frequency in FREQUENCIES:
        found = (speed(outcomes, robot, frequency) for robot in ROBOTS)
        yield f"Mode 1, {frequency} Hz", *(shown(v, "mm/s") for v in found)


def speed(outcomes: Outcomes, robot: Robot, frequency: int) -> float:
    """Return the mean speed [mm/s] in Mode 1 at a frequency [Hz]."""
    return MILLI * speed_after(outcomes[vibrating(robot, frequency).name].history, SETTLED)


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Draw displacement over the falling pressure, a panel a pipe, and speed over frequency."""
    with drawing(path, 2.8) as figure:
        panels = figure.subplots(1, len(PIPES) + 1)
        draw_falls(panels[:-1], outcomes, ROBOTS)
        for robot in ROBOTS:
            along = [speed(outcomes, robot, frequency) for frequency in FREQUENCIES]
            panels[-1].plot(FREQUENCIES, along, color=robot.colour, marker="o")
        panels[-1].set(title="Mode 1", xlabel="frequency [Hz]", ylabel="mean speed [mm/s]")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=len(ROBOTS))


SCRIPT = Script(
    name=NAME,
    model=TRIAL,
    figure="adhesion of the spikes",
    about=(
        "The robot in space with adhesion of its spikes to the pipe, which theory bounds and "
        f"nobody measured: work of adhesion {WORK:g} J/m^2, pull-off stresses of "
        f"{', '.join(f'{stress:g}' for stress in STRESSES)} kPa. One cycle with natural deflation "
        "a pipe, and vibration without air at four frequencies. Drawn: displacement over the "
        "falling pressure, P_M3^S dashed; speed over frequency."
    ),
    cases=cases,
    rows=rows,
    draw=draw,
    listings=listings,
)

if __name__ == "__main__":
    command([SCRIPT])
