"""The robot in space: statements of the thesis that other scripts examine with the plane section.

The model is `robot:pfr/solid`: all spikes, with the real mass and motor force. Cycles, pulls and
layouts are those of the scripts for Fig 4.8, 4.11, 6.5, 6.6, 6.9 with `pfr_*_3d` in place of
`pfr_*`, one cycle a run. The pull in space is the robot's, that of the section is half of it.

A T branch (6.6, 7.2.4) is passed by a level robot, by one exit or the other as the motor turns, and
not by one in a vertical plane. The section is no model of it: its motor turns about the axis across
the plane, that in space about the axis of the pipe.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from softsim.report.style import BLUE, INK, ORANGE, QUIET, drawing
from validation import (
    critical_zones,
    deflation_rate,
    displacement,
    lowest_pressure,
    mode1_speed,
    statements,
)
from validation import propulsion_force as pulling
from validation.air import deflation, natural_deflation
from validation.cases import THINNED, Case, LayoutCase, Outcome, Outcomes
from validation.command import command
from validation.contact_rows import EXPECTED, expected
from validation.critical_zones import CLAIMED, is_passed, report, verdict
from validation.digitised import Points
from validation.motion import MILLI, NAN, displacement_while_falling, falls, speed_after
from validation.pull import pull_of
from validation.script import Listing, Script
from validation.slope import upwards
from validation.statements import (
    CLIMBS,
    CONTACT_ROWS,
    FREQUENCY,
    HOLDS,
    MODE1_BEST,
    MODE1_SLOW,
    PULL,
    PULL_PIPE,
    PULL_PRESSURE,
    RATE_LIMIT,
    Statement,
)
from validation.thesis import (
    BEST_FREQUENCY,
    BEST_RATE,
    FREQUENCIES,
    HIGHEST,
    HIGHESTS,
    LOWEST,
    LOWEST_SPREAD,
    LOWEST_VERTICAL,
    PIPES,
    RING,
    STOP_RATE,
    WEIGHT,
)
from validation.verdicts import (
    AGREES,
    DISAGREES,
    IN_SPACE,
    UNKNOWN,
    VERDICTS,
    Finding,
    Row,
    above,
    at_most_share,
    below,
    between,
    highest_at,
    judged,
    more_than,
    rises,
    row,
    shown,
    within,
)
from validation.verdicts import falls as decreases

NAME = "space"
PIPE = 36  # mm, where frequencies and rates are varied
RATES = (BEST_RATE, 3.0, STOP_RATE)  # kPa/s
MODE1 = (64, BEST_FREQUENCY)  # Hz
ZONES = (
    "elbow_90_36mm",
    "elbow_90_36mm_up",
    "c_bend",
    "c_bend_up",
    "transition_30_to_41",
    "transition_41_to_30",
    "transition_30_to_41_vertical",
    "transition_41_to_30_vertical",
)
BRANCH, BRANCH_UP = "t_branch_36mm", "t_branch_36mm_up"
SENSES = {1: "", -1: ", motor reversed"}


@dataclass(frozen=True)
class Robot:
    """Model of the robot that is compared.

    suffix: of the names of its scenes. pull_factor: the robot's pull over the tension of its
    tendon. in_vertical: its run in a vertical pipe. overrides: of all its runs.
    """

    name: str
    suffix: str
    of_layouts: str
    pull_factor: float
    colour: str
    in_vertical: Case
    overrides: tuple[str, ...] = ()

    def scene(self, stem: str) -> str:
        """Return the name of the scene with this robot in it."""
        return f"{stem}{self.suffix}.yaml"


SPACE = Robot("space", "_3d", "pfr_solid", 1.0, BLUE, Case("", "pfr_vertical_3d.yaml", THINNED))
CLIMB = upwards(PIPE, 90, LOWEST_VERTICAL[PIPE] - lowest_pressure.LOWER)
IN_VERTICAL = Case("", f"pfr_{PIPE}mm.yaml", (*CLIMB, *THINNED))
SECTION = Robot("section", "", "pfr", RING, ORANGE, IN_VERTICAL)
ROBOTS = (SPACE, SECTION)
Claim = tuple[Statement, str, str, Finding, list[Outcome]]
"""Statement, claim, reference, finding, and the runs behind it."""


def cycle(robot: Robot, pipe: int, frequency: int) -> Case:
    """Return the case of one cycle of natural deflation in a pipe [mm] at a frequency [Hz]."""
    air = natural_deflation(round(displacement.TIME_CONSTANT, 3), displacement.END, 1)
    return Case(
        f"{pipe} mm, {frequency} Hz, {robot.name}",
        robot.scene(f"pfr_{pipe}mm"),
        (*robot.overrides, *air, f"loads.motor.frequency={frequency} Hz", *THINNED),
    )


def rated(robot: Robot, rate: float) -> Case:
    """Return the case of one cycle at a deflation rate [kPa/s] in PIPE."""
    overrides = (*robot.overrides, *deflation(rate, LOWEST[PIPE]), *THINNED)
    return Case(f"{rate:g} kPa/s, {robot.name}", robot.scene(f"pfr_{PIPE}mm"), overrides)


def held(robot: Robot, pipe: int, highest: float) -> Case:
    """Return the case of a robot held by a tendon in a pipe [mm], inflated to `highest` [kPa]."""
    case = pulling.case(pipe, BEST_FREQUENCY, highest)
    name = f"held, {pipe} mm, {highest:g} kPa, {robot.name}"
    overrides = (*robot.overrides, *case.overrides)
    return Case(name, robot.scene(f"pfr_{pipe}mm"), overrides)


def upright(robot: Robot) -> Case:
    """Return the case of a vertical pipe of 36 mm, inflated at once and let down."""
    overrides = (*robot.overrides, *robot.in_vertical.overrides)
    return Case(f"vertical, {robot.name}", robot.in_vertical.scene, overrides)


def vibrating(robot: Robot, frequency: int) -> Case:
    """Return the case of Mode 1 at a frequency [Hz]."""
    motor = f"loads.motor.frequency={frequency} Hz"
    overrides = (*robot.overrides, motor, "time.end=2 s", *THINNED)
    return Case(f"Mode 1, {frequency} Hz, {robot.name}", robot.scene("pfr_mode1"), overrides)


def through(robot: Robot, layout: str, sense: int = 1) -> LayoutCase:
    """Return the case of a layout; sense: of the motor."""
    motor = () if sense == 1 else (f"loads.motor.sense={sense}",)
    overrides = (*robot.overrides, critical_zones.PICTURES, *motor)
    name = f"{layout}{SENSES[sense]}, {robot.name}"
    return LayoutCase(name, f"layouts/{layout}.yaml", overrides, robot.of_layouts)


def cases() -> list[Case]:
    """Return the cases in space, and the cycles of the section, which are drawn beside."""
    beside = [cycle(SECTION, pipe, BEST_FREQUENCY) for pipe in PIPES]
    return [*cases_of(SPACE), *beside]


def cases_of(robot: Robot) -> Iterator[Case]:
    """Yield all cases of a robot, the most informative ones first."""
    yield from (cycle(robot, pipe, BEST_FREQUENCY) for pipe in PIPES)
    yield from (held(robot, pipe, HIGHEST) for pipe in PIPES)
    yield from (held(robot, PIPE, highest) for highest in HIGHESTS if highest != HIGHEST)
    yield from (vibrating(robot, frequency) for frequency in MODE1)
    yield upright(robot)
    yield from (cycle(robot, PIPE, f) for f in FREQUENCIES if f != BEST_FREQUENCY)
    yield from (rated(robot, rate) for rate in RATES)
    yield from (through(robot, layout) for layout in ZONES)
    yield from (through(robot, layout, s) for layout in (BRANCH, BRANCH_UP) for s in SENSES)


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Yield every claim on the robot in space."""
    for part in (motion, frequencies, rates, touch_and_pull, vertical, vibration, zones, branches):
        for claim in part(outcomes, SPACE):
            yield row(*claim)


