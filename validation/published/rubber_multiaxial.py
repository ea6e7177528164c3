"""Rubbers in several modes of deformation, predicted from their uniaxial tension alone.

Protocol. Data: nominal stress over stretch of two natural rubbers (Treloar 1944, Kawabata 1981) and
of two silicones (end-linked PDMS, Kawamura 2001; RTV 141, Meunier 2008), in uniaxial tension and in
two or three other modes: equibiaxial, planar (pure shear), uniaxial compression, and for PDMS a
sheet stretched by different amounts along two axes (stress on either axis).

Constants: each law of softsim with its largest number of terms is fitted to the uniaxial tension of
a material by least squares (softsim.materials.fitting.fit_law, all points with a strain above 0,
because these tests measured strain on the specimen). Two fits: to stretches up to 2, the range of
soft robots, and to the whole test. The second is judged for the natural rubbers only, because both
silicones were tested up to stretches of about 2. Compressive points are not fitted.

Prediction: closed form of the incompressible solid, no mesh. A point is compared if its I1 is at
most that of the fitted range; points beyond it are drawn only. Error of a mode: root mean square of
predicted minus measured nominal stress over the root mean square of the measured one, each point
with the same weight.

Band: 10 % in every other mode of the material. A law agrees if all its modes are within it. The
spread of nominally equal tests in two laboratories is about as large. For fewer terms of a law the
errors are listed without a verdict.

Compression and equibiaxial tension are the same deformation of an isotropic incompressible solid.
The difference of their measured true stresses is listed too, for it bounds what any law can achieve
in both modes.

The data had been looked at before this protocol was written, no fit to them had been made.

Changed after the first comparison: fits of Ogden's law keep their exponents between -10 and 10, so
its errors are no blind prediction.
"""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from softsim.errors import MaterialError
from softsim.materials.fitting import TensileTest, fit_law
from softsim.materials.laws import LAWS, Law
from softsim.report.style import BLUE, GREEN, INK, ORANGE, PURPLE, QUIET, drawing
from validation.cases import Outcomes
from validation.command import command
from validation.digitised import Points
from validation.published import MEASURED
from validation.script import PUBLISHED, Listing, Script
from validation.verdicts import Row, judged, percent, row

NAME = "rubber_multiaxial"
DATA = MEASURED / NAME
BAND = 0.1
MODERATE, WHOLE = 2.0, np.inf
"""Largest stretch of the two fits."""
TENSION, COMPRESSION, BIAXIAL = "uniaxial", "uniaxial compression", "biaxial"
EQUIBIAXIAL, PLANAR = "equibiaxial", "pure shear"
MODES = (EQUIBIAXIAL, PLANAR, COMPRESSION, BIAXIAL)
MATERIALS = {
    "Treloar_1944": "natural rubber (Treloar 1944)",
    "Kawabata_1981": "natural rubber (Kawabata 1981)",
    "Kawamura_2001": "PDMS (Kawamura 2001)",
    "Meunier_2008": "silicone RTV 141 (Meunier 2008)",
}
LONG = ("Treloar_1944", "Kawabata_1981")
"""Materials tested to stretches far beyond 2."""
COLOURS = dict(zip(LAWS, (BLUE, GREEN, PURPLE, ORANGE), strict=True))
MARKERS = {TENSION: "o", EQUIBIAXIAL: "s", PLANAR: "^", COMPRESSION: "v"}
FEWER_TERMS = (("yeoh", 2), ("ogden", 1), ("ogden", 2))


