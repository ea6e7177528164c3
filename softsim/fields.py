"""Fields, and how arrays get into them and out again.

Taichi's own ways are slow to start: a field made on its own gets a tree of memory of its own, and
each field that is filled or read on its own a kernel of its own, traced anew at every start. A
model has about a hundred fields. So they are made `together`, one after another in one block of
memory, and two kernels write and read all of them, whatever they hold: they copy words of four
bytes, and Taichi tells at which word of the block a field begins.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import taichi as ti

from softsim import backend
from softsim.errors import DeviceError

WORD = 4  # bytes
CACHE_LINE = 64  # bytes
NUMPY_TYPES: dict[Any, np.dtype] = {ti.i32: np.dtype(np.int32), ti.f64: np.dtype(np.float64)}


@dataclass(frozen=True)
class _New:
    """A field still without memory (None if it is only counted), and what it will hold; no values:
    zeros.
    """

    field: Any
    dtype: np.dtype
    cells: tuple[int, ...]
    components: tuple[int, ...]
    values: np.ndarray | None

    @property
    def cell_bytes(self) -> int:
        return math.prod(self.components) * self.dtype.itemsize


class Made:
    """Fields made in one block, so far."""

    def __init__(self, counted_only: bool) -> None:
        self.counted_only = counted_only
        self.fields: list[_New] = []

    @property
    def size(self) -> int:
        """Bytes that their numbers take."""
        return sum(math.prod(new.cells) * new.cell_bytes for new in self.fields)


@dataclass(frozen=True)
class _Place:
    """Where a field lies: the block, its first word there, shape and type of all its numbers."""

    block: "_Block"
    first: int
    shape: tuple[int, ...]
    dtype: np.dtype

    def first_of(self, row: int) -> int:
        """First word of a row, which is an index of the first axis."""
        return self.first + row * math.prod(self.shape[1:]) * self.dtype.itemsize // WORD


_made: Made | None = None
_places: WeakKeyDictionary[ti.Field, _Place] = WeakKeyDictionary()


@contextmanager
def together() -> Iterator[Made]:
    """Give the fields made inside one block of memory, and their values, when it closes.

    Until then Taichi refuses to run any kernel: "These field(s) are not placed".

    Raises DeviceError where the block would be larger than its words can be numbered (8 GiB).
    """
    with _gathered(Made(counted_only=False)) as made:
        yield made
    _allocate(made)


@contextmanager
def counted() -> Iterator[Made]:
    """Only count the fields made inside: they never get memory, and None stands for each."""
    with _gathered(Made(counted_only=True)) as made:
        yield made


@contextmanager
def _gathered(made: Made) -> Iterator[Made]:
    global _made
    outer, _made = _made, made
    try:
        yield made
    finally:
        _made = outer


def index_field(values: np.ndarray) -> ti.ScalarField:
    """A field of whole numbers (at least one cell, so that it can be allocated)."""
    return _make(ti.i32, values)


def real_field(values: np.ndarray) -> ti.ScalarField:
    """A field of real numbers (at least one cell)."""
    return _make(backend.real, values)


def vector_field(values: np.ndarray) -> ti.MatrixField:
    """A field of vectors from `values` (..., components), at least one cell."""
    return _make(backend.real, values, 1)


def matrix_field(values: np.ndarray) -> ti.MatrixField:
    """A field of matrices from `values` (..., rows, columns), at least one cell."""
    return _make(backend.real, values, 2)


def lane_field(shape: tuple[int, ...]) -> ti.MatrixField:
    """A field of zero lane vectors; `shape` counts lane vectors, not numbers."""
    return _new(backend.real, shape, (backend.lanes(),), None)


def lane_data(values: np.ndarray) -> ti.MatrixField:
    """A field of lane vectors from `values` (..., elements), whole lane vectors of elements."""
    return vector_field(values.reshape(*values.shape[:-1], -1, backend.lanes()))


def shape_of(field: ti.Field) -> tuple[int, ...]:
    """Shape of the array of all numbers of a field: cells, then components."""
    return _places[field].shape


def read(field: ti.Field) -> np.ndarray:
    """All numbers of a field (cells, components)."""
    place = _places[field]
    values: np.ndarray = np.empty(place.shape, place.dtype)
    place.block.copy_out(place.first, values.reshape(-1).view(np.int32))
    return values


def read_row(field: ti.Field, row: int) -> np.ndarray:
    """All numbers of one row of a field: of one scenario, where the first axis counts these."""
    place = _places[field]
    values: np.ndarray = np.empty(place.shape[1:], place.dtype)
    place.block.copy_out(place.first_of(row), values.reshape(-1).view(np.int32))
    return values


def write(field: ti.Field, values: np.ndarray | float) -> None:
    """Give a field new numbers: an array (cells, components), or one that broadcasts to it."""
    place = _places[field]
    place.block.copy_in(place.first, _words(values, place.shape, place.dtype))


def write_row(field: ti.Field, row: int, values: np.ndarray | float) -> None:
    """Give one row of a field new numbers; the other rows stay as they are."""
    place = _places[field]
    place.block.copy_in(place.first_of(row), _words(values, place.shape[1:], place.dtype))


def _words(values: np.ndarray | float, shape: tuple[int, ...], dtype: np.dtype) -> np.ndarray:
    """Values broadcast to this shape, as words one after another."""
    whole: np.ndarray = np.broadcast_to(values, shape)
    return np.ascontiguousarray(whole, dtype=dtype).reshape(-1).view(np.int32)


@ti.data_oriented
class _Block:
    """Memory of fields, one after another, seen as words.

    `words` is declared with the first cache line only: indices beyond it reach the fields that
    follow. Nothing checks them; `_Place` keeps them right.
    """

    def __init__(self, made: list[_New]) -> None:
        builder = ti.FieldsBuilder()
        self.words = ti.field(ti.i32)
        builder.dense(ti.i, CACHE_LINE // WORD).place(self.words)
        for new in made:
            builder.dense(ti.axes(*range(len(new.cells))), new.cells).place(new.field)
        builder.finalize()

    @ti.kernel
    def copy_in(self, first: ti.i32, data: ti.types.ndarray(ti.i32, ndim=1)):  # type: ignore[valid-type]  # Taichi wants an instance
        """Write `data` from word `first` on."""
        for k in range(data.shape[0]):
            self.words[first + k] = data[k]

    @ti.kernel
    def copy_out(self, first: ti.i32, data: ti.types.ndarray(ti.i32, ndim=1)):  # type: ignore[valid-type]  # Taichi wants an instance
        """Read `data` from word `first` on."""
        for k in range(data.shape[0]):
            data[k] = self.words[first + k]


def _make(dtype: type, values: np.ndarray, component_axes: int = 0) -> ti.Field:
    """A field of `values`; its memory starts as zeros, so only other values are written."""
    split = values.ndim - component_axes
    cells = values.shape[:split] if values.size else (1,) * split
    return _new(dtype, cells, values.shape[split:], values if np.any(values) else None)


def _new(
    dtype: type, cells: tuple[int, ...], components: tuple[int, ...], values: np.ndarray | None
) -> ti.Field:
    """A field that gets its memory at once, or with the others that are made together."""
    made = Made(counted_only=False) if _made is None else _made
    field = None
    if not made.counted_only:
        field = (ti.field, ti.Vector.field, ti.Matrix.field)[len(components)](*components, dtype)
    made.fields.append(_New(field, NUMPY_TYPES[dtype], cells, components, values))
    if _made is None:
        _allocate(made)
    return field


def _allocate(made: Made) -> None:
    """Place fields in one block and fill them.

    Whole cache lines come first, so that no lane vector lies across two of them.
    """
    placed = sorted(made.fields, key=lambda new: new.cell_bytes % CACHE_LINE != 0)
    if made.size > WORD * np.iinfo(np.int32).max:
        raise DeviceError(
            f"the model needs {made.size / 2**30:.1f} GiB in one piece, more than can be numbered",
            hint="use a coarser mesh or fewer scenarios at once",
        )
    block = _Block(placed)
    for new in placed:
        first = new.field.parent()._offset_bytes_in_parent_cell // WORD
        shape = (*new.cells, *new.components)
        _places[new.field] = _Place(block, first, shape, new.dtype)
        if new.values is not None:
            write(new.field, new.values)
