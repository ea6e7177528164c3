"""What the figures of motion owe to mesh, step and contact stiffness: numbers that must not matter.

Displacement of one cycle of Mode 3, its onset and end pressure in the 36 mm pipe, the displacement
of its first 0.4 s, and the speed of Mode 1 at 64 Hz, over
- the mesh: quadrilaterals across a spike and through the skin;
- mass scaling: none, and four and nine times the inertia within groups of 1.05 mm;
- the time step: the share of the stable one;
- the penalty stiffness: half and twice what "auto" is;
- the stiffness of sticking friction over it.
One of them at a time departs from REFERENCE. A result is a result where each stays within 5 % of
that of the finest (smallest step, stiffest) one; the largest departure is the band of the figure.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from softsim.builder.assembly import build_model
from softsim.report.style import BLUE, WALL, drawing
from softsim.scene.loading import load_scene
from validation.air import deflation
from validation.cases import SCENES, THINNED, Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points
from validation.mode1_speed import BEST, SETTLED
from validation.motion import MILLI, NAN, Fall, falls, speed_after
from validation.script import Listing, Script
from validation.statements import CONVERGENCE
from validation.thesis import LOWEST
from validation.verdicts import Finding, Row, judged, row, shown, shown_list

NAME = "convergence"
PIPE = 36  # mm
RATE = 4.0  # kPa/s, of the fall: three times the best one, for nine runs are wanted
TOLERANCE = 0.05
ROWS_AND_SIZE = {1: (1, 1.0), 2: (1, 0.7), 3: (2, 0.5)}
"""Through the skin, and the length of cells along it [mm], by their number across a spike."""
GROUPS = 1.05  # mm, of mass scaling: across the skin
BEGINNING = 0.4  # s
CYCLE, SHORT, MODE1 = "a cycle", "0.4 s", "Mode 1"
SCENE_OF = {CYCLE: f"pfr_{PIPE}mm.yaml", SHORT: f"pfr_{PIPE}mm.yaml", MODE1: "pfr_mode1.yaml"}


@dataclass(frozen=True)
class Numerics:
    """What a result must not hang on. across: quadrilaterals across a spike, inertia: factor of
    mass scaling, 1 for none, step: over the stable one, penalty: over the automatic one,
    tangential: over the penalty.
    """

    across: int = 1
    inertia: float = 1.0
    step: float = 0.9
    penalty: float = 1.0
    tangential: float = 1.0

    @property
    def name(self) -> str:
        """For people."""
        return (
            f"{self.across} across, inertia {self.inertia:g}, step {self.step:g}, "
            f"penalty {self.penalty:g}, tangential {self.tangential:g}"
        )

    def overrides(self, scene: str) -> tuple[str, ...]:
        """Of a scene."""
        rows, size = ROWS_AND_SIZE[self.across]
        mesh = (
            f"bodies.skin.mesh.skin_rows={rows}",
            f"bodies.skin.mesh.spike_columns={self.across}",
            f"bodies.skin.mesh.element_size={size} mm",
        )
        found = [
            *mesh,
            f"solver.safety_factor={self.step}",
            f"contact.tangential_stiffness_ratio={self.tangential}",
        ]
        if self.inertia != 1.0:
            scaling = f"{{within: {GROUPS} mm, factor: {self.inertia:g}}}"
            found.append(f"solver.mass_scaling={scaling}")
        if self.penalty != 1.0:
            stiffness = self.penalty * automatic_penalty(scene, mesh)
            found.append(f"contact.penalty_stiffness={stiffness:.6g} N/m")
        return tuple(found)


REFERENCE = Numerics()


@dataclass(frozen=True)
class Series:
    """Numerics of which one number varies, by that number, the finest last."""

    name: str
    by_value: Mapping[float, Numerics]

    @property
    def values(self) -> tuple[float, ...]:
        """Of the number."""
        return tuple(self.by_value)

    @property
    def settings(self) -> tuple[Numerics, ...]:
        """With these."""
        return tuple(self.by_value.values())


ALL = (
    Series(
        "quadrilaterals across a spike",
        {across: replace(REFERENCE, across=across) for across in (1, 2, 3)},
    ),
    Series(
        "inertia within groups",
        {factor: replace(REFERENCE, inertia=factor) for factor in (9.0, 4.0, 1.0)},
    ),
    Series(
        "step over the stable one",
        {share: replace(REFERENCE, step=share) for share in (0.9, 0.67, 0.45)},
    ),
    Series(
        "penalty over the automatic one",
        {share: replace(REFERENCE, penalty=share) for share in (0.5, 1.0, 2.0)},
    ),
    Series(
        "tangential stiffness over penalty",
        {share: replace(REFERENCE, tangential=share) for share in (0.5, 1.0)},
    ),
)
DISTINCT = tuple(dict.fromkeys(setting for one in ALL for setting in one.settings))


@cache
def automatic_penalty(scene: str, mesh: tuple[str, ...]) -> float:
    """Penalty stiffness [N/m] that the builder gives the spikes, which are what touches: the least
    of all nodes, since the sector of the skin that a strip stands for is wider than its spikes.
    """
    contact = build_model(load_scene(SCENES / scene, mesh)).contact
    return float(contact.penalty.k_n.min())


def label(what: str, numerics: Numerics) -> str:
    """The name of a case."""
    return f"{what}, {numerics.name}"


def case(what: str, numerics: Numerics) -> Case:
    """One run of CYCLE, SHORT or MODE1."""
    scene = SCENE_OF[what]
    of_kind = {
        CYCLE: deflation(RATE, LOWEST[PIPE]),
        SHORT: (f"time.end={BEGINNING} s",),
        MODE1: (f"loads.motor.frequency={BEST} Hz", "time.end=2 s"),
    }[what]
    overrides = (*of_kind, *THINNED, *numerics.overrides(scene))
    return Case(label(what, numerics), scene, overrides)


def cases() -> list[Case]:
    """All settings."""
    kinds = (SHORT, MODE1, CYCLE)
    return [case(what, numerics) for what in kinds for numerics in DISTINCT]


@dataclass(frozen=True)
class Quantity:
    """A figure that the validation rests on; `unit` of `measured`, of the run `what`."""

    name: str
    what: str
    unit: str

    def measured(self, outcomes: Outcomes, one: Series) -> list[float]:
        """At each setting of a series; NaN of a run that failed, or without motion."""
        found = (outcomes[label(self.what, numerics)] for numerics in one.settings)
        return [_measure(self.name, outcome) for outcome in found]


DISPLACEMENT, ONSET, END, FIRST, SPEED = (
    "displacement of a cycle", "onset pressure", "end pressure", "displacement in 0.4 s",
    "speed of Mode 1",
)  # fmt: skip
QUANTITIES = (
    Quantity(DISPLACEMENT, CYCLE, "mm"),
    Quantity(ONSET, CYCLE, "kPa"),
    Quantity(END, CYCLE, "kPa"),
    Quantity(FIRST, SHORT, "mm"),
    Quantity(SPEED, MODE1, "mm/s"),
)


def _measure(name: str, outcome: Outcome) -> float:
    if outcome.failure:
        return NAN
    if name == FIRST:
        return MILLI * float(outcome.history["frame_x"][-1] - outcome.history["frame_x"][0])
    if name == SPEED:
        return MILLI * speed_after(outcome.history, SETTLED)
    cycles = falls(outcome.history)
    return _of_fall(name, cycles[0]) if cycles else NAN


def _of_fall(name: str, fall: Fall) -> float:
    return {
        DISPLACEMENT: MILLI * fall.displacement,
        ONSET: 1e-3 * fall.onset_pressure,
        END: 1e-3 * fall.end_pressure,
    }[name]


def departures(found: Sequence[float]) -> np.ndarray:
    """Share by which each result differs from the last, the finest (settings,)."""
    values = np.array(found)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.abs(values / values[-1] - 1.0)


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Each quantity over each setting."""
    for quantity in QUANTITIES:
        for one in ALL:
            found = quantity.measured(outcomes, one)
            claim = f"{quantity.name} over {one.name}, {shown_list(one.values)}"
            reference = f"within {100.0 * TOLERANCE:g} % of the last"
            behind = [outcomes[label(quantity.what, numerics)] for numerics in one.settings]
            yield row(CONVERGENCE, claim, reference, settled(found, quantity.unit), behind)


