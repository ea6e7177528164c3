"""Command that calibrates a plane section as a model of a body in space."""

from pathlib import Path
from typing import Annotated

import typer

from softsim.options import Device, DeviceName, Threads, explained, positive


def calibrate_section(
    scene: Annotated[Path, typer.Argument(help="Scene file of the section.", show_default=False)],
    reference: Annotated[Path, typer.Option(help="Scene file of the body in the same pipe.")],
    highest: Annotated[str, typer.Option(help="Highest pressure of the reference.")] = "23 kPa",
    spikes: Annotated[int, typer.Option(min=3, help="Number of spikes in a row.")] = 14,
    ramp: Annotated[
        str, typer.Option(help="Duration of the inflation of the reference.")
    ] = "0.4 s",
    push_at: Annotated[
        str | None, typer.Option(help="Pressure of the reference at which the frames are pushed.")
    ] = None,
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="PATH=VALUE", help="Override a value of the section."),
    ] = None,
    reference_overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set-reference", metavar="PATH=VALUE", help="Override a value of the reference."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Output folder; default: runs/SCENE_calibration.")
    ] = None,
    device: Device = DeviceName.auto,
    threads: Threads = "auto",
) -> None:
    """Calibrate the pressure factor, pressure offset and thickness of a plane section of a body.

    With the values found, the section presses each spike on the wall with the same force and
    holds the frame with the same stiffness as the reference. The reference is a solid (3D) or an
    axisymmetric model. An axisymmetric one represents spikes by rings: it yields the pressures
    while the skin carries the pressure, but neither the bending of spikes nor the transverse
    stiffness.
    """
    with explained() as console:
        from softsim.apps.calibration.experiments import (
            reference_specimen,
            refuse_other_pipe,
            section_specimen,
        )
        from softsim.scene.loading import load_scene

        section = section_specimen(load_scene(scene, overrides or []))
        body = reference_specimen(load_scene(reference, reference_overrides or []))
        refuse_other_pipe(section, body)
        pressure, time = positive("--highest", highest, "Pa"), positive("--ramp", ramp, "s")
        push = None if push_at is None else positive("--push-at", push_at, "Pa")
        folder = out or Path("runs") / f"{scene.stem}_calibration"

        from softsim.apps.calibration.running import Settings, calibrate  # imports Taichi

        settings = Settings(pressure, time, push, spikes, folder, device.value, threads)
        calibrate(section, body, settings, console)
