"""Leafbot's analytical model (5.1, 5.2) against the thesis's statements, beside finite elements.

Three sets of constants of the chain: Table B as it is, and two in which the motor's mass and the
wave's tension are fitted on the three speeds that the first rows hold against them; that they agree
there is no confirmation. Slopes at 142 Hz. The plane section by finite elements is that of
`leafbot`; nothing is fitted in it.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from softsim.apps.chain.running import ChainSource
from softsim.report.style import BLUE, GREEN, INK, ORANGE, PURPLE, QUIET, drawing
from softsim.study.cases import Source
from validation.cases import SCENES, Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points
from validation.leafbot import (
    FREQUENCIES,
    HIGHEST,
    SETTLING,
    SPEEDS,
    SPREAD,
    STEEP,
    climbing,
    label,
    rise,
    settling,
    walking,
)
from validation.leafbot import speed as speed_of_elements
from validation.motion import MILLI, NAN
from validation.script import Listing, Script
from validation.statements import FLAT_SLOPE, NODES, SPEED
from validation.verdicts import (
    EQUATIONS,
    TRIAL,
    Row,
    all_between,
    below,
    judged,
    rises,
    row,
    shown,
    shown_list,
    within,
)

NAME = "leafbot_chain"
ROWS, MIDDLE = 5, 142  # of limbs; Hz, at which it goes up slopes
CHAINS = {"table": BLUE, "swing": ORANGE, "drag": GREEN}
"""Scenes `leafbot5_NAME` -> colour. The first one has the constants of the thesis, Table B."""
ELEMENTS = "finite elements"
SLOPES = (10, 20, 25, 30)  # deg
JUMPS = 0.05, 0.95  # share of the time on the ground of a node that jumps
NEAR_ZERO = 0.05  # least over mean speed of a head that stands between its steps
SAME = 2.0  # Hz, between a dominant frequency and the motor's


@dataclass(frozen=True)
class ChainCase(Case):
    """A chain's file under `scenes/`."""

    @property
    def source(self) -> Source:
        """The file."""
        return ChainSource(SCENES / self.scene)


def level(chain: str, frequency: int) -> ChainCase:
    """On the flat at a frequency [Hz]."""
    overrides = (f"motor.frequency={frequency} Hz", "motor.further={}")
    return ChainCase(f"{chain}, {frequency} Hz", f"chains/leafbot5_{chain}.yaml", overrides)


def uphill(chain: str, slope: int) -> ChainCase:
    """Up a slope [deg] at MIDDLE."""
    flat = level(chain, MIDDLE)
    return ChainCase(f"{chain}, {slope} deg", flat.scene, (*flat.overrides, f"slope={slope} deg"))


def cases() -> list[Case]:
    """Chains and finite elements, on the flat and up slopes."""
    chains: list[Case] = [level(chain, f) for chain in CHAINS for f in FREQUENCIES[ROWS]]
    chains += [uphill(chain, slope) for chain in CHAINS for slope in SLOPES]
    elements = [walking(ROWS, f) for f in FREQUENCIES[ROWS]]
    return [*chains, *elements, *(climbing(slope) for slope in SLOPES)]


def speed(outcome: Outcome) -> float:
    """Of the head of a chain, in the second half [mm/s]."""
    return MILLI * outcome.number("speed")


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """The claims of each chain."""
    for chain in CHAINS:
        yield from of_chain(chain, rows_of(chain, outcomes))


def of_chain(chain: str, rows: Iterable[Row]) -> Iterator[Row]:
    """Yield the rows with their model: only the first chain has the constants of the thesis."""
    for one in rows:
        yield one if chain == next(iter(CHAINS)) else replace(one, model=TRIAL)


def rows_of(chain: str, outcomes: Outcomes) -> Iterator[Row]:
    """Speeds; how they grow and settle; which nodes jump, how high and how fast; slopes."""
    flat = [outcomes[level(chain, f).name] for f in FREQUENCIES[ROWS]]
    middle = flat[FREQUENCIES[ROWS].index(MIDDLE)]
    for f, wanted, outcome in zip(FREQUENCIES[ROWS], SPEEDS, flat, strict=True):
        found = within(speed(outcome), wanted, SPREAD, "mm/s")
        reference = f"{wanted:g} mm/s within {100 * SPREAD:g} %"
        yield row(SPEED, f"{chain}: speed at {f} Hz", reference, found, [outcome])
    grows = rises([speed(outcome) for outcome in flat], "mm/s")
    yield row(SPEED, f"{chain}: faster the faster the motor", "rises", grows, flat)
    settled = all_between([outcome.number("settling_time") for outcome in flat], *SETTLING, "s")
    claim = f"{chain}: speed is reached in about 1 s"
    yield row(SPEED, claim, f"{SETTLING[0]:g} to {SETTLING[1]:g} s", settled, flat)
    off = [farthest(outcome, f) for f, outcome in zip(FREQUENCIES[ROWS], flat, strict=True)]
    found = below(max(off), SAME, "Hz off")
    yield row(
        NODES, f"{chain}: every node shakes as the motor turns", f"within {SAME:g} Hz", found, flat
    )
    shares = middle.numbers("contact_shares")
    found = all_between(shares.tolist() or [NAN], *JUMPS)
    reference = f"on the ground {JUMPS[0]:g} to {JUMPS[1]:g} of the time"
    yield row(NODES, f"{chain}: all nodes jump at {MIDDLE} Hz", reference, found, [middle])
    depth = MILLI * middle.number("head_depth")
    found = judged(depth > 0.0, shown(-depth, "mm"), depth)
    yield row(NODES, f"{chain}: the head comes below 0", "below", found, [middle])
    head = MILLI * max(outcome.number("head_height") for outcome in flat)
    found = below(head, HIGHEST, "mm")
    yield row(NODES, f"{chain}: the head rises little", f"below {HIGHEST:g} mm", found, flat)
    least, mean = MILLI * middle.number("least_speed"), speed(middle)
    found = judged(
        abs(least) <= NEAR_ZERO * abs(mean), f"{shown(least)} of {shown(mean, 'mm/s')}", least, mean
    )
    reference = f"within {100 * NEAR_ZERO:g} % of 0"
    yield row(NODES, f"{chain}: the head stands between steps", reference, found, [middle])
    steep = outcomes[uphill(chain, STEEP).name]
    found = judged(speed(steep) <= 0.0, shown(speed(steep), "mm/s"), speed(steep))
    claim = f"{chain}: does not climb {STEEP} deg"
    yield row(FLAT_SLOPE, claim, "0 mm/s or less", found, [steep])


