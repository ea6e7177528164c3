"""The run folder: the names of its files, and functions that write them atomically."""

import io
import json
import math
import os
import re
import shutil
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import polars
from filelock import FileLock, Timeout

from softsim.errors import OutputError
from softsim.scene.loading import Loaded
from softsim.study.bisection import Bisection
from softsim.study.schema import Goal, Plot, StudyAxis

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


# -------------------------------------------------------------------------------------------------
# checkpoint.h5: the full state of a run, from which it continues bit for bit.

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


# -------------------------------------------------------------------------------------------------
# Lock of a folder: only one run, or one study, writes there at a time.

LOCK, OWNER = ".lock", ".owner"
"""Files in a locked folder: the lock of the process that works there, and its name."""


@contextmanager
def claimed(folder: Path) -> Iterator[None]:
    """Lock a folder against other runs and studies, on all machines that share its disk.

    The operating system releases the lock when the process ends, however it ends.

    Raises OutputError: another one works there, or the disk refuses.
    """
    owner = folder / OWNER
    with explained(folder / LOCK):
        try:
            held = FileLock(folder / LOCK).acquire(timeout=0)
        except Timeout:
            name = owner.read_text(encoding="utf-8") if owner.is_file() else "another process"
            hint = "wait until it has finished, or choose another folder with --out"
            raise OutputError(f"{name} is using the folder {folder}", hint) from None
    with held:
        try:
            with explained(owner):
                owner.write_text(f"process {os.getpid()} on {socket.gethostname()}", "utf-8")
            yield
        finally:
            owner.unlink(missing_ok=True)


# -------------------------------------------------------------------------------------------------
# The folder of a study: its files, its table, and the data for its report.
#
#     study.json               description of the study: `StudyRecord`
#     table.parquet, table.csv one row for each case
#     cases/KEY/               results of a run, thinned; KEY is the digest of all its inputs
#
# Columns of the table, in this order: `case`, one a factor, one a measure, `verdict` (of layouts
# only), `status`, `reason`, `warnings` (how many, if any case has some), `wall_time [s]`, `key`. A
# column of numbers with a unit is called "name [unit]".

STUDY, TABLE, TABLE_TEXT, CASES = "study.json", "table.parquet", "table.csv", "cases"

FORMULA_STARTS = r"^[=+\-@\t\r\n]"
"""Pattern of the texts that a spreadsheet may take for a formula (OWASP, CSV injection)."""

WARNINGS = "warnings"
"""Column of the number of warnings of each case."""

BEGIN_AGAIN = "remove it and start the study again: completed cases are not run again"


@dataclass(frozen=True)
class StudyRecord:
    """Content of study.json.

    status: running, done or interrupted. wall_time: of all sessions [s]. settings: title -> text,
    shown in the report. case_count: number of cases; the largest possible one for a bisection.
    sampled: True if cases are drawn from the ranges of the factors, so that a fraction of them
    estimates a probability.
    """

    title: str
    source: str
    factors: tuple[StudyAxis, ...]
    measures: tuple[StudyAxis, ...]
    plots: tuple[Plot, ...] = ()
    goal: Goal | None = None
    repeats: int = 1
    case_count: int = 0
    status: str = "running"
    wall_time: float = 0.0
    version: str = ""
    settings: dict[str, str] | None = None
    bisection: Bisection | None = None
    sampled: bool = False


def write_study(folder: Path, record: StudyRecord) -> None:
    """Write study.json. Raises OutputError."""
    RunFolder(folder).write_json_atomic(STUDY, asdict(record))


def read_study(folder: Path) -> StudyRecord:
    """Read study.json. Raises OutputError where there is none, or it is damaged."""
    file = folder / STUDY
    if not file.is_file():
        raise OutputError(f"{folder} is not the folder of a study: it has no {STUDY}")
    found = read_json(file, BEGIN_AGAIN)
    try:
        found["factors"] = tuple(StudyAxis(**axis) for axis in found["factors"])
        found["measures"] = tuple(StudyAxis(**axis) for axis in found["measures"])
        found["plots"] = tuple(Plot(**plot) for plot in found["plots"])
        found["goal"] = Goal(**found["goal"]) if found["goal"] else None
        found["bisection"] = Bisection.read(found.get("bisection"))
        return StudyRecord(**found)
    except (KeyError, TypeError) as error:
        raise OutputError(
            f"{file} is not a file written by softsim: {error}", BEGIN_AGAIN
        ) from error


def write_table(folder: Path, table: polars.DataFrame) -> None:
    """Write the table as Parquet and as text. Raises OutputError."""
    content = io.BytesIO()
    table.write_parquet(content)
    with replacing(folder / TABLE) as partial:
        partial.write_bytes(content.getvalue())
    with replacing(folder / TABLE_TEXT) as partial:
        partial.write_text(inert(table).write_csv(), encoding="utf-8")


def inert(table: polars.DataFrame) -> polars.DataFrame:
    """Return the table with an apostrophe before every text that a spreadsheet would compute.

    Spreadsheets take a text that begins with one of FORMULA_STARTS for a formula and run it.
    Columns of numbers, negative ones among them, stay as they are.
    """
    texts = polars.col(polars.String)
    escaped = table.with_columns(texts.str.replace(FORMULA_STARTS, "'${0}"))
    names = {name: f"'{name}" for name in table.columns if re.match(FORMULA_STARTS, name)}
    return escaped.rename(names)


def read_table(folder: Path) -> polars.DataFrame:
    """Read the table. Raises OutputError where there is none, or it is damaged."""
    file = folder / TABLE
    if not file.is_file():
        raise OutputError(f"{folder} has no {TABLE}: the study has not started")
    try:
        return polars.read_parquet(file)
    except (OSError, polars.exceptions.PolarsError) as error:
        raise OutputError(f"{file} is damaged: {error}", BEGIN_AGAIN) from error


def is_study(folder: Path) -> bool:
    """Return True if `folder` holds a study."""
    return (folder / STUDY).is_file()