def motion(outcomes: Outcomes, robot: Robot) -> Iterator[Claim]:
    """Yield the claims of Fig 6.5: standstill, onset, end in three pipes."""
    for pipe in PIPES:
        outcome = outcomes[cycle(robot, pipe, BEST_FREQUENCY).name]
        for statement, claim, reference, found in displacement.motion_findings(outcome, pipe):
            yield statement, f"{claim}; {pipe} mm pipe", reference, found, [outcome]


def frequencies(outcomes: Outcomes, robot: Robot) -> Iterator[Claim]:
    """Yield the claim of Fig 6.5: farther at higher frequency."""
    behind = [outcomes[cycle(robot, PIPE, f).name] for f in FREQUENCIES]
    found = rises([down_to_end(outcome) for outcome in behind], "mm")
    named = ", ".join(map(str, FREQUENCIES))
    yield FREQUENCY, f"farther at {named} Hz; {PIPE} mm pipe", "rises", found, behind


def down_to_end(outcome: Outcome) -> float:
    """Return the displacement [mm] while the pressure falls to P_M3^S of PIPE."""
    cycles = falls(outcome.history)
    return MILLI * cycles[0].displacement_above(1e3 * LOWEST[PIPE]) if cycles else NAN


def rates(outcomes: Outcomes, robot: Robot) -> Iterator[Claim]:
    """Yield the claims of Fig 6.6 A to C: less the faster the pressure falls, nothing at last."""
    behind = [outcomes[rated(robot, rate).name] for rate in RATES]
    found = [MILLI * displacement_while_falling(outcome.history) for outcome in behind]
    named = ", ".join(f"{rate:g}" for rate in RATES)
    yield (
        RATE_LIMIT,
        f"less the faster it deflates, {named} kPa/s",
        "falls",
        decreases(found, "mm"),
        behind,
    )
    share = deflation_rate.NOTHING
    nothing = at_most_share(found[-1], found[0], share)
    reference = f"below {100 * share:g} % of that at {RATES[0]:g} kPa/s"
    yield RATE_LIMIT, f"nothing at {STOP_RATE:g} kPa/s", reference, nothing, behind


