"""Fig 4.9 of the thesis: pressure over the outer radius of the PFR's skin in free air.

First the simulation is verified, then the thesis's pressures are compared with it.

Verification: the half section of the skin without spikes, as in the thesis's ABAQUS model, against
an incompressible membrane clamped at both ends (`validation.membrane`, solved here). One skin is
nearly incompressible, as the membrane is; the other one has the bulk modulus of the scenes. They
agree if they differ by less than 5 %; the wall is an eighth of its radius thick, which the membrane
neglects.

Statements of the thesis: the pressures at which the spikes reach the pipes, the working pressure
and the largest size, each with the factor between the thesis's pressure and the computed one. They
are compared with the skin of the stated constants, of constants fitted to a tensile test, with rows
of spikes as rings of equivalent stiffness, and in space with 70 spikes. A statement agrees if the
difference is less than 15 %, the spread between the thesis's own two values of P_M3^S (Fig 6.6 and
Table 6.2).

All runs are static and prescribe the volume, so that the curves continue beyond the limit point.

Digitised points: pressure_kPa, outer_radius_mm, one row a point.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from scipy.interpolate import PchipInterpolator
from scipy.signal import find_peaks

from softsim.report.style import BLUE, GREEN, INK, ORANGE, PURPLE, RED, SKY, drawing
from validation import statements
from validation.cases import Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points, deviation
from validation.membrane import Tube, inflate
from validation.script import Script
from validation.statements import Statement
from validation.thesis import STATED
from validation.verdicts import (
    IN_SECTION,
    IN_SPACE,
    TRIAL,
    Finding,
    Row,
    judged,
    row,
    shown,
    signed,
    within,
)

NAME = "inflation_radius"
TOLERANCE = 0.15  # of the thesis's statements
VERIFIED = 0.05  # of the membrane

SKIN = Tube(8e-3, 1e-3, 30e-3, (1e3 * STATED[0], 1e3 * STATED[1], 1e3 * STATED[2]))
MIDDLE_RADII = (*np.arange(8.1, 10.0, 0.2), *np.arange(10.0, 31.0, 0.5))  # mm, of the membrane
RADII_COMPARED = (9.0, 17.0)  # mm, outer radii, up to twice the first one

SPIKE_HEIGHT = 5.0  # mm, above the skin
SPIKED_DIAMETER = 27.0  # mm, OD_S
# Pipe [mm] -> P_M3^S [kPa] in Table 6.2 and Fig 6.6: where the spikes leave the wall.
TOUCH = {30.0: (9.0, 9.0), 36.0: (11.0, 12.0), 41.0: (12.5, 13.0)}
FILLED = 1.5  # times OD_S
GROWTH = 2.5  # times OD_S
WORKING = (20.0, 26.0)  # kPa, at which the robot is said to fill 1 to 1.5 OD_S
INCOMPRESSIBLE, DIGITISED = "membrane, incompressible", "thesis, digitised"


@dataclass(frozen=True)
class Curve:
    """Curve of the pressure [kPa] over the outer radius [mm], in the order of the inflation."""

    name: str
    outer_radius: np.ndarray
    pressure: np.ndarray
    outcome: Outcome | None = None

    @property
    def model(self) -> str:
        """Model behind the curve, for the rows that rest on it."""
        return {MEASURED: TRIAL, SOLID: IN_SPACE}.get(self.name, IN_SECTION)

    def pressure_at(self, radius: float) -> float:
        """Return the pressure [kPa] at a radius [mm]; NaN beyond the curve."""
        return float(np.interp(radius, self.outer_radius, self.pressure, left=np.nan, right=np.nan))

    def radius_at(self, pressure: float) -> float:
        """Return the radius [mm] where the rising branch first reaches a pressure [kPa], or NaN."""
        reached = np.flatnonzero(self.pressure >= pressure)
        if len(reached) == 0 or reached[0] == 0:
            return float("nan")
        k = slice(reached[0] - 1, reached[0] + 1)
        return float(np.interp(pressure, self.pressure[k], self.outer_radius[k]))

    def limit_point(self) -> tuple[float, float]:
        """Return radius [mm] and pressure [kPa] of the limit point, NaN if the curve has none.

        It is the first peak above half of the largest pressure from which the curve falls by 0.2 %
        of that. The curve beyond three times the radius, where the law stiffens again, is ignored.
        """
        pressure = self.pressure[self.outer_radius < 3.0 * self.outer_radius[0]]
        if len(pressure) == 0:
            return float("nan"), float("nan")
        largest = pressure.max()
        peaks, _ = find_peaks(pressure, height=0.5 * largest, prominence=0.002 * largest)
        if len(peaks) == 0:
            return float("nan"), float("nan")
        return float(self.outer_radius[peaks[0]]), float(pressure[peaks[0]])

    def limit_pressure(self) -> float:
        """Return the pressure [kPa] of the limit point, NaN if the curve has none."""
        return self.limit_point()[1]


STIFF, SMOOTH, MEASURED, RINGED, SOLID = (
    "skin, nearly incompressible", "skin", "skin, measured constants", "skin with rings",
    "skin with 70 spikes in space",
)  # fmt: skip

INTERPOLATED = 1001  # points of a curve
# Two quadrilaterals through the wall: they are 0.11 % off FElupe's radius at 8 kPa.
QUADRILATERALS = ("bodies.skin.mesh.cells=quad", "bodies.skin.mesh.element_size=0.5 mm")
STEPS = ("output.history_interval=5 ms", "output.frame_interval=1000 s")


def pumped(volume: float) -> tuple[str, ...]:
    """Return the overrides of a half section into which a volume [ml] is pumped."""
    profile = f"{{kind: smooth_step, value: {volume:g} ml, duration: 0.3 s}}"
    return (*QUADRILATERALS, f"loads.air.profile={profile}", "time.end=0.3 s", *STEPS)


def cases() -> list[Case]:
    """Return the skins; the half sections take seconds, the one in space takes minutes."""
    scene = "skin_inflation.yaml"
    c10, c20, c30 = STATED
    incompressible = (
        f"materials={{stated: {{law: yeoh, C10: {c10} kPa, C20: {c20} kPa, C30: {c30} kPa, "
        "density: 1070 kg/m^3, poisson_ratio: 0.4975}}", "bodies.skin.material=stated",
    )  # fmt: skip
    return [
        Case(STIFF, scene, (*incompressible, *pumped(70.0))),
        Case(SMOOTH, scene, pumped(70.0)),
        Case(MEASURED, scene, ("bodies.skin.material=dragon_skin_10_measured", *pumped(85.0))),
        Case(RINGED, "skin_inflation_rings.yaml", pumped(75.0)),
        Case(SOLID, "skin_inflation_3d.yaml", STEPS),
    ]


def inflated(outcome: Outcome) -> Curve:
    """Return the curve of a case; it is one point of NaN if the case failed."""
    if outcome.failure:
        nothing = np.array([np.nan])
        return Curve(outcome.name, nothing, nothing, outcome)
    history = outcome.history
    radius, pressure = 1e3 * history["outer_radius"], 1e-3 * history["pressure"]
    return interpolated(outcome.name, radius, pressure, outcome)


def interpolated(
    name: str, radius: np.ndarray, pressure: np.ndarray, outcome: Outcome | None = None
) -> Curve:
    """Return the curve through equilibria, interpolated monotonically over the radius [mm, kPa]."""
    radius, first = np.unique(np.maximum.accumulate(radius), return_index=True)
    fine = np.linspace(radius[0], radius[-1], INTERPOLATED)
    return Curve(name, fine, PchipInterpolator(radius, pressure[first])(fine), outcome)


@cache
def membrane() -> Curve:
    """Return the membrane of the stated constants."""
    path = inflate(SKIN, 1e-3 * np.array(MIDDLE_RADII))
    return interpolated(INCOMPRESSIBLE, 1e3 * path.outer_radius, 1e-3 * path.pressure)


def scaled(curve: Curve) -> Curve:
    """Return a hypothesis: the same skin, stiffer by the factor that moves its limit point to the
    middle of the working pressures.

    All constants, the bulk modulus included, are scaled alike. At equal volume the shape is then
    the same and the pressure goes with the factor, so that no run is needed.
    """
    factor = float(np.mean(WORKING)) / curve.limit_pressure()
    name = f"hypothesis: skin {factor:.2f} times as stiff"
    return Curve(name, curve.outer_radius, factor * curve.pressure)


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Return the verdicts on the simulation, on the statements, and on the figure's points."""
    for name in (STIFF, SMOOTH):
        yield from against_membrane(inflated(outcomes[name]))
    for name in (SMOOTH, MEASURED, RINGED, SOLID):
        yield from against_statements(inflated(outcomes[name]))
    if points is not None:
        yield against_points(inflated(outcomes[SMOOTH]), points)


