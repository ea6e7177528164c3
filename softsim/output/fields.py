"""results.vtkhdf: the mesh once, then fields frame by frame, as ParaView opens it.

The file follows VTKHDF 2.0, UnstructuredGrid with Steps. Beside /VTKHDF the group /softsim holds
what VTK has no place for: in /softsim/frames arrays per frame (poses of rigid bodies), in /softsim
itself arrays and texts of the whole run (walls, outlines, titles, node sets).

A killed run leaves a file that reads. Frames are written, one or several, in one opening of the
file in HDF5's single-writer mode, which orders its writes so that the file is whole at any moment,
and the number of frames is raised last: a frame of which only a part was written does not count.
What that mode cannot do, adding arrays, is done on a copy that takes the file's place.
"""

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import h5py
import numpy as np

from softsim.errors import OutputError
from softsim.output.folder import explained, replacing, require_room

Arrays = Mapping[str, np.ndarray]

VTKHDF_VERSION = (2, 0)
CELL_TYPES = {(2, 3): 5, (2, 4): 9, (3, 3): 5, (3, 4): 10, (3, 8): 12}
"""VTK's number of a cell, by dimension of the points and nodes a cell."""

FORMAT = ("v110", "v110")
"""File format of HDF5 1.10: the oldest with the single-writer mode, so that ParaView reads it."""

ROOT, STEPS, TIMES = "VTKHDF", "VTKHDF/Steps", "VTKHDF/Steps/Values"
POINT_DATA, CELL_DATA = "VTKHDF/PointData", "VTKHDF/CellData"
OWN, EXTRA, SETS = "softsim", "softsim/frames", "softsim/sets"


@dataclass(frozen=True)
class Frame:
    """Fields at a time [s].

    point_data: arrays (n,) or (n, c), two columns become three, as ParaView wants vectors.
    cell_data: (m,) or (m, c). extra: arrays of any shape, beside the mesh.
    """

    time: float
    point_data: Arrays
    cell_data: Arrays
    extra: Arrays

    def entries(self) -> dict[str, np.ndarray]:
        """Return the rows of each array of the file."""
        return {
            **{f"{POINT_DATA}/{name}": _vectors(a) for name, a in self.point_data.items()},
            **{f"{CELL_DATA}/{name}": _vectors(a) for name, a in self.cell_data.items()},
            **{f"{EXTRA}/{name}": np.asarray(a)[None] for name, a in self.extra.items()},
        }


