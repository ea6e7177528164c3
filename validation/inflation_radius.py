"""Fig 4.9 of the thesis: pressure against the outer radius of the PFR's skin.

Runs the skin as a half section, without spikes (as the thesis's ABAQUS model; also nearly
incompressible, as the membrane is, and with constants fitted to a tensile test), with rows of
spikes as rings of equivalent stiffness, and in space with its 70 spikes.
All are driven by volume, so the curves go on where the pressure falls.

The curves are held against an independent membrane solution, where its file is there
(../shared/reference), and against what the thesis says in words. Digitised points: pressure_kPa,
outer_radius_mm, one row a point.

A claim agrees when computed and reference differ by less than 15 %, the spread between the
thesis's own two values of P_M3^S (Fig 6.6 and Table 6.2).
"""

import csv
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import find_peaks

from softsim.report.style import BLUE, GREEN, INK, ORANGE, PURPLE, QUIET, SKY, drawing
from validation.cases import THINNED, Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points, deviation
from validation.script import Script
from validation.verdicts import Finding, Row, judged, row, shown, within

NAME = "inflation_radius"
ROOT = Path(__file__).resolve().parents[1]
MEMBRANE = ROOT.parent / "shared" / "reference" / "derived_pfr_membrane_inflation.csv"
TOLERANCE = 0.15

SPIKE_HEIGHT = 5.0  # mm, above the skin
SPIKED_DIAMETER = 27.0  # mm, OD_S
# Pipe [mm] -> P_M3^S [kPa] in Table 6.2 and Fig 6.6: where the spikes leave the wall.
TOUCH = {30.0: (9.0, 9.0), 36.0: (11.0, 12.0), 41.0: (12.5, 13.0)}
GROWTH = 2.5  # times OD_S
WORKING = (20.0, 26.0)  # kPa, at which the robot is said to fill 1 to 1.5 OD_S
INCOMPRESSIBLE, DIGITISED = "membrane, incompressible", "thesis, digitised"


@dataclass(frozen=True)
class Curve:
    """pressure [kPa] over outer_radius [mm], in the order of the inflation."""

    name: str
    outer_radius: np.ndarray
    pressure: np.ndarray
    outcome: Outcome | None = None

    def pressure_at(self, radius: float) -> float:
        """Pressure [kPa] at a radius [mm]; NaN beyond the curve."""
        return float(np.interp(radius, self.outer_radius, self.pressure, left=np.nan, right=np.nan))

    def radius_at(self, pressure: float) -> float:
        """Radius [mm] at which the rising branch first reaches a pressure [kPa], or NaN."""
        reached = np.flatnonzero(self.pressure >= pressure)
        if len(reached) == 0 or reached[0] == 0:
            return float("nan")
        k = slice(reached[0] - 1, reached[0] + 1)
        return float(np.interp(pressure, self.pressure[k], self.outer_radius[k]))

    def limit_pressure(self) -> float:
        """The first peak [kPa] above half of the largest pressure from which the curve falls by
        0.2 % of that, more than what is left of vibration; NaN where it rises all the way. Beyond
        three times the radius, where the law stiffens again, nothing counts.
        """
        pressure = self.pressure[self.outer_radius < 3.0 * self.outer_radius[0]]
        if len(pressure) == 0:
            return float("nan")
        largest = pressure.max()
        peaks, _ = find_peaks(pressure, height=0.5 * largest, prominence=0.002 * largest)
        return float(pressure[peaks[0]]) if len(peaks) else float("nan")


SMOOTH, STIFF, RINGED, MEASURED, SOLID = (
    "skin", "skin, nearly incompressible", "skin with rings", "skin, measured constants",
    "skin with 70 spikes in space",
)  # fmt: skip