def touch_and_pull(outcomes: Outcomes, robot: Robot) -> Iterator[Claim]:
    """Yield the claims of Fig 4.12 and 4.11: rows that touch, pull, most in the narrow pipe."""
    at_highest = {pipe: outcomes[held(robot, pipe, HIGHEST).name] for pipe in PIPES}
    for pipe, outcome in at_highest.items():
        found = between(outcome.number("rows_at_highest"), *EXPECTED[pipe])
        yield (
            CONTACT_ROWS,
            f"rows that touch at {HIGHEST:g} kPa; {pipe} mm pipe",
            expected(pipe),
            found,
            [outcome],
        )
    low, high = (outcomes[held(robot, PIPE, p).name] for p in HIGHESTS[-2:])
    counts = [outcome.number("rows_at_highest") for outcome in (high, low)]
    same = judged(counts[0] == counts[1], f"{shown(counts[0])} against {shown(counts[1])}", *counts)
    claim = f"as many rows at {HIGHESTS[-1]:g} as at {HIGHEST:g} kPa; {PIPE} mm pipe"
    yield CONTACT_ROWS, claim, "equal", same, [low, high]
    least, most = pulling.WEIGHTS
    for pipe, outcome in at_highest.items():
        found = between(pull(outcome, robot) / WEIGHT, least, most, "times the weight")
        claim = f"pull at {HIGHEST:g} kPa; {pipe} mm pipe"
        yield PULL, claim, f"{least:g} to {most:g} times the weight", found, [outcome]
    pulls = [pull(outcome, robot) for outcome in at_highest.values()]
    best = highest_at([f"{pipe} mm" for pipe in PIPES], pulls, [f"{PIPES[0]} mm"], "N")
    claim = f"pulls most in the {PIPES[0]} mm pipe"
    yield PULL_PIPE, claim, f"{PIPES[0]} mm", best, list(at_highest.values())
    more, less = pull(high, robot), pull(low, robot)
    alike = within(more, less, pulling.ALIKE)
    found = replace(alike, computed=f"{shown(more, 'N')} against {shown(less, 'N')}")
    claim = f"pull at {HIGHESTS[-1]:g} kPa like that at {HIGHEST:g} kPa; {PIPE} mm pipe"
    yield PULL_PRESSURE, claim, f"equal within {100 * pulling.ALIKE:g} %", found, [low, high]


