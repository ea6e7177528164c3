"""Allocation of Taichi fields in one block of memory, and transfer of arrays to and from them.

In Taichi alone, each field gets its own memory tree, and each field that is filled or read gets its
own kernel, traced at every start. This is slow: a model has about a hundred fields. Here they are
allocated `together`, one after another in one block of memory, addressed as words of four bytes;
Taichi returns the word at which a field begins. The block of a CPU lies in the memory of this
process, where numpy reads and writes it in place; the words of a GPU's block are copied by two
kernels, whatever their type. Fields that are too many for one of Taichi's trees get a second block.

A compiled kernel is reused wherever the extents of the fields are the same. So extents are rounded
up (`rounded`), and integers that depend on the mesh are a `Number`, which a kernel reads at run
time: meshes of about the same size share their kernels. Arrays that are read or written have the
requested shape; the cells beyond it hold zeros, and no kernel accesses them.
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

from softsim.compute import backend
from softsim.compute.taichi_internals import offset_in_block
from softsim.errors import DeviceError

WORD = 4  # bytes
CACHE_LINE = 64  # bytes
NUMPY_TYPES: dict[Any, np.dtype] = {ti.i32: np.dtype(np.int32), ti.f64: np.dtype(np.float64)}
EXACT = 8  # extents up to here stay: corners, lanes of a vector, components, few scenarios
TREE_NODES = 1000  # of Taichi's 1024 in a tree, of which it has some of its own
DOUBLING = 2**15  # rounding doubles up to here; beyond, where memory counts, it adds an eighth


def rounded(extent: int) -> int:
    """Return the allocated extent of a field along an axis of `extent` cells.

    It is slightly larger than a power of two: fields that lie whole pages of memory apart share the
    lines of the first cache, and a store to one delays loads from the next (60 against 39 us an
    increment of the robot's section).

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
    """Field without memory yet, its shape and initial values.

    field is None if it is only counted; values is None for zeros.
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
        """Number of nodes in Taichi's tree: one for the cells and one for each component."""
        return 1 + math.prod(self.components)


class Made:
    """Fields declared so far in one block, for a number of scenarios."""

    def __init__(self, counted_only: bool, scenarios: int) -> None:
        self.counted_only, self.scenarios = counted_only, scenarios
        self.fields: list[_New] = []

    def extents(self, cells: tuple[int, ...]) -> tuple[int, ...]:
        """Return the cells in memory along each axis: the first long axis is rounded up.

        The scenario axis is not; it is the first axis and recognised by its length. A mesh that
        happens to have the same length there merely does not share kernels.
        """
        first = 1 if cells[0] == self.scenarios else 0
        long = next((axis for axis in range(first, len(cells)) if cells[axis] > EXACT), None)
        return tuple(rounded(n) if axis == long else n for axis, n in enumerate(cells))

    @property
    def size(self) -> int:
        """Size of the fields in memory [bytes]."""
        return sum(math.prod(new.extents) * new.cell_bytes for new in self.fields)

    def add(
        self, dtype: type, cells: tuple[int, ...], components: tuple[int, ...],
        values: np.ndarray | None,
    ) -> ti.Field | None:  # fmt: skip
        """Add a field without memory and return it; None if it is only counted."""
        field = None
        if not self.counted_only:
            kind = (ti.field, ti.Vector.field, ti.Matrix.field)[len(components)]
            field = kind(*components, dtype)
        self.fields.append(
            _New(field, NUMPY_TYPES[dtype], cells, self.extents(cells), components, values)
        )
        return field

    def forget_values(self) -> None:
        """Drop the initial values once they are in the fields."""
        self.fields = [replace(new, values=None) for new in self.fields]


class DifferentFieldsError(Exception):
    """Raised when fields to be refilled differ in type or shape."""


class _Refill(Made):
    """Existing fields that get new values, in the same order."""

    def __init__(self, earlier: Sequence[_New], scenarios: int) -> None:
        super().__init__(counted_only=False, scenarios=scenarios)
        self.earlier = earlier

    def add(
        self, dtype: type, cells: tuple[int, ...], components: tuple[int, ...],
        values: np.ndarray | None,
    ) -> ti.Field | None:  # fmt: skip
        """Return the next existing field; raise DifferentFieldsError if it differs."""
        if len(self.fields) == len(self.earlier):
            raise DifferentFieldsError
        known = self.earlier[len(self.fields)]
        if (known.dtype, known.cells, known.components) != (NUMPY_TYPES[dtype], cells, components):
            raise DifferentFieldsError
        self.fields.append(replace(known, values=values))
        return known.field


class _Place(ABC):
    """Location of the numbers of a field.

    device: on which the field was allocated; its memory is lost when Taichi restarts. shape, dtype:
    of the numbers.
    """

    device: backend.Device
    shape: tuple[int, ...]
    dtype: np.dtype

    @abstractmethod
    def row(self, row: int) -> "_Place":
        """Return the location of a row, an index of the first axis, or raise IndexError."""

    @abstractmethod
    def read(self) -> np.ndarray:
        """Return the numbers."""

    @abstractmethod
    def read_into(self, array: np.ndarray) -> None:
        """Write the numbers into an array of their shape."""

    @abstractmethod
    def write(self, values: np.ndarray | float) -> None:
        """Write new values, an array or one that broadcasts to it."""


class _HostPlace(_Place):
    """Location in the memory of this process, as the array `numbers`."""

    def __init__(self, device: backend.Device, numbers: np.ndarray) -> None:
        self.device, self.numbers = device, numbers
        self.shape, self.dtype = numbers.shape, numbers.dtype

    def row(self, row: int) -> "_HostPlace":
        return _HostPlace(self.device, self.numbers[row, ...])

    def read(self) -> np.ndarray:
        return self.numbers.copy()

    def read_into(self, array: np.ndarray) -> None:
        np.copyto(array, self.numbers)

    def write(self, values: np.ndarray | float) -> None:
        self.numbers[...] = values


class _DevicePlace(_Place):
    """Location in a block on another device, from word `first` on; extents: in that memory."""

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
        words = math.prod(self.extents[1:]) * self.dtype.itemsize // WORD
        first = self.first + range(self.shape[0])[row] * words  # a row beside the field is refused
        return _DevicePlace(self.block, first, self.shape[1:], self.extents[1:], self.dtype)

    def read(self) -> np.ndarray:
        values: np.ndarray = np.empty(self.extents, self.dtype)
        self.block.copy_out(self.first, values.reshape(-1).view(np.int32))
        return np.array(values[tuple(map(slice, self.shape))])

    def read_into(self, array: np.ndarray) -> None:
        np.copyto(array, self.read())

    def write(self, values: np.ndarray | float) -> None:
        whole = np.zeros(self.extents, self.dtype)
        whole[tuple(map(slice, self.shape))] = values
        self.block.copy_in(self.first, whole.reshape(-1).view(np.int32))


_made: Made | None = None
_places: WeakKeyDictionary[ti.Field, _Place] = WeakKeyDictionary()


@contextmanager
def together(scenarios: int = 1) -> Iterator[Made]:
    """Allocate the fields declared inside, for a number of scenarios, in one block of memory.

    They get memory and values when the block ends. Until then Taichi does not run any kernel:
    "These field(s) are not placed".

    Raises DeviceError where the block would exceed the range of word indices (8 GiB).
    """
    with _gathered(Made(counted_only=False, scenarios=scenarios)) as made:
        yield made
    _allocate(made)
    made.forget_values()


@contextmanager
def refilled(made: Made, count: int) -> Iterator[None]:
    """Write the values of the fields declared inside to the first `count` fields of `made`.

    The order is the same. Raises DifferentFieldsError, without writing, if types or shapes differ.
    """
    with _gathered(_Refill(made.fields[:count], made.scenarios)) as again:
        yield
    if len(again.fields) != count:
        raise DifferentFieldsError
    for new in again.fields:
        write(new.field, 0.0 if new.values is None else new.values)


@contextmanager
def counted(scenarios: int = 1) -> Iterator[Made]:
    """Count the fields declared inside without memory: None replaces each field."""
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
    """Return a field of integers (at least one cell, so that it can be allocated)."""
    return _make(ti.i32, values)


def real_field(values: np.ndarray) -> ti.ScalarField:
    """Return a field of real numbers (at least one cell)."""
    return _make(backend.real, values)


def vector_field(values: np.ndarray) -> ti.MatrixField:
    """Return a field of vectors from `values` (..., components), at least one cell."""
    return _make(backend.real, values, 1)


def matrix_field(values: np.ndarray) -> ti.MatrixField:
    """Return a field of matrices from `values` (..., rows, columns), at least one cell."""
    return _make(backend.real, values, 2)


def lane_field(shape: tuple[int, ...]) -> ti.MatrixField:
    """Return a field of zero lane vectors; `shape` counts lane vectors, not numbers."""
    return _new(backend.real, shape, (backend.lanes(),), None)


def lane_data(values: np.ndarray) -> ti.MatrixField:
    """Return a field of lane vectors from `values` (..., elements) of whole lane vectors."""
    return vector_field(values.reshape(*values.shape[:-1], -1, backend.lanes()))


def _place(field: ti.Field) -> _Place:
    """Return the location of a field; raise DeviceError if Taichi was restarted since."""
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
    """Return the shape of all numbers of a field: cells, then components."""
    return _place(field).shape


def read(field: ti.Field) -> np.ndarray:
    """Return all numbers of a field (cells, components)."""
    return _place(field).read()


def read_row(field: ti.Field, row: int) -> np.ndarray:
    """Return the numbers of one row of a field: of one scenario if the first axis is scenarios."""
    return _place(field).row(row).read()


def write(field: ti.Field, values: np.ndarray | float) -> None:
    """Write new numbers to a field: an array (cells, components), or one that broadcasts to it."""
    _place(field).write(values)


def write_row(field: ti.Field, row: int, values: np.ndarray | float) -> None:
    """Write new numbers to one row of a field; the other rows are unchanged."""
    _place(field).row(row).write(values)


class Row:
    """One row of several fields, such as all impulses of one scenario.

    bytes: size of all its numbers.
    """

    def __init__(self, fields: Sequence[ti.Field], row: int) -> None:
        self.fields, self.places = fields, [_place(field).row(row) for field in fields]
        self.bytes = sum(math.prod(place.shape) * place.dtype.itemsize for place in self.places)

    def fill(self, values: np.ndarray | float) -> None:
        """Set the numbers of each field to an array, or to one that broadcasts to it.

        Raises DeviceError if Taichi was restarted.
        """
        self._refuse_stale()
        for place in self.places:
            place.write(values)

    def _refuse_stale(self) -> None:
        if self.fields:
            _place(self.fields[0])

    def arrays(self, count: int) -> list[np.ndarray]:
        """Return arrays (count, ...) for so many copies of the numbers of each field."""
        return [np.empty((count, *place.shape), place.dtype) for place in self.places]

    def copy_to(self, arrays: Sequence[np.ndarray], number: int) -> None:
        """Copy the present numbers to place `number` of the arrays.

        Raises DeviceError if Taichi was restarted.
        """
        self._refuse_stale()
        for place, array in zip(self.places, arrays, strict=True):
            place.read_into(array[number, ...])


class Number:
    """Integer that kernels read at run time, so that a change does not trigger recompilation.

    It is an index in Python. An example is the number of elements of a model.
    """

    def __init__(self, value: int) -> None:
        self.value = value
        self.cell = index_field(np.array([value]))
        self.parts = backend.device().parts

    def __index__(self) -> int:
        return self.value

    @ti.func
    def read(self):
        """Return the number in a kernel."""
        return self.cell[0]

    @ti.func
    def first(self, part):
        """Return, in a kernel, the first of the indices in a part of a sum over this many indices.

        The number of parts is that of the device.
        """
        return self.cell[0] * part // self.parts


@ti.func
def once(part):
    """Return 1 in the first part of a sum, else 0: a factor of terms that are not split."""
    return ti.cast(part == 0, backend.real)


@ti.data_oriented
class _Block:
    """Memory of fields, one after another, addressed as words.

    `words` is declared with the first cache line only: indices beyond it reach the fields that
    follow. Taichi does not check them; `_DevicePlace` computes valid indices.
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
        """Yield the fields of this block with their locations."""
        start = self.address() if self.device.name == "cpu" else None
        for new in made:
            offset = offset_in_block(new.field)
            shape, extents = (*new.cells, *new.components), (*new.extents, *new.components)
            if start is None:
                yield new.field, _DevicePlace(self, offset // WORD, shape, extents, new.dtype)
                continue
            kind = np.ctypeslib.as_ctypes_type(new.dtype) * math.prod(extents)
            numbers = np.ctypeslib.as_array(kind.from_address(start + offset)).reshape(extents)
            yield new.field, _HostPlace(self.device, numbers[tuple(map(slice, shape))])

    @ti.kernel
    def address(self) -> ti.u64:
        """Return the address of the first word."""
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
    """Return a field of `values`; memory starts as zeros, so only nonzero values are written."""
    split = values.ndim - component_axes
    cells = tuple(max(1, extent) for extent in values.shape[:split])
    return _new(dtype, cells, values.shape[split:], values if np.any(values) else None)


def _new(
    dtype: type, cells: tuple[int, ...], components: tuple[int, ...], values: np.ndarray | None
) -> ti.Field:
    """Return a field allocated at once, or later with the others of an open block."""
    made = Made(counted_only=False, scenarios=1) if _made is None else _made
    field = made.add(dtype, cells, components, values)
    if _made is None:
        _allocate(made)
    return field


def _allocate(made: Made) -> None:
    """Allocate fields in one block or several, and write their values.

    Cells of whole cache lines come first, so that no lane vector spans two of them.
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
    """Return the fields split into as many Taichi trees as they need, mostly one."""
    trees: list[list[_New]] = [[]]
    nodes = 0
    for new in made:
        nodes += new.tree_nodes
        if nodes > TREE_NODES:
            trees.append([])
            nodes = new.tree_nodes
        trees[-1].append(new)
    return trees


def lengthened(values: np.ndarray) -> np.ndarray:
    """Return a list (n,) with zeros appended up to a power of two.

    A reused solver takes lists of the same length only; those of similar models then have it.
    """
    length = 1 << (len(values) - 1).bit_length()
    return np.pad(values, (0, length - len(values)))


def padded(tables: Sequence[np.ndarray]) -> np.ndarray:
    """Return tables (n, ...) of scenarios as one (scenarios, longest n, ...), padded with zeros."""
    longest = max(1, *map(len, tables))
    return np.stack(
        [
            np.concatenate([t, np.zeros((longest - len(t), *t.shape[1:]), dtype=t.dtype)])
            for t in tables
        ]
    )
