"""Leafbot-X5, two motors side by side, against the thesis's section 5.4 and Table 5.1.

Two chains with links across, with three sets of constants: Table B's, and the two that were fitted
on Leafbot5's speeds straight on (`leafbot_chain`). Nothing is fitted on how the robot turns. Its
width, masses and rows of limbs are missing in the thesis: a band lists what else they might be.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from softsim.report.style import INK, drawing
from validation.cases import Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points
from validation.leafbot_chain import CHAINS, ChainCase, of_chain
from validation.motion import MILLI
from validation.script import Listing, Script
from validation.statements import CURVATURE, TURNING
from validation.verdicts import (
    EQUATIONS,
    TRIAL,
    UNKNOWN,
    Finding,
    Row,
    judged,
    row,
    shown,
    shown_list,
    within,
)

NAME = "leafbot_x5"
PLACES = ("rear", "middle", "front")
FREQUENCIES = (95, 115, 150)  # Hz, at 3, 4, 5 V
SIDES = ("left", "right")  # of the motor that runs; the robot turns to the other
TABLE = {
    "rear": ((0.015, 0.009, 0.008), (0.015, 0.013, 0.004)),
    "middle": ((0.014, 0.015, 0.015), (0.014, 0.014, 0.017)),
    "front": ((0.018, 0.016, 0.015), (0.017, 0.010, 0.008)),
}
"""Table 5.1: |K_s| [1/mm] at each frequency, turning to the left (right motor), to the right."""

SPREAD = 0.3  # share within which a curvature agrees
STRAIGHT = 0.1  # share of the way that it may go sideways
WEAK, STRONG = FREQUENCIES[0], FREQUENCIES[-1]  # Hz, of motors that run at once

SCATTERED = "swing"  # the chain whose sides are made unlike
SCATTER, DRAWS = 0.05, 6
SHOWN = 0.045  # 1/mm, in the figure: a robot that hardly moves may turn on the spot
SHARES = ("motor_share", "limb_share", "friction_share")

MIDDLE = 115  # Hz, at which assumptions are varied, with the motors in the middle
ASSUMPTIONS = {
    "friction of the weight": ("friction.load=weight",),
    "friction 0.63": ("friction.coefficient=0.63",),
    "friction 0.77": ("friction.coefficient=0.77",),
    "light, 0.5 g a node": ("backbone.width=15 mm", "masses.node=0.5 g", "masses.head=2.1 g"),
    "heavy, 1 g a node": ("masses.node=1 g", "masses.head=2.6 g"),
    "one limb a side and row": ("rows.limbs=1",),
    "three limbs a side and row": ("rows.limbs=3",),
    "three rows": ("rows.count=3", "rows.pitch=28 mm", "masses.node=1.25 g"),
    "three rows under the motor": ("rows.under_head=3", "masses.head=3.85 g"),
    "all limbs push, no wave": ("limbs.thrust=all", "wave_tension=0 N"),
    "bending 0.003 N m": ("backbone.bending_stiffness=0.003 N*m/rad",),
    "bending of joints": ("backbone.bending=joint",),
    "steps of 0.1 ms": ("time.increment=0.1 ms",),
}
"""What is missing in the thesis, or may be otherwise -> overrides."""


def robot(chain: str, name: str, *overrides: str) -> ChainCase:
    """A case of a chain, half a second unless told otherwise: it settles within a tenth of one."""
    return ChainCase(f"{chain}, {name}", f"chains/leafbot_x5_{chain}.yaml",
                     ("time.end=0.5 s", *overrides))  # fmt: skip


def turning(chain: str, place: str, frequency: int, running: str, *overrides: str) -> ChainCase:
    """One motor runs."""
    return robot(
        chain, f"{place}, {frequency} Hz, {running} motor", f"motor.place={place}",
        f"motor.frequency={frequency} Hz", f"sides.running={running}", *overrides,
    )  # fmt: skip


def straight(chain: str, place: str) -> ChainCase:
    """Both motors run at WEAK."""
    return robot(chain, f"{place}, both motors", f"motor.place={place}",
                 f"motor.frequency={WEAK} Hz")  # fmt: skip


def unequal(chain: str, place: str) -> ChainCase:
    """The left motor runs at WEAK, the right one at STRONG."""
    return robot(
        chain, f"{place}, {WEAK} and {STRONG} Hz", f"motor.place={place}",
        f"motor.frequency={STRONG} Hz", f"sides.left.frequency={WEAK} Hz",
    )  # fmt: skip


def unlike(draw: int) -> tuple[str, ...]:
    """Sides whose motors, limbs and friction differ by chance."""
    shares = 1.0 + SCATTER * np.random.default_rng(draw).standard_normal((2, len(SHARES)))
    return tuple(
        f"sides.{side}.{name}={share:.4f}"
        for side, of_side in zip(SIDES, shares, strict=True)
        for name, share in zip(SHARES, of_side, strict=True)
    )


def turning_unlike(place: str, frequency: int, draw: int) -> ChainCase:
    """The right motor runs, of sides that are unlike. The left one of another draw is its mirror
    image: differences of two draws are those of left and right.
    """
    one = turning(SCATTERED, place, frequency, "right", *unlike(draw))
    return ChainCase(f"{one.name}, draw {draw}", one.scene, one.overrides)


def straight_unlike(draw: int) -> ChainCase:
    """Both motors in the middle run, of sides that are unlike, for 3 s as in the thesis."""
    return robot(SCATTERED, f"both motors, draw {draw}", f"motor.frequency={WEAK} Hz",
                 *unlike(draw), "time.end=3 s")  # fmt: skip


def assumed(chain: str, name: str) -> ChainCase:
    """One of ASSUMPTIONS, the right motor in the middle."""
    one = turning(chain, "middle", MIDDLE, "right", *ASSUMPTIONS[name])
    return ChainCase(f"{chain}, {name}", one.scene, one.overrides)


def cases() -> list[Case]:
    """Right motor, left motor, both, unlike sides, and what was assumed."""
    right: list[Case] = [
        turning(chain, place, f, "right") for chain in CHAINS for place in PLACES
        for f in FREQUENCIES
    ]  # fmt: skip
    left = [turning(chain, p, f, "left") for chain in CHAINS for p in PLACES for f in FREQUENCIES]
    both = [kind(chain, p) for chain in CHAINS for p in PLACES for kind in (straight, unequal)]
    unlike = [turning_unlike(p, f, draw) for p in PLACES for f in (WEAK, STRONG)
              for draw in range(DRAWS)]  # fmt: skip
    astray = [straight_unlike(draw) for draw in range(DRAWS)]
    band = [assumed(chain, name) for chain in CHAINS for name in ASSUMPTIONS]
    return [*right, *left, *both, *unlike, *astray, *band]


def curvature(outcome: Outcome) -> float:
    """Of the track, positive to the left [1/mm]."""
    return outcome.number("curvature") / MILLI


def curvatures(outcomes: Outcomes, chain: str, place: str, running: str) -> list[float]:
    """At each frequency [1/mm]."""
    return [curvature(outcomes[turning(chain, place, f, running).name]) for f in FREQUENCIES]


def speed(outcome: Outcome) -> float:
    """Between the motors [mm/s]."""
    return MILLI * outcome.number("speed")


def astray(outcome: Outcome) -> float:
    """How far it came sideways, as a share of the way."""
    return abs(outcome.number("sideways_displacement") / outcome.number("head_displacement"))


def dependence(values: list[float]) -> float:
    """Of curvatures on the frequency: from the least to the greatest, over their mean."""
    return float(np.ptp(values) / abs(np.mean(values)))


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """The claims of each chain, and of one with unlike sides."""
    for chain in CHAINS:
        yield from of_chain(chain, rows_of(chain, outcomes))
    drawn = [outcomes[straight_unlike(draw).name] for draw in range(DRAWS)]
    shares = [astray(outcome) for outcome in drawn]
    computed = f"{shown(100.0 * float(np.median(shares)), '%')} of the way, half of {DRAWS} draws"
    found = judged(float(np.median(shares)) < STRAIGHT, computed, *shares)
    claim = f"{SCATTERED}, sides unlike by {100 * SCATTER:g} %: straight with both motors, 3 s"
    yield row(TURNING, claim, f"sideways below {100 * STRAIGHT:g} %", found, drawn, model=TRIAL)


def rows_of(chain: str, outcomes: Outcomes) -> Iterator[Row]:
    """Curvatures, where to, at which place alike over frequency; both motors."""
    right = [outcomes[turning(chain, "middle", f, "right").name] for f in FREQUENCIES]
    for f, outcome, *measured in zip(FREQUENCIES, right, *TABLE["middle"], strict=True):
        wanted = float(np.mean(measured))
        found = within(curvature(outcome), wanted, SPREAD, "1/mm")
        reference = f"{wanted:.3g} 1/mm within {100 * SPREAD:g} %"
        yield row(
            CURVATURE, f"{chain}: motors in the middle turn at {f} Hz", reference, found, [outcome]
        )
    alone = {
        running: [outcomes[turning(chain, p, f, running).name] for p in PLACES for f in FREQUENCIES]
        for running in SIDES
    }
    to_left = [curvature(outcome) for outcome in alone["right"]]
    to_right = [-curvature(outcome) for outcome in alone["left"]]
    away = [value > 0.0 for value in to_left + to_right]
    found = judged(all(away), f"{sum(away)} of {len(away)} do", *to_left, *to_right)
    both = [*alone["right"], *alone["left"]]
    yield row(TURNING, f"{chain}: turns away from the motor that runs", "all do", found, both)
    spreads = {p: dependence(curvatures(outcomes, chain, p, "right")) for p in PLACES}
    texts = [f"{p} {shown(100.0 * spread, '%')}" for p, spread in spreads.items()]
    least = spreads["middle"] <= min(spreads.values())
    found = judged(least, ", ".join(texts), *spreads.values())
    claim = f"{chain}: motors in the middle turn it most alike at all frequencies"
    yield row(CURVATURE, claim, "least spread over its mean", found, alone["right"])
    equal = [outcomes[straight(chain, p).name] for p in PLACES]
    aside = shown(100.0 * max(astray(outcome) for outcome in equal), "%")
    found = Finding(f"{aside}: the model is symmetric", UNKNOWN)
    reference = f"sideways below {100 * STRAIGHT:g} % of the way"
    yield row(TURNING, f"{chain}: straight with both motors", reference, found, equal)
    weaker = [outcomes[unequal(chain, p).name] for p in PLACES]
    turns = [curvature(outcome) for outcome in weaker]
    found = judged(all(turn > 0.0 for turn in turns), shown_list(turns, "1/mm"), *turns)
    claim = f"{chain}: {WEAK} Hz left, {STRONG} Hz right turn it to the weaker"
    yield row(TURNING, claim, "to the left", found, weaker)
    off = [abs(a - b) for a, b in zip(to_left, to_right, strict=True)]
    found = Finding(f"they differ by {shown(max(off), '1/mm')}: the model is symmetric", UNKNOWN)
    claim = f"{chain}: left and right differ with motors at the rear and the front"
    yield row(TURNING, claim, "up to a factor of 2", found, both)


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """Table 5.1 beside the chains; speeds; what scatter and assumptions do."""
    headings = ("motors", "Hz", "thesis, left, right",
                *(f"{chain}, left, right" for chain in CHAINS))  # fmt: skip
    yield Listing(
        "K_s [1/mm], turning to the left and to the right", headings, tuple(table(outcomes))
    )
    headings = ("motors", "Hz", *(f"{chain}, one motor" for chain in CHAINS))
    yield Listing("Speed between the motors [mm/s]", headings, tuple(speeds(outcomes)))
    headings = ("motors", "Hz", "mean", "deviation", "typical difference of left and right")
    title = f"{SCATTERED}, K_s [1/mm] of {DRAWS} robots whose sides are unlike by 5 %"
    yield Listing(title, headings, tuple(scattered(outcomes)))
    title = f"K_s [1/mm] of motors in the middle at {MIDDLE} Hz under other assumptions"
    yield Listing(title, ("assumption", *CHAINS), tuple(band(outcomes)))


def table(outcomes: Outcomes) -> Iterator[tuple[str, ...]]:
    """A row a place and frequency. The right motor turns it to the left."""
    for place in PLACES:
        for index, f in enumerate(FREQUENCIES):
            found = [
                [abs(curvature(outcomes[turning(chain, place, f, running).name]))
                 for running in ("right", "left")]
                for chain in CHAINS
            ]  # fmt: skip
            thesis = [side[index] for side in TABLE[place]]
            yield (place, str(f), *(shown_list(pair) for pair in (thesis, *found)))


def speeds(outcomes: Outcomes) -> Iterator[tuple[str, ...]]:
    """A row a place and frequency, of the right motor alone."""
    for place in PLACES:
        for f in FREQUENCIES:
            found = [speed(outcomes[turning(chain, place, f, "right").name]) for chain in CHAINS]
            yield (place, str(f), *map(shown, found))


def scattered(outcomes: Outcomes) -> Iterator[tuple[str, ...]]:
    """A row a place and frequency; left and right are two draws, which differ by sqrt(2) times the
    deviation.
    """
    for place in PLACES:
        for f in (WEAK, STRONG):
            drawn = [outcomes[turning_unlike(place, f, draw).name] for draw in range(DRAWS)]
            values = np.array([curvature(outcome) for outcome in drawn])
            deviation = float(values.std(ddof=1))
            told = (float(values.mean()), deviation, float(np.sqrt(2.0)) * deviation)
            yield (place, str(f), *map(shown, told))


def band(outcomes: Outcomes) -> Iterator[tuple[str, ...]]:
    """A row an assumption, the one of the file first."""
    as_stated = [outcomes[turning(c, "middle", MIDDLE, "right").name] for c in CHAINS]
    yield ("as in the file", *(shown(curvature(outcome)) for outcome in as_stated))
    for name in ASSUMPTIONS:
        found = [curvature(outcomes[assumed(chain, name).name]) for chain in CHAINS]
        yield (name, *map(shown, found))


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Curvature over frequency at each place; tracks of the right motor in the middle."""
    with drawing(path, 5.4) as figure:
        panels = figure.subplot_mosaic([[*PLACES], ["tracks"] * 3])
        for place in PLACES:
            axes = panels[place]
            axes.set_ylim(-SHOWN, SHOWN)
            for chain, colour in CHAINS.items():
                axes.plot(FREQUENCIES, curvatures(outcomes, chain, place, "right"), color=colour,
                          marker="o", label=chain)  # fmt: skip
            for marker, name, values in zip("<>", SIDES, TABLE[place], strict=True):
                axes.plot(FREQUENCIES, values, color=INK, marker=marker, linestyle="none",
                          label=f"thesis, to the {name}")  # fmt: skip
            axes.set(title=place, xlabel="frequency [Hz]")
        panels["rear"].set_ylabel(f"K_s [1/mm], cut at {SHOWN:g}")
        tracks = panels["tracks"]
        for chain, colour in CHAINS.items():
            history = outcomes[turning(chain, "middle", STRONG, "right").name].history
            if "centre_x" in history:
                x = MILLI * (history["centre_x"] - history["centre_x"][0])
                tracks.plot(x, MILLI * history["centre_y"], color=colour)
        tracks.set_aspect("equal", adjustable="datalim")
        tracks.set(xlabel="x [mm]", ylabel="y [mm]",
                   title=f"right motor in the middle, {STRONG} Hz, 0.5 s")  # fmt: skip
        figure.legend(*panels["rear"].get_legend_handles_labels(), loc="outside upper center",
                      ncols=5)  # fmt: skip


SCRIPT = Script(
    name=NAME,
    model=EQUATIONS,
    figure="Leafbot-X5, two motors: 5.4, Table 5.1",
    about=(
        "Leafbot widened for two motors, as two chains of masses on springs with links across. "
        "Table B's constants as they are, and two sets (swing, drag) fitted on Leafbot5's speeds "
        "straight on; nothing is fitted on how it turns. Width, masses and rows of limbs are "
        "missing in the thesis and assumed."
    ),
    cases=cases,
    rows=rows,
    draw=draw,
    listings=listings,
)

if __name__ == "__main__":
    command([SCRIPT])