def pull(outcome: Outcome, robot: Robot) -> float:
    """Return the robot's largest pull [N]; NaN where the run has none."""
    found = pull_of(outcome.history)
    return robot.pull_factor * found.peak if found else NAN


def vertical(outcomes: Outcomes, robot: Robot) -> Iterator[Claim]:
    """Yield the claims of Fig 6.6 G to I: climbs while the pressure falls, holds to P_M3^S."""
    outcome = outcomes[upright(robot).name]
    fall = lowest_pressure.fall_of(outcome)
    climbed = (
        NAN if fall is None else MILLI * float((fall.x[fall.began :] - fall.x[fall.began]).max())
    )
    claim = f"climbs while the pressure falls; vertical {PIPE} mm pipe"
    resolution = MILLI * displacement.LEAST
    yield CLIMBS, claim, f"above {resolution:g} mm", above(climbed, resolution, "mm"), [outcome]
    holds = within(
        lowest_pressure.holding_pressure(fall), LOWEST_VERTICAL[PIPE], LOWEST_SPREAD, "kPa"
    )
    reference = f"{LOWEST_VERTICAL[PIPE]:g} kPa within {100 * LOWEST_SPREAD:g} %"
    yield HOLDS, f"holds down to P_M3^S; vertical {PIPE} mm pipe", reference, holds, [outcome]


def vibration(outcomes: Outcomes, robot: Robot) -> Iterator[Claim]:
    """Yield the claims of Fig 4.8: Mode 1, faster at 64 than at 192 Hz, where it is slow."""
    behind = [outcomes[vibrating(robot, f).name] for f in MODE1]
    low, high = (MILLI * speed_after(each.history, mode1_speed.SETTLED) for each in behind)
    claim = f"Mode 1: faster at {MODE1[0]} than at {MODE1[1]} Hz"
    yield MODE1_BEST, claim, "faster", more_than(low, high, "mm/s"), behind
    slow = below(abs(high), mode1_speed.SLOW, "mm/s")
    reference = f"below {mode1_speed.SLOW:g} mm/s"
    yield MODE1_SLOW, f"Mode 1: slow at {MODE1[1]} Hz", reference, slow, behind[1:]


def zones(outcomes: Outcomes, robot: Robot) -> Iterator[Claim]:
    """Yield the claims of section 6.6: bends and transitions are passed."""
    for layout in ZONES:
        outcome = outcomes[through(robot, layout).name]
        statement, claim, where = CLAIMED[layout]
        yield statement, claim, f"passed ({where})", is_passed(outcome), [outcome]


def branches(outcomes: Outcomes, robot: Robot) -> Iterator[Claim]:
    """Yield the claims of sections 6.6 and 7.2.4.

    A level T branch is passed, by the other exit with the motor reversed; a vertical one is not.
    """
    level = [outcomes[through(robot, BRANCH, sense).name] for sense in SENSES]
    for outcome, said in zip(level, SENSES.values(), strict=True):
        claim = f"passes a level T branch{said}"
        yield statements.BRANCH, claim, "passed (6.6)", is_passed(outcome), [outcome]
    exits = [str(report(outcome).get("exit", "")) for outcome in level]
    both = all(exits)
    told = " against ".join(each or verdict(one) for each, one in zip(exits, level, strict=True))
    found = judged(exits[0] != exits[1], told) if both else Finding(told, UNKNOWN)
    yield (
        statements.BRANCH,
        "the motor reversed, it leaves a level T branch by the other exit",
        "another",
        found,
        level,
    )
    upward = outcomes[through(robot, BRANCH_UP).name]
    claim = "does not pass a T branch in a vertical plane"
    yield statements.BRANCH_UP, claim, "not passed (6.6, 7.2.4)", is_not_passed(upward), [upward]


