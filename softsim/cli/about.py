"""Commands that print the version, the schema of input files, and the available devices."""

import json
from typing import Annotated

import typer
from rich.console import Console

from softsim import __version__
from softsim.applications import STUDY_MODELS
from softsim.compute.machine import (
    CORNERS_FOR_GPU,
    CORNERS_FOR_THREADS,
    Memory,
    cores,
    cuda_device_count,
    graphics_card,
    processor,
)
from softsim.errors import DeviceError
from softsim.options import explained
from softsim.report.table import Cell, Row, Table, cell
from softsim.units import count_text

KINDS = ("scene", "study", *STUDY_MODELS)
"""Kinds of input files: those of the engine, and those of applications."""


def print_version(asked: bool) -> None:
    """Print the version of softsim and exit if `asked` is true."""
    if asked:
        print(f"softsim {__version__}")
        raise typer.Exit


def schema(
    of: Annotated[
        str,
        typer.Argument(metavar="|".join(KINDS), help="Kind of file that the schema describes."),
    ] = "scene",
) -> None:
    """Print the JSON schema of scene, study or chain files, which editors use to check keys."""
    from softsim.scene.quantities import json_schema
    from softsim.scene.schema import scene_json_schema
    from softsim.study.cases import source_class
    from softsim.study.schema import study_json_schema

    if of not in KINDS:
        raise typer.BadParameter(f"{of!r} is not one of {', '.join(KINDS)}", param_hint="of")
    if of == "scene":
        found = scene_json_schema()
    elif of == "study":
        found = study_json_schema()
    else:
        found = json_schema(source_class(of).root)
    print(json.dumps(found, indent=2))


def devices(
    seconds: Annotated[
        float, typer.Option(min=0.0, help="Total time of the measurements [s]; 0 skips them.")
    ] = 10.0,
) -> None:
    """List the available devices, measure their speed and show which one `auto` selects."""
    with explained() as console:
        print_devices(console, seconds)


def print_devices(console: Console, seconds: float) -> None:
    """Print the table of devices.

    Rates are measured for `seconds` in total; 0 omits them.
    """
    faults: list[str] = []
    cpu = processor()
    described = {"cpu": [f"{cpu.name}, {cores(cpu.cores)}", _free(cpu.memory)]}
    if cuda_device_count():
        described["cuda"] = _cuda(faults)
    rates: dict[str, dict[str, Cell]] = {}
    if seconds > 0.0:
        console.print("measuring speed; the first time, kernels are compiled for about a minute")
        rates = _rates(list(described), seconds, faults)
    rows: list[Row] = [
        [name, *columns, *(measured[name] for measured in rates.values())]
        for name, columns in described.items()
    ]
    console.print(Table(rows, ["device", "hardware", "free memory", *rates]))
    if "cuda" not in described:
        console.print(f"cuda: {_why_there_is_none()}")
    for fault in faults:
        console.print(fault, highlight=False)
    if "cuda" in described:
        taken = f"cuda from {CORNERS_FOR_GPU:,} element nodes on, else cpu"
    else:
        taken = "cpu"
    console.print(
        f"auto selects {taken}; --threads auto uses one thread below {CORNERS_FOR_THREADS:,} "
        "element nodes (elements times nodes per element), else all",
        highlight=False,
    )


def _cuda(faults: list[str]) -> list[str]:
    try:
        card = graphics_card()
    except DeviceError as fault:
        faults.append(f"cuda: {fault}")
        card = None
    if card is None:
        return ["CUDA device (the driver reports no name)", ""]
    return [f"{card.name}, driver {card.driver}", _free(card.memory)]


def _why_there_is_none() -> str:
    """Return the reason, as reported by the driver, why no CUDA device is available."""
    try:
        card = graphics_card()
    except DeviceError as fault:
        return str(fault)
    if card is None:
        return "no NVIDIA driver found"
    return f"CUDA does not respond on the {card.name} with driver {card.driver}"


def _rates(devices: list[str], seconds: float, faults: list[str]) -> dict[str, dict[str, Cell]]:
    """Return the rate by heading and device, for a small mesh on one thread and a large one on all.

    Failures are appended to `faults`.
    """
    from softsim.run.cost import LARGE, SECTION, measured_rate  # Taichi is imported here

    everything = processor().cores
    each = seconds / (2 * len(devices))
    columns: dict[str, dict[str, Cell]] = {}
    for work, threads in ((SECTION, 1), (LARGE, everything)):
        heading = f"{work.elements:,} triangles\n{count_text(threads, 'thread')}"
        columns[heading] = {}
        for device in devices:
            try:
                rate = measured_rate(device, threads if device == "cpu" else 1, work, each)
                columns[heading][device] = cell(rate / 1e6, ".1f", " M/s")
            except DeviceError as fault:
                columns[heading][device] = Cell("fails")
                faults.append(f"{device}, {work.elements:,} triangles: {fault}")
    return columns


def _free(memory: Memory) -> str:
    return f"{memory.free / 1e9:.1f} of {memory.total / 1e9:.1f} GB"
