"""Fields, and how arrays get into them and out again.

Taichi's own ways are slow to start: a field made on its own gets a tree of memory of its own, and
each field that is filled or read on its own a kernel of its own, traced anew at every start. A
model has about a hundred fields. So they are made `together`, one after another in one block of
memory, seen as words of four bytes, and Taichi tells at which word of the block a field begins. A
CPU's block lies in the memory of this process, where numpy reads and writes it in place; of a
GPU's, two kernels copy the words, whatever they hold. Where fields are too many for one of Taichi's
trees, they get a second block.

A compiled kernel is kept and serves again wherever the extents of the fields are the same. So these
are rounded up (`rounded`), and what depends on the mesh is a `Number`, which a kernel reads when it
runs: meshes of about the same size share their kernels. Arrays that are read or written have the
shape that was asked for; the cells beyond it hold zeros, and no kernel comes there.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import taichi as ti

from softsim import backend
from softsim.errors import DeviceError

WORD = 4  # bytes
CACHE_LINE = 64  # bytes
NUMPY_TYPES: dict[Any, np.dtype] = {ti.i32: np.dtype(np.int32), ti.f64: np.dtype(np.float64)}
EXACT = 8  # extents up to here stay: corners, lanes of a vector, components, few scenarios
TREE_NODES = 1000  # of Taichi's 1024 in a tree, of which it has some of its own
DOUBLING = 2**15  # rounding doubles up to here; beyond, where memory counts, it adds an eighth


def rounded(extent: int) -> int:
    """The extent that a field gets along an axis of so many cells.

    Some more than a power of two: fields that lie whole pages of memory apart share the places of
    the first cache, and a store to one holds up loads from the next (60 against 39 us an increment
    of the robot's section).

    >>> [rounded(n) for n in (3, 8, 9, 1000, 40_000)]
    [3, 8, 24, 1032, 40968]
    """
    if extent <= EXACT:
        return extent
    power = 1 << (extent - 1).bit_length()
    step = power if power <= DOUBLING else power // 16
    return -(-extent // step) * step + EXACT


@dataclass(frozen=True)
class _New:
    """A field still without memory (None if it is only counted), and what it will hold; no values:
    zeros.
    """

    field: Any
    dtype: np.dtype
    cells: tuple[int, ...]
    extents: tuple[int, ...]
    components: tuple[int, ...]
    values: np.ndarray | None

    @property
    def cell_bytes(self) -> int:
        return math.prod(self.components) * self.dtype.itemsize

    @property
    def tree_nodes(self) -> int:
        """Its cells and each of its components: nodes of Taichi's tree."""
        return 1 + math.prod(self.components)


class Made:
    """Fields made in one block, so far, for so many scenarios."""

    def __init__(self, counted_only: bool, scenarios: int) -> None:
        self.counted_only, self.scenarios = counted_only, scenarios
        self.fields: list[_New] = []

    def extents(self, cells: tuple[int, ...]) -> tuple[int, ...]:
        """Cells in memory along each axis: the first long one is rounded up, not that of scenarios.

        That of scenarios, the first, is told by its length: a mesh that happens to have as many of
        something only shares no kernels.
        """
        first = 1 if cells[0] == self.scenarios else 0
        long = next((axis for axis in range(first, len(cells)) if cells[axis] > EXACT), None)
        return tuple(rounded(n) if axis == long else n for axis, n in enumerate(cells))

    @property
    def size(self) -> int:
        """Bytes that their numbers take."""
        return sum(math.prod(new.extents) * new.cell_bytes for new in self.fields)

    def add(
        self, dtype: type, cells: tuple[int, ...], components: tuple[int, ...],
        values: np.ndarray | None,
    ) -> ti.Field | None:  # fmt: skip
        """Add a field, which has no memory yet; None if it is only counted."""
        field = None
        if not self.counted_only:
            kind = (ti.field, ti.Vector.field, ti.Matrix.field)[len(components)]
            field = kind(*components, dtype)
        self.fields.append(
            _New(field, NUMPY_TYPES[dtype], cells, self.extents(cells), components, values)
        )
        return field

    def forget_values(self) -> None:
        """Drop the initial values, which are in the fields now."""
        self.fields = [replace(new, values=None) for new in self.fields]


class DifferentFieldsError(Exception):
    """Fields that were to be filled anew have another type or shape."""


class _Refill(Made):
    """Fields that were made before and get new values, in the same order."""

    def __init__(self, earlier: Sequence[_New], scenarios: int) -> None:
        super().__init__(counted_only=False, scenarios=scenarios)
        self.earlier = earlier

    def add(
        self, dtype: type, cells: tuple[int, ...], components: tuple[int, ...],
        values: np.ndarray | None,
    ) -> ti.Field | None:  # fmt: skip
        """Return the next field. Raises DifferentFieldsError."""
        if len(self.fields) == len(self.earlier):
            raise DifferentFieldsError
        known = self.earlier[len(self.fields)]
        if (known.dtype, known.cells, known.components) != (NUMPY_TYPES[dtype], cells, components):
            raise DifferentFieldsError
        self.fields.append(replace(known, values=values))
        return known.field


class _Place(ABC):
    """Where numbers of a field lie.

    device: on which the field was made; when Taichi starts anew, its memory is gone. shape: of the
    numbers.
    """

    device: backend.Device
    shape: tuple[int, ...]

    @abstractmethod
    def row(self, row: int) -> "_Place":
        """Where a row lies, which is an index of the first axis. Raises IndexError."""

    @abstractmethod
    def read(self) -> np.ndarray:
        """The numbers."""

    @abstractmethod
    def write(self, values: np.ndarray | float) -> None:
        """Give the numbers new values, an array or one that broadcasts to it."""


class _HostPlace(_Place):
    """In the memory of this process: `numbers` lie there."""

    def __init__(self, device: backend.Device, numbers: np.ndarray) -> None:
        self.device, self.numbers, self.shape = device, numbers, numbers.shape

    def row(self, row: int) -> "_HostPlace":
        """Where a row lies."""
        return _HostPlace(self.device, self.numbers[row, ...])

    def read(self) -> np.ndarray:
        """The numbers."""
        return self.numbers.copy()

    def write(self, values: np.ndarray | float) -> None:
        """Give the numbers new values."""
        self.numbers[...] = values


class _DevicePlace(_Place):
    """In a block of another memory, from a word of it on; extents: there."""

    def __init__(
        self,
        block: "_Block",
        first: int,
        shape: tuple[int, ...],
        extents: tuple[int, ...],
        dtype: np.dtype,
    ) -> None:
        self.block, self.first, self.extents, self.dtype = block, first, extents, dtype
        self.device, self.shape = block.device, shape

    def row(self, row: int) -> "_DevicePlace":
        """Where a row lies."""
        words = math.prod(self.extents[1:]) * self.dtype.itemsize // WORD
        first = self.first + range(self.shape[0])[row] * words  # a row beside the field is refused
        return _DevicePlace(self.block, first, self.shape[1:], self.extents[1:], self.dtype)

    def read(self) -> np.ndarray:
        """The numbers."""
        values: np.ndarray = np.empty(self.extents, self.dtype)
        self.block.copy_out(self.first, values.reshape(-1).view(np.int32))
        return np.array(values[tuple(map(slice, self.shape))])

    def write(self, values: np.ndarray | float) -> None:
        """Give the numbers new values."""
        whole = np.zeros(self.extents, self.dtype)
        whole[tuple(map(slice, self.shape))] = values
        self.block.copy_in(self.first, whole.reshape(-1).view(np.int32))


_made: Made | None = None
_places: WeakKeyDictionary[ti.Field, _Place] = WeakKeyDictionary()


@contextmanager
def together(scenarios: int = 1) -> Iterator[Made]:
    """Give the fields made inside, of so many scenarios, one block of memory, and their values,
    when it closes.

    Until then Taichi refuses to run any kernel: "These field(s) are not placed".

    Raises DeviceError where the block would be larger than its words can be numbered (8 GiB).
    """
    with _gathered(Made(counted_only=False, scenarios=scenarios)) as made:
        yield made
    _allocate(made)
    made.forget_values()


@contextmanager
def refilled(made: Made, count: int) -> Iterator[None]:
    """Give the first `count` fields that were made `together` the values of those made inside, in
    the same order. Nothing is written unless all have the types and shapes of before.

    Raises DifferentFieldsError if they have not.
    """
    with _gathered(_Refill(made.fields[:count], made.scenarios)) as again:
        yield
    if len(again.fields) != count:
        raise DifferentFieldsError
    for new in again.fields:
        write(new.field, 0.0 if new.values is None else new.values)


@contextmanager
def counted(scenarios: int = 1) -> Iterator[Made]:
    """Only count the fields made inside: they never get memory, and None stands for each."""
    with _gathered(Made(counted_only=True, scenarios=scenarios)) as made:
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


def _place(field: ti.Field) -> _Place:
    """Where a field lies. Raises DeviceError where Taichi was started anew since it was made."""
    place = _places[field]
    if place.device is not backend.device():
        raise DeviceError(
            "the fields of this solver no longer exist: Taichi was started again after they were "
            "made",
            hint="use one solver per process at a time, and read its results before the next one "
            "starts",
        )
    return place


def shape_of(field: ti.Field) -> tuple[int, ...]:
    """Shape of the array of all numbers of a field: cells, then components."""
    return _place(field).shape


def read(field: ti.Field) -> np.ndarray:
    """All numbers of a field (cells, components)."""
    return _place(field).read()


def read_row(field: ti.Field, row: int) -> np.ndarray:
    """All numbers of one row of a field: of one scenario, where the first axis counts these."""
    return _place(field).row(row).read()


def write(field: ti.Field, values: np.ndarray | float) -> None:
    """Give a field new numbers: an array (cells, components), or one that broadcasts to it."""
    _place(field).write(values)


def write_row(field: ti.Field, row: int, values: np.ndarray | float) -> None:
    """Give one row of a field new numbers; the other rows stay as they are."""
    _place(field).row(row).write(values)


class Number:
    """A whole number of a model, such as how many elements it has: an index in Python; in a kernel
    read when it runs, not written into it.
    """

    def __init__(self, value: int) -> None:
        self.value = value
        self.cell = index_field(np.array([value]))
        self.parts = backend.device().parts

    def __index__(self) -> int:
        return self.value

    @ti.func
    def read(self):
        """The number, in a kernel."""
        return self.cell[0]

    @ti.func
    def first(self, part):
        """In a kernel, the first of so many indices in a part of a sum, which has as many parts as
        the device says.
        """
        return self.cell[0] * part // self.parts


@ti.func
def once(part):
    """1 in the first part of a sum, else 0: a factor of what is not split, as a tether's energy."""
    return ti.cast(part == 0, backend.real)


@ti.data_oriented
class _Block:
    """Memory of fields, one after another, seen as words.

    `words` is declared with the first cache line only: indices beyond it reach the fields that
    follow. Nothing checks them; `_DevicePlace` keeps them right.
    """

    def __init__(self, made: list[_New]) -> None:
        self.device = backend.device()
        builder = ti.FieldsBuilder()
        self.words = ti.field(ti.i32)
        builder.dense(ti.i, CACHE_LINE // WORD).place(self.words)
        for new in made:
            builder.dense(ti.axes(*range(len(new.cells))), new.extents).place(new.field)
        builder.finalize()

    def places(self, made: list[_New]) -> Iterator[tuple[ti.Field, _Place]]:
        """The fields of this block, and where each lies."""
        start = self.address() if self.device.name == "cpu" else None
        for new in made:
            offset = new.field.parent()._offset_bytes_in_parent_cell
            shape, extents = (*new.cells, *new.components), (*new.extents, *new.components)
            if start is None:
                yield new.field, _DevicePlace(self, offset // WORD, shape, extents, new.dtype)
                continue
            kind = np.ctypeslib.as_ctypes_type(new.dtype) * math.prod(extents)
            numbers = np.ctypeslib.as_array(kind.from_address(start + offset)).reshape(extents)
            yield new.field, _HostPlace(self.device, numbers[tuple(map(slice, shape))])

    @ti.kernel
    def address(self) -> ti.u64:
        """Of the first word."""
        return ti.get_addr(self.words, [0])

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
    cells = tuple(max(1, extent) for extent in values.shape[:split])
    return _new(dtype, cells, values.shape[split:], values if np.any(values) else None)


def _new(
    dtype: type, cells: tuple[int, ...], components: tuple[int, ...], values: np.ndarray | None
) -> ti.Field:
    """A field that gets its memory at once, or with the others that are made together."""
    made = Made(counted_only=False, scenarios=1) if _made is None else _made
    field = made.add(dtype, cells, components, values)
    if _made is None:
        _allocate(made)
    return field


def _allocate(made: Made) -> None:
    """Place fields in a block, or several, and fill them.

    Whole cache lines come first, so that no lane vector lies across two of them.
    """
    if made.size > WORD * np.iinfo(np.int32).max:
        raise DeviceError(
            f"the model needs {made.size / 2**30:.1f} GiB in one array, more than the largest "
            "possible index",
            hint="use a coarser mesh or fewer scenarios per batch",
        )
    trees = [
        sorted(tree, key=lambda new: new.cell_bytes % CACHE_LINE != 0)
        for tree in _trees(made.fields)
    ]
    blocks = [_Block(tree) for tree in trees]  # all, before a kernel runs
    for block, tree in zip(blocks, trees, strict=True):
        _places.update(block.places(tree))
    for new in made.fields:
        if new.values is not None:
            write(new.field, new.values)


def _trees(made: list[_New]) -> list[list[_New]]:
    """Fields in as many of Taichi's trees as they need: mostly one."""
    trees: list[list[_New]] = [[]]
    nodes = 0
    for new in made:
        nodes += new.tree_nodes
        if nodes > TREE_NODES:
            trees.append([])
            nodes = new.tree_nodes
        trees[-1].append(new)
    return trees


def padded(tables: Sequence[np.ndarray]) -> np.ndarray:
    """Tables (n, ...) of several scenarios as one (scenarios, longest n, ...), with zeros."""
    longest = max(1, *map(len, tables))
    return np.stack(
        [
            np.concatenate([t, np.zeros((longest - len(t), *t.shape[1:]), dtype=t.dtype)])
            for t in tables
        ]
    )