def counted(robot: Robot, claims: Iterable[Claim]) -> tuple[str, ...]:
    """Return the robot and how many of its claims have each verdict, as a line of a table."""
    verdicts = [found.verdict for *_, found, _ in claims]
    return robot.name, *(str(verdicts.count(verdict)) for verdict in VERDICTS)


def side_by_side(
    title: str, headings: Iterable[str], columns: Iterable[Iterable[Claim]]
) -> Listing:
    """Return a table with a claim a line and a robot a column; what agrees is marked."""
    lines = []
    for told in zip(*columns, strict=True):
        _, claim, reference, *_ = told[0]
        lines.append((claim, reference, *(cell(found) for *_, found, _ in told)))
    return Listing(title, ("claim", "thesis", *headings), tuple(lines))


def cell(found: Finding) -> str:
    """Return what was computed, marked where it agrees."""
    return f"+ {found.computed}" if found.verdict == AGREES else found.computed


def is_not_passed(outcome: Outcome) -> Finding:
    """Return the opposite of `is_passed`; a robot that still moved at the end is undecided."""
    found = is_passed(outcome)
    reverse = {AGREES: DISAGREES, DISAGREES: AGREES, UNKNOWN: UNKNOWN}
    return replace(found, verdict=reverse[found.verdict])


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Draw displacement over the falling pressure in three pipes, of both robots."""
    with drawing(path, 2.8) as figure:
        panels = figure.subplots(1, len(PIPES), sharex=True)
        draw_falls(panels, outcomes, ROBOTS)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)


def draw_falls(panels: np.ndarray, outcomes: Outcomes, robots: Iterable[Robot]) -> None:
    """Draw displacement over the falling pressure, a panel a pipe (3,)."""
    for robot in robots:
        for axes, pipe in zip(panels, PIPES, strict=True):
            draw_fall(axes, outcomes[cycle(robot, pipe, BEST_FREQUENCY).name], robot)
    for axes, pipe in zip(panels, PIPES, strict=True):
        axes.axvline(LOWEST[pipe], color=QUIET, linewidth=0.8, linestyle="--")
        axes.axhline(0.0, color=INK, linewidth=0.6)
        axes.set(title=f"{pipe} mm pipe", xlabel="pressure, falling [kPa]")
        axes.set_xlim(HIGHEST, displacement.END)
    panels[0].set_ylabel("displacement [mm]")


def draw_fall(axes: Axes, outcome: Outcome, robot: Robot) -> None:
    """Draw displacement over the falling pressure of one cycle."""
    line = axes.plot([], [], color=robot.colour, label=robot.name)[0]
    for fall in falls(outcome.history)[:1]:
        x = fall.x[fall.began :] - fall.x[fall.began]
        line.set_data(1e-3 * fall.pressure[fall.began :], MILLI * x)
    axes.relim()
    axes.autoscale_view()


SCRIPT = Script(
    name=NAME,
    model=IN_SPACE,
    figure="the robot in space",
    about=(
        "The claims on motion, rows, pull, vertical pipe, vibration alone, bends, transitions and "
        "T branches, of the robot in space. One cycle with natural deflation a pipe; frequencies, "
        f"deflation rates and pressures in the {PIPE} mm pipe. Drawn: displacement over the "
        "falling pressure, beside that of the plane section; P_M3^S dashed."
    ),
    cases=cases,
    rows=rows,
    draw=draw,
)

if __name__ == "__main__":
    command([SCRIPT])
