"""Maxwell branches of a material: given as a Prony series, or fitted to its spectrum."""

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from softsim.materials.laws import LAWS
from softsim.materials.maxwell import MaxwellSeries
from softsim.materials.maxwell_fit import MaxwellFit, fewest_branches
from softsim.materials.spectrum import Spectrum, constant_loss_factor, fractional, measured
from softsim.scene import spectra
from softsim.scene.materials import Material

SPECTRA: Mapping[str, Callable[[Any, float], Spectrum]] = {
    "fractional": lambda data, _: fractional(data.relaxation_time, data.order, data.band),
    "loss_factor": lambda data, _: constant_loss_factor(data.loss_factor, data.band),
    "table": lambda data, mu0: measured(data.points, data.long_term_modulus or mu0),
}
"""Kind of a scene's spectrum -> the spectrum, of a law with a shear modulus at rest [Pa]."""


def viscoelasticity(data: Material) -> tuple[MaxwellSeries, MaxwellFit | None]:
    """Return the Maxwell branches of a material, and their fit to its spectrum or None.

    Without a spectrum they are those of its Prony series.

    Raises
    ------
    MaterialError: a spectrum that branches do not meet.
    """
    if data.spectrum is None:
        return MaxwellSeries.of_prony([(term.g, term.relaxation_time) for term in data.prony]), None
    mu0 = LAWS[data.law](*data.constants).initial_shear_modulus
    fit = fitted(data.spectrum, mu0)
    return fit.series, fit


@lru_cache
def fitted(data: spectra.Spectrum, mu0: float) -> MaxwellFit:
    """Return the fit to a scene's spectrum; mu0 [Pa] is the law's shear modulus at rest.

    It is stored, because it takes a third of a second and the cases of a study build the same
    material again.

    Raises
    ------
    MaterialError: no branches meet the spectrum.
    """
    return fewest_branches(SPECTRA[data.kind](data, mu0), data.largest_error)