class FieldWriter:
    """Writer of results.vtkhdf.

    points: (n, 2 or 3) reference positions [m]. cells: (m, corners) nodes of each cell: triangles,
    quadrilaterals in the plane, tetrahedra or hexahedra in space; corners may be repeated, as in
    mesh/mesh.py. resumed_at: time [s] at which a stopped run of this mesh goes on, and after which
    frames are dropped; None: a file that is there is replaced.

    Raises OutputError if the shapes are others, the disk refuses, or there is no file of softsim's
    to go on with.
    """

    def __init__(
        self,
        path: Path | str,
        points: np.ndarray,
        cells: np.ndarray,
        resumed_at: float | None = None,
    ) -> None:
        points, cells = np.asarray(points, dtype=float), np.asarray(cells, dtype=np.int64)
        if (points.ndim, cells.ndim) != (2, 2) or (
            (points.shape[1], cells.shape[1]) not in CELL_TYPES
        ):
            raise OutputError(
                f"{path}: points of shape {points.shape} and cells of shape {cells.shape} are not "
                "a mesh; points must be (n, 2 or 3) and cells (m, 3 or 4), in 3D (m, 4 or 8)"
            )
        self.path = Path(path)
        self._lengths = {POINT_DATA: len(points), CELL_DATA: len(cells), EXTRA: 1}
        self._shapes: dict[str, tuple[int, ...]] | None = None  # of every frame, from the first on
        self.last_time = -np.inf
        """Time of the newest frame [s]; minus infinity before the first."""
        self.frame_count = 0
        if resumed_at is None:
            with replacing(self.path) as partial, h5py.File(partial, "w", libver=FORMAT) as file:
                _write_mesh(file, points, cells)
            return
        with _replaced(self.path) as file:
            times = _times(file)
            kept = int(np.searchsorted(times, resumed_at, side="right"))
            _shorten(file, kept)
            if TIMES in file:
                self._shapes = {
                    f"{group}/{name}": (length, *entry.shape[1:])
                    for group, length in self._lengths.items()
                    for name, entry in file[group].items()
                }
        self.frame_count = kept
        if kept:
            self.last_time = float(times[kept - 1])

    def describe(self, **entries: np.ndarray | str | Arrays) -> None:
        """Store data of the whole run: arrays, texts, or `sets`, node-set name -> nodes.

        For the figures: walls (w, 2 d), a point of each [m] and its normal into the free side;
        pipes (p, 7), a point on the axis, its direction, the radius [m];
        path (n, 2 d + 2), samples of pipes' centre lines: arc length, point, tangent, radius [m];
        path_branch (n,), the number of the branch that each is of;
        wall_lines (k, 2, 2), pieces of curved walls in a section [m], one after another, with the
        free side on their left; wall_faces (k, 3 or 4, 3), the same in space [m], towards the free
        side by the right-hand rule; centre_lines (k, 2, d), pieces of what bodies follow [m];
        of each of the walls NAME_owner (k,): its number among the walls, whose displacements are in
        the frames as wall_offset (w, d) [m]; gravity (d,) [m/s^2];
        outlines (k, 4), one a rigid body: centre in the body's axes, length, height [m];
        rigid_vertices (v, d), of rigid bodies with a mesh surface, in the axes of the rigid body
        rigid_vertex_bodies (v,) of each, from its centre [m]; rigid_faces (m, d), their edges or
        triangles by number of vertex;
        cable_starts (c,), where each cable's nodes begin among those in the frames, cables (n, d)
        [m]; fibre_starts and fibres, the same of the places of each fibre; layers (m, 2 or 3), the
        nodes of the facets of all layers.
        A name that is there already gets the new content. Raises OutputError if the disk refuses.
        """
        with _replaced(self.path) as file:
            for name, entry in entries.items():
                if isinstance(entry, str):
                    file[OWN].attrs[name] = entry
                    continue
                if name in file[OWN]:
                    del file[OWN][name]
                arrays = entry if isinstance(entry, Mapping) else {"": entry}
                for key, array in arrays.items():
                    file[OWN][f"{name}/{key}".rstrip("/")] = array

    def append(
        self, time: float, point_data: Arrays, cell_data: Arrays, extra: Arrays | None = None
    ) -> None:
        """Write one frame; arguments and errors as for `extend`."""
        self.extend([Frame(time, point_data, cell_data, extra or {})])

    def extend(self, frames: Sequence[Frame]) -> None:
        """Write one or several frames and hand them to the operating system.

        Times increase. Names and shapes are the same in every frame.
        Raises OutputError if any of that does not hold, or if the disk refuses.
        """
        times = [self.last_time, *(frame.time for frame in frames)]
        for last, time in itertools.pairwise(times):
            if not time > last:
                raise OutputError(
                    f"{self.path}: a frame at {time:g} s does not come after the last one, "
                    f"at {last:g} s"
                )
        entries = [frame.entries() for frame in frames]
        with explained(self.path):
            require_room(self.path, sum(array.nbytes for of in entries for array in of.values()))
            if self._shapes is None:
                self._check(entries[0])
                with _replaced(self.path) as file:
                    _declare(file, {**entries[0], **_steps([frames[0].time], 0, entries[0])})
                self._shapes = {name: array.shape for name, array in entries[0].items()}
            for of in entries:
                self._check(of)
            with _single_writer(self.path) as file:
                _extend(file, times[1:], entries)
        self.last_time, self.frame_count = times[-1], self.frame_count + len(frames)

    def _check(self, frame: Arrays) -> None:
        """Raise OutputError if a frame does not fit the mesh, or the frames before it."""
        known = frame if self._shapes is None else self._shapes
        for group, length in self._lengths.items():
            there, here = (
                sorted(name.split("/")[-1] for name in names if name.startswith(f"{group}/"))
                for names in (known, frame)
            )
            if there != here:
                raise OutputError(
                    f"{self.path}: every frame must have the same arrays: {group} has {there}, "
                    f"this frame {here}"
                )
            for name in (f"{group}/{key}" for key in here):
                shape = frame[name].shape
                expected = (length, *shape[1:]) if self._shapes is None else self._shapes[name]
                if shape != expected:
                    raise OutputError(
                        f"{self.path}: {name} has the shape {shape}, expected {expected}"
                    )