def cases() -> list[Case]:
    """The skins; the one in space takes minutes."""
    scene = "skin_inflation.yaml"
    found = [
        Case(SMOOTH, scene, THINNED),
        Case(STIFF, scene, (
            "materials={thesis: {law: yeoh, C10: 36 kPa, C20: 0.25 kPa, C30: 0.023 kPa, "
            "density: 1070 kg/m^3, poisson_ratio: 0.4975}}", "bodies.skin.material=thesis",
            "loads.air.profile={kind: smooth_step, value: 23 ml, duration: 0.16 s}",
            "time.end=0.16 s", *THINNED,
        )),
        Case(MEASURED, scene, (
            "bodies.skin.material=dragon_skin_10_measured",
            "loads.air.profile={kind: smooth_step, value: 33 ml, duration: 0.2 s}",
            "time.end=0.2 s", *THINNED,
        )),
        Case(RINGED, "skin_inflation_rings.yaml", THINNED),
    ]  # fmt: skip
    return [*found, Case(SOLID, "skin_inflation_3d.yaml", THINNED)]


def inflated(outcome: Outcome) -> Curve:
    """The curve of a case; one point of NaN where it failed."""
    if outcome.failure:
        nothing = np.array([np.nan])
        return Curve(outcome.name, nothing, nothing, outcome)
    history = outcome.history
    return Curve(outcome.name, 1e3 * history["outer_radius"], 1e-3 * history["pressure"], outcome)


def membrane(length: float = 30.0) -> Curve | None:
    """The membrane solution with the thesis's constants, or None where its file is absent."""
    if not MEMBRANE.is_file():
        return None
    with MEMBRANE.open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(line for line in stream if not line.startswith(('"#', "#"))))
    chosen = [r for r in rows if r["material"] == "thesis_DS10" and float(r["L_mm"]) == length]
    return Curve(
        INCOMPRESSIBLE,
        np.array([float(r["r_outer_mm"]) for r in chosen]),
        np.array([float(r["P_kPa"]) for r in chosen]),
    )


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Verdicts on the membrane, the statements, and the figure's points."""
    reference = membrane()
    for name in (STIFF, SMOOTH):
        yield from against_membrane(inflated(outcomes[name]), reference)
    for name in (SMOOTH, MEASURED, RINGED, SOLID):
        yield from against_statements(inflated(outcomes[name]))
    if points is not None:
        yield against_points(inflated(outcomes[SMOOTH]), points)


def against_membrane(curve: Curve, reference: Curve | None) -> Iterator[Row]:
    """Radii on the rising branch, and the limit point."""
    for pressure in (3.0, 6.0, 8.0):
        known = float("nan") if reference is None else reference.radius_at(pressure)
        claim = f"membrane: outer radius at {pressure:g} kPa; {curve.name}"
        yield compared(claim, known, curve.radius_at(pressure), "mm", curve)
    known = float("nan") if reference is None else reference.limit_pressure()
    claim = f"membrane: limit pressure; {curve.name}"
    yield compared(claim, known, curve.limit_pressure(), "kPa", curve)


def against_statements(curve: Curve) -> Iterator[Row]:
    """What the thesis says of pressures and sizes."""
    for pipe, values in TOUCH.items():
        radius = 0.5 * pipe - SPIKE_HEIGHT
        claim = f"thesis: P_M3^S, spikes reach the {pipe:g} mm pipe; {curve.name}"
        yield compared(claim, float(np.mean(values)), curve.pressure_at(radius), "kPa", curve)
    radius = 0.75 * SPIKED_DIAMETER - SPIKE_HEIGHT
    claim = f"thesis: 1.5 OD_S at {WORKING[0]:g} to {WORKING[1]:g} kPa; {curve.name}"
    yield compared(claim, float(np.mean(WORKING)), curve.pressure_at(radius), "kPa", curve)
    # A run that was not driven that far cannot tell.
    reached = 2.0 * (curve.outer_radius.max() + SPIKE_HEIGHT) / SPIKED_DIAMETER
    grown = GROWTH if reached >= GROWTH else float("nan")
    finding = judged(True, f"driven to {shown(reached, 'OD_S')}", grown)
    claim = f"thesis: the skin can grow to {GROWTH:g} OD_S; {curve.name}"
    yield row(NAME, claim, f"{GROWTH:g} OD_S", finding, _behind(curve))


