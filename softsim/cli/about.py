"""What there is: keys of scenes and studies, devices."""

import json
from typing import Annotated

import typer

from softsim.cli.explaining import explained


def schema() -> None:
    """Print the JSON schema of scene files, with which an editor completes and checks keys."""
    from softsim.scene.schema import scene_json_schema

    print(json.dumps(scene_json_schema(), indent=2))


def devices(
    seconds: Annotated[
        float, typer.Option(min=0.0, help="Time of all measurements; 0 leaves them out.")
    ] = 10.0,
) -> None:
    """Say which devices there are, how fast they are, and which one `auto` takes."""
    with explained() as console:
        from softsim.commands.devices import print_devices

        print_devices(console, seconds)
