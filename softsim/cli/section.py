"""A plane section that stands for a body in space."""

from pathlib import Path
from typing import Annotated

import typer

from softsim.cli.options import DeviceName, Threads, explained
from softsim.errors import CalibrationError


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

        from softsim.cli.laboratory import Settings, calibrate  # imports Taichi

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
