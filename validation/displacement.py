"""Fig 6.5 of the thesis: displacement in Mode 3, in three pipes at four frequencies, two cycles.

The air is let out, which the thesis does not describe further. Its average rate must lie between
1.3 kPa/s, at which a controlled deflation brings the farthest, and 6 kPa/s, at which nothing moves:
4.5 kPa/s down to 11 kPa lies between the two. The time constant is the same
in all pipes.

The pressure falls on below every P_M3^S, so that there is room to see motion end. The displacement
of a cycle is that down to P_M3^S of the pipe: there the thesis's robot has stopped.
Digitised points: pipe_mm, frequency_Hz, displacement_mm (of one cycle).
"""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from softsim.report.style import BLUE, GREEN, INK, ORANGE, PURPLE, QUIET, drawing
from validation.air import natural_deflation
from validation.cases import THINNED, Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points, deviation
from validation.motion import LEAST, MILLI, NAN, Fall, falls
from validation.script import Script
from validation.statements import FALLING, FREQUENCY, NATURAL, STANDSTILL, STOP, Statement
from validation.thesis import (
    BEST_FREQUENCY,
    FREQUENCIES,
    HIGHEST,
    LOWEST,
    LOWEST_SPREAD,
    PIPES,
)
from validation.verdicts import (
    Finding,
    Row,
    at_most_share,
    below,
    more_than,
    rises,
    row,
    within,
)

NAME = "displacement"
RATE = 4.5  # kPa/s, average from HIGHEST to P_M3^S of the 36 mm pipe
TIME_CONSTANT = (HIGHEST - LOWEST[36]) / RATE / math.log(HIGHEST / LOWEST[36])  # s
END = 7.0  # kPa, a fifth below the smallest P_M3^S
CYCLES = 2
STILL = 0.1  # share of a fall's displacement that counts as standing still
HARDLY = 0.1  # share of the displacement at 192 Hz that counts as barely moving
ROOM = (
    0.15  # share of the pressure's fall before 5 % of the way; of a steady motion it would be 5 %
)
COLOURS = dict(zip(FREQUENCIES, (PURPLE, GREEN, ORANGE, BLUE), strict=True))


def label(pipe: int, frequency: int) -> str:
    """The name of a case."""
    return f"{pipe} mm, {frequency} Hz"


def cases() -> list[Case]:
    """One a pipe and frequency."""
    air = natural_deflation(round(TIME_CONSTANT, 3), END, CYCLES)
    return [
        Case(
            label(pipe, f), f"pfr_{pipe}mm.yaml", (*air, f"loads.motor.frequency={f} Hz", *THINNED)
        )
        for pipe in PIPES
        for f in FREQUENCIES
    ]


def displacements(outcomes: Outcomes, pipe: int) -> np.ndarray:
    """Of one cycle, down to P_M3^S, at each of FREQUENCIES [mm]."""
    histories = (outcomes[label(pipe, f)].history for f in FREQUENCIES)
    return np.array([MILLI * _displacement(falls(history), pipe) for history in histories])


