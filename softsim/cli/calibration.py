"""Constants for scenes: of a material from a test, of a section from a body in space."""

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from softsim.cli.explaining import explained
from softsim.cli.options import DeviceName, Threads
from softsim.errors import CalibrationError


def fit_material(
    file: Annotated[Path, typer.Argument(help="Table of a uniaxial test.", show_default=False)],
    max_strain: Annotated[float, typer.Option(help="Fit up to this strain; 1 is 100 %.")],
    law: Annotated[str, typer.Option(help="Strain-energy law, as scenes name it.")] = "yeoh",
    min_strain: Annotated[float, typer.Option(help="Leave out the slack below it.")] = 0.1,
    terms: Annotated[int | None, typer.Option(help="Fit so many constants; default: all.")] = None,
    out: Annotated[Path | None, typer.Option(help="Figure; default: FILE_LAW.png here.")] = None,
    strain_column: Annotated[str, typer.Option(help="Its heading.")] = "Engineering Strain",
    stress_column: Annotated[str, typer.Option(help="Its heading.")] = "Engineering Stress",
    stress_unit: Annotated[
        str | None, typer.Option(help="Such as MPa; default: as the heading says.")
    ] = None,
    delimiter: Annotated[str | None, typer.Option(help="Default: ; or , or tab.")] = None,
) -> None:
    """Fit a material's constants to a tensile test, and say how well and how far they hold."""
    with explained() as console:
        from softsim.materials.fitting import fit_law
        from softsim.materials.laws import named_law
        from softsim.materials.tensile import read_tensile_test
        from softsim.report.fit import draw_fit, fit_rows, scene_snippet

        test = read_tensile_test(file, strain_column, stress_column, stress_unit, delimiter)
        fit = fit_law(test, named_law(law), max_strain, min_strain, terms)
        figure = out or Path(f"{file.stem}_{law}.png")
        draw_fit(test, fit, figure)
        table = Table(show_header=False, box=None)
        for row in fit_rows(fit):
            table.add_row(*row)
        console.print(table)
        console.print(f"figure  {figure}", highlight=False)
        print(f"\n{scene_snippet(test, fit, law)}")


def calibrate_section(
    scene: Annotated[Path, typer.Argument(help="Scene of the section.", show_default=False)],
    reference: Annotated[Path, typer.Option(help="Scene of the body in space, in the same pipe.")],
    highest: Annotated[str, typer.Option(help="Inflate the reference up to it.")] = "23 kPa",
    spikes: Annotated[int, typer.Option(min=3, help="Spikes around a row.")] = 14,
    ramp: Annotated[
        str, typer.Option(help="Time of the reference's inflation; longer is slower.")
    ] = "0.4 s",
    push_at: Annotated[
        str | None, typer.Option(help="Pressure in space at which frames are pushed.")
    ] = None,
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="PATH=VALUE", help="Override a value of the section."),
    ] = None,
    reference_overrides: Annotated[
        list[str] | None,
        typer.Option("--set-reference", metavar="PATH=VALUE", help="The same for the reference."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder; default: runs/SCENE_calibration.")
    ] = None,
    device: Annotated[DeviceName, typer.Option(help="Where to run.")] = DeviceName.auto,
    threads: Threads = "auto",
) -> None:
    """Find the pressure factor, offset and thickness with which a plane section stands for a body
    in space: each spike is pressed as hard, and the frame held as stiffly.

    The reference is solid, or axisymmetric: rings, whose force on the wall is that of the whole
    circumference; that tells the pressures as long as the skin carries the air, but neither how
    spikes bend nor a stiffness across the pipe.
    """
    with explained() as console:
        from softsim.calibration.specimen import (
            reference_specimen,
            refuse_other_pipe,
            section_specimen,
        )
        from softsim.scene.loading import load_scene

        section = section_specimen(load_scene(scene, overrides or []))
        body = reference_specimen(load_scene(reference, reference_overrides or []))
        refuse_other_pipe(section, body)
        pressure, time = _quantity("--highest", highest, "Pa"), _quantity("--ramp", ramp, "s")
        push = None if push_at is None else _quantity("--push-at", push_at, "Pa")
        folder = out or Path("runs") / f"{scene.stem}_calibration"

        from softsim.commands.calibrate_section import Settings, calibrate  # imports Taichi

        settings = Settings(pressure, time, push, spikes, folder, device.value, threads)
        calibrate(section, body, settings, console)


def _quantity(option: str, text: str, unit: str) -> float:
    """The positive quantity of an option, in the SI unit `unit`."""
    from softsim.units import parse

    try:
        value = parse(text, unit)
    except ValueError as error:
        raise CalibrationError(f"{option}: {error}") from None
    if not value > 0.0:
        raise CalibrationError(f"{option}: {text!r} must be greater than zero")
    return value
