"""Materials of a scene: its own and those of the library."""

import dataclasses
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from softsim.builder.names import Names, close_names
from softsim.elements.geometry import Region
from softsim.errors import MaterialError
from softsim.materials.fitting import first_unstable_I1
from softsim.materials.laws import LAWS
from softsim.materials.library import library_material, library_names, silicone_of
from softsim.materials.material import (
    DEFAULT_BULK_RATIO,
    Material,
    Mullins,
    bulk_modulus_from_poisson_ratio,
)
from softsim.materials.maxwell import (
    MaxwellFit,
    MaxwellSeries,
    Spectrum,
    constant_loss_factor,
    fewest_branches,
    fractional,
    measured,
)
from softsim.model import Model
from softsim.scene import materials as scene_materials
from softsim.scene.loading import LoadedScene
from softsim.scene.schema import Scene
from softsim.scene.text import Keys

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


def material(names: Names, named_at: Keys) -> Material:
    """Return the material that the scene names at these keys.

    Under a static procedure it has no Maxwell branches, which have relaxed.
    """
    built = viscoelastic_material(names.loaded, named_at)
    is_static = names.scene.time.procedure == "static"
    return dataclasses.replace(built, branches=(), spectrum_error=None) if is_static else built


def with_branches(loaded: LoadedScene, model: Model) -> Model:
    """Return the model of a static scene with the Maxwell branches of its materials."""
    named = named_materials(loaded.scene)

    def of(region: Region) -> Material:
        own: Keys = ("bodies", region.body, "regions", region.cell_set or "", "material")
        return viscoelastic_material(
            loaded, own if own in named else ("bodies", region.body, "material")
        )

    bodies = tuple(
        dataclasses.replace(
            body,
            regions=tuple(dataclasses.replace(r, material=of(r)) for r in body.regions),
        )
        for body in model.bodies
    )
    return dataclasses.replace(model, bodies=bodies)


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
