"""Spectra of materials beside the Maxwell branches that stand for them: curves and numbers."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter

from softsim.materials.maxwell import MaxwellSeries
from softsim.materials.maxwell_fit import MaxwellFit
from softsim.report.style import COLOURS, INK, drawing
from softsim.units import format_quantity

SHOWN_BEYOND = 4.0
"""How far curves are shown beyond a band, as a factor: there branches are nobody's measurement."""

LEGEND_COLUMNS = 3
"""Names of materials beside each other, above the axes: curves fill these."""


@dataclass(frozen=True, eq=False)
class DrawnSpectrum:
    """A material's name, long-term shear modulus [Pa], branches, and their fit to a spectrum, if
    they are fitted.
    """

    name: str
    long_term_modulus: float
    series: MaxwellSeries
    fit: MaxwellFit | None

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency [Hz] that it stands for: those of given branches span it."""
        if self.fit is not None:
            return self.fit.spectrum.band
        turning = 1.0 / (2.0 * np.pi * self.series.relaxation_times)
        return float(turning.min()), float(turning.max())


def draw_spectra(materials: Sequence[DrawnSpectrum], path: Path) -> None:
    """Storage modulus and loss factor over frequency, and the error of the fit, as PNG.

    Dots are the spectrum, lines the branches, dashed beyond the band. OutputError if the disk
    refuses.
    """
    colours = cycle(COLOURS)
    with drawing(path, height=5.6) as figure:
        storage, loss, error = figure.subplots(3, sharex=True, height_ratios=[3, 3, 1.3])
        for material, colour in zip(materials, colours, strict=False):
            low, high = material.band
            inside = np.geomspace(low, high, 300)
            beyond = np.geomspace(low / SHOWN_BEYOND, high * SHOWN_BEYOND, 300)
            mu0, modulus = material.long_term_modulus, material.series.modulus
            _draw(storage, loss, beyond, mu0 * modulus(beyond), color=colour, ls="--", lw=0.9)
            _draw(storage, loss, inside, mu0 * modulus(inside), color=colour, label=material.name)
            if material.fit is None:
                continue
            frequency, target = material.fit.spectrum.frequency, material.fit.spectrum.modulus
            dots = {"color": colour, "ls": "", "marker": "o", "ms": 3.0, "alpha": 0.45}
            _draw(storage, loss, frequency, mu0 * target, **dots)
            misses = 100.0 * np.abs(modulus(frequency) / target - 1.0)
            error.plot(frequency, misses, color=colour)
            error.axhline(100.0 * material.fit.largest_error, color=colour, lw=0.6, ls=":")
        storage.plot([], [], "o", color=INK, ms=3.0, alpha=0.45, label="spectrum")
        storage.plot([], [], color=INK, label="branches (dashed beyond the band)")
        storage.set_xscale("log")
        storage.set_yscale("log")
        storage.set_ylabel("storage modulus,\nshear [kPa]")
        storage.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        storage.yaxis.set_major_formatter("{x:g}")
        storage.yaxis.set_minor_formatter(NullFormatter())
        named = storage.get_legend_handles_labels()
        figure.legend(*named, loc="outside upper left", ncols=LEGEND_COLUMNS)
        loss.set_ylim(bottom=0.0)
        loss.set_ylabel("loss factor")
        error.set_ylim(bottom=0.0)
        error.set_ylabel("error [%]")
        error.xaxis.set_major_formatter("{x:g}")
        error.set_xlabel("frequency [Hz]")
        figure.align_ylabels()


def _draw(storage: Axes, loss: Axes, frequency: np.ndarray, modulus: np.ndarray, **look) -> None:
    """A complex modulus [Pa] as its two curves."""
    storage.plot(frequency, modulus.real / 1e3, **look)
    loss.plot(frequency, modulus.imag / modulus.real, **look)


def spectra_rows(material: DrawnSpectrum) -> list[tuple[str, str]]:
    """The numbers of a material as (name, text): modulus, band, error, branches."""
    series = material.series
    low, high = (format_quantity(float(f"{f:.3g}"), "Hz") for f in material.band)
    ends = series.modulus(np.array(material.band)).real
    rows = [
        ("long-term", f"{material.long_term_modulus / 1e3:.4g} kPa, shear"),
        ("band", f"{low} to {high}: storage {ends[0]:.3g} to {ends[1]:.3g} times the long-term"),
    ]
    if material.fit is not None:
        error = 100.0 * material.fit.largest_error
        rows.append(("error", f"{error:.2g} % of the complex modulus at most"))
    for time, modulus, share in zip(
        series.relaxation_times, series.moduli, series.shares, strict=True
    ):
        shown = format_quantity(float(f"{time:.4g}"), "s")
        rows.append(("branch", f"{shown}, {modulus:.4g} times the long-term, g = {share:.4g}"))
    return rows
