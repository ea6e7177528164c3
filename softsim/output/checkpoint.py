"""checkpoint.h5: the full state of a run, from which it continues bit for bit."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from softsim.errors import OutputError
from softsim.output.folder import replacing
from softsim.scene.loading import Loaded

FORMAT = ("v110", "v110")
"""File format of HDF5 1.10, which has checksums of everything but the contents of arrays."""

TEXTS = ("progress", "scene", "device", "files")


@dataclass(frozen=True)
class Checkpoint:
    """State of a run, from which it can be continued.

    Parameters
    ----------
    state: name -> array of the solver.
    progress: numbers of the run, in JSON types.
    inspected: positions of the nodes at the last inspection of the elements (n, d) [m].
    scene: the scene of the run, as JSON.
    device: the device on which it was computed.
    files: path of each file that the scene names -> digest of its content.
    """

    state: dict[str, np.ndarray]
    progress: dict[str, Any]
    inspected: np.ndarray
    scene: str
    device: str
    files: dict[str, str] = field(default_factory=dict)

    def mismatch(self, loaded: Loaded[Any]) -> str:
        """Return how a scene or one of its files differs from those of the checkpoint.

        Returns
        -------
        A predicate for a message, such as "was computed before m.inp changed"; "" if scene and
        files are the same.

        Raises
        ------
        SceneError: a file that the scene names is missing.
        """
        key = self.differing_key(loaded.scene.model_dump_json())
        if key:
            return f"was computed with another {key}"
        digests = loaded.file_digests()
        changed = [name for name, digest in self.files.items() if digests.get(name) != digest]
        return f"was computed before {', '.join(changed)} changed" if changed else ""

    def differing_key(self, scene: str) -> str:
        """Return the first key, as a.b.c, in which a scene (JSON) differs from the checkpoint; ""
        if none does.
        """
        if scene == self.scene:
            return ""
        return ".".join(_first_difference(json.loads(self.scene), json.loads(scene)))


def write_checkpoint(path: Path, checkpoint: Checkpoint) -> None:
    """Replace the checkpoint; a reader finds the old or the new one, never a part.

    Fletcher checksums of the arrays and the checksums of the file format let a reader detect a
    flipped bit. Raises OutputError if the disk refuses.
    """
    # Python's JSON writes floats so that reading gives the same bits.
    texts = {
        "progress": json.dumps(checkpoint.progress),
        "scene": checkpoint.scene,
        "device": checkpoint.device,
        "files": json.dumps(checkpoint.files),
    }
    with replacing(path) as partial, h5py.File(partial, "w", libver=FORMAT) as file:
        for name, array in checkpoint.state.items():
            _write(file, f"state/{name}", array)
        _write(file, "inspected", checkpoint.inspected)
        for name, text in texts.items():  # as bytes: texts of HDF5's have no checksums
            _write(file, name, np.frombuffer(text.encode(), np.uint8))


def read_checkpoint(path: Path) -> Checkpoint:
    """Return the checkpoint in a run folder.

    Raises OutputError if there is none, or it is damaged.
    """
    if not path.is_file():
        raise OutputError(
            f"there is no checkpoint {path}",
            hint="run without --resume to start from the beginning",
        )
    state: dict[str, np.ndarray] = {}

    def note(name: str, item: h5py.Group | h5py.Dataset) -> None:
        if isinstance(item, h5py.Dataset):
            state[name] = item[()]

    try:
        with h5py.File(path, "r") as file:
            file["state"].visititems(note)
            inspected = file["inspected"][()]
            texts = {name: file[name][:].tobytes().decode() for name in TEXTS}
        return Checkpoint(
            state, json.loads(texts["progress"]), inspected, texts["scene"], texts["device"],
            json.loads(texts["files"]),
        )  # fmt: skip
    except (OSError, KeyError, ValueError, RuntimeError) as error:
        raise OutputError(
            f"{path} is not a readable checkpoint: {error}",
            hint="remove it to start the run from the beginning",
        ) from error


def _write(file: h5py.File, name: str, array: np.ndarray) -> None:
    """Write an array, with checksums unless it is empty."""
    file.create_dataset(name, data=array, fletcher32=array.size > 0)


def _first_difference(there: object, here: object) -> list[str]:
    """Return the keys that lead to the first value in which two scenes differ.

    If only the order of the keys differs, the last one is "order of keys": it numbers the loads.
    """
    if not (isinstance(there, dict) and isinstance(here, dict)):
        return []
    for key in [*there, *here]:
        if key not in there or key not in here or there[key] != here[key]:
            return [key, *_first_difference(there.get(key), here.get(key))]
    return ["order of keys"]