class FieldSeries(Protocol):
    """One array over the frames: series[0], series[-1]."""

    def __getitem__(self, index: int) -> np.ndarray:
        """Return the array of a frame."""

    def at(self, indices: Iterable[int]) -> list[np.ndarray]:
        """Return the arrays of several frames."""


@dataclass(frozen=True)
class SeriesInMemory:
    """A series of arrays that no file holds."""

    arrays: list[np.ndarray]

    def __getitem__(self, index: int) -> np.ndarray:
        return self.arrays[index]

    def at(self, indices: Iterable[int]) -> list[np.ndarray]:
        """Return the arrays of several frames."""
        return [self.arrays[index] for index in indices]


@dataclass(frozen=True)
class FrameSeries:
    """Series that is read from the file on access.

    rows: rows of the file that make a frame; None where a frame is one entry.
    """

    path: Path
    name: str
    frames: int
    rows: int | None

    def __len__(self) -> int:
        return self.frames

    def __getitem__(self, index: int) -> np.ndarray:
        return self.at([index])[0]

    def at(self, indices: Iterable[int]) -> list[np.ndarray]:
        """Return the arrays of several frames.

        The file is opened only once, as that takes longer than reading a small array.
        """
        numbers = [range(self.frames)[index] for index in indices]
        with _opened(self.path) as file:
            stored = file[self.name]
            if self.rows is None:
                return [stored[k] for k in numbers]
            return [stored[k * self.rows : (k + 1) * self.rows] for k in numbers]


@dataclass(frozen=True)
class Frames:
    """Frames of a run; only the mesh, the times and the description are always in memory.

    points: (n, 2 or 3) reference positions [m]. cells: (m, corners). times: (frames,) [s].
    point_data, cell_data, extra: name -> series of arrays, vectors with three components.
    described: name -> array of the whole run. titles: name -> text. sets: name -> nodes.
    """

    points: np.ndarray
    cells: np.ndarray
    times: np.ndarray
    point_data: Mapping[str, FieldSeries]
    cell_data: Mapping[str, FieldSeries]
    extra: Mapping[str, FieldSeries]
    described: Arrays
    titles: Mapping[str, str]
    sets: Arrays

    def __len__(self) -> int:
        return len(self.times)


def read_frames(path: Path | str) -> Frames:
    """Open the frames of a run, which may be running or killed.

    Raises OutputError if there is no such file or it is not softsim's.
    """
    path = Path(path)
    with _opened(path) as file:
        own, times = file[OWN], _times(file)
        points = file[f"{ROOT}/Points"][:, : own.attrs["dimension"]]
        cells = file[f"{ROOT}/Connectivity"][:].reshape(_rows(file, CELL_DATA), -1)

        def series(group: str, rows: int | None) -> dict[str, FrameSeries]:
            return {n: FrameSeries(path, f"{group}/{n}", len(times), rows) for n in file[group]}

        return Frames(
            points,
            cells,
            times,
            point_data=series(POINT_DATA, len(points)),
            cell_data=series(CELL_DATA, len(cells)),
            extra=series(EXTRA, None),
            described={name: a[()] for name, a in own.items() if isinstance(a, h5py.Dataset)},
            titles={name: text for name, text in own.attrs.items() if isinstance(text, str)},
            sets={name: nodes[()] for name, nodes in file[SETS].items()} if SETS in file else {},
        )


