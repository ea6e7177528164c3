"""Ecoflex 00-30 and 00-50 in compression, predicted from their tension in another laboratory.

Protocol. Data: modulus in uniaxial compression of Ecoflex 00-30 and 00-50 without thinner (Dawood,
phantom-material-database): mean and standard deviation of repeated tests. The database states
neither the shape of the specimens, nor the friction on the plates, nor the strain range of the
modulus. Ecoflex 00-10 and the thinned mixtures are not predicted, because no tension of them is at
hand.

Constants: Yeoh's law with two terms, fitted to the tension to failure of each silicone (Marechal
et al.) up to a strain of 2, with the default lower limit of fit-material: the way in which the
material library of softsim was made. For Ecoflex 00-30 also the initial shear modulus of 22 kPa
from the tension of a long strip (arXiv 2603.18839, 21 to 23 kPa).

Prediction: initial modulus 3 mu0 of a specimen that slides freely on the plates, no mesh.

Band: 30 %, the difference between sources above which softsim calls a material uncertain. Ratio of
the two silicones: 15 %, because shape, friction and strain range cancel if both were tested alike.

Bounds: as the conditions are not stated, it is also judged whether the measured modulus lies
between the initial modulus of a sliding specimen and the secant modulus at a compression of 30 %
of a bonded one with the shape of ASTM D575 (28.6 mm wide, 12.5 mm high), whose stiffness is 1 + 2
S^2 times as large with S = diameter / (4 height) (Gent and Lindley 1959). Agreement of this kind
is weak evidence.

It was known before the first run that the library's initial modulus of Ecoflex 00-30 is 47 kPa and
the measured one 97 kPa, so the first claim was expected to fail.
"""

import csv
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from softsim.materials.fitting import fit_law, read_tensile_test
from softsim.materials.laws import LAWS, UNIAXIAL, Law, NeoHooke
from softsim.report.style import BLUE, INK, ORANGE, drawing
from validation.cases import Outcomes
from validation.command import command
from validation.digitised import Points
from validation.published import MEASURED, REFERENCE
from validation.script import PUBLISHED, Script
from validation.verdicts import Row, between, percent, row, shown, signed, within

NAME = "silicone_compression"
DATA = MEASURED / NAME
BAND, BAND_OF_RATIO = 0.3, 0.15
SPECIMENS = {"Ecoflex 00-30": "EF30_0T", "Ecoflex 00-50": "EF50_0T"}
SHORT, STRIP = "tension to failure", "tension of a long strip"
SOURCES = (("Ecoflex 00-30", SHORT), ("Ecoflex 00-30", STRIP), ("Ecoflex 00-50", SHORT))
LONG_STRIP_MODULUS = 22e3  # Pa, initial shear modulus
LARGEST_STRAIN, TERMS = 2.0, 2
SHAPE_FACTOR = 28.6 / (4.0 * 12.5)
COMPRESSION = 0.3


@cache
def measured(silicone: str) -> tuple[float, float]:
    """Return mean and standard deviation of the modulus in compression [Pa]."""
    with (DATA / "phantoms_table.csv").open(encoding="utf-8", newline="") as stream:
        lines = {line["sample_label"]: line for line in csv.DictReader(stream)}
    line = lines[SPECIMENS[silicone]]
    mean, deviation = (float(line[f"elastic_modulus_{key}_kPa"]) for key in ("mean", "std"))
    return 1e3 * mean, 1e3 * deviation


@cache
def law(silicone: str, source: str) -> Law:
    """Return the law of a silicone by one of its tests in tension."""
    if source == STRIP:
        return NeoHooke(LONG_STRIP_MODULUS / 2.0)
    test = read_tensile_test(REFERENCE / "tensile" / f"{silicone.replace(' ', '_')}.csv")
    return fit_law(test, LAWS["yeoh"], LARGEST_STRAIN, terms=TERMS).law


def sliding(silicone: str, source: str) -> float:
    """Return the initial modulus in compression without friction [Pa]."""
    return 3.0 * law(silicone, source).initial_shear_modulus


def bonded(silicone: str, source: str) -> float:
    """Return the secant modulus of a bonded specimen at the largest compression [Pa]."""
    stress = UNIAXIAL.nominal_stress(law(silicone, source), np.array(1.0 - COMPRESSION))
    return float(-stress / COMPRESSION) * (1.0 + 2.0 * SHAPE_FACTOR**2)


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Yield the modulus, its bounds and the ratio of the silicones."""
    for silicone, source in SOURCES:
        mean, deviation = measured(silicone)
        text = f"{mean / 1e3:.4g} +- {deviation / 1e3:.2g} kPa"
        value = sliding(silicone, source)
        found = within(value / 1e3, mean / 1e3, BAND, "kPa")
        claim = f"{silicone}, modulus, from {source}"
        yield row(None, claim, text, found, (), signed(value / mean - 1.0), percent(BAND))
        most = bonded(silicone, source)
        found = between(mean / 1e3, value / 1e3, most / 1e3, "kPa")
        bounds = f"{value / 1e3:.4g} to {most / 1e3:.4g} kPa"
        claim = f"{silicone}, modulus within the bounds from {source}"
        yield Row(None, claim, text, bounds, found.verdict, "", "sliding to bonded")
    (hard, _), (soft, _) = measured("Ecoflex 00-50"), measured("Ecoflex 00-30")
    value = sliding("Ecoflex 00-50", SHORT) / sliding("Ecoflex 00-30", SHORT)
    found = within(value, hard / soft, BAND_OF_RATIO)
    error, band = signed(value * soft / hard - 1.0), percent(BAND_OF_RATIO)
    claim = f"Ecoflex 00-50 over 00-30, modulus, from {SHORT}"
    yield row(None, claim, shown(hard / soft), found, (), error, band)


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Draw the measured modulus, the prediction and its bounds."""
    with drawing(path, 2.4) as figure:
        axes = figure.subplots()
        for place, (silicone, source) in enumerate(SOURCES):
            mean, deviation = measured(silicone)
            value, most = sliding(silicone, source), bonded(silicone, source)
            is_first = place == 0
            axes.plot(
                (value / 1e3, most / 1e3), (place, place), color=BLUE, linewidth=3, alpha=0.4,
                label="sliding to bonded specimen" if is_first else None,
            )  # fmt: skip
            axes.plot(value / 1e3, place, "o", color=BLUE, label="predicted" if is_first else None)
            axes.errorbar(
                mean / 1e3, place, xerr=deviation / 1e3, fmt="D", color=ORANGE, ecolor=INK,
                label="measured" if is_first else None,
            )  # fmt: skip
        axes.set_yticks(range(len(SOURCES)), [", ".join(source) for source in SOURCES])
        axes.set(xlabel="modulus in compression [kPa]", xlim=(0.0, None), ylim=(2.5, -0.5))
        figure.legend(loc="outside upper center", ncols=3)


SCRIPT = Script(
    name=NAME,
    figure="Dawood, phantom-material-database; Marechal et al., doi 10.1089/soro.2019.0115",
    about=__doc__,
    quick=(),
    rows=rows,
    draw=draw,
    evidence=PUBLISHED,
    data=DATA,
)

if __name__ == "__main__":
    command([SCRIPT])
