"""Materials of a scene and of the library."""

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from softsim.scene.part import Part
from softsim.scene.quantities import (
    Number,
    PositiveCompressibility,
    PositiveDensity,
    PositivePressure,
    PositiveTime,
    Pressure,
    Text,
    written,
)
from softsim.scene.spectra import Spectrum


def _some(exponent: float) -> float:
    if exponent == 0.0:
        raise ValueError("an exponent must not be 0")
    return exponent


class PronyTerm(Part):
    """Term of a Prony series."""

    g: Number = Field(
        gt=0.0, lt=1.0, description="Fraction of the instantaneous shear modulus that relaxes."
    )
    relaxation_time: PositiveTime = Field(
        description="Relaxation time, in which this part falls to 1/e."
    )


class _Rubber(Part):
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
    source: Text = Field(default="", description="Source of the constants.")
    strain_range: Number | None = Field(
        default=None,
        gt=0.0,
        description="Largest engineering strain of the data to which the constants were fitted.",
    )

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