def against_membrane(curve: Curve) -> Iterator[Row]:
    """Compare radii on the rising branch and the limit pressure."""
    reference = membrane()
    for pressure in (3.0, 6.0, 8.0):
        claim = f"verification: membrane's radius at {pressure:g} kPa; {curve.name}"
        radius = curve.radius_at(pressure)
        yield verified(claim, reference.radius_at(pressure), radius, "mm", curve)
    claim = f"verification: membrane's limit pressure; {curve.name}"
    yield verified(claim, reference.limit_pressure(), curve.limit_pressure(), "kPa", curve)


def verified(claim: str, reference: float, computed: float, unit: str, curve: Curve) -> Row:
    """Compare a number with the membrane's."""
    verdict = within(computed, reference, VERIFIED).verdict
    error = computed / reference - 1.0
    text = shown(computed, unit) + ("" if np.isnan(error) else f", {signed(error)}")
    return row(
        statements.MEMBRANE, claim, shown(reference, unit), Finding(text, verdict), _behind(curve)
    )


def against_statements(curve: Curve) -> Iterator[Row]:
    """Compare pressures and sizes with the thesis's statements."""
    for pipe, values in TOUCH.items():
        claim = f"P_M3^S, spikes reach the {pipe:g} mm pipe; {curve.name}"
        pressure = curve.pressure_at(touching(pipe))
        yield compared(statements.TOUCH, claim, float(np.mean(values)), pressure, curve)
    claim = f"{FILLED:g} OD_S at {WORKING[0]:g} to {WORKING[1]:g} kPa; {curve.name}"
    pressure = curve.pressure_at(touching(FILLED * SPIKED_DIAMETER))
    yield compared(statements.SIZE, claim, float(np.mean(WORKING)), pressure, curve)
    pressure = curve.pressure_at(touching(GROWTH * SPIKED_DIAMETER))
    text = f"reached at {shown(pressure, 'kPa')}"
    if np.isnan(pressure):  # a run that was not driven that far decides nothing
        size = 2.0 * (curve.outer_radius.max() + SPIKE_HEIGHT) / SPIKED_DIAMETER
        text = f"driven to {shown(size, 'OD_S')}"
    claim = f"the skin can grow to {GROWTH:g} OD_S; {curve.name}"
    finding = judged(True, text, pressure)
    yield row(
        statements.GROWTH, claim, f"{GROWTH:g} OD_S", finding, _behind(curve), model=curve.model
    )


