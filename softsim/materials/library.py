"""Library of silicones: materials that scenes name, and the published sources of each silicone.

The sources of one silicone differ by tens of per cent, with its batch, cure and age and with the
method of the test. The library states them all, with the spread of their initial shear moduli.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from statistics import NormalDist
from typing import Any

import yaml
from pydantic import Field, TypeAdapter, ValidationInfo, field_validator

from softsim.materials.laws import LAWS, Law, NeoHooke
from softsim.scene import materials as scene_materials
from softsim.scene.quantities import Number, PositivePressure, Spec, Text

LARGEST_AGREEMENT = 1.3
"""Ratio of the highest to the lowest shear modulus up to which sources of a silicone agree."""


class SourceSpec(Spec):
    """Published source of the stiffness of a silicone, as the library states it."""

    citation: Text = Field(description="Authors and publication.")
    url: Text = Field(default="", description="DOI or address.")
    test: Text = Field(description="Mode of the test and specimen.")
    batch: Text = Field(default="", description="Batch of the silicone, if the source states it.")
    strains: tuple[Number, Number] | None = Field(
        default=None, description="Lowest and highest engineering strain of the data."
    )
    shear_modulus: PositivePressure | None = Field(
        default=None, description="Initial shear modulus mu0."
    )
    youngs_modulus: PositivePressure | None = Field(
        default=None, description="Initial Young's modulus, 3 mu0; instead of shear_modulus."
    )
    points: tuple[tuple[Number, PositivePressure], ...] = Field(
        default=(), description="[stretch, nominal stress] of uniaxial tension."
    )

    @field_validator("youngs_modulus")
    @classmethod
    def _one_modulus(cls, value: float | None, info: ValidationInfo) -> float | None:
        if value is not None and info.data.get("shear_modulus") is not None:
            raise ValueError("defines the same property as shear_modulus: give one of them")
        return value


class SiliconeSpec(Spec):
    """Silicone and its sources, as the library states them."""

    title: Text = Field(description="Name of the product.")
    typical: Text = Field(description="Name of the source with the typical shear modulus.")
    sources: dict[Text, SourceSpec] = Field(
        min_length=1, description="Sources by name; that of a material has its name."
    )


@dataclass(frozen=True)
class SiliconeSource:
    """Source of the stiffness of a silicone.

    name: that of the material in the library if `is_material`; law: its law, or the neo-Hookean
    one with its initial shear modulus; strain_range: largest engineering strain of `law`, or None.
    """

    name: str
    spec: SourceSpec
    law: Law
    is_material: bool
    strain_range: float | None

    @property
    def initial_shear_modulus(self) -> float:
        """mu0 [Pa]."""
        return self.law.initial_shear_modulus


@dataclass(frozen=True)
class ModulusSpread:
    """Lowest, typical and highest initial shear modulus [Pa] of the sources of a silicone."""

    low: float
    typical: float
    high: float

    @property
    def agrees(self) -> bool:
        """True if the highest modulus is at most LARGEST_AGREEMENT times the lowest one."""
        return self.high <= LARGEST_AGREEMENT * self.low

    def modulus(self, draw: float) -> float:
        """Return the modulus [Pa] that belongs to a standard normal `draw`.

        Its logarithm has a triangular distribution from the lowest to the highest modulus, with
        its peak at the typical one.
        """
        low, peak, high = map(math.log, (self.low, self.typical, self.high))
        quantile = NormalDist().cdf(draw)
        if quantile * (high - low) < peak - low:
            return math.exp(low + math.sqrt(quantile * (high - low) * (peak - low)))
        return math.exp(high - math.sqrt((1.0 - quantile) * (high - low) * (high - peak)))


@dataclass(frozen=True)
class Silicone:
    """Silicone with its sources, in the order of the library."""

    name: str
    title: str
    typical: str
    sources: tuple[SiliconeSource, ...]

    @property
    def spread(self) -> ModulusSpread | None:
        """Spread of the initial shear modulus; None if there is one source only."""
        if len(self.sources) < 2:
            return None
        moduli = {source.name: source.initial_shear_modulus for source in self.sources}
        return ModulusSpread(min(moduli.values()), moduli[self.typical], max(moduli.values()))


_MATERIAL: TypeAdapter[scene_materials.Material] = TypeAdapter(scene_materials.Material)


@lru_cache
def _library() -> dict[str, Any]:
    text = resources.files("softsim.materials").joinpath("library.yaml").read_text("utf-8")
    return yaml.safe_load(text)


def library_material(name: str) -> scene_materials.Material | None:
    """Return the material `name` of the library, or None."""
    entry = _library()["materials"].get(name)
    return None if entry is None else _MATERIAL.validate_python(entry)


def library_names() -> list[str]:
    """Return the names in the material library."""
    return list(_library()["materials"])


@lru_cache
def silicones() -> Mapping[str, Silicone]:
    """Return the silicones of the library by name."""
    found = {}
    for name, entry in _library()["silicones"].items():
        spec = SiliconeSpec.model_validate(entry)
        sources = tuple(_source(key, source) for key, source in spec.sources.items())
        found[name] = Silicone(name, spec.title, spec.typical, sources)
    return found


def silicone_of(name: str) -> Silicone | None:
    """Return the silicone of this name or of the library's material `name`, or None."""
    for silicone in silicones().values():
        materials = (source.name for source in silicone.sources if source.is_material)
        if name == silicone.name or name in materials:
            return silicone
    return None


MODULI = ("C10", "C20", "C30", "C01", "mu")
"""Keys of the constants of all laws that are stresses."""


def spread_of(name: str, own: Mapping[str, Any] | None) -> ModulusSpread | None:
    """Return the spread of a scene's material `own`, or of the library's material `name`, or None.

    own: its keys in the scene; None where the scene does not define it.
    """
    if own is None:
        silicone = silicone_of(name) if name in library_names() else None
        return None if silicone is None else silicone.spread
    given = _MATERIAL.validate_python(own).spread
    return None if given is None else ModulusSpread(*given)


def drawn_material(
    name: str, own: Mapping[str, Any] | None, spread: ModulusSpread, draw: float
) -> dict[str, Any]:
    """Return the keys of a material with the shear modulus that belongs to a standard normal draw.

    All constants of its law have the same factor, so that its curve keeps its shape. Its spectrum
    stays the same relative to its modulus.
    """
    entry = dict(_library()["materials"][name] if own is None else own)
    data = _MATERIAL.validate_python(entry)
    mu0 = LAWS[data.law](*data.constants).initial_shear_modulus
    factor = spread.modulus(draw) / mu0
    for key in MODULI:
        if key in entry:
            value = getattr(data, key)
            entry[key] = (
                [f"{factor * each!r} Pa" for each in value]
                if isinstance(value, tuple) else f"{factor * value!r} Pa"
            )  # fmt: skip
    spectrum = data.spectrum
    if isinstance(spectrum, scene_materials.TableSpectrum) and spectrum.long_term_modulus is None:
        entry["spectrum"] = {**entry["spectrum"], "long_term_modulus": f"{mu0!r} Pa"}
    return entry


def _source(name: str, spec: SourceSpec) -> SiliconeSource:
    material = library_material(name)
    if material is not None:
        law = LAWS[material.law](*material.constants)
        return SiliconeSource(name, spec, law, True, material.strain_range)
    mu0 = spec.shear_modulus
    if mu0 is None:
        assert spec.youngs_modulus is not None  # the library is part of the program
        mu0 = spec.youngs_modulus / 3.0
    return SiliconeSource(name, spec, NeoHooke(0.5 * mu0), False, None)
