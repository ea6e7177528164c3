"""Commands for the start: version, schema of input files, devices, examples, templates."""

import json
import re
import shutil
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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
from softsim.errors import DeviceError, Location, OutputError, SceneError
from softsim.options import explained
from softsim.report.table import Cell, Row, Table, cell
from softsim.units import count_text

if TYPE_CHECKING:
    from pydantic import BaseModel

    from softsim.scene.text import Tree


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


# -------------------------------------------------------------------------------------------------
# Commands that copy the example scenes, layouts and studies, and write scenes from templates.


TEMPLATES = (
    "bending_actuator", "bellows", "bellows_3d", "pneunet", "gripper", "quadruped",
    "tendon_finger",
)  # fmt: skip
"""Examples whose bodies come from generators."""

GENERATOR = re.compile(r"( *)mesh:( &\w+)? \{generator: .*\}")
"""Line of a template with the mesh of a body; group 2: its anchor."""


def examples(
    name: Annotated[
        str | None, typer.Argument(help="Example to copy; default: list all.", show_default=False)
    ] = None,
    to: Annotated[Path, typer.Option(help="Folder to copy it to.")] = Path(),
) -> None:
    """List the example scenes, layouts and studies, or copy one with all files that it needs."""
    with explained() as console:
        root = examples_folder()
        if name is None:
            for path in example_files(root):
                line = f"{command_for(path, path).split()[1]:10}{path.stem:30}{example_title(path)}"
                console.print(line, highlight=False, markup=False, soft_wrap=True)
            return
        example = find_example(root, name)
        for path in copy_example(example, root, to):
            console.print(f"file    {path}", highlight=False, soft_wrap=True)
        command = command_for(example, to / example.relative_to(root))
        console.print(f"next    {command}", highlight=False, soft_wrap=True)


def new(
    name: Annotated[
        str | None, typer.Argument(help="Template; default: list all.", show_default=False)
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="File to write; default: NAME.yaml.", show_default=False)
    ] = None,
) -> None:
    """List the templates of robots and actuators, or write a scene with all dimensions of one."""
    with explained() as console:
        root = examples_folder()
        if name is None:
            for template in TEMPLATES:
                title = example_title(find_example(root, template))
                console.print(f"softsim new {template:20}{title}", highlight=False, soft_wrap=True)
            return
        target = Path(f"{name}.yaml") if out is None else out
        write_new(template_text(root, name), target)
        console.print(f"file    {target}", highlight=False, soft_wrap=True)
        console.print(f"next    softsim check {target}", highlight=False, soft_wrap=True)


def template_text(root: Path, name: str) -> str:
    """Return the scene of a template, with all keys of its mesh generators and their meanings.

    Raises SceneError if no template has this name.
    """
    from softsim.scene.loading import load_scene
    from softsim.scene.reporting import did_you_mean
    from softsim.scene.text import entries

    if name not in TEMPLATES:
        raise SceneError(f"there is no template {name!r}", did_you_mean(name, TEMPLATES))
    path = find_example(root, name)
    loaded, lines = load_scene(path), path.read_text(encoding="utf-8").split("\n")
    for body, spec in loaded.scene.bodies.items():
        mesh = entries(loaded.tree, "bodies", body)["mesh"]
        assert isinstance(mesh.key_origin, Location)
        number = mesh.key_origin.line - 1
        if written_here := GENERATOR.fullmatch(lines[number]):
            margin, anchor = written_here.groups()
            keys = commented_keys(spec.mesh, mesh)
            block = [f"{margin}mesh:{anchor or ''}", *(f"{margin}  {line}" for line in keys)]
            lines[number] = "\n".join(block)
    return "\n".join(lines)


def commented_keys(model: "BaseModel", given: "Tree") -> Iterator[str]:
    """Yield a line of YAML for each key of a mesh generator, with its meaning as a comment."""
    from softsim.scene.loading import flow_text
    from softsim.scene.text import child

    fields = type(model).model_fields
    for key in sorted(fields, key=lambda key: key != "generator"):
        field, value = fields[key], child(given, key)
        if value is not None or field.default is not None:
            entry = f"{key}: {flow_text(field.default if value is None else value)}"
            yield f"{entry:26}# {field.description}" if key != "generator" else entry


