"""Materials that scenes name: those of the library with its silicones, and those of the scene.

The sources of one silicone differ by tens of per cent, with its batch, cure and age and with the
method of the test. The library states them all, with the spread of their initial shear moduli.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib import resources
from statistics import NormalDist
from typing import Any

import yaml
from pydantic import Field, TypeAdapter, ValidationInfo, field_validator

from softsim.errors import MaterialError
from softsim.materials.fitting import first_unstable_I1
from softsim.materials.laws import LAWS, Law, NeoHooke
from softsim.materials.material import (
    DEFAULT_BULK_RATIO,
    Material,
    MaxwellFit,
    MaxwellSeries,
    Mullins,
    Spectrum,
    bulk_modulus_from_poisson_ratio,
    constant_loss_factor,
    fewest_branches,
    fractional,
    measured,
)
from softsim.scene import materials as scene_materials
from softsim.scene.loading import LoadedScene
from softsim.scene.names import close_names
from softsim.scene.quantities import Number, PositivePressure, Spec, Text
from softsim.scene.schema import Scene
from softsim.scene.text import Keys

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


# -------------------------------------------------------------------------------------------------
# Maxwell branches of a material: given as a Prony series, or fitted to its spectrum.

SPECTRA: Mapping[str, Callable[[Any, float], Spectrum]] = {
    "fractional": lambda data, _: fractional(data.relaxation_time, data.order, data.band),
    "loss_factor": lambda data, _: constant_loss_factor(data.loss_factor, data.band),
    "table": lambda data, mu0: measured(data.points, data.long_term_modulus or mu0),
}
"""Kind of a scene's spectrum -> the spectrum, of a law with a shear modulus at rest [Pa]."""


def viscoelasticity(data: scene_materials.Material) -> tuple[MaxwellSeries, MaxwellFit | None]:
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
def fitted(data: scene_materials.Spectrum, mu0: float) -> MaxwellFit:
    """Return the fit to a scene's spectrum; mu0 [Pa] is the law's shear modulus at rest.

    It is stored, because it takes a third of a second and the cases of a study build the same
    material again.

    Raises
    ------
    MaterialError: no branches meet the spectrum.
    """
    return fewest_branches(SPECTRA[data.kind](data, mu0), data.largest_error)


# -------------------------------------------------------------------------------------------------
# Materials that a scene names: its own and those of the library.


def materials_of(loaded: LoadedScene) -> dict[str, tuple[Keys, scene_materials.Material]]:
    """Return the materials that the scene defines or names: name -> key and data.

    They are those that the scene gives, and those of the library that its bodies and regions name.
    """
    scene = loaded.scene
    found: dict[str, tuple[Keys, scene_materials.Material]] = {
        name: (("materials", name), data) for name, data in scene.materials.items()
    }
    for keys, name in named_materials(scene).items():
        named = library_material(name)
        if named is not None:
            found.setdefault(name, (keys, named))
    return found


def named_materials(scene: Scene) -> dict[Keys, str]:
    """Return the names of the materials of bodies and regions, by the keys at which they stand."""
    found: dict[Keys, str] = {}
    for body, data in scene.bodies.items():
        found["bodies", body, "material"] = data.material
        for region, own in data.regions.items():
            if own.material is not None:
                found["bodies", body, "regions", region, "material"] = own.material
    return found


def disagreement_notes(loaded: LoadedScene) -> list[str]:
    """Return one text per named material of the library whose published sources disagree."""
    notes = []
    for name in dict.fromkeys(named_materials(loaded.scene).values()):
        silicone = None if name in loaded.scene.materials else silicone_of(name)
        spread = None if silicone is None else silicone.spread
        if silicone is None or spread is None or spread.agrees:
            continue
        own = next(s.initial_shear_modulus for s in silicone.sources if s.name == name)
        notes.append(
            f"material '{name}' has an initial shear modulus of {own / 1e3:.3g} kPa; published "
            f"sources of {silicone.title} have {spread.low / 1e3:.3g} to {spread.high / 1e3:.3g} "
            "kPa. Where stiffness matters, fit a test of your own batch (softsim fit-material); "
            f"`softsim materials {silicone.name}` shows the sources"
        )
    return notes


def built_material(loaded: LoadedScene, named_at: Keys) -> Material:
    """Return the material that the scene names at these keys.

    Under a static procedure it has no Maxwell branches, which have relaxed.
    """
    built = viscoelastic_material(loaded, named_at)
    is_static = loaded.scene.time.procedure == "static"
    return replace(built, branches=(), spectrum_error=None) if is_static else built


def viscoelastic_material(loaded: LoadedScene, named_at: Keys) -> Material:
    """Return the material that a scene names at these keys, with its Maxwell branches."""
    name = named_materials(loaded.scene)[named_at]
    known = materials_of(loaded)
    if name not in known:
        choice = list(dict.fromkeys([*known, *library_names()]))
        raise loaded.error(
            named_at,
            f"there is no material '{name}'",
            close_names(name, choice, "materials"),
        )
    keys, data = known[name]
    law = LAWS[data.law](*data.constants)
    refuse_unstable_law(loaded, name, data, keys)
    mu0 = law.initial_shear_modulus
    if data.bulk_modulus is not None:
        kappa = data.bulk_modulus
    elif data.D1 is not None:
        kappa = 2.0 / data.D1
    elif data.poisson_ratio is not None:
        kappa = bulk_modulus_from_poisson_ratio(mu0, data.poisson_ratio)
    else:
        kappa = DEFAULT_BULK_RATIO * mu0
    try:
        series, fit = viscoelasticity(data)
    except MaterialError as error:
        raise loaded.error((*keys, "spectrum"), error.message, error.hint) from None
    return Material(
        name, law, kappa, data.density, series.branches(mu0), data.strain_range,
        None if fit is None else fit.largest_error,
        None if data.mullins is None else Mullins(**data.mullins.model_dump()),
    )  # fmt: skip


def refuse_unstable_law(
    loaded: LoadedScene, name: str, data: scene_materials.Material, keys: Keys
) -> None:
    """Raise SceneError if a law loses its stiffness within the strain range of its fit."""
    if data.strain_range is None:
        return
    stretch = 1.0 + data.strain_range
    largest_I1 = stretch**2 + 2.0 / stretch  # uniaxial, incompressible
    lost = first_unstable_I1(LAWS[data.law](*data.constants), largest_I1)
    if lost is not None:
        raise loaded.error(
            keys,
            f"material '{name}' loses its stiffness at I1 = {lost:.3g}, within its "
            f"strain range of {data.strain_range:g} (I1 up to {largest_I1:.3g})",
            "a negative constant causes this: fit fewer terms, or a wider strain range",
        )
