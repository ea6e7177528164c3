"""Spectra of materials and the Maxwell branches fitted to them: curves and numbers."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path

import numpy as np

from softsim.materials.maxwell import MaxwellSeries
from softsim.materials.maxwell_fit import MaxwellFit
from softsim.report.diagram import FLAT, POINTS, Axis, Diagram, Panel, Scale, Series
from softsim.report.png import draw
from softsim.report.style import COLOURS
from softsim.units import format_quantity

SHOWN_BEYOND = 4.0
"""Ratio of the plotted frequency range to the band on each side; there branches are extrapolated.
"""


@dataclass(frozen=True, eq=False)
class DrawnSpectrum:
    """Material with its branches as drawn.

    name, long-term shear modulus [Pa], branches, and their fit to a spectrum, if they are
    fitted.
    """

    name: str
    long_term_modulus: float
    series: MaxwellSeries
    fit: MaxwellFit | None

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency [Hz] of the band of the fit, or of the given branches."""
        if self.fit is not None:
            return self.fit.spectrum.band
        turning = 1.0 / (2.0 * np.pi * self.series.relaxation_times)
        return float(turning.min()), float(turning.max())


def draw_spectra(materials: Sequence[DrawnSpectrum], path: Path) -> None:
    """Draw `spectra_diagram` as PNG. Raises OutputError if the file cannot be written."""
    draw(path, spectra_diagram(materials))


def spectra_diagram(materials: Sequence[DrawnSpectrum]) -> Diagram:
    """Return the diagram of storage modulus, loss factor and fit error over frequency.

    Points are the spectrum, lines the branches, dashed beyond the band.
    """
    storage, loss, errors = [], [], []
    for material, colour in zip(materials, cycle(COLOURS), strict=False):
        low, high = material.band
        inside = np.geomspace(low, high, 300)
        beyond = np.geomspace(low / SHOWN_BEYOND, high * SHOWN_BEYOND, 300)
        modulus = material.series.modulus
        shown = [("", beyond, modulus(beyond), "--"), (material.name, inside, modulus(inside), "-")]
        if material.fit is not None:
            f, target = material.fit.spectrum.frequency, material.fit.spectrum.modulus
            shown.append((f"{material.name}, spectrum", f, target, POINTS))
            misses = 100.0 * np.abs(modulus(f) / target - 1.0)
            largest = np.full(len(f), 100.0 * material.fit.largest_error)
            errors += [Series("", f, misses, colour), Series("", f, largest, colour, ":")]
        for name, f, complex_modulus, kind in shown:
            kilo = material.long_term_modulus * complex_modulus.real / 1e3
            storage.append(Series(name, f, kilo, colour, kind))
            loss.append(Series("", f, complex_modulus.imag / complex_modulus.real, colour, kind))
    panels = [
        Panel(Axis(Scale("storage modulus, shear [kPa]", logarithmic=True), storage)),
        Panel(Axis(Scale("loss factor", from_zero=True), loss)),
    ]
    if errors:
        panels.append(Panel(Axis(Scale("error [%]", from_zero=True), errors), height=FLAT))
    return Diagram("Spectra", Scale("frequency [Hz]", logarithmic=True), panels)


def spectra_rows(material: DrawnSpectrum) -> list[tuple[str, str]]:
    """Return the numbers of a material as (name, text): modulus, band, error, branches."""
    series = material.series
    low, high = (format_quantity(float(f"{f:.3g}"), "Hz") for f in material.band)
    ends = series.modulus(np.array(material.band)).real
    rows = [
        ("long-term", f"{material.long_term_modulus / 1e3:.4g} kPa, shear"),
        (
            "band",
            f"{low} to {high}: storage modulus {ends[0]:.3g} to {ends[1]:.3g} times the "
            "long-term modulus",
        ),
    ]
    if material.fit is not None:
        error = 100.0 * material.fit.largest_error
        rows.append(("error", f"at most {error:.2g} % of the complex modulus"))
    for time, modulus, share in zip(
        series.relaxation_times, series.moduli, series.shares, strict=True
    ):
        shown = format_quantity(float(f"{time:.4g}"), "s")
        rows.append(
            ("branch", f"{shown}, {modulus:.4g} times the long-term modulus, g = {share:.4g}")
        )
    return rows
