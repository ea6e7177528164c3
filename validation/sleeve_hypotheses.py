"""What the gauge reads and how stiff the sleeve is: hypotheses against the thesis's statements.

A sleeve of the stated constants balloons at 8 to 9 kPa; the thesis works at 20 to 26 kPa. What
could explain that, each as it would be written in a scene:
- the whole sleeve is stiffer (`sleeve_stiffness` chose the factor, from statements at rest alone);
- the skin alone is, as with a thicker one, a thread, a glued seam: the spikes are as stated;
- it is Dragon Skin 30;
- the constants are right and most of the gauge's pressure is lost on its way to the skin;
- nothing: constants and pressures as stated.

Under each, the robot in three pipes: cycles, held by a tendon, in a vertical pipe; the claims are
those of the script `space`. They are computed in the plane section
and in space.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from softsim.report.style import BLUE, GREEN, INK, ORANGE, PURPLE, drawing
from validation.cases import Case, Outcomes
from validation.command import command
from validation.digitised import Points
from validation.script import Listing, Script
from validation.sleeve_stiffness import FACTOR
from validation.space import (
    PIPE,
    SECTION,
    SPACE,
    Claim,
    Robot,
    counted,
    cycle,
    draw_falls,
    held,
    motion,
    side_by_side,
    touch_and_pull,
    upright,
    vertical,
)
from validation.thesis import BEST_FREQUENCY, HIGHEST, HIGHESTS, PIPES, STATED
from validation.verdicts import IN_SECTION, IN_SPACE, TRIAL, VERDICTS, Row, row

NAME = "sleeve_hypotheses"
C10, C20, C30 = STATED
AS_STATED = f"{{law: yeoh, C10: {C10} kPa, C20: {C20} kPa, C30: {C30} kPa, density: 1070 kg/m^3, \
strain_range: 2.0, spectrum: {{kind: fractional, relaxation_time: 330 us, order: 0.32, \
band: [2 Hz, 5 kHz]}}}}"
STATED_SLEEVE = (f"materials.stated={AS_STATED}", "bodies.skin.material=stated")
HYPOTHESES = {
    f"sleeve {FACTOR:g} times as stiff": ((), BLUE),
    f"skin alone {FACTOR:g} times as stiff": (
        (f"materials.stated={AS_STATED}", "bodies.skin.regions={spikes: {material: stated}}"),
        GREEN,
    ),
    "Dragon Skin 30": (("bodies.skin.material=dragon_skin_30",), PURPLE),
    f"pressure lost, 1/{FACTOR:g} of it on the skin": (
        (*STATED_SLEEVE, f"loads.air.factor={1.0 / FACTOR:.6g}"),
        ORANGE,
    ),
    "as stated": (STATED_SLEEVE, INK),
}
"""Hypothesis -> overrides and colour. The first one is that of the scenes."""


def robots(model: Robot) -> Iterator[Robot]:
    """That model of the robot under each hypothesis."""
    for name, (overrides, colour) in HYPOTHESES.items():
        yield replace(model, name=f"{name}, {model.name}", overrides=overrides, colour=colour)


ROBOTS = (*robots(SECTION), *robots(SPACE))


def cases() -> list[Case]:
    """Ten a hypothesis and model."""
    return [case for robot in ROBOTS for case in cases_of(robot)]


def cases_of(robot: Robot) -> Iterator[Case]:
    """Three cycles, five pulls, one in a vertical pipe."""
    yield from (cycle(robot, pipe, BEST_FREQUENCY) for pipe in PIPES)
    yield from (held(robot, pipe, HIGHEST) for pipe in PIPES)
    yield from (held(robot, PIPE, highest) for highest in HIGHESTS if highest != HIGHEST)
    yield upright(robot)


def claims(outcomes: Outcomes, robot: Robot) -> Iterator[Claim]:
    """Of a robot, in the order of the rows."""
    for part in (motion, touch_and_pull, vertical):
        yield from part(outcomes, robot)


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Yield every claim under every hypothesis but the first, whose rows other scripts have."""
    for robot in ROBOTS:
        if not robot.overrides:
            continue
        model = TRIAL
        if robot.overrides == STATED_SLEEVE:  # the thesis's own constants
            model = IN_SPACE if robot.name.endswith(SPACE.name) else IN_SECTION
        for statement, claim, reference, found, behind in claims(outcomes, robot):
            yield row(statement, f"{robot.name}: {claim}", reference, found, behind, model=model)


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """How many statements each hypothesis agrees with; then claim by claim, a model a table."""
    counts = tuple(counted(robot, claims(outcomes, robot)) for robot in ROBOTS)
    yield Listing("Statements, by hypothesis", ("hypothesis", *VERDICTS), counts)
    for model in (SECTION, SPACE):
        columns = [claims(outcomes, robot) for robot in robots(model)]
        yield side_by_side(f"Claim by claim, {model.name}; + agrees", HYPOTHESES, columns)


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Displacement over the falling pressure, a row a model, a panel a pipe."""
    with drawing(path, 5.0) as figure:
        panels = figure.subplots(2, len(PIPES), sharex=True, squeeze=False)
        for line, model in zip(panels, (SECTION, SPACE), strict=True):
            draw_falls(line, outcomes, robots(model))
            line[0].set_ylabel(f"{model.name}: displacement [mm]")
        handles = panels[0, 0].get_legend_handles_labels()[0]
        figure.legend(handles, HYPOTHESES, loc="outside upper center", ncols=3)


SCRIPT = Script(
    name=NAME,
    model=TRIAL,
    figure="pressures and stiffness",
    about=(
        "Why 20 to 26 kPa, where the stated constants balloon at 8 to 9? Hypotheses: the whole "
        "sleeve stiffer; the skin alone; Dragon Skin 30; pressure lost on the way; nothing. Each "
        "against the claims on motion, rows, pull and the vertical pipe, of the plane section and "
        "of the robot in space."
    ),
    cases=cases,
    rows=rows,
    draw=draw,
    listings=listings,
)

if __name__ == "__main__":
    command([SCRIPT])
