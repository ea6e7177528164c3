"""Materials of a scene and of the library."""

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator

from softsim.scene.quantities import (
    NotNegativePressure,
    Number,
    PositiveCompressibility,
    PositiveDensity,
    PositiveFrequency,
    PositivePressure,
    PositiveTime,
    Pressure,
    Spec,
    Text,
    written,
)

# -------------------------------------------------------------------------------------------------
# Spectra of materials in a scene: stiffness and damping over frequency.

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


class _Spectrum(Spec):
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


def _some(exponent: float) -> float:
    if exponent == 0.0:
        raise ValueError("an exponent must not be 0")
    return exponent


class PronyTerm(Spec):
    """Term of a Prony series."""

    g: Number = Field(
        gt=0.0, lt=1.0, description="Fraction of the instantaneous shear modulus that relaxes."
    )
    relaxation_time: PositiveTime = Field(
        description="Relaxation time, in which this part falls to 1/e."
    )


class MullinsSpec(Spec):
    """Mullins effect (Ogden and Roxburgh): the stress of the law is multiplied by 1 - erf((W_m -
    W) / (m + beta W_m)) / r, where W is its energy density and W_m the largest so far.
    """

    r: Number = Field(
        gt=1.0, description="1/r is the largest fraction of the stress that softening takes away."
    )
    m: NotNegativePressure = Field(
        default=written("0 Pa"),
        description="Energy density, which makes small deformations soften less.",
    )
    beta: Number = Field(
        default=0.0,
        ge=0.0,
        description="Width of the softening over W_m: small values soften more after little "
        "unloading. At least one of m and beta is greater than 0.",
    )

    @model_validator(mode="after")
    def _has_width(self) -> "MullinsSpec":
        if self.m == 0.0 and self.beta == 0.0:
            raise ValueError("give m or beta, greater than 0")
        return self


class _Rubber(Spec):
    density: PositiveDensity = Field(description="Mass density.")
    bulk_modulus: PositivePressure | None = Field(
        default=None,
        description="Bulk modulus kappa in the energy (kappa/2) (J - 1)^2. Give at most one of "
        "bulk_modulus, D1 and poisson_ratio. Default: 20 times the shear modulus, as in "
        "ABAQUS/Explicit.",
    )
    D1: PositiveCompressibility | None = Field(
        default=None, description="Compressibility constant as in ABAQUS: kappa = 2 / D1."
    )
    poisson_ratio: Number | None = Field(
        default=None, ge=0.0, lt=0.5, description="Poisson's ratio at small strain."
    )
    prony: tuple[PronyTerm, ...] = Field(
        default=(), description="Prony series of the shear modulus (viscoelasticity)."
    )
    spectrum: Spectrum | None = Field(
        default=None,
        description="Viscoelasticity as a spectrum, to which a Prony series is fitted; instead of "
        "`prony`. The constants of the law are then the long-term ones, from slow tests.",
    )
    mullins: MullinsSpec | None = Field(
        default=None, description="Softening by the largest deformation so far."
    )
    source: Text = Field(default="", description="Source of the constants.")
    spread: tuple[PositivePressure, PositivePressure, PositivePressure] | None = Field(
        default=None,
        description="Lowest, typical and highest initial shear modulus, from several tests. It "
        "changes nothing in a run: a study can draw from it (`perturb`).",
    )
    strain_range: Number | None = Field(
        default=None,
        gt=0.0,
        description="Largest engineering strain of the data to which the constants were fitted.",
    )

    @field_validator("spread")
    @classmethod
    def _spread_rises(
        cls, value: tuple[float, float, float] | None
    ) -> tuple[float, float, float] | None:
        if value is not None and not value[0] <= value[1] <= value[2]:
            raise ValueError("must rise: lowest, typical and highest modulus")
        return value

    @field_validator("D1", "poisson_ratio")
    @classmethod
    def _one_compressibility(cls, value: float | None, info: ValidationInfo) -> float | None:
        earlier = [n for n in ("bulk_modulus", "D1") if info.data.get(n) is not None]
        if value is not None and earlier:
            raise ValueError(f"defines the same property as {earlier[0]}: give one of them")
        return value

    @field_validator("prony")
    @classmethod
    def _something_remains(cls, prony: tuple[PronyTerm, ...]) -> tuple[PronyTerm, ...]:
        total = sum(term.g for term in prony)
        if total >= 1.0:
            raise ValueError(f"the g of all terms add up to {total:g}; the sum must be less than 1")
        return prony

    @field_validator("spectrum")
    @classmethod
    def _one_viscoelasticity(cls, value: Spectrum | None, info: ValidationInfo) -> Spectrum | None:
        if value is not None and info.data.get("prony"):
            raise ValueError("defines the same property as prony: give one of them")
        return value


