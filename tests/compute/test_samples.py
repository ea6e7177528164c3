"""Rows of fields that are kept until their columns are computed."""

import numpy as np
import pytest

from softsim.compute import fields, term
from softsim.compute.term import Sampler, Samples, present


def test_samples_are_copies_of_the_row_in_order(fresh_taichi):
    force = fields.vector_field(np.zeros((2, 5, 3)))
    count = fields.index_field(np.array([3, 4]))
    sampler = Sampler(1, [force, count, force], most=4)
    for k in range(3):
        fields.write_row(force, 1, float(k))
        fields.write_row(count, 1, 10 + k)
        sampler.take(0.1 * k, 0.2 * k, 0.3)
    assert not sampler.is_full
    taken = sampler.handed_over()
    np.testing.assert_array_equal(taken.read(force)[:, 4, 2], [0.0, 1.0, 2.0])
    assert taken.read(force).shape == (3, 5, 3)
    assert taken.read(count).tolist() == [10, 11, 12]
    assert taken.times.tolist() == pytest.approx([0.0, 0.1, 0.2])
    assert taken.load_times.tolist() == pytest.approx([0.0, 0.2, 0.4])
    assert (len(taken), taken.scenario) == (3, 1)
    assert present(0, [count]).read(count).tolist() == [3]


def test_large_fields_are_sampled_in_fewer_rows(fresh_taichi, monkeypatch):
    numbers = fields.real_field(np.zeros((1, 100)))  # 800 bytes
    monkeypatch.setattr(term, "MOST_BYTES", 2000)
    sampler = Sampler(0, [numbers], most=8)
    sampler.take(0.0, 0.0, 1.0)
    assert not sampler.is_full
    sampler.take(1.0, 1.0, 1.0)
    assert sampler.is_full
    assert len(sampler.handed_over()) == 2
    monkeypatch.setattr(term, "MOST_BYTES", 1)
    assert present(0, [numbers]).read(numbers).shape == (1, 100)


def test_mean_forces_of_an_interval_without_time_are_zero():
    taken = Samples(0, np.zeros(2), np.zeros(2), np.array([0.0, 0.1]), {})
    impulses = np.array([[1.0, 2.0], [3.0, 4.0]])
    np.testing.assert_array_equal(taken.mean(impulses), [[0.0, 0.0], [3.0 / 0.1, 4.0 / 0.1]])
    assert taken.rates.tolist() == [0.0, 1.0 / 0.1]
