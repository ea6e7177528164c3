"""What `softsim spectrum` draws: viscoelastic materials of the library and of scenes."""

from collections.abc import Sequence
from pathlib import Path

from softsim.builder import library_material, library_names
from softsim.builder.materials import materials_of
from softsim.builder.names import close_names
from softsim.builder.viscoelasticity import viscoelasticity
from softsim.errors import MaterialError
from softsim.materials.laws import LAWS
from softsim.report.spectra import DrawnSpectrum
from softsim.scene.loading import load_scene
from softsim.scene.materials import Material
from softsim.scene.yaml_reading import is_file


def named_spectra(names: Sequence[str], overrides: Sequence[str]) -> list[DrawnSpectrum]:
    """The viscoelastic materials among those that `names` mean: materials of the library, or scene
    files, which `overrides` change.

    Raises
    ------
    MaterialError: a name that means nothing, a spectrum that branches do not meet, or nothing to
    draw. SceneError: a scene that is none.
    """
    found: list[DrawnSpectrum] = []
    for name in names:
        for material, data in _meant(name, overrides).items():
            try:
                series, fit = viscoelasticity(data)
            except MaterialError as error:
                raise MaterialError(f"{material}: {error.message}", error.hint) from None
            if len(series.moduli):
                mu0 = LAWS[data.law](*data.constants).initial_shear_modulus
                found.append(DrawnSpectrum(material, mu0, series, fit))
    if not found:
        raise MaterialError(
            f"{', '.join(names)}: no viscoelastic material",
            hint="give it a spectrum, such as {kind: loss_factor, loss_factor: 0.2, "
            "band: [2 Hz, 5 kHz]}, or a prony series",
        )
    return found


def _meant(name: str, overrides: Sequence[str]) -> dict[str, Material]:
    """Name -> material, of the library or of a scene file."""
    material = library_material(name)
    if material is not None:
        return {name: material}
    path = Path(name)
    if not is_file(path):
        raise MaterialError(
            f"'{name}' is neither a material of the library nor a scene file",
            hint=close_names(name, library_names(), "materials"),
        )
    return {key: data for key, (_, data) in materials_of(load_scene(path, overrides)).items()}
