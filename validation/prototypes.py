"""Table 3.2 of the thesis: three patterns of spikes, of which the second became the robot.

Around x rows: 10 x 3, 14 x 5, and 18 x 5 on a wider body. Mode 3 at 192 Hz and 23 kPa, one cycle at
1.3 kPa/s down to P_M3^S of the pipe. The thesis names no pipe: the first two stand in the 30 mm
pipe, which the third, 31 mm wide, does not fit, and all three in the 36 mm pipe.

How a section knows the number n around: a strip stands for n/4 spikes, so that its thickness goes
as n. The skin and the frame of the first are those of the second. Nobody tells the third one's
mass: that of its frame goes as the volume of the body, (21 mm / 17 mm)^2, motor included, which is
rather too much. Spikes stand on the whole length, so that three rows have a pitch of 10 mm.
Digitised points: pipe_mm, prototype (1, 2, 3), speed_mm_s (the thesis has none; a measurement of
one's own fits here).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from softsim.report.style import BLUE, GREEN, INK, ORANGE, QUIET, drawing
from validation.air import deflation
from validation.cases import THINNED, Case, Outcomes
from validation.command import command
from validation.deflation_rate import case as second_design
from validation.digitised import Points, deviation
from validation.motion import LEAST, MILLI, NAN, falls
from validation.script import Script
from validation.statements import PROTOTYPES
from validation.thesis import BEST_RATE, LOWEST
from validation.verdicts import Row, above, at_most_share, more_than, row, shown

NAME = "prototypes"
FREE_LENGTH = 30.0  # mm, L_B of all three
BODY = 17.0  # mm, outer diameter of the second one's skin, OD_SB
AROUND = 14  # spikes of the second in a row
STUCK = 0.1  # share of the second's displacement that counts as not moving


@dataclass(frozen=True)
class Design:
    """around, rows: of spikes. inner, outer: diameters of the skin [mm], ID_SB and OD_SB."""

    name: str
    around: int
    rows: int
    inner: float
    outer: float


FIRST = Design("10 x 3", 10, 3, 15.0, 17.0)
SECOND = Design("14 x 5", AROUND, 5, 15.0, BODY)
THIRD = Design("18 x 5, wider", 18, 5, 19.0, 21.0)
DESIGNS = (FIRST, SECOND, THIRD)
PIPES = {30: (FIRST, SECOND), 36: DESIGNS}
"""Pipe [mm] -> the designs that fit."""

COLOURS = (ORANGE, BLUE, GREEN)


def label(pipe: int, design: Design) -> str:
    """The name of a case."""
    return f"{design.name}, {pipe} mm"


def case(pipe: int, design: Design) -> Case:
    """One cycle of a design in a pipe [mm]."""
    shared = replace(second_design(pipe, BEST_RATE), name=label(pipe, design))
    if design is SECOND:
        return shared
    scene = shared.loaded.scene
    thickness, frame = scene.bodies["skin"].thickness, scene.rigid_bodies["frame"].mass
    if thickness is None or frame is None:
        raise ValueError(f"{shared.scene} is not the section, whose thickness stands for spikes")
    overrides = (
        f"bodies.skin.mesh.spikes_per_strip={design.rows}",
        f"bodies.skin.mesh.spike_pitch={FREE_LENGTH / design.rows} mm",
        f"bodies.skin.mesh.inner_diameter={design.inner} mm",
        f"bodies.skin.mesh.outer_diameter={design.outer} mm",
        f"bodies.skin.thickness={MILLI * thickness * design.around / AROUND:.6g} mm",
        f"rigid_bodies.frame.outline.height={design.inner} mm",
        f"rigid_bodies.frame.mass={MILLI * frame * volume(design):.6g} g",
        *deflation(BEST_RATE, LOWEST[pipe]),
        *THINNED,
    )
    return replace(shared, overrides=overrides)


def volume(design: Design) -> float:
    """Volume of the body over that of the second; they are as long."""
    return (design.outer / BODY) ** 2


def cases() -> list[Case]:
    """One a design and a pipe that it fits."""
    return [case(pipe, design) for pipe, design in conditions()]


def conditions() -> tuple[tuple[int, Design], ...]:
    """All pipes with the designs that fit."""
    return tuple((pipe, design) for pipe, designs in PIPES.items() for design in designs)


def displacement(outcomes: Outcomes, pipe: int, design: Design) -> float:
    """While the pressure falls [mm]."""
    cycles = falls(outcomes[label(pipe, design)].history)
    return MILLI * cycles[0].displacement if cycles else NAN


def speed(outcomes: Outcomes, pipe: int, design: Design) -> float:
    """The same over the time of the cycle [mm/s]."""
    cycles = falls(outcomes[label(pipe, design)].history)
    return MILLI * cycles[0].speed_above(0.0) if cycles else NAN


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """The first does not move, the second does, the third is slower."""
    for pipe in PIPES:
        first, second = (displacement(outcomes, pipe, design) for design in (FIRST, SECOND))
        behind = [outcomes[label(pipe, design)] for design in (FIRST, SECOND)]
        moves = above(second, MILLI * LEAST, "mm")
        claim = f"the second design, {SECOND.name}, moves forward; {pipe} mm pipe"
        yield row(PROTOTYPES, claim, f"above {MILLI * LEAST:g} mm", moves, behind[1:])
        stuck = at_most_share(first, second, STUCK)
        claim = f"the first design, {FIRST.name}, does not move forward; {pipe} mm pipe"
        reference = f"below {100 * STUCK:g} % of the second's displacement"
        yield row(PROTOTYPES, claim, reference, stuck, behind)
    pipe = 36
    slow, fast = (speed(outcomes, pipe, design) for design in (THIRD, SECOND))
    behind = [outcomes[label(pipe, design)] for design in (THIRD, SECOND)]
    claim = f"the third design, {THIRD.name}, is slower than the second; {pipe} mm pipe"
    yield row(PROTOTYPES, claim, "slower", more_than(fast, slow, "mm/s"), behind)
    forward = above(slow, 0.0, "mm/s")
    claim = f"the third design, {THIRD.name}, moves forward; {pipe} mm pipe"
    yield row(PROTOTYPES, claim, "above 0 mm/s", forward, behind[:1])
    if points is not None:
        computed = [
            measured(outcomes, pipe, number)
            for pipe, number in zip(points["pipe_mm"], points["prototype"], strict=True)
        ]
        finding = deviation(np.array(computed), points["speed_mm_s"], points["spread"], "mm/s")
        yield row(PROTOTYPES, "Table 3.2: speed", "digitised points", finding, outcomes.values())


def measured(outcomes: Outcomes, pipe: float, number: float) -> float:
    """Speed [mm/s] of a digitised point; NaN where there is none."""
    designs = PIPES.get(int(pipe), ())
    known = {float(place): design for place, design in enumerate(designs, 1)}
    return speed(outcomes, int(pipe), known[number]) if number in known else NAN


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Mean speed, a bar a design, a panel a pipe."""
    with drawing(path, 2.6) as figure:
        panels = figure.subplots(1, len(PIPES), sharey=True, width_ratios=(2, 3))
        for axes, (pipe, designs) in zip(panels, PIPES.items(), strict=True):
            places = np.arange(1, len(designs) + 1)
            found = [speed(outcomes, pipe, design) for design in designs]
            axes.axhline(0.0, color=QUIET, linewidth=0.7)
            axes.bar(places, np.nan_to_num(found), width=0.5, color=COLOURS[: len(designs)])
            for place, value in zip(places, found, strict=True):
                axes.annotate(
                    shown(value, "mm/s"), (place, np.nan_to_num(max(value, 0.0))), xytext=(0, 2),
                    textcoords="offset points", ha="center", fontsize=8,
                )  # fmt: skip
            if points is not None:
                at = points["pipe_mm"] == pipe
                axes.errorbar(
                    points["prototype"][at], points["speed_mm_s"][at], points["spread"][at],
                    color=INK, marker="s", linestyle="none", label="measured",
                )  # fmt: skip
                if at.any():
                    axes.legend()
            axes.set_xticks(places, [design.name for design in designs])
            axes.set_title(f"{pipe} mm pipe")
        panels[0].set_ylabel("mean speed of a cycle [mm/s]")


SCRIPT = Script(
    name=NAME,
    figure="Table 3.2",
    about=(
        "Three patterns of spikes, around x rows, one cycle of Mode 3 at 192 Hz: the first two in "
        "the 30 mm pipe, all three in the 36 mm pipe, since the third is 31 mm wide. Claims: the "
        "first does not move, the second does, the third moves, but slower. The thesis gives "
        "neither their pipes nor their masses: the first has the second one's frame, that of the "
        "third is scaled by the volume of the body. The pressures are those of the pipe for all."
    ),
    cases=cases,
    quick=(label(36, SECOND),),
    rows=rows,
    draw=draw,
    columns=("pipe_mm", "prototype", "speed_mm_s"),
)

if __name__ == "__main__":
    command([SCRIPT])