def farthest(outcome: Outcome, frequency: float) -> float:
    """Of the nodes' dominant frequencies from another one [Hz]."""
    found = outcome.numbers("dominant_frequencies")
    return float(np.abs(found - frequency).max()) if len(found) else NAN


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """Both models side by side."""
    models = [*CHAINS, ELEMENTS]
    over_frequency = {model: speeds(outcomes, model) for model in models}
    over_slope = {model: speeds_uphill(outcomes, model) for model in models}
    yield table("Speed [mm/s] over frequency", FREQUENCIES[ROWS], "Hz", over_frequency)
    yield table(f"Speed [mm/s] over the slope, {MIDDLE} Hz", (0, *SLOPES), "deg", over_slope)
    headings = ("model", "head rises [mm]", "settles [s]", "on the ground, head to rear [%]")
    yield Listing(
        f"At {MIDDLE} Hz", headings, tuple((model, *gait(outcomes, model)) for model in models)
    )


def table(title: str, places: tuple[int, ...], unit: str, found: dict[str, list[float]]) -> Listing:
    """A row a model."""
    headings = ("model", *(f"{place} {unit}" for place in places))
    return Listing(title, headings, tuple((m, *map(shown, values)) for m, values in found.items()))


def speeds(outcomes: Outcomes, model: str) -> list[float]:
    """At each frequency [mm/s]."""
    if model == ELEMENTS:
        return [speed_of_elements(outcomes[label(ROWS, f)]) for f in FREQUENCIES[ROWS]]
    return [speed(outcomes[level(model, f).name]) for f in FREQUENCIES[ROWS]]


def speeds_uphill(outcomes: Outcomes, model: str) -> list[float]:
    """On the flat and at each of SLOPES [mm/s], at MIDDLE."""
    flat = speeds(outcomes, model)[FREQUENCIES[ROWS].index(MIDDLE)]
    if model == ELEMENTS:
        return [flat, *(speed_of_elements(outcomes[climbing(s).name]) for s in SLOPES)]
    return [flat, *(speed(outcomes[uphill(model, s).name]) for s in SLOPES)]


def gait(outcomes: Outcomes, model: str) -> tuple[str, str, str]:
    """How far the head rises, when the speed is there, how long each node or row is on the ground,
    in texts.
    """
    if model == ELEMENTS:
        outcome = outcomes[label(ROWS, MIDDLE)]
        return (
            shown(rise(outcome)),
            shown(settling(outcome, MIDDLE)),
            shares(outcome, "row_contact_shares"),
        )
    outcome = outcomes[level(model, MIDDLE).name]
    height, settled = MILLI * outcome.number("head_height"), outcome.number("settling_time")
    return shown(height), shown(settled), shares(outcome, "contact_shares")


def shares(outcome: Outcome, name: str) -> str:
    """Shares of the time in %, in a text."""
    return shown_list((100.0 * outcome.numbers(name)).round().tolist())


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Speed over frequency and over the slope, of chains and finite elements."""
    with drawing(path, 3.2) as figure:
        left, right = figure.subplots(1, 2, sharey=True)
        for model, colour in (*CHAINS.items(), (ELEMENTS, PURPLE)):
            left.plot(FREQUENCIES[ROWS], speeds(outcomes, model), color=colour, marker="o",
                      label=model)  # fmt: skip
            right.plot((0, *SLOPES), speeds_uphill(outcomes, model), color=colour, marker="o")
        left.plot(FREQUENCIES[ROWS], SPEEDS, color=INK, marker="s", linestyle="none",
                  label="thesis")  # fmt: skip
        right.axvline(STEEP, color=QUIET, linewidth=0.8, linestyle="--")
        for axes in (left, right):
            axes.axhline(0.0, color=QUIET, linewidth=0.7)
        left.set(xlabel="frequency of the motor [Hz]", ylabel="speed [mm/s]")
        right.set(xlabel="slope [deg]", title=f"{MIDDLE} Hz")
        figure.legend(*left.get_legend_handles_labels(), loc="outside upper center", ncols=5)


SCRIPT = Script(
    name=NAME,
    model=EQUATIONS,
    figure="Leafbot's analytical model: 5.1, 5.2",
    about=(
        "Leafbot with five rows as a chain of masses on springs: Table B's constants as they are, "
        "and two sets (swing, drag) of which motor and wave are fitted on the three speeds, where "
        "agreement means nothing. Beside it the plane section by finite elements, in which nothing "
        "is fitted."
    ),
    cases=cases,
    quick=tuple(level(chain, MIDDLE).name for chain in CHAINS),
    rows=rows,
    draw=draw,
    listings=listings,
)

if __name__ == "__main__":
    command([SCRIPT])
