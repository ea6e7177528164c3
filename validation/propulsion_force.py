"""Fig 4.11 of the thesis: the robot's pull on a force gauge, 36 cases.

Three pipes, four frequencies, three highest pressures; a tendon holds the robot back while it is
inflated and the air is let out down to P_M3^S of the pipe (4.2.4). How long that takes decides how
far a free robot walks, but a held one stands: its pull follows the pressure. So the fall is quick,
0.7 to 1.6 s, which is 45 periods of the slowest vibration at least. The robot is meshed close above
the bottom, where it settles before the start.

A plane section has the vertical stiffness of the ring of spikes, sum(cos^2) = half of their number.
Along the axis all of them push: the robot's pull is twice the section's.

Digitised points: pipe_mm, frequency_Hz, highest_kPa, peak_N (of the robot).
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from softsim.report.style import INK, QUIET, WALL, drawing
from validation.air import HOLD, INFLATION_RATE, natural_deflation
from validation.cases import Case, Outcomes
from validation.command import command
from validation.digitised import Points, deviation
from validation.displacement import COLOURS
from validation.motion import NAN
from validation.pull import Pull, pull_of
from validation.script import Script
from validation.statements import PULL, PULL_NOISE, PULL_PIPE, PULL_PRESSURE
from validation.thesis import (
    BEST_FREQUENCY,
    FREQUENCIES,
    HIGHEST,
    HIGHESTS,
    LOWEST,
    PIPES,
    RING,
    WEIGHT,
)
from validation.verdicts import (
    Finding,
    Row,
    all_between,
    highest_at,
    more_than,
    rises,
    row,
    shown,
    within,
)

NAME = "propulsion_force"
WEIGHTS = (20.0, 35.0)  # times the weight, the largest pull (4.2.4)
TIME_CONSTANT = 1.5  # s
TENDON = 3.5  # N/mm: 10 g on it swing at 94 Hz, halfway between 64 and 137 Hz
WIDTH = 27.0  # mm, of the robot across its spikes, OD_S
CLEARANCE = 0.05  # mm below it at the start
LOOK = 0.6  # s, within the rest at every highest pressure
OUTPUT = ("output.history_interval=2 ms", f"output.frame_interval={LOOK} s")
NOISY = 0.02  # share of the largest pull: scatter from which on the force counts as noisy
NOISIER = 2.0  # times the scatter while inflating: the same
ALIKE = 0.15  # share by which "no significant difference" may differ
ALL = tuple((pipe, f, highest) for pipe in PIPES for f in FREQUENCIES for highest in HIGHESTS)


def label(pipe: int, frequency: int, highest: float) -> str:
    """The name of a case."""
    return f"{pipe} mm, {frequency} Hz, {highest:g} kPa"


def case(pipe: int, frequency: int, highest: float) -> Case:
    """A held robot in a pipe [mm] at a frequency [Hz], inflated to `highest` [kPa]."""
    height = 0.5 * (pipe - WIDTH) - CLEARANCE
    overrides = (
        f"environment.walls.pipe.axis_height={height:.6g} mm",
        f"loads.gauge={{kind: tendon, acts_on: frame, stiffness: {TENDON} N/mm}}",
        f"loads.motor.frequency={frequency} Hz",
        *natural_deflation(TIME_CONSTANT, LOWEST[pipe], 1, highest),
        *OUTPUT,
    )
    return Case(label(pipe, frequency, highest), f"pfr_{pipe}mm.yaml", overrides)


def cases() -> list[Case]:
    """One a pipe, frequency and pressure."""
    return [case(*condition) for condition in ALL]


def peak(outcomes: Outcomes, pipe: int, frequency: int, highest: float) -> float:
    """The robot's largest pull [N]; NaN where the case has none."""
    pull = pull_of(outcomes[label(pipe, frequency, highest)].history)
    return RING * pull.peak if pull else NAN


def peaks(outcomes: Outcomes, pipe: int) -> np.ndarray:
    """The same at each of FREQUENCIES and HIGHESTS (4, 3)."""
    return np.array([[peak(outcomes, pipe, f, p) for p in HIGHESTS] for f in FREQUENCIES])