def settled(found: Sequence[float], unit: str) -> Finding:
    """Every result within TOLERANCE of the last."""
    off = departures(found)
    text = f"{shown_list(found, unit)}; off by {shown(100.0 * float(off.max()), '%')}"
    return judged(bool((off < TOLERANCE).all()), text, *off)


def band(outcomes: Outcomes, quantity: Quantity) -> float:
    """The largest departure of REFERENCE from the finest of a series; NaN where a run lacks."""
    found = [
        departures(quantity.measured(outcomes, one))[one.settings.index(REFERENCE)] for one in ALL
    ]
    return float(np.max(found))


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """Each figure over the mesh, and the band."""
    meshes = ALL[0]
    lines = []
    for quantity in QUANTITIES:
        found = quantity.measured(outcomes, meshes)
        if np.isnan(found).all():
            continue
        width = shown(100.0 * band(outcomes, quantity), "%")
        cells = (f"{value:.4g}" for value in found)
        lines.append((f"{quantity.name} [{quantity.unit}]", *cells, width))
    if lines:
        yield Listing(
            "Figures over the mesh; the band of the reference",
            ("figure", *(f"{across:g} across" for across in meshes.values), "band"),
            tuple(lines),
        )


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Every result over its finest one, a panel a series."""
    with drawing(path, 4.4) as figure:
        panels = figure.subplots(len(QUANTITIES), len(ALL), sharey="row", sharex="col")
        for quantity, line in zip(QUANTITIES, panels, strict=True):
            shares = []
            for one, axes in zip(ALL, line, strict=True):
                axes.axhspan(1.0 - TOLERANCE, 1.0 + TOLERANCE, color=WALL, zorder=0)
                found = np.array(quantity.measured(outcomes, one))
                with np.errstate(divide="ignore", invalid="ignore"):
                    shares += list(found / found[-1])
                axes.plot(one.values, shares[-len(found) :], color=BLUE, marker="o")
            line[0].set_ylabel(wrapped(quantity.name), fontsize=6.5)
            line[0].set_ylim(min(0.75, *shares) - 0.05, max(1.25, *shares) + 0.05)
        for one, axes in zip(ALL, panels[-1], strict=True):
            axes.set_xlabel(wrapped(one.name), fontsize=7)


def wrapped(name: str) -> str:
    """A name on two lines."""
    for word in (" of ", " in ", " over ", " across ", " within "):
        name = name.replace(word, f"\n{word.lstrip()}")
    return name


SCRIPT = Script(
    name=NAME,
    figure="error bands",
    about=(
        f"Displacement of a cycle of Mode 3 in the {PIPE} mm pipe, its onset and end pressure, its "
        "first 0.4 s, and the speed of Mode 1 at 64 Hz over the mesh, mass scaling, the time step, "
        "the penalty stiffness and the stiffness of sticking friction: none of them may matter. "
        "Shown: each result over that of the finest setting, the grey band "
        f"{100.0 * TOLERANCE:g} %. The reference has {REFERENCE.name}."
    ),
    cases=cases,
    rows=rows,
    draw=draw,
    listings=listings,
)

if __name__ == "__main__":
    command([SCRIPT])