def compared(
    statement: Statement, claim: str, reference: float, computed: float, curve: Curve
) -> Row:
    """Compare a pressure [kPa] with the thesis's, and give the factor between them."""
    verdict = within(computed, reference, TOLERANCE).verdict
    factor = reference / computed
    text = shown(computed, "kPa")
    text += "" if np.isnan(factor) else f"; thesis: {factor:.2f} times that"
    finding = Finding(text, verdict)
    return row(
        statement, claim, shown(reference, "kPa"), finding, _behind(curve), model=curve.model
    )


def touching(diameter: float) -> float:
    """Return the outer radius of the skin [mm] at which its spikes span a diameter [mm]."""
    return 0.5 * diameter - SPIKE_HEIGHT


def against_points(curve: Curve, points: Points) -> Row:
    """Compare the radii at the digitised pressures."""
    computed = np.array([curve.radius_at(float(pressure)) for pressure in points["pressure_kPa"]])
    finding = deviation(computed, points["outer_radius_mm"], points["spread"], "mm")
    claim = "Fig 4.9: radius over pressure"
    return row(statements.SIZE, claim, "digitised points", finding, _behind(curve))


def remarks(outcomes: Outcomes) -> Iterable[str]:
    """Return what agrees and what cannot agree."""
    stiff, smooth = (inflated(outcomes[name]) for name in (STIFF, SMOOTH))
    if not np.isnan(stiff.limit_pressure()):
        yield (
            "The simulation agrees with the membrane: at equal radius, up to twice the initial "
            "radius, the pressure of the nearly incompressible skin is within "
            f"{100.0 * largest_deviation(stiff):.1f} % of the membrane's, and its limit pressure "
            f"is {stiff.limit_pressure():.2f} kPa against {membrane().limit_pressure():.2f} kPa."
        )
    limit = smooth.limit_pressure()
    if np.isnan(limit):
        return
    reached = {pipe: smooth.pressure_at(touching(pipe)) for pipe in TOUCH}
    touch = [float(np.mean(values)) / reached[pipe] for pipe, values in TOUCH.items()]
    filled = float(np.mean(WORKING)) / smooth.pressure_at(touching(FILLED * SPIKED_DIAMETER))
    wanted = ", ".join(f"{np.mean(values):g}" for values in TOUCH.values())
    found = ", ".join(f"{filled * pressure:.1f}" for pressure in reached.values())
    yield (
        f"The thesis's pressures cannot agree: a skin of the stated constants carries at most "
        f"{limit:.2f} kPa in free air, and the thesis's P_M3^S are {min(touch):.1f} to "
        f"{max(touch):.1f} times, its pressure at {FILLED:g} OD_S is {filled:.1f} times the "
        "computed one. No stiffness of an elastic skin satisfies both, because it scales all "
        f"pressures alike: a skin {filled:.1f} times as stiff reaches the pipes at {found} kPa, "
        f"and the thesis states {wanted} kPa. `sleeve_stiffness` and `sleeve_hypotheses` examine "
        "such factors."
    )