def pulls(outcomes: Outcomes, pipe: int, highest: float) -> list[Pull | None]:
    """At each of FREQUENCIES."""
    return [pull_of(outcomes[label(pipe, f, highest)].history) for f in FREQUENCIES]


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """How large, how noisy, and what pipe, frequency and pressure make of it."""
    found = {pipe: peaks(outcomes, pipe) for pipe in PIPES}
    for pipe in PIPES:
        behind = [outcomes[label(pipe, f, p)] for f in FREQUENCIES for p in HIGHESTS]
        claim = f"largest pull of all 12 cases; {pipe} mm pipe"
        reference = (
            f"{WEIGHTS[0]:g} to {WEIGHTS[1]:g} times the weight, "
            f"{WEIGHTS[0] * WEIGHT:.2f} to {WEIGHTS[1] * WEIGHT:.2f} N"
        )
        yield row(PULL, claim, reference, in_weights(found[pipe]), behind)
    means = [found[pipe].mean() for pipe in PIPES]
    most = highest_at([f"{pipe} mm" for pipe in PIPES], means, ["30 mm"], "N")
    claim = "pulls most in the 30 mm pipe, mean of the 12 largest pulls"
    yield row(PULL_PIPE, claim, "30 mm", most, outcomes.values())
    for pipe in PIPES:
        yield from noise_rows(outcomes, pipe)
    for pipe in PIPES:
        yield from pressure_rows(outcomes, pipe, found[pipe])
    if points is not None:
        computed = [
            peak(outcomes, int(pipe), int(f), p) if (pipe, f, p) in ALL else NAN
            for pipe, f, p in zip(
                points["pipe_mm"], points["frequency_Hz"], points["highest_kPa"], strict=True
            )
        ]
        finding = deviation(np.array(computed), points["peak_N"], points["spread"], "N")
        yield row(PULL, "Fig 4.11: largest pull", "digitised points", finding, outcomes.values())


def in_weights(found: np.ndarray) -> Finding:
    """Every pull (cases) [N] lies within WEIGHTS; a known one that does not disagrees."""
    finding = all_between(found.ravel() / WEIGHT, *WEIGHTS)
    known = found[np.isfinite(found)]
    if not len(known):
        return finding
    low, high = known.min(), known.max()
    text = (
        f"{low / WEIGHT:.3g} to {high / WEIGHT:.3g} times, {low:.3g} to {high:.3g} N "
        f"(section {low / RING:.3g} to {high / RING:.3g} N), {len(known)} of {found.size} cases"
    )
    return replace(finding, computed=text)


def noise_rows(outcomes: Outcomes, pipe: int) -> Iterator[Row]:
    """Smooth while inflating, noisy at the end of the deflation; how, over the frequency."""
    held = pulls(outcomes, pipe, HIGHEST)
    behind = [outcomes[label(pipe, f, HIGHEST)] for f in FREQUENCIES]
    where = f"{pipe} mm pipe, {HIGHEST:g} kPa"
    at_best, rests_on = held[-1], [behind[-1]]
    rising, early, late = (NAN, NAN, NAN) if at_best is None else thirds(at_best)
    least = NAN if at_best is None else 1e3 * RING * NOISY * at_best.peak
    noisier = more_than(late, max(NOISIER * rising, least), "mN")
    claim = f"noisy in the last third of the deflation, smooth while inflating; {where}, 192 Hz"
    reference = f"above {NOISIER:g} times the scatter, and {100 * NOISY:g} % of the largest pull"
    yield row(PULL_NOISE, claim, reference, noisier, rests_on)
    if pipe == PIPES[0]:
        claim = f"noisier in the last third of the deflation than in the first; {where}, 192 Hz"
        yield row(PULL_NOISE, claim, "more", more_than(late, early, "mN"), rests_on)
        return
    scatter = [NAN if pull is None else noise_falling(pull) for pull in held]
    claim = f"noisier the faster the motor while it deflates; {where}"
    yield row(PULL_NOISE, claim, "rises with frequency", rises(scatter, "mN"), behind)
    onset = [NAN if pull is None else 1e-3 * pull.noisy_from(NOISY * pull.peak) for pull in held]
    claim = f"noisy earlier, at higher pressure, the faster the motor; {where}"
    yield row(PULL_NOISE, claim, "rises with frequency", rises(onset, "kPa"), behind)


def thirds(pull: Pull) -> tuple[float, float, float]:
    """The robot's scatter [mN] while inflating, in the first and in the last third of the fall."""
    found = pull.scatter_inflating, pull.scatter_falling(0.0, 1 / 3), pull.scatter_falling(2 / 3, 1)
    inflating, first, last = (1e3 * RING * scatter for scatter in found)
    return inflating, first, last


def noise_falling(pull: Pull) -> float:
    """The robot's scatter over the whole fall [mN]."""
    return 1e3 * RING * pull.scatter_falling(0.0, 1.0)


