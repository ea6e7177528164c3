"""Commands on materials: list the library, fit constants to tests, plot spectra."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softsim.errors import MaterialError
from softsim.options import Overrides, explained
from softsim.report.table import Table

if TYPE_CHECKING:
    from softsim.report.curves import DrawnSpectrum
    from softsim.scene.materials import Material


StrainColumn = Annotated[str, typer.Option(help="Heading of the strain column.")]
StressColumn = Annotated[str, typer.Option(help="Heading of the stress column.")]
StressUnit = Annotated[
    str | None, typer.Option(help="Unit of the stress, such as MPa; default: from the heading.")
]
Delimiter = Annotated[
    str | None, typer.Option(help="Column separator; default: detected (; , or tab).")
]


def materials(
    name: Annotated[
        str | None,
        typer.Argument(help="Silicone or material of the library.", show_default=False),
    ] = None,
    compare: Annotated[
        Path | None,
        typer.Option(help="Data file of a uniaxial test to draw beside the sources of NAME."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Figure; default: NAME_sources.png in the current folder.")
    ] = None,
    strain_column: StrainColumn = "Engineering Strain",
    stress_column: StressColumn = "Engineering Stress",
    stress_unit: StressUnit = None,
    delimiter: Delimiter = None,
) -> None:
    """List the silicones of the library with their sources; with NAME, draw its curves too.

    Sources of one silicone differ: the spread is the lowest, the typical and the highest initial
    shear modulus among them.
    """
    if name is None and (compare is not None or out is not None):
        option = "--compare" if compare is not None else "--out"
        raise typer.BadParameter("needs the NAME of a silicone", param_hint=option)
    with explained() as console:
        from softsim.materials.fitting import read_tensile_test
        from softsim.materials.library import library_names, silicone_of, silicones
        from softsim.report.materials import comparison_rows, sources_diagram, sources_table
        from softsim.report.png import draw
        from softsim.scene.names import close_names

        if name is None:
            for each in silicones().values():
                console.print(sources_table(each), highlight=False)
            return
        silicone = silicone_of(name)
        if silicone is None:
            known = list(dict.fromkeys([*silicones(), *library_names()]))
            raise MaterialError(
                f"there is no silicone '{name}' in the library",
                hint=close_names(name, known, "silicones"),
            )
        test = None
        if compare is not None:
            test = read_tensile_test(compare, strain_column, stress_column, stress_unit, delimiter)
        figure = out or Path(f"{silicone.name}_sources.png")
        draw(figure, sources_diagram(silicone, test))
        console.print(sources_table(silicone), highlight=False)
        if test is not None:
            console.print(f"stress of {test.title} over that of a source", style="bold")
            console.print(Table(comparison_rows(silicone, test)), highlight=False)
        console.print(f"figure  {figure}", highlight=False)


def fit_material(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE...", help="Data files of tests.", show_default=False),
    ],
    max_strain: Annotated[float, typer.Option(help="Fit up to this strain; 1 is 100 %.")],
    law: Annotated[str, typer.Option(help="Strain-energy law, named as in a scene.")] = "yeoh",
    mode: Annotated[
        list[str] | None,
        typer.Option(
            help="Mode of each test, in the order of the files: uniaxial, equibiaxial, planar or "
            "compression; default: uniaxial."
        ),
    ] = None,
    weight: Annotated[
        list[float] | None,
        typer.Option(help="Weight of each test, in the order of the files; default: 1."),
    ] = None,
    min_strain: Annotated[float, typer.Option(help="Ignore data below this strain.")] = 0.1,
    terms: Annotated[
        int | None, typer.Option(help="Number of constants to fit; default: all.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Figure; default: FILE_LAW.png in the current folder.")
    ] = None,
    strain_column: StrainColumn = "Engineering Strain",
    stress_column: StressColumn = "Engineering Stress",
    stress_unit: StressUnit = None,
    delimiter: Delimiter = None,
) -> None:
    """Fit material constants to tests; print the error of the fit and its strain range.

    Several tests in different modes are fitted at once. The error of each is printed, and how well
    a fit to one of them alone predicts the others.
    """
    with explained() as console:
        from softsim.materials.fitting import fit_tests, prediction_errors, read_tensile_test
        from softsim.materials.laws import named_law
        from softsim.report import materials as report
        from softsim.report.png import draw

        modes = mode or ["uniaxial"] * len(files)
        for option, given in (("mode", modes), ("weight", weight or files)):
            if len(given) != len(files):
                raise MaterialError(
                    f"there are {len(files)} files and {len(given)} times --{option}",
                    hint=f"give --{option} once per file, in the order of the files",
                )
        columns = strain_column, stress_column, stress_unit, delimiter
        tests = [read_tensile_test(file, *columns, m) for file, m in zip(files, modes, strict=True)]
        chosen = named_law(law)
        fits = fit_tests(tests, chosen, max_strain, min_strain, terms, weight or None)
        figure = out or Path(f"{files[0].stem}_{law}.png")
        if len(tests) == 1:
            draw(figure, report.fit_diagram(tests[0], fits[0]))
            console.print(Table(report.fit_rows(fits)))
        else:
            draw(figure, report.fits_diagram(tests, fits))
            names = report.names_of(tests)
            errors = prediction_errors(tests, chosen, max_strain, min_strain, terms)
            console.print(Table(report.fit_rows(fits, names)))
            console.print("rms error of each test with the constants fitted to one test alone")
            console.print(Table(report.prediction_rows(names, errors)), highlight=False)
            for text in report.prediction_warnings(names, fits, errors):
                console.print(f"warning: {text}", highlight=False)
        console.print(f"figure  {figure}", highlight=False)
        print(f"\n{report.scene_snippet(tests, fits, law)}")


def spectrum(
    materials: Annotated[
        list[str],
        typer.Argument(help="Materials of the library, or scene files.", show_default=False),
    ],
    overrides: Overrides = None,
    out: Annotated[
        Path | None, typer.Option(help="Figure; default: NAME_spectrum.png in the current folder.")
    ] = None,
) -> None:
    """Draw storage modulus and loss factor of viscoelastic materials over frequency.

    The given spectrum is drawn together with the Maxwell branches fitted to it; the error of the
    fit is printed.
    """
    with explained() as console:
        from softsim.report.curves import spectra_diagram, spectra_rows
        from softsim.report.png import draw

        spectra = named_spectra(materials, overrides or [])
        figure = out or Path(f"{Path(materials[0]).stem}_spectrum.png")
        draw(figure, spectra_diagram(spectra))
        for drawn in spectra:
            console.print(drawn.name, style="bold", highlight=False)
            console.print(Table(spectra_rows(drawn)))
        console.print(f"figure  {figure}", highlight=False)


def named_spectra(names: Sequence[str], overrides: Sequence[str]) -> "list[DrawnSpectrum]":
    """Return the viscoelastic materials among `names`.

    A name is that of a material of the library or of a scene file, to which `overrides` apply.

    Raises
    ------
    MaterialError: an unknown name, a spectrum that the branches do not fit, or nothing to draw.
    SceneError: an invalid scene.
    """
    from softsim.materials.laws import LAWS
    from softsim.materials.library import viscoelasticity
    from softsim.report.curves import DrawnSpectrum

    spectra: list[DrawnSpectrum] = []
    for name in names:
        for material, data in _meant(name, overrides).items():
            try:
                series, fit = viscoelasticity(data)
            except MaterialError as error:
                raise MaterialError(f"{material}: {error.message}", error.hint) from None
            if len(series.moduli):
                mu0 = LAWS[data.law](*data.constants).initial_shear_modulus
                spectra.append(DrawnSpectrum(material, mu0, series, fit))
    if not spectra:
        raise MaterialError(
            f"{', '.join(names)}: no viscoelastic material",
            hint="give a material a spectrum, such as {kind: loss_factor, loss_factor: 0.2, "
            "band: [2 Hz, 5 kHz]}, or a prony series",
        )
    return spectra


def _meant(name: str, overrides: Sequence[str]) -> "dict[str, Material]":
    """Return the materials by name, from the library or from a scene file."""
    from softsim.materials.library import library_material, library_names, materials_of
    from softsim.scene.loading import load_scene
    from softsim.scene.names import close_names
    from softsim.scene.text import is_file

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