@dataclass(frozen=True, eq=False)
class Measured:
    """Points of one mode: squared stretches (points, 3) [-] and nominal stress (points,) [Pa].

    axis: the axis of the stress, 0 or 1, (points,); the third axis is free.
    """

    squared_stretches: np.ndarray
    stress: np.ndarray
    axis: np.ndarray

    @property
    def stretch(self) -> np.ndarray:
        """Stretch along the axis of the stress (points,)."""
        return np.sqrt(self.squared_stretches[np.arange(len(self.axis)), self.axis])

    @property
    def I1(self) -> np.ndarray:
        """First invariant (points,)."""
        return self.squared_stretches.sum(axis=1)

    def predicted(self, law: Law) -> np.ndarray:
        """Return the nominal stress of the incompressible solid (points,) [Pa]."""
        tau = law.extra_stress(self.squared_stretches)
        along = tau[np.arange(len(self.axis)), self.axis]
        return np.asarray((along - tau[:, 2]) / self.stretch)

    def within(self, largest_I1: float) -> np.ndarray:
        """Return True for points up to an I1 (points,)."""
        return np.less_equal(self.I1, largest_I1 * (1.0 + 1e-9))

    def error(self, law: Law, largest_I1: float) -> float:
        """Return the relative error [-] of the points up to an I1."""
        inside = self.within(largest_I1)
        off = self.predicted(law)[inside] - self.stress[inside]
        return float(np.linalg.norm(off) / np.linalg.norm(self.stress[inside]))


@cache
def measured() -> dict[str, dict[str, Measured]]:
    """Return material -> mode -> points; compression is a mode of its own."""
    collected: dict[str, dict[str, list[tuple[float, float, float, int]]]] = {}
    with (DATA / "tests.csv").open(encoding="utf-8", newline="") as stream:
        for line in csv.DictReader(stream):
            mode, first = line["test"], float(line["stretch_1"])
            if mode == TENSION and first < 1.0:
                mode = COMPRESSION
            second = _second_stretch(mode, first, line["stretch_2"])
            axis = 0 if line["nominal_stress_1_MPa"] else 1
            stress = 1e6 * float(line[f"nominal_stress_{axis + 1}_MPa"])
            points = collected.setdefault(line["source"], {}).setdefault(mode, [])
            points.append((first, second, stress, axis))
    return {
        source: {mode: _points(rows) for mode, rows in modes.items()}
        for source, modes in collected.items()
    }


def _second_stretch(mode: str, first: float, given: str) -> float:
    if given:
        return float(given)
    return {EQUIBIAXIAL: first, PLANAR: 1.0}.get(mode, first**-0.5)


def _points(rows: list[tuple[float, float, float, int]]) -> Measured:
    first, second, stress, axis = (np.array(column) for column in zip(*rows, strict=True))
    stretches = np.stack([first, second, 1.0 / (first * second)], axis=1)
    return Measured(stretches**2, stress, axis)


@cache
def fitted(source: str, law: str, terms: int | None, largest_stretch: float) -> Law | str:
    """Return a law fitted to the uniaxial tension of a material, or why there is none."""
    tension = measured()[source][TENSION]
    test = TensileTest(tension.stretch - 1.0, tension.stress, source)
    try:
        return fit_law(test, LAWS[law], largest_stretch - 1.0, 0.0, terms).law
    except MaterialError as error:
        return str(error).splitlines()[0].removeprefix(f"{source}: ")


def errors(source: str, law: str, terms: int | None, largest_stretch: float) -> dict[str, float]:
    """Return the error of each mode that was measured, of the fitted one first; NaN without fit."""
    modes = measured()[source]
    chosen = [mode for mode in (TENSION, *MODES) if mode in modes]
    model = fitted(source, law, terms, largest_stretch)
    if isinstance(model, str):
        return dict.fromkeys(chosen, np.nan)
    tension = modes[TENSION]
    largest_I1 = tension.I1[tension.stretch <= largest_stretch].max()
    return {mode: modes[mode].error(model, largest_I1) for mode in chosen}


def ranges(source: str) -> tuple[float, ...]:
    """Return the largest stretches of the fits of a material."""
    return (MODERATE, WHOLE) if source in LONG else (MODERATE,)