def _displacement(cycles: list[Fall], pipe: int) -> float:
    """Mean over the cycles [m]; NaN where there is none."""
    found = [fall.displacement_above(1e3 * LOWEST[pipe]) for fall in cycles]
    return float(np.mean(found)) if found else NAN


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Standstill, onset and end; growth with frequency; more in the larger pipes."""
    found = {pipe: displacements(outcomes, pipe) for pipe in PIPES}
    for pipe in PIPES:
        outcome = outcomes[label(pipe, BEST_FREQUENCY)]
        for statement, claim, reference, finding in motion_findings(outcome, pipe):
            where = f"{pipe} mm pipe, {BEST_FREQUENCY} Hz"
            yield row(statement, f"{claim}; {where}", reference, finding, [outcome])
    for pipe in PIPES:
        behind = [outcomes[label(pipe, f)] for f in FREQUENCIES]
        growth = rises(found[pipe], "mm", resolution=MILLI * LEAST)
        claim = f"farther at {', '.join(map(str, FREQUENCIES))} Hz; {pipe} mm pipe"
        reference = f"rises; below {MILLI * LEAST:g} mm is recoil, no motion"
        yield row(FREQUENCY, claim, reference, growth, behind)
        hardly = at_most_share(float(found[pipe][0]), float(found[pipe][-1]), HARDLY)
        claim = f"64 Hz barely moves; {pipe} mm pipe"
        yield row(FREQUENCY, claim, f"below {100 * HARDLY:g} % of 192 Hz", hardly, behind)
    for pipe in (36, 41):
        more = more_than(float(found[pipe][-1]), float(found[30][-1]), "mm")
        behind = [outcomes[label(p, BEST_FREQUENCY)] for p in (30, pipe)]
        claim = f"the {pipe} mm pipe gives more than the 30 mm pipe at 192 Hz"
        yield row(NATURAL, claim, "more", more, behind)
    if points is not None:
        computed = [
            found[int(pipe)][FREQUENCIES.index(int(f))] if _is_known(pipe, f) else NAN
            for pipe, f in zip(points["pipe_mm"], points["frequency_Hz"], strict=True)
        ]
        there, spread = points["displacement_mm"], points["spread"]
        finding = deviation(np.array(computed), there, spread, "mm")
        claim = "Fig 6.5: displacement of a cycle"
        yield row(FREQUENCY, claim, "digitised points", finding, outcomes.values())


def _is_known(pipe: float, frequency: float) -> bool:
    return pipe in PIPES and frequency in FREQUENCIES


def motion_findings(outcome: Outcome, pipe: int) -> Iterator[tuple[Statement, str, str, Finding]]:
    """Yield statement, claim, reference and finding: where motion begins and ends in the last cycle
    of a run in a pipe [mm].
    """
    cycles = falls(outcome.history)
    last = cycles[-1] if cycles else None
    displacement = last.displacement if last else NAN
    still = at_most_share(last.standstill if last else NAN, displacement, STILL)
    reference = f"below {100 * STILL:g} % of the fall's displacement"
    yield STANDSTILL, "stands still above P_M3^B", reference, still
    onset = 1e-3 * last.onset_pressure if last else NAN
    limit = HIGHEST - ROOM * (HIGHEST - END)
    claim = "P_M3^B lies below the highest pressure"
    yield STANDSTILL, claim, f"below {limit:.3g} kPa", below(onset, limit, "kPa")
    elsewhere = at_most_share(last.before if last else NAN, displacement, STILL)
    yield FALLING, "moves while the pressure falls, not while it rises", reference, elsewhere
    end = 1e-3 * last.end_pressure if last else NAN
    stop = within(end, LOWEST[pipe], LOWEST_SPREAD, "kPa")
    reference = f"{LOWEST[pipe]:g} kPa within {100 * LOWEST_SPREAD:g} %"
    yield STOP, "motion stops at P_M3^S", reference, stop


def remarks(outcomes: Outcomes) -> Iterator[str]:
    """What happens below P_M3^S, where the thesis's robot has stopped."""
    beyond = {}
    for pipe in PIPES:
        for f in FREQUENCIES:
            cycles = falls(outcomes[label(pipe, f)].history)
            if cycles:
                fall = cycles[-1]
                on = fall.displacement - fall.displacement_above(1e3 * LOWEST[pipe])
                beyond[label(pipe, f)] = f"{MILLI * on:.1f} mm"
    if beyond:
        yield (
            f"Displacement from P_M3^S of the pipe down to {END:g} kPa, where the thesis's robot "
            "has lost the wall and stands: "
            + "; ".join(f"{name}: {text}" for name, text in beyond.items())
            + ". It is not part of the displacements above."
        )


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Position and pressure over time, a column a pipe, as the thesis's figure."""
    with drawing(path, 4.0) as figure:
        upper, lower = figure.subplots(2, 3, sharex=True, sharey="row", height_ratios=(3, 1))
        for column, pipe in enumerate(PIPES):
            for f in FREQUENCIES:
                history = outcomes[label(pipe, f)].history
                if history:
                    x = MILLI * (history["frame_x"] - history["frame_x"][0])
                    upper[column].plot(history["time"], x, color=COLOURS[f], label=f"{f} Hz")
                    lower[column].plot(history["time"], 1e-3 * history["pressure"], color=INK)
            lower[column].axhline(LOWEST[pipe], color=QUIET, linewidth=0.8, linestyle="--")
            upper[column].set_title(f"{pipe} mm pipe")
            lower[column].set_xlabel("time [s]")
        lower[0].annotate(
            "P_M3^S", (0.12, LOWEST[PIPES[0]]), xycoords=("axes fraction", "data"), xytext=(0, -2),
            textcoords="offset points", va="top", fontsize=8, color=QUIET,
        )  # fmt: skip
        if points is not None:
            _draw_points(upper, points)
        upper[0].set_ylabel("displacement [mm]")
        lower[0].set_ylabel("pressure [kPa]")
        for axes in upper:
            if axes.get_legend_handles_labels()[1]:
                axes.legend()
                break


def _draw_points(panels: np.ndarray, points: Points) -> None:
    """Two cycles of the digitised displacement, as a line at the height it reaches."""
    for pipe, f, x in zip(
        points["pipe_mm"], points["frequency_Hz"], points["displacement_mm"], strict=True
    ):
        if _is_known(pipe, f):
            axes = panels[PIPES.index(int(pipe))]
            axes.axhline(CYCLES * x, color=COLOURS[int(f)], linewidth=0.8, linestyle=":")


SCRIPT = Script(
    name=NAME,
    figure="Fig 6.5",
    about=(
        "Mode 3 with natural deflation from 23 kPa, two cycles, in three pipes at four "
        "frequencies. Claims: it stands still above P_M3^B, moves while the pressure falls, stops "
        "at P_M3^S; down to there farther at higher frequency, barely at 64 Hz, farther in the 36 "
        f"and 41 mm pipes. Time constant {TIME_CONSTANT:.2f} s, an average of {RATE:g} kPa/s down "
        "to 11 kPa, between the best rate and the one that stops it; the same in all pipes. The "
        "thesis explains the larger displacement in larger pipes by a slower fall there, of which "
        "it gives no numbers."
    ),
    cases=cases,
    rows=rows,
    draw=draw,
    columns=("pipe_mm", "frequency_Hz", "displacement_mm"),
    remarks=remarks,
)

if __name__ == "__main__":
    command([SCRIPT])