@contextmanager
def _opened(path: Path) -> Iterator[h5py.File]:
    """Open the file for reading, also one that a killed run left or a run is writing.

    Raises OutputError if there is none, it is not softsim's, or it is found damaged in the block.
    """
    if not path.is_file():
        raise OutputError(
            f"there is no {path}", hint="name a folder that a run with field output has written"
        )
    changed = path.stat().st_mtime_ns
    try:
        # Single-writer mode reads a wrong checksum again and again, waiting longer each time: a
        # damaged file would never be refused. Only a file with a writer needs it.
        writer = _has_writer(path)
        with h5py.File(path, "r", libver=FORMAT, swmr=writer, locking=False) as file:
            if OWN not in file or STEPS not in file:
                raise OutputError(
                    f"{path} is not a result file of softsim: {OWN} or {STEPS} is missing"
                )
            yield file
    except (OSError, KeyError, RuntimeError) as error:  # h5py has no error of its own
        if path.is_file() and path.stat().st_mtime_ns != changed:
            hint = "a run wrote to it at the same time: try again"
        else:
            hint = "it is damaged or not an HDF5 file: run again, without --resume"
        raise OutputError(f"cannot read {path}: {error}", hint) from error


def _has_writer(path: Path) -> bool:
    """Return True if a writer has the file open, or was killed while it had.

    Raises OSError if the file is shorter than when it was closed: a reader would wait for the rest
    without end.

    HDF5 File Format Specification II.A, superblock of version 3: byte 8 is the version, byte 11
    has the flags of a writer, bytes 28 to 35 are the end of the file.
    """
    with path.open("rb") as stream:
        superblock = stream.read(36)
    if len(superblock) < 36:
        raise OSError("it ends within its superblock")
    if superblock[8] == 3 and superblock[11] != 0:
        return True
    size, end = path.stat().st_size, int.from_bytes(superblock[28:36], "little")
    if superblock[8] == 3 and size < end:
        raise OSError(f"it is truncated: {size} of {end} bytes are left")
    return False


@contextmanager
def _single_writer(path: Path) -> Iterator[h5py.File]:
    """Open the file in single-writer mode from the start: h5py's own switch comes later."""
    access = h5py.h5p.create(h5py.h5p.FILE_ACCESS)
    access.set_libver_bounds(h5py.h5f.LIBVER_V110, h5py.h5f.LIBVER_V110)
    access.set_file_locking(False, False)  # a ParaView that has the file open must not stop a run
    flags = h5py.h5f.ACC_RDWR | h5py.h5f.ACC_SWMR_WRITE
    try:
        with h5py.File(h5py.h5f.open(str(path).encode(), flags, fapl=access)) as file:
            yield file
    except RuntimeError as error:  # what h5py makes of a disk that fails while it flushes
        raise OSError(str(error)) from error


@contextmanager
def _replaced(path: Path) -> Iterator[h5py.File]:
    """Yield a copy of the file to change, which replaces the file at the end."""
    with replacing(path) as partial, h5py.File(partial, "w", libver=FORMAT) as new:
        with _opened(path) as old:
            require_room(path, path.stat().st_size)
            for name in old:
                old.copy(name, new)
        yield new


