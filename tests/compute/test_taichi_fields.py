"""Fields in one block: every number at its place, whatever lies before and behind."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import taichi as ti

from softsim.compute import backend, fields
from softsim.errors import DeviceError

random = np.random.default_rng(1)
ARRAYS = {
    "index": random.integers(-9, 9, 7),  # an odd number of words: the next real number is aligned
    "real": random.random((2, 5)),
    "vector": random.random((3, 4, 2)),
    "matrix": random.random((2, 3, 3)),
    "lane": random.random((2, 16)),
    "number": random.random(1),
    "long": random.random((2, 21, 3)),  # of which memory holds more
}
MAKERS = {
    "index": fields.index_field,
    "real": fields.real_field,
    "vector": fields.vector_field,
    "matrix": fields.matrix_field,
    "lane": fields.lane_data,
    "number": fields.real_field,
    "long": fields.vector_field,
}


@pytest.fixture(params=["in this process", "on a device"])
def made(fresh_taichi, request, monkeypatch):
    """As a CPU's fields are reached, and, on the CPU, as those of a device are."""
    if request.param == "on a device":
        device = replace(fresh_taichi, name="another")
        monkeypatch.setattr(backend, "_device", device)
    with fields.together():
        return {name: make(ARRAYS[name]) for name, make in MAKERS.items()}


def test_taichi_finds_every_number_where_it_was_written(made):
    for name, field in made.items():
        seen = field.to_numpy()
        shape = fields.shape_of(field)
        kept = seen[tuple(map(slice, shape))]
        np.testing.assert_array_equal(kept.reshape(ARRAYS[name].shape), ARRAYS[name])
        np.testing.assert_array_equal(fields.read(field), kept)
        assert np.count_nonzero(seen) == np.count_nonzero(kept)  # what lies beyond is zero


def test_a_number_is_read_when_a_kernel_runs(fresh_taichi):
    number = fields.Number(12)

    @ti.kernel
    def doubled() -> ti.i32:
        return 2 * number.read()

    assert (doubled(), np.zeros(number).shape, int(number)) == (24, (12,), 12)
    fields.write(number.cell, 13)
    assert doubled() == 26


def test_a_row_is_read_and_written_alone(made):
    for field in made.values():
        whole = fields.read(field)
        if whole.ndim > 1 and len(whole) > 1:
            np.testing.assert_array_equal(fields.read_row(field, 1), whole[1])
            fields.write_row(field, 1, 5.0)
            whole[1] = 5
            np.testing.assert_array_equal(fields.read(field), whole)


def test_rows_of_fields_are_copied_and_filled_together(made):
    names = [name for name in made if name not in ("index", "number")]
    wanted = {name: fields.read_row(made[name], 1) for name in names}
    row = fields.Row([made[name] for name in names], 1)
    copies = row.arrays(3)
    row.copy_to(copies, 2)
    assert 3 * row.bytes == sum(array.nbytes for array in copies)
    for name, array in zip(names, copies, strict=True):
        np.testing.assert_array_equal(array[2], wanted[name])
    row.fill(4.0)
    for name in names:
        assert (fields.read_row(made[name], 1) == 4.0).all()
        assert (fields.read_row(made[name], 0) != 4.0).any()


def test_a_row_beside_its_field_is_refused(made):
    with pytest.raises(IndexError):
        fields.read_row(made["real"], 2)
    with pytest.raises(IndexError):
        fields.write_row(made["real"], 2, 0.0)


def test_writing_changes_one_field_only(made):
    fields.write(made["vector"], 7.0)
    fields.write(made["index"], np.arange(7))
    for name, field in made.items():
        wanted = {"vector": np.full((3, 4, 2), 7.0), "index": np.arange(7)}.get(name, ARRAYS[name])
        np.testing.assert_array_equal(fields.read(field).reshape(wanted.shape), wanted)


def test_an_array_of_another_shape_is_refused(made):
    with pytest.raises(ValueError, match="shape"):
        fields.write(made["real"], np.zeros((2, 6)))


def test_new_fields_are_zero_where_old_ones_were_not(kernel_cache):
    for value in (0.0, 5.0):
        backend.start("cpu", cache=Path(kernel_cache))
        field = fields.lane_field((1000,))
        assert not fields.read(field).any()
        fields.write(field, value + 1.0)


def test_no_field_is_reached_after_taichi_was_started_anew(restart):
    restart()
    field = fields.real_field(np.ones(3))
    restart()
    with pytest.raises(DeviceError, match="started again"):
        fields.read(field)
    with pytest.raises(DeviceError, match="started again"):
        fields.write(field, 0.0)


def test_no_field_can_be_used_before_its_block_closes(fresh_taichi):
    @ti.kernel
    def first(field: ti.template()) -> ti.f64:
        return field[0]

    with fields.together():
        field = fields.real_field(np.ones(3))
        with pytest.raises(RuntimeError, match="not placed"):
            first(field)
        with pytest.raises(KeyError):
            fields.read(field)
    assert first(field) == 1.0


def test_a_field_without_entries_has_one_cell(fresh_taichi):
    """In each scenario."""
    assert fields.shape_of(fields.vector_field(np.zeros((0, 2)))) == (1, 2)
    of_scenarios = fields.vector_field(np.zeros((3, 0, 2)))
    assert fields.read_row(of_scenarios, 2).shape == (1, 2)


def test_more_fields_than_one_tree_takes(fresh_taichi):
    """Each has 17 of Taichi's nodes, of which a tree has 1024 at most."""
    values = random.random((80, 3, 4, 4))
    with fields.together():
        made = [fields.matrix_field(each) for each in values]

    @ti.kernel
    def add_up(first: ti.template(), last: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        for i in range(3):
            last[i] = last[i] + first[i]

    add_up(made[0], made[-1])
    for field, each in zip(made[:-1], values, strict=False):
        np.testing.assert_array_equal(fields.read(field), each)
    np.testing.assert_array_equal(fields.read(made[-1]), values[-1] + values[0])
