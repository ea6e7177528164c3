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
    """One term of a Prony series."""

    g: Number = Field(
        gt=0.0, lt=1.0, description="Share of the instantaneous shear modulus that relaxes."
    )
    relaxation_time: PositiveTime = Field(description="Time in which it falls to 1/e.")


class _Rubber(Part):
    density: PositiveDensity = Field(description="Mass density.")
    bulk_modulus: PositivePressure | None = Field(
        default=None, description="kappa in (kappa/2) (J - 1)^2. Give at most one of bulk_modulus, "
        "D1, poisson_ratio; without any, kappa = 20 times the shear modulus, as ABAQUS/Explicit."
    )  # fmt: skip
    D1: PositiveCompressibility | None = Field(
        default=None, description="ABAQUS's compressibility, kappa = 2 / D1."
    )
    poisson_ratio: Number | None = Field(
        default=None, ge=0.0, lt=0.5, description="Poisson's ratio at small strain."
    )
    prony: tuple[PronyTerm, ...] = Field(default=(), description="Viscoelastic shear relaxation.")
    spectrum: Spectrum | None = Field(
        default=None,
        description="Viscoelasticity as a spectrum, to which a Prony series is fitted; instead of "
        "prony. The constants of the law are those of slow tests.",
    )
    source: Text = Field(default="", description="Where the constants come from.")
    strain_range: Number | None = Field(
        default=None, gt=0.0, description="Largest engineering strain that they were fitted on."
    )

    @field_validator("D1", "poisson_ratio")
    @classmethod
    def _one_compressibility(cls, value: float | None, info: ValidationInfo) -> float | None:
        earlier = [n for n in ("bulk_modulus", "D1") if info.data.get(n) is not None]
        if value is not None and earlier:
            raise ValueError(f"says the same thing as {earlier[0]}: give one of them")
        return value

    @field_validator("prony")
    @classmethod
    def _something_remains(cls, prony: tuple[PronyTerm, ...]) -> tuple[PronyTerm, ...]:
        total = sum(term.g for term in prony)
        if total >= 1.0:
            raise ValueError(f"the g of all terms add up to {total:g}: must stay below 1")
        return prony

    @field_validator("spectrum")
    @classmethod
    def _one_viscoelasticity(cls, value: Spectrum | None, info: ValidationInfo) -> Spectrum | None:
        if value is not None and info.data.get("prony"):
            raise ValueError("says the same thing as prony: give one of them")
        return value


class YeohMaterial(_Rubber):
    """A Yeoh solid: W = C10 k + C20 k^2 + C30 k^3, k = I1_bar - 3, long-term constants."""

    law: Literal["yeoh"] = Field(description="The strain-energy law.")
    C10: PositivePressure = Field(description="First constant; the shear modulus is 2 C10.")
    C20: Pressure = Field(default=written("0 Pa"), description="Second constant.")
    C30: Pressure = Field(default=written("0 Pa"), description="Third constant.")

    @property
    def constants(self) -> tuple[float, ...]:
        """Of the law, as it takes them [Pa]."""
        return (self.C10, self.C20, self.C30)


class NeoHookeanMaterial(_Rubber):
    """A neo-Hookean solid: W = C10 (I1_bar - 3), the shear modulus is 2 C10."""

    law: Literal["neo_hooke"] = Field(description="The strain-energy law.")
    C10: PositivePressure = Field(description="The constant; the shear modulus is 2 C10.")

    @property
    def constants(self) -> tuple[float, ...]:
        """Of the law, as it takes them [Pa]."""
        return (self.C10,)


class MooneyRivlinMaterial(_Rubber):
    """A Mooney-Rivlin solid: W = C10 (I1_bar - 3) + C01 (I2_bar - 3), the shear modulus is
    2 (C10 + C01).
    """

    law: Literal["mooney_rivlin"] = Field(description="The strain-energy law.")
    C10: Pressure = Field(description="Of the first invariant.")
    C01: Pressure = Field(description="Of the second invariant.")

    @field_validator("C01")
    @classmethod
    def _stiff_at_rest(cls, C01: float, info: ValidationInfo) -> float:
        C10 = info.data.get("C10")
        if C10 is not None and C10 + C01 <= 0.0:
            raise ValueError(f"C10 + C01 = {C10 + C01:g} Pa must be greater than 0 Pa")
        return C01

    @property
    def constants(self) -> tuple[float, ...]:
        """Of the law, as it takes them [Pa]."""
        return (self.C10, self.C01)


class OgdenMaterial(_Rubber):
    """An Ogden solid, with ABAQUS's constants: W = sum 2 mu / alpha^2 (l1^alpha + l2^alpha +
    l3^alpha - 3), l1, l2, l3 the isochoric principal stretches; the shear modulus is sum mu.
    """

    law: Literal["ogden"] = Field(description="The strain-energy law.")
    mu: tuple[Pressure, ...] = Field(min_length=1, max_length=6, description="Of each term.")
    alpha: tuple[Annotated[Number, AfterValidator(_some)], ...] = Field(
        description="The exponent of each term."
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
        """Of the law, as it takes them: moduli [Pa] and exponents [-]."""
        return (self.mu, self.alpha)


Material = Annotated[
    YeohMaterial | NeoHookeanMaterial | MooneyRivlinMaterial | OgdenMaterial,
    Field(discriminator="law"),
]