def compared(claim: str, reference: float, computed: float, unit: str, curve: Curve) -> Row:
    """A number against another, with their ratio."""
    verdict = within(computed, reference, TOLERANCE).verdict
    ratio = computed / reference
    text = shown(computed, unit) + ("" if np.isnan(ratio) else f", ratio {ratio:.2f}")
    return row(NAME, claim, shown(reference, unit), Finding(text, verdict), _behind(curve))


def against_points(curve: Curve, points: Points) -> Row:
    """The radii at the digitised pressures."""
    computed = np.array([curve.radius_at(float(pressure)) for pressure in points["pressure_kPa"]])
    finding = deviation(computed, points["outer_radius_mm"], points["spread"], "mm")
    return row(NAME, "Fig 4.9: radius over pressure", "digitised points", finding, _behind(curve))


def remarks(outcomes: Outcomes) -> Iterable[str]:
    """What cannot be reconciled."""
    limit = inflated(outcomes[SMOOTH]).limit_pressure()
    if np.isnan(limit):
        return
    yield (
        "What cannot be reconciled: a silicone skin with these constants and this size carries at "
        f"most {limit:.2f} kPa in free air. The thesis works at 20 to 26 kPa, "
        f"{np.mean(WORKING) / limit:.1f} times as much, and sees the spikes leave the wall at 9 to "
        "13 kPa. All pressures here go as the stiffness of the skin: what a stiffer one would make "
        "of these statements, `sleeve_stiffness` says."
    )


def _behind(curve: Curve) -> tuple[Outcome, ...]:
    return () if curve.outcome is None else (curve.outcome,)


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """All curves, and the radii at which the spikes reach the pipes."""
    computed = [inflated(outcome) for outcome in outcomes.values() if not outcome.failure]
    curves, reference = list(computed), membrane()
    if reference is not None:
        curves.append(reference)
    if points is not None:
        curves.append(Curve(DIGITISED, points["outer_radius_mm"], points["pressure_kPa"]))
    looks: dict[str, dict[str, Any]] = {
        INCOMPRESSIBLE: {"linestyle": "--", "color": QUIET},
        DIGITISED: {"linestyle": "none", "marker": "o", "color": INK},
    }
    colours = iter((BLUE, SKY, PURPLE, GREEN, ORANGE))
    with drawing(path, 4.2) as figure:
        axes = figure.subplots()
        for curve in curves:
            look = looks.get(curve.name) or {"color": next(colours)}
            axes.plot(curve.outer_radius, curve.pressure, label=curve.name, **look)
        for pipe, values in TOUCH.items():
            radius = 0.5 * pipe - SPIKE_HEIGHT
            axes.plot([radius] * 2, [0.0, 14.0], color=QUIET, linewidth=0.6, zorder=0)
            axes.plot([radius] * 2, (values[0] - 0.06, values[1] + 0.06), color=INK, linewidth=4.0)
            axes.annotate(
                f"{pipe:g} mm pipe", (radius, 14.0), xytext=(0, 2), textcoords="offset points",
                ha="center", fontsize=8, color=QUIET,
            )  # fmt: skip
        axes.plot([], [], color=INK, linewidth=4.0, label="thesis: spikes leave the pipe, P_M3^S")
        largest = max((curve.outer_radius.max() for curve in computed), default=20.0)
        axes.set(
            xlim=(8.0, largest + 0.5), ylim=(0.0, 15.0),
            xlabel="outer radius of the skin at mid length [mm]", ylabel="pressure [kPa]",
        )  # fmt: skip
        axes.legend(loc="lower right")


SCRIPT = Script(
    name=NAME,
    figure="Fig 4.9",
    about=(
        "Pressure against the outer radius of the skin, driven by volume. Claims: the membrane's "
        "radii and limit pressure; the pressures at which the spikes reach the pipes (P_M3^S); "
        "1.5 OD_S at 20 to 26 kPa; growth to 2.5 OD_S. All within 15 %."
    ),
    cases=cases,
    quick=(SMOOTH,),
    rows=rows,
    draw=draw,
    columns=("pressure_kPa", "outer_radius_mm"),
    remarks=remarks,
)

if __name__ == "__main__":
    command([SCRIPT])
