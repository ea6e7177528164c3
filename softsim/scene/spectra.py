"""Spectra of materials in a scene: stiffness and damping over frequency."""

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, field_validator

from softsim.scene.part import Part
from softsim.scene.quantities import Number, PositiveFrequency, PositivePressure, PositiveTime

WIDEST_BAND = 1e9


def _rises(band: tuple[float, float]) -> tuple[float, float]:
    if band[1] <= band[0]:
        raise ValueError(f"must rise, from the lowest to the highest: {band[0]:g}, {band[1]:g} Hz")
    if band[1] > WIDEST_BAND * band[0]:
        raise ValueError(
            f"{band[0]:g} to {band[1]:g} Hz is too wide to fit: the limit is a factor of "
            f"{WIDEST_BAND:g}"
        )
    return band


Band = Annotated[tuple[PositiveFrequency, PositiveFrequency], AfterValidator(_rises)]
LossFactor = Annotated[Number, Field(ge=0.0, le=2.0)]
Point = tuple[PositiveFrequency, PositivePressure, LossFactor]


class _Spectrum(Part):
    largest_error: Number = Field(
        default=0.05,
        gt=0.0,
        le=0.5,
        description="Largest relative error of the complex modulus of the Prony series fitted to "
        "the spectrum, which has as few terms as this allows. The default is the difference "
        "between two measurements of the same silicone.",
    )


class FractionalSpectrum(_Spectrum):
    """Fractional Kelvin-Voigt model: mu = mu0 (1 + (i omega tau)^n), where mu0 is
    the shear modulus of the law.
    """

    kind: Literal["fractional"] = Field(description="Kind of spectrum.")
    relaxation_time: PositiveTime = Field(description="Time constant tau.")
    order: Number = Field(
        gt=0.0,
        lt=1.0,
        description="Order n of the fractional derivative, between 0 (spring) and 1 (dashpot).",
    )
    band: Band = Field(description="Lowest and highest frequency of the fit.")


class LossFactorSpectrum(_Spectrum):
    """Constant loss factor in a frequency band. The storage modulus rises as omega^n, n = (2/pi)
    atan(loss factor). The constants of the law hold far below the band.
    """

    kind: Literal["loss_factor"] = Field(description="Kind of spectrum.")
    loss_factor: LossFactor = Field(gt=0.0, description="Loss modulus divided by storage modulus.")
    band: Band = Field(description="Lowest and highest frequency of the fit.")


class TableSpectrum(_Spectrum):
    """Measured spectrum. The frequency band of the fit is that of the table."""

    kind: Literal["table"] = Field(description="Kind of spectrum.")
    points: tuple[Point, ...] = Field(
        min_length=2,
        description="[frequency, storage modulus, loss factor] with increasing frequencies.",
    )
    long_term_modulus: PositivePressure | None = Field(
        default=None,
        description="Modulus of the same specimen in slow tests, of the same kind (shear or "
        "Young's) as in the table; only the ratio to it is used. Default: shear modulus of the "
        "law.",
    )

    @field_validator("points")
    @classmethod
    def _frequencies_rise(cls, points: tuple[Point, ...]) -> tuple[Point, ...]:
        for number, (one, following) in enumerate(pairwise(points)):
            if following[0] <= one[0]:
                raise ValueError(
                    f"point {number + 1} must have a higher frequency than point {number}"
                )
        return points


Spectrum = Annotated[
    FractionalSpectrum | LossFactorSpectrum | TableSpectrum, Field(discriminator="kind")
]