def _write_mesh(file: h5py.File, points: np.ndarray, cells: np.ndarray) -> None:
    dimension, corners = points.shape[1], cells.shape[1]
    root = file.create_group(ROOT)
    root.attrs["Version"] = np.array(VTKHDF_VERSION, dtype=np.int64)
    root.attrs["Type"] = np.bytes_("UnstructuredGrid")
    root["NumberOfPoints"] = np.array([len(points)])
    root["NumberOfCells"] = np.array([len(cells)])
    root["NumberOfConnectivityIds"] = np.array([cells.size])
    root["Points"] = np.pad(points, ((0, 0), (0, 3 - dimension)))
    root["Connectivity"] = cells.ravel()
    root["Offsets"] = np.arange(len(cells) + 1) * corners
    root["Types"] = np.full(len(cells), CELL_TYPES[dimension, corners], dtype=np.uint8)
    for group in (STEPS, POINT_DATA, CELL_DATA, EXTRA):
        file.create_group(group)
    file[STEPS].attrs["NSteps"] = 0
    file[OWN].attrs["dimension"] = dimension


def _steps(times: Sequence[float], first: int, frame: Arrays) -> dict[str, np.ndarray]:
    """Return the VTKHDF entries of steps from number `first` on: times, offsets of mesh and arrays.

    frame: the arrays of one step.
    """
    numbers = first + np.arange(len(times))
    of_mesh = np.zeros(len(times), dtype=np.int64)  # every step has the one mesh
    offsets = {
        f"{STEPS}/{group}Offsets/{key}": numbers * len(rows)
        for group, key, rows in ((*name.split("/")[1:], rows) for name, rows in frame.items())
        if group in ("PointData", "CellData")
    }
    return {
        TIMES: np.array(times, dtype=float),
        f"{STEPS}/NumberOfParts": of_mesh + 1,
        f"{STEPS}/PartOffsets": of_mesh,
        f"{STEPS}/PointOffsets": of_mesh,
        f"{STEPS}/CellOffsets": of_mesh[:, None],
        f"{STEPS}/ConnectivityIdOffsets": of_mesh[:, None],
        **offsets,
    }


def _declare(file: h5py.File, frame: Arrays) -> None:
    """Create the arrays of a frame, without rows."""
    for name, rows in frame.items():
        chunk = (max(len(rows), 64 if rows.ndim == 1 else 1), *rows.shape[1:])
        file.create_dataset(
            name,
            shape=(0, *rows.shape[1:]),
            maxshape=(None, *rows.shape[1:]),
            chunks=tuple(max(extent, 1) for extent in chunk),
            dtype=rows.dtype,
        )


def _shorten(file: h5py.File, count: int) -> None:
    """Keep the first `count` frames."""
    offsets = (f"{STEPS}/PointDataOffsets", f"{STEPS}/CellDataOffsets")
    for group in (POINT_DATA, CELL_DATA, EXTRA, STEPS, *offsets):
        for entry in file.get(group, {}).values():
            if isinstance(entry, h5py.Dataset):
                entry.resize(count * _rows(file, group), axis=0)
    file[STEPS].attrs.modify("NSteps", count)


def _extend(file: h5py.File, times: Sequence[float], frames: Sequence[Arrays]) -> None:
    first = int(file[STEPS].attrs["NSteps"])
    together = {name: np.concatenate([of[name] for of in frames]) for name in frames[0]}
    for name, rows in {**together, **_steps(times, first, frames[0])}.items():
        start, entry = first * len(rows) // len(times), file[name]
        entry.resize(start + len(rows), axis=0)
        entry[start:] = rows
    file.flush()
    file[STEPS].attrs.modify("NSteps", first + len(times))


def _times(file: h5py.File) -> np.ndarray:
    count = int(file[STEPS].attrs["NSteps"])
    return file[TIMES][:count] if count else np.zeros(0)


def _rows(file: h5py.File, group: str) -> int:
    """Return the number of rows of a frame in the arrays of `group`."""
    counts = {POINT_DATA: "NumberOfPoints", CELL_DATA: "NumberOfCells"}
    return int(file[f"{ROOT}/{counts[group]}"][0]) if group in counts else 1


def _vectors(array: np.ndarray) -> np.ndarray:
    """Return the array, with a third column of zeros if it has two columns."""
    array = np.asarray(array)
    return np.pad(array, ((0, 0), (0, 1))) if array.shape[1:] == (2,) else array