class YeohMaterial(_Rubber):
    """Yeoh material: W = C10 k + C20 k^2 + C30 k^3, k = I1_bar - 3, with long-term
    constants.
    """

    law: Literal["yeoh"] = Field(description="Strain-energy function.")
    C10: PositivePressure = Field(description="First constant. The initial shear modulus is 2 C10.")
    C20: Pressure = Field(default=written("0 Pa"), description="Second constant.")
    C30: Pressure = Field(default=written("0 Pa"), description="Third constant.")

    @property
    def constants(self) -> tuple[float, ...]:
        """Constants in the order that the law takes [Pa]."""
        return (self.C10, self.C20, self.C30)


class NeoHookeanMaterial(_Rubber):
    """Neo-Hookean material: W = C10 (I1_bar - 3). The shear modulus is 2 C10."""

    law: Literal["neo_hooke"] = Field(description="Strain-energy function.")
    C10: PositivePressure = Field(description="Constant C10, half the shear modulus.")

    @property
    def constants(self) -> tuple[float, ...]:
        """Constants in the order that the law takes [Pa]."""
        return (self.C10,)


class MooneyRivlinMaterial(_Rubber):
    """Mooney-Rivlin material: W = C10 (I1_bar - 3) + C01 (I2_bar - 3). The shear
    modulus is 2 (C10 + C01).
    """

    law: Literal["mooney_rivlin"] = Field(description="Strain-energy function.")
    C10: Pressure = Field(description="Constant of the first invariant.")
    C01: Pressure = Field(description="Constant of the second invariant.")

    @field_validator("C01")
    @classmethod
    def _stiff_at_rest(cls, C01: float, info: ValidationInfo) -> float:
        C10 = info.data.get("C10")
        if C10 is not None and C10 + C01 <= 0.0:
            raise ValueError(f"C10 + C01 = {C10 + C01:g} Pa must be greater than 0 Pa")
        return C01

    @property
    def constants(self) -> tuple[float, ...]:
        """Constants in the order that the law takes [Pa]."""
        return (self.C10, self.C01)


class OgdenMaterial(_Rubber):
    """Ogden material with the constants of ABAQUS: W = sum 2 mu / alpha^2 (l1^alpha + l2^alpha +
    l3^alpha - 3), where l1, l2, l3 are the isochoric principal stretches. The shear modulus is sum
    mu.
    """

    law: Literal["ogden"] = Field(description="Strain-energy function.")
    mu: tuple[Pressure, ...] = Field(
        min_length=1, max_length=6, description="Shear modulus of each term."
    )
    alpha: tuple[Annotated[Number, AfterValidator(_some)], ...] = Field(
        description="Exponent of each term."
    )

    @field_validator("mu")
    @classmethod
    def _stiff_at_rest(cls, mu: tuple[float, ...]) -> tuple[float, ...]:
        if sum(mu) <= 0.0:
            raise ValueError(f"all terms add up to {sum(mu):g} Pa: must be greater than 0 Pa")
        return mu

    @field_validator("alpha")
    @classmethod
    def _one_for_each(cls, alpha: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        mu = info.data.get("mu")
        if mu is not None and len(alpha) != len(mu):
            raise ValueError(f"must have {len(mu)} numbers, as many as mu, not {len(alpha)}")
        return alpha

    @property
    def constants(self) -> tuple[tuple[float, ...], ...]:
        """Constants in the order that the law takes: moduli [Pa] and exponents [-]."""
        return (self.mu, self.alpha)


Material = Annotated[
    YeohMaterial | NeoHookeanMaterial | MooneyRivlinMaterial | OgdenMaterial,
    Field(discriminator="law"),
]