def largest_deviation(curve: Curve) -> float:
    """Return the largest relative deviation from the membrane's pressure in RADII_COMPARED."""
    radii = np.linspace(*RADII_COMPARED, 41)
    pairs = [(curve.pressure_at(radius), membrane().pressure_at(radius)) for radius in radii]
    return max(abs(computed / reference - 1.0) for computed, reference in pairs)


def _behind(curve: Curve) -> tuple[Outcome, ...]:
    return () if curve.outcome is None else (curve.outcome,)


COLOURS = {STIFF: SKY, SMOOTH: BLUE, MEASURED: GREEN, RINGED: PURPLE, SOLID: RED}


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Draw all curves with their limit points, and the thesis's statements as marks."""
    computed = [inflated(outcome) for outcome in outcomes.values() if not outcome.failure]
    with drawing(path, 5.0) as figure:
        axes = figure.subplots()
        for curve in computed:
            axes.plot(
                curve.outer_radius, curve.pressure, label=curve.name, color=COLOURS[curve.name]
            )
        reference = membrane()
        axes.plot(
            reference.outer_radius, reference.pressure, label=INCOMPRESSIBLE, color=INK,
            linestyle="--", linewidth=1.0,
        )  # fmt: skip
        with_limit = [curve for curve in computed if not np.isnan(curve.limit_pressure())]
        for curve in with_limit:
            if curve.name == SMOOTH:
                stiffer = scaled(curve)
                axes.plot(
                    stiffer.outer_radius, stiffer.pressure, label=stiffer.name, color=ORANGE,
                    linestyle=":",
                )  # fmt: skip
        limits = np.array([curve.limit_point() for curve in (*with_limit, reference)])
        axes.plot(
            *limits.T, label="limit points", linestyle="none", marker="o", markersize=4.5,
            markerfacecolor="white", markeredgecolor=INK, markeredgewidth=0.9,
        )  # fmt: skip
        _statements(axes)
        if points is not None:
            axes.plot(
                points["outer_radius_mm"], points["pressure_kPa"], label=DIGITISED,
                linestyle="none", marker="x", color=INK,
            )  # fmt: skip
        axes.set(
            xlim=(8.0, 30.0), xticks=np.arange(8.0, 31.0, 2.0), ylim=(0.0, 28.0),
            xlabel="outer radius of the skin at mid length [mm]", ylabel="pressure [kPa]",
        )  # fmt: skip
        figure.legend(loc="outside lower center", ncols=3)


def _statements(axes: Axes) -> None:
    """Mark the thesis's pressures at the radii that they belong to."""
    bar: dict[str, Any] = {"color": INK, "linewidth": 4.0, "solid_capstyle": "butt"}
    beside: dict[str, Any] = {"textcoords": "offset points", "va": "center", "fontsize": 8.5}
    for pipe, (low, high) in TOUCH.items():
        axes.plot([touching(pipe)] * 2, (low - 0.15, high + 0.15), **bar)
        middle = (touching(pipe), 0.5 * (low + high))
        shift = (5, 11 if pipe == min(TOUCH) else 0)  # above the curves
        axes.annotate(f"$P_{{M3}}^S$, {pipe:g} mm pipe", middle, shift, **beside)
    filled = touching(FILLED * SPIKED_DIAMETER)
    axes.plot([filled] * 2, WORKING, **bar)
    text = f"{FILLED:g} OD$_S$ at {WORKING[0]:g} to {WORKING[1]:g} kPa"
    axes.annotate(text, (filled, WORKING[1] - 0.6), (5, 0), **beside)
    grown = touching(GROWTH * SPIKED_DIAMETER)
    axes.axvline(grown, color=INK, linewidth=0.8, linestyle="-.")
    axes.annotate(f"{GROWTH:g} OD$_S$", (grown, 14.0), (-8, 0), ha="right", **beside)
    axes.plot([], [], label="statements of the thesis", **bar)


SCRIPT = Script(
    name=NAME,
    figure="Fig 4.9",
    about=(
        "Pressure over the outer radius of the skin at prescribed volume. Verification: radii and "
        "limit pressure against an incompressible membrane that is solved here, within 5 %. "
        "Statements: the pressures at which the spikes reach the pipes (P_M3^S), 1.5 OD_S at 20 to "
        "26 kPa, growth to 2.5 OD_S, within 15 %, with the factor by which the pressures differ."
    ),
    cases=cases,
    quick=(STIFF, SMOOTH),
    rows=rows,
    draw=draw,
    columns=("pressure_kPa", "outer_radius_mm"),
    remarks=remarks,
)

if __name__ == "__main__":
    command([SCRIPT])