def range_name(largest_stretch: float) -> str:
    """Return the range of a fit in words."""
    return "whole test" if np.isinf(largest_stretch) else f"stretch up to {largest_stretch:g}"


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Yield a claim per material, law and range of the fit: all other modes are within the band."""
    for source, material in MATERIALS.items():
        for largest_stretch in ranges(source):
            for law in LAWS:
                others = errors(source, law, None, largest_stretch)
                fit = others.pop(TENSION)
                worst = max(others.values())
                claim = f"{material}, {range_name(largest_stretch)}: {law}"
                model = fitted(source, law, None, largest_stretch)
                text = f"uniaxial fitted within {percent(fit)}" if isinstance(model, Law) else model
                found = judged(worst <= BAND, text, worst)
                error = ", ".join(f"{mode} {percent(value)}" for mode, value in others.items())
                yield row(None, claim, ", ".join(others), found, (), error, percent(BAND))


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """Yield a summary per law, errors with fewer terms, constants, consistency of the data."""
    yield Listing(
        "Summary: errors of all predicted modes of all materials",
        ("law", "fit", f"modes within {percent(BAND)}", "median", "largest"),
        tuple(_summary(law, largest) for largest in (MODERATE, WHOLE) for law in LAWS),
    )
    lines = [
        (f"{law}, {terms} term{'s' if terms > 1 else ''}", material, range_name(largest_stretch),
         *(percent(found[mode]) if mode in found else "-" for mode in (TENSION, *MODES)))
        for law, terms in FEWER_TERMS
        for source, material in MATERIALS.items()
        for largest_stretch in ranges(source)
        for found in [errors(source, law, terms, largest_stretch)]
    ]  # fmt: skip
    yield Listing("Fewer terms", ("law", "material", "fit", TENSION, *MODES), tuple(lines))
    constants = [
        (material, range_name(largest_stretch), law, constants_of(source, law, largest_stretch))
        for source, material in MATERIALS.items()
        for largest_stretch in ranges(source)
        for law in LAWS
    ]
    yield Listing("Fitted constants", ("material", "fit", "law", "constants"), tuple(constants))
    consistency = [
        (material, percent(inconsistency(measured()[source])))
        for source, material in MATERIALS.items()
        if COMPRESSION in measured()[source]
    ]
    heading = "equibiaxial true stress minus that of the same deformation in compression, rms"
    yield Listing("Consistency of the data", ("material", heading), tuple(consistency))


def _summary(law: str, largest_stretch: float) -> tuple[str, ...]:
    """Return a line of the summary; modes without a fit are not counted."""
    found = [
        error
        for source in MATERIALS
        if largest_stretch in ranges(source)
        for mode, error in errors(source, law, None, largest_stretch).items()
        if mode != TENSION and not np.isnan(error)
    ]
    within = f"{sum(error <= BAND for error in found)} of {len(found)}"
    middle, largest = percent(float(np.median(found))), percent(max(found))
    return law, range_name(largest_stretch), within, middle, largest


def constants_of(source: str, law: str, largest_stretch: float) -> str:
    """Return the fitted constants as a text, moduli in kPa."""
    model = fitted(source, law, None, largest_stretch)
    if isinstance(model, str):
        return model
    return ", ".join(
        f"{name} = {_constant(value, name in model.pure_numbers)}"
        for name, value in vars(model).items()
    )


def _constant(value: float | tuple[float, ...], is_pure: bool) -> str:
    values = value if isinstance(value, tuple) else (value,)
    text = ", ".join(f"{v if is_pure else v / 1e3:.4g}" for v in values)
    text = f"({text})" if isinstance(value, tuple) else text
    return text if is_pure else f"{text} kPa"


def inconsistency(modes: dict[str, Measured]) -> float:
    """Return the relative difference of equibiaxial tension and compression of one material.

    Compression to l has the stretches l, l^-1/2, l^-1/2, as equibiaxial tension to l^-1/2, and the
    principal stresses differ by a pressure: the true stresses are opposite.
    """
    tension, compression = modes[EQUIBIAXIAL], modes[COMPRESSION]
    order = np.argsort(-compression.stretch)
    stretch = np.r_[1.0, compression.stretch[order] ** -0.5]
    true_stress = np.r_[0.0, -(compression.stress * compression.stretch)[order]]
    common = tension.stretch <= stretch[-1]
    own = (tension.stress * tension.stretch)[common]
    other = np.interp(tension.stretch[common], stretch, true_stress)
    return float(np.linalg.norm(own - other) / np.linalg.norm(own))


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Draw measurement and prediction of each mode: a line of panels per material and range."""
    panels = [(source, largest) for source in MATERIALS for largest in ranges(source)]
    with drawing(path, 2.0 * len(panels)) as figure:
        grid = figure.subplots(len(panels), 4, squeeze=False)
        for axes, (source, largest_stretch) in zip(grid, panels, strict=True):
            modes = measured()[source]
            largest_I1 = modes[TENSION].I1[modes[TENSION].stretch <= largest_stretch].max()
            chosen = [mode for mode in (TENSION, *MODES) if mode in modes]
            for panel, mode in zip(axes, chosen, strict=False):
                models = {law: fitted(source, law, None, largest_stretch) for law in LAWS}
                _draw_mode(panel, mode, modes[mode], models, largest_I1)
            for panel in axes[len(chosen) :]:
                panel.set_visible(False)
            axes[0].set_ylabel("nominal stress [MPa]")
            axes[0].set_title(
                f"{MATERIALS[source]}, {range_name(largest_stretch)}\nuniaxial, fitted"
            )
        for panel in grid[-1]:
            panel.set_xlabel("stretch")
        handles, labels = grid[-1][0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))


