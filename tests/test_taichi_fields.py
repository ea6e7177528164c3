"""Fields in one block: every number at its place, whatever lies before and behind."""

from pathlib import Path

import numpy as np
import pytest
import taichi as ti

from softsim import backend, fields

random = np.random.default_rng(1)
ARRAYS = {
    "index": random.integers(-9, 9, 7),  # an odd number of words: the next real number is aligned
    "real": random.random((2, 5)),
    "vector": random.random((3, 4, 2)),
    "matrix": random.random((2, 3, 3)),
    "lane": random.random((2, 16)),
    "number": random.random(1),
}
MAKERS = {
    "index": fields.index_field,
    "real": fields.real_field,
    "vector": fields.vector_field,
    "matrix": fields.matrix_field,
    "lane": fields.lane_data,
    "number": fields.real_field,
}


@pytest.fixture
def made(cpu):
    with fields.together():
        return {name: make(ARRAYS[name]) for name, make in MAKERS.items()}


def test_taichi_finds_every_number_where_it_was_written(made):
    for name, field in made.items():
        seen = field.to_numpy()
        np.testing.assert_array_equal(seen.reshape(ARRAYS[name].shape), ARRAYS[name])


def test_reading_gives_what_taichi_gives(made):
    for field in made.values():
        assert fields.shape_of(field) == field.to_numpy().shape
        np.testing.assert_array_equal(fields.read(field), field.to_numpy())


def test_a_row_is_read_and_written_alone(made):
    for field in made.values():
        whole = fields.read(field)
        if whole.ndim > 1 and len(whole) > 1:
            np.testing.assert_array_equal(fields.read_row(field, 1), whole[1])
            fields.write_row(field, 1, 5.0)
            whole[1] = 5
            np.testing.assert_array_equal(fields.read(field), whole)


def test_writing_changes_one_field_only(made):
    fields.write(made["vector"], 7.0)
    fields.write(made["index"], np.arange(7))
    for name, field in made.items():
        wanted = {"vector": np.full((3, 4, 2), 7.0), "index": np.arange(7)}.get(name, ARRAYS[name])
        np.testing.assert_array_equal(fields.read(field).reshape(wanted.shape), wanted)


def test_an_array_of_another_shape_is_refused(made):
    with pytest.raises(ValueError, match="shape"):
        fields.write(made["real"], np.zeros((2, 6)))


def test_lane_vectors_start_at_cache_lines(made):
    @ti.kernel
    def address(field: ti.template()) -> ti.u64:
        return ti.get_addr(field.snode, [0])

    assert backend.lanes() * 8 == fields.CACHE_LINE
    with fields.together():
        fields.index_field(np.arange(3))
        lane = fields.lane_field((4,))
    assert address(lane) % fields.CACHE_LINE == 0


def test_new_fields_are_zero_where_old_ones_were_not(kernel_cache):
    for value in (0.0, 5.0):
        backend.start("cpu", cache=Path(kernel_cache))
        field = fields.lane_field((1000,))
        assert not fields.read(field).any()
        fields.write(field, value + 1.0)


def test_no_field_can_be_used_before_its_block_closes(cpu):
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


def test_a_field_without_entries_has_one_cell(cpu):
    assert fields.shape_of(fields.vector_field(np.zeros((0, 2)))) == (1, 2)
