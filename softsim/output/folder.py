"""The run folder: the names of its files, and functions that write them atomically."""

import json
import math
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from softsim.errors import OutputError

SCENE = "scene.resolved.yaml"
SUMMARY = "summary.json"
HISTORY = "history.csv"
RESULTS = "results.vtkhdf"
CHECKPOINT = "checkpoint.h5"
LOG = "run.log"

WRITTEN_ANEW = "run with --resume to write it again; for a case of a study, remove its folder"
"""Hint for a damaged file that a run writes again in any case."""

RESERVE = 64 * 2**20
"""Free space that a run must find when it starts [bytes]: a fine plane run's files fit in it."""

MARGIN = 8 * 2**20
"""Free space that a single write leaves over [bytes]: for the logs, and the summary of the end."""


class RunFolder:
    """A folder for the files of one run, created with its parents.

    Raises OutputError if it cannot be created or written, or if its disk has less than RESERVE.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            probe = self.path / ".write_probe"
            probe.write_bytes(b"softsim")
            probe.unlink()
        except OSError as error:
            raise OutputError(
                f"cannot write to the run folder {self.path}: {_reason(error)}",
                hint="choose another folder with --out",
            ) from error
        free = shutil.disk_usage(self.path).free
        if free < RESERVE:
            raise OutputError(
                f"the disk of the run folder {self.path} has {_megabytes(free)} left; a run needs "
                f"at least {_megabytes(RESERVE)}",
                hint="free disk space, or choose a folder on another disk with --out",
            )

    def write_text_atomic(self, name: str, text: str) -> None:
        """Write `text` (UTF-8) to the file `name`: a reader finds the old or the new, never a part.

        Raises OutputError if the disk refuses.
        """
        with replacing(self.path / name) as partial, partial.open("w", encoding="utf-8") as stream:
            stream.write(text)

    def write_json_atomic(self, name: str, content: Mapping[str, Any]) -> None:
        """Write a dictionary as JSON, atomically; NumPy values become plain, paths become text.

        JSON has no NaN and no infinity: both become null.
        Raises OutputError if the disk refuses, TypeError for a value that JSON cannot hold.
        """
        text = json.dumps(json_value(content), indent=2, ensure_ascii=False, allow_nan=False)
        self.write_text_atomic(name, text + "\n")


def read_summary(folder: Path) -> dict[str, Any]:
    """Return the content of summary.json in a run folder; empty if there is none.

    Raises OutputError where it is damaged.
    """
    file = folder / SUMMARY
    return read_json(file, WRITTEN_ANEW) if file.is_file() else {}


def read_json(file: Path, hint: str) -> dict[str, Any]:
    """Return the dictionary in a JSON file. Raises OutputError with `hint` if there is none."""
    try:
        found = json.loads(file.read_text("utf-8"))
        if not isinstance(found, dict):
            raise ValueError("not in braces")
    except (OSError, ValueError) as error:
        raise OutputError(f"{file} is damaged: {error}", hint) from error
    return found


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary file to write to, which replaces `path` at the end of the block.

    Its bytes are on the disk before its name is. If the block fails, `path` stays as it was and
    nothing is left beside it. Raises OutputError if the disk refuses.
    """
    partial = path.with_name(f".{path.name}.partial")
    try:
        with explained(path):
            yield partial
            with partial.open("rb+") as stream:
                os.fsync(stream.fileno())
            os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


def require_room(path: Path, size: int) -> None:
    """Raise OutputError unless the disk of `path` has `size` bytes and the MARGIN.

    For writers that cannot handle a full disk: HDF5 may crash the whole process.
    """
    free = shutil.disk_usage(path.parent).free
    if free < size + MARGIN:
        raise OutputError(
            f"cannot write {path}: it needs {_megabytes(size + MARGIN)}, and its disk has "
            f"{_megabytes(free)} left",
            hint="free disk space, then continue: a run with --resume, a study by repeating the "
            "command",
        )


@contextmanager
def explained(path: Path) -> Iterator[None]:
    """Turn an OSError of the block into an OutputError that names `path` and the free space."""
    try:
        yield
    except OSError as error:
        raise OutputError(
            f"cannot write {path}: {_reason(error)} ({_room(path)})",
            hint="free disk space or check write permission, then continue: a run with --resume, "
            "a study by repeating the command",
        ) from error


def _reason(error: OSError) -> str:
    return error.strerror or str(error)


def _room(path: Path) -> str:
    try:
        return f"{_megabytes(shutil.disk_usage(path.parent).free)} free on its disk"
    except OSError:
        return f"its folder {path.parent} does not exist"


def _megabytes(size: int) -> str:
    return f"{size / 2**20:.1f} MiB"


def json_value(value: Any) -> Any:
    """Return `value` in JSON types: numbers, lists, dictionaries; NaN and infinity as None."""
    if hasattr(value, "tolist"):  # a NumPy scalar or array
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): json_value(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [json_value(item) for item in value]
    return str(value) if isinstance(value, os.PathLike) else value