def _draw_mode(
    panel: Axes, mode: str, data: Measured, models: dict[str, Law | str], largest_I1: float
) -> None:
    """Draw one mode: points within the range filled, those beyond it open, and all laws."""
    inside, near = data.within(largest_I1), data.within(2.0 * largest_I1 - 3.0)
    if mode == BIAXIAL:
        for law, model in models.items():
            if isinstance(model, Law):
                stress = data.predicted(model)[inside] / 1e6
                panel.plot(data.stress[inside] / 1e6, stress, ".", color=COLOURS[law], markersize=2)
        panel.axline((0.0, 0.0), slope=1.0, color=INK, linewidth=0.7)
        panel.set_title("biaxial: predicted\nover measured [MPa]")
        return
    for chosen, face in ((inside, INK), (near & ~inside, "none")):
        panel.plot(
            data.stretch[chosen], data.stress[chosen] / 1e6, MARKERS[mode], color=QUIET,
            markerfacecolor=face, markeredgecolor=INK, markersize=3, markeredgewidth=0.5,
        )  # fmt: skip
    stretches = np.linspace(1.0, data.stretch[inside][np.argmax(data.I1[inside])], 100)
    path = _points([(first, _second_stretch(mode, first, ""), 0.0, 0) for first in stretches])
    for law, model in models.items():
        if isinstance(model, Law):
            stress = path.predicted(model) / 1e6
            panel.plot(path.stretch, stress, color=COLOURS[law], linewidth=1.0, label=law)
    shown_stress = data.stress[near] / 1e6
    room = 0.15 * np.ptp(shown_stress)
    panel.set_ylim(shown_stress.min() - room, shown_stress.max() + room)
    panel.set_title(mode)


SCRIPT = Script(
    name=NAME,
    figure="Treloar 1944, Kawabata 1981, Kawamura 2001, Meunier 2008",
    about=__doc__,
    quick=(),
    rows=rows,
    draw=draw,
    listings=listings,
    evidence=PUBLISHED,
    data=DATA,
)

if __name__ == "__main__":
    command([SCRIPT])