def pressure_rows(outcomes: Outcomes, pipe: int, found: np.ndarray) -> Iterator[Row]:
    """23 kPa like 26 kPa: largest pull, and mean pull."""
    highs = HIGHESTS[-2:]
    behind = [outcomes[label(pipe, f, p)] for f in FREQUENCIES for p in highs]
    large = found[:, -2:].mean(axis=0)
    mean = np.array(
        [[outcomes[label(pipe, f, p)].number("mean_pull") for p in highs] for f in FREQUENCIES]
    ).mean(axis=0)
    for what, (low, high) in (("largest", large), ("mean", RING * mean)):
        told = f"{shown(high, 'N')} against {shown(low, 'N')}"
        alike = replace(within(high, low, ALIKE), computed=told)
        claim = f"{what} pull at 26 kPa like that at 23 kPa; {pipe} mm pipe, mean of 4 frequencies"
        yield row(PULL_PRESSURE, claim, f"equal within {100 * ALIKE:g} %", alike, behind)


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Pull and pressure over time, a row a pipe, a column a highest pressure."""
    with drawing(path, 6.0) as figure:
        panels = figure.subplots(len(PIPES), len(HIGHESTS), sharex=True, sharey=True)
        for axes, (pipe, highest) in zip(
            panels.flat, ((pipe, p) for pipe in PIPES for p in HIGHESTS), strict=True
        ):
            axes.axhspan(WEIGHTS[0] * WEIGHT, WEIGHTS[1] * WEIGHT, color=WALL, zorder=0,
                         label="thesis: largest pull")  # fmt: skip
            gauge = axes.twinx()
            gauge.set(ylim=(0.0, 30.0), yticks=(0.0, 10.0, 20.0, 30.0))
            last = highest == HIGHESTS[-1]
            gauge.tick_params(right=last, labelright=last, colors=QUIET)
            gauge.grid(visible=False)
            # The fastest, which swings most, lies behind.
            for f in reversed(FREQUENCIES):
                history = outcomes[label(pipe, f, highest)].history
                if history:
                    axes.plot(history["time"], RING * history["pull"], color=COLOURS[f],
                              linewidth=0.7, label=f"{f} Hz")  # fmt: skip
                    gauge.plot(history["time"], 1e-3 * history["pressure"], color=QUIET,
                               linewidth=0.8, linestyle="--")  # fmt: skip
            if points is not None:
                _draw_points(axes, points, pipe, highest)
            axes.set_title(f"{pipe} mm pipe, {highest:g} kPa")
            if last:
                gauge.set_ylabel("pressure [kPa]", color=QUIET)
        for axes in panels[:, 0]:
            axes.set_ylabel("pull [N]")
            axes.set_ylim(bottom=0.0)
        for axes in panels[-1]:
            axes.set_xlabel("time [s]")
        found = {
            name: handle
            for axes in panels.flat
            for handle, name in zip(*axes.get_legend_handles_labels(), strict=True)
        }
        figure.legend(found.values(), found.keys(), loc="outside lower center", ncols=len(found))


def _draw_points(axes: Axes, points: Points, pipe: int, highest: float) -> None:
    """Digitised largest pulls, at the time of the highest pressure."""
    at = (points["pipe_mm"] == pipe) & (points["highest_kPa"] == highest)
    time = highest / INFLATION_RATE + 0.5 * HOLD
    axes.errorbar(
        np.full(at.sum(), time), points["peak_N"][at], points["spread"][at], color=INK, marker="s",
        markersize=4, linestyle="none", label="thesis, digitised",
    )  # fmt: skip


SCRIPT = Script(
    name=NAME,
    figure="Fig 4.11",
    about=(
        "Pull of the robot, held by a tendon to a force gauge, while it is inflated and the air "
        "let out: three pipes, four frequencies, three highest pressures. The robot's pull is "
        "twice the section's, which has half of the spikes along the axis; both are told. A pull "
        "is a running mean over 50 ms, noise the scatter about it. Claims: 20 to 35 times the "
        "weight, most in the 30 mm pipe; smooth while inflating, noisy at the end of the "
        "deflation, in the 36 and 41 mm pipes earlier and more at higher frequency; 23 like "
        "26 kPa. The inflation takes half a second; the thesis gives no rate. Nor does it "
        f"describe its tendon: {TENDON:g} N/mm are taken, on which the "
        "robot swings between the two lowest frequencies of the motor."
    ),
    cases=cases,
    quick=(label(36, BEST_FREQUENCY, HIGHEST),),
    rows=rows,
    draw=draw,
    columns=("pipe_mm", "frequency_Hz", "highest_kPa", "peak_N"),
)

if __name__ == "__main__":
    command([SCRIPT])