def write_new(text: str, target: Path) -> None:
    """Write a file that does not exist yet.

    Raises OutputError if it exists or cannot be written.
    """
    try:
        with target.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise OutputError(
            f"{target} already exists", hint="name another file with --out, or move it away"
        ) from None
    except OSError as error:
        raise OutputError(f"{target} cannot be written: {error.strerror}") from error


def examples_folder() -> Path:
    """Return the folder of the examples: that of the installed package, in a checkout `scenes`."""
    package = Path(str(resources.files("softsim"))).resolve()
    installed = package / "examples"
    return installed if installed.is_dir() else package.parent / "scenes"


def example_files(root: Path) -> list[Path]:
    """Return all examples: first the scenes, then the files in subfolders."""
    return sorted(root.rglob("*.yaml"), key=lambda path: (path.parent, path.name))


def example_title(path: Path) -> str:
    """Return the title given in the file.

    Raises SceneError if the file has none.
    """
    from softsim.scene.text import entries, read_file

    tree = read_file(path)
    title = entries(tree).get("title")
    if title is None:
        raise SceneError(f"{path}: an example needs a title", "title: What it shows")
    return str(title.value)


def find_example(root: Path, name: str) -> Path:
    """Return the file of the example `name`.

    Raises SceneError if no example has this name.
    """
    from softsim.scene.reporting import did_you_mean

    found = {path.stem: path for path in example_files(root)}
    if name not in found:
        raise SceneError(f"there is no example {name!r}", did_you_mean(name, list(found)))
    return found[name]


def command_for(example: Path, target: Path) -> str:
    """Return the command that runs an example whose file is at `target`."""
    from softsim.scene.text import entries, read_file

    if example.parent.name == "layouts":
        return f"softsim assess {target} --robot pfr"
    if example.parent.name == "reach":
        return f"softsim reach {target} --robot pfr"
    if example.parent.name == "chains":
        return f"softsim chain {target}"
    if example.parent.name == "studies":
        verb = "optimize" if "optimize" in entries(read_file(example, "study")) else "sweep"
        return f"softsim {verb} {target}"
    return f"softsim run {target}"


def copy_example(example: Path, root: Path, folder: Path) -> list[Path]:
    """Copy an example and the files that it names into `folder`; return the copies.

    The example is first. The copies keep their positions relative to `root`.

    Raises
    ------
    OutputError: a file of that name exists with other content, or cannot be written.
    """
    sources = needed_files(example)
    targets = [folder / source.relative_to(root) for source in sources]
    for source, target in zip(sources, targets, strict=True):
        if target.exists() and target.read_bytes() != source.read_bytes():
            raise OutputError(
                f"{target} already exists, with content other than that of the example",
                hint="name another folder with --to, or move the file away",
            )
    for source, target in zip(sources, targets, strict=True):
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)
        except OSError as error:
            raise OutputError(f"{target} cannot be written: {error.strerror}") from error
    return targets


def needed_files(example: Path) -> list[Path]:
    """Return the example and all files that it names, directly or through scene files.

    For a mesh, the script that generates it is included.
    """
    from softsim.scene.text import is_file, read_file

    found = [example]
    for path in found:  # which grows as files are found
        if path.suffix == ".yaml":
            named = (path.parent / text for text in _texts(read_file(path)))
            files = dict.fromkeys(file.resolve() for file in named if is_file(file))
            found.extend(file for file in files if file not in found)
        elif path.suffix == ".msh" and (script := path.with_suffix(".geo")).is_file():
            found.append(script)
    return found


def _texts(tree: "Tree") -> Iterator[str]:
    """Yield every text value below `tree`."""
    if isinstance(tree.value, dict):
        for child in tree.value.values():
            yield from _texts(child)
    elif isinstance(tree.value, list):
        for child in tree.value:
            yield from _texts(child)
    elif isinstance(tree.value, str):
        yield tree.value
