"""Fig 6.6 A to C of the thesis: displacement of one cycle over the average deflation rate Df_r^a.

Mode 3 at 192 Hz and 23 kPa, down to P_M3^S of the pipe, one cycle; the displacement is that while
the pressure falls. The thesis does not say which rates it tried. Digitised points: pipe_mm,
rate_kPa_s, displacement_mm.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from softsim.report.style import INK, QUIET, drawing
from validation.air import deflation
from validation.cases import THINNED, Case, Outcomes
from validation.command import command
from validation.digitised import Points, deviation
from validation.motion import MILLI, displacement_while_falling
from validation.pipes import LOOKS
from validation.script import Script
from validation.statements import RATE, RATE_LIMIT, RATE_PIPE
from validation.thesis import BEST_RATE, LOWEST, PIPES, STOP_RATE
from validation.verdicts import Row, at_most_share, falls, highest_at, row

NAME = "deflation_rate"
RATES = (0.5, BEST_RATE, 3.0, STOP_RATE, 10.0)  # kPa/s
ABOUT_BEST = (BEST_RATE,)
AT_BEST = RATES.index(BEST_RATE)
BEYOND_BEST = RATES[AT_BEST:]
NOTHING = 0.05  # share of the displacement at BEST_RATE that counts as nothing


def label(pipe: int, rate: float) -> str:
    """The name of a case."""
    return f"{pipe} mm, {rate:g} kPa/s"


def case(pipe: int, rate: float) -> Case:
    """One cycle in a pipe [mm] at a deflation rate [kPa/s]."""
    overrides = (*deflation(rate, LOWEST[pipe]), *THINNED)
    return Case(label(pipe, rate), f"pfr_{pipe}mm.yaml", overrides)


def cases() -> list[Case]:
    """One a pipe and rate."""
    return [case(pipe, rate) for pipe in PIPES for rate in RATES]


def displacements(outcomes: Outcomes, pipe: int) -> np.ndarray:
    """While the pressure falls, at each of RATES [mm]."""
    histories = (outcomes[label(pipe, rate)].history for rate in RATES)
    return np.array([MILLI * displacement_while_falling(history) for history in histories])


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Best about 1.3 kPa/s, falling beyond, nothing above 6; at 1.3 most in the 30 mm pipe."""
    names = [f"{rate:g} kPa/s" for rate in RATES]
    wanted = [f"{rate:g} kPa/s" for rate in ABOUT_BEST]
    found = {pipe: displacements(outcomes, pipe) for pipe in PIPES}
    for pipe in PIPES:
        behind = [outcomes[label(pipe, rate)] for rate in RATES]
        best = highest_at(names, found[pipe], wanted, "mm")
        claim = f"farthest a cycle at about {BEST_RATE:g} kPa/s; {pipe} mm pipe"
        yield row(RATE, claim, f"at {_rates(ABOUT_BEST)}", best, behind)
        beyond = falls(found[pipe][-len(BEYOND_BEST) :], "mm")
        claim = f"less the faster it deflates, {_rates(BEYOND_BEST)}; {pipe} mm pipe"
        yield row(RATE_LIMIT, claim, "falls", beyond, behind)
        last, at_best = float(found[pipe][-1]), float(found[pipe][AT_BEST])
        nothing = at_most_share(last, at_best, NOTHING)
        claim = f"nothing above about {STOP_RATE:g} kPa/s, at 10; {pipe} mm pipe"
        reference = f"below {100 * NOTHING:g} % of that at {BEST_RATE:g} kPa/s"
        yield row(RATE_LIMIT, claim, reference, nothing, behind)
    order = highest_at(
        [f"{pipe} mm" for pipe in PIPES], [found[pipe][AT_BEST] for pipe in PIPES], ["30 mm"], "mm"
    )
    behind = [outcomes[label(pipe, BEST_RATE)] for pipe in PIPES]
    claim = f"the 30 mm pipe gives the most at {BEST_RATE:g} kPa/s"
    yield row(RATE_PIPE, claim, "30 mm", order, behind)
    if points is not None:
        finding = deviation(_at(found, points), points["displacement_mm"], points["spread"], "mm")
        claim = "Fig 6.6: displacement over rate"
        yield row(RATE_LIMIT, claim, "digitised points", finding, outcomes.values())


def _rates(rates: tuple[float, ...]) -> str:
    return ", ".join(f"{rate:g}" for rate in rates) + " kPa/s"


def _at(found: dict[int, np.ndarray], points: Points) -> np.ndarray:
    """Computed displacement [mm] at each digitised point, NaN between unknown rates or pipes."""
    nothing = np.full(len(RATES), np.nan)
    return np.array(
        [
            np.interp(rate, RATES, found.get(int(pipe), nothing), left=np.nan, right=np.nan)
            for pipe, rate in zip(points["pipe_mm"], points["rate_kPa_s"], strict=True)
        ]
    )


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Displacement over rate, a curve a pipe."""
    with drawing(path, 3.2) as figure:
        axes = figure.subplots()
        axes.axhline(0.0, color=QUIET, linewidth=0.7)
        axes.axvline(BEST_RATE, color=QUIET, linewidth=0.8, linestyle="--", label="thesis: best")
        axes.axvline(STOP_RATE, color=QUIET, linewidth=0.8, linestyle=":", label="thesis: stops")
        for pipe, look in LOOKS.items():
            axes.plot(RATES, displacements(outcomes, pipe), label=f"{pipe} mm pipe", **look)
        if points is not None:
            for pipe, look in LOOKS.items():
                at = points["pipe_mm"] == pipe
                axes.errorbar(
                    points["rate_kPa_s"][at], points["displacement_mm"][at], points["spread"][at],
                    linestyle="none", marker=look["marker"], mfc="none", color=look["color"],
                    ecolor=INK, label=f"thesis, digitised, {pipe} mm",
                )  # fmt: skip
        axes.set_xscale("log")
        axes.set_xticks(RATES, [f"{rate:g}" for rate in RATES])
        axes.minorticks_off()
        axes.set(
            xlabel="average deflation rate Df_r^a [kPa/s]",
            ylabel="displacement while the pressure falls [mm]",
        )
        axes.legend()


SCRIPT = Script(
    name=NAME,
    figure="Fig 6.6 A to C",
    about=(
        "Mode 3 at 192 Hz and 23 kPa, one cycle down to P_M3^S of the pipe: displacement while the "
        "pressure falls, over the average deflation rate. Claims: farthest at about 1.3 kPa/s, "
        "less the faster, nothing above about 6; at 1.3 most in the 30 mm pipe. The thesis does "
        "not say which rates it tried."
    ),
    cases=cases,
    quick=(label(36, BEST_RATE), label(36, 10.0)),
    rows=rows,
    draw=draw,
    columns=("pipe_mm", "rate_kPa_s", "displacement_mm"),
)

if __name__ == "__main__":
    command([SCRIPT])
