"""What there is: the version, keys of scenes and studies, devices."""

import json
from enum import Enum
from typing import Annotated

import typer

from softsim import __version__
from softsim.cli.explaining import explained


class FileKind(str, Enum):
    """What a file describes."""

    scene = "scene"
    study = "study"


def print_version(asked: bool) -> None:
    """Print softsim's version and end, if it is asked for."""
    if asked:
        print(f"softsim {__version__}")
        raise typer.Exit


def schema(
    of: Annotated[FileKind, typer.Argument(help="Which files.")] = FileKind.scene,
) -> None:
    """Print the JSON schema of scene or study files, with which an editor completes and checks
    keys.
    """
    from softsim.scene.schema import scene_json_schema
    from softsim.study.schema import study_json_schema

    found = {FileKind.scene: scene_json_schema, FileKind.study: study_json_schema}[of]()
    print(json.dumps(found, indent=2))


def devices(
    seconds: Annotated[
        float, typer.Option(min=0.0, help="Time of all measurements; 0 leaves them out.")
    ] = 10.0,
) -> None:
    """Say which devices there are, how fast they are, and which one `auto` takes."""
    with explained() as console:
        from softsim.commands.devices import print_devices

        print_devices(console, seconds)
