"""checkpoint.h5: the full state, so that a run goes on to the very same bits."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from softsim.errors import OutputError
from softsim.output.folder import replacing


@dataclass(frozen=True)
class Checkpoint:
    """state: name -> array of the solver. progress: numbers of the run, as JSON keeps them.

    inspected: places of the nodes (n, d) [m] at the last inspection of the elements. scene: the
    scene it belongs to, as JSON. device: where it was computed.
    """

    state: dict[str, np.ndarray]
    progress: dict[str, Any]
    inspected: np.ndarray
    scene: str
    device: str


def write_checkpoint(path: Path, checkpoint: Checkpoint) -> None:
    """Replace the checkpoint; a reader finds the old or the new one, never a part.

    Raises OutputError if the disk refuses.
    """
    with replacing(path) as partial, h5py.File(partial, "w") as file:
        for name, array in checkpoint.state.items():
            file[f"state/{name}"] = array
        file["inspected"] = checkpoint.inspected
        # Python's JSON writes floats so that reading gives the same bits. These may be longer than
        # the 64 kB that an attribute holds.
        file["progress"] = json.dumps(checkpoint.progress)
        file["scene"] = checkpoint.scene
        file.attrs["device"] = checkpoint.device


def read_checkpoint(path: Path) -> Checkpoint:
    """The checkpoint in a run folder.

    Raises OutputError if there is none or it cannot be read.
    """
    if not path.is_file():
        raise OutputError(
            f"there is no checkpoint {path}", hint="run without --resume to start anew"
        )
    try:
        with h5py.File(path, "r") as file:
            state: dict[str, np.ndarray] = {}
            file["state"].visititems(
                lambda name, item: (
                    state.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None
                )
            )
            progress = json.loads(file["progress"].asstr()[()])
            inspected = file["inspected"][()]
            scene, device = str(file["scene"].asstr()[()]), str(file.attrs["device"])
    except (OSError, KeyError, ValueError) as error:
        raise OutputError(
            f"{path} is not a readable checkpoint: {error}",
            hint="run without --resume to start from the beginning",
        ) from error
    return Checkpoint(state, progress, inspected, scene, device)
