"""Thinned signals keep the band and the mean of what they stand for."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from softsim.report.diagram import thinned


@given(rows=st.integers(1, 5000), bins=st.integers(1, 300), seed=st.integers(0, 99))
def test_the_band_holds_every_sample(rows, bins, seed) -> None:
    time = np.sort(np.random.default_rng(seed).random(rows))
    values = np.random.default_rng(seed + 1).normal(size=rows)
    at, mean, band = thinned(time, values, bins)
    assert len(at) <= 2 * bins and (np.diff(at) >= 0).all()
    low, high = (mean, mean) if band is None else band
    assert low.min() == values.min() and high.max() == values.max()
    assert (low <= high).all()


def test_a_vibration_becomes_its_mean_and_its_swing() -> None:
    time = np.linspace(0.0, 6.0, 12001)
    at, mean, band = thinned(time, 3.0 * time + np.sin(2 * np.pi * 192 * time), 400)
    np.testing.assert_allclose(mean[1:-1], 3.0 * at[1:-1], atol=0.12)
    np.testing.assert_allclose(np.ptp(band, axis=0), 2.0, atol=0.15)


def test_few_rows_stay_as_they_are() -> None:
    values = np.array([1.0, 5.0, 2.0])
    _, mean, band = thinned(np.arange(3.0), values, 400)
    assert mean is values and band is None


def test_missing_samples_are_left_out_and_missing_bins_are_gaps() -> None:
    values = np.ones(1000)
    values[:100], values[500:550] = np.nan, np.inf
    _, mean, band = thinned(np.arange(1000.0), values, bins=10)
    assert np.isnan(mean[0]) and np.isnan(band[:, 0]).all()
    np.testing.assert_allclose(mean[1:], 1.0)
    np.testing.assert_allclose(band[:, 1:], 1.0)
