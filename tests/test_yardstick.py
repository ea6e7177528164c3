"""The rate of a device, measured in a process of its own."""

import pytest

from softsim.errors import DeviceError
from softsim.machine import cuda_device_count
from softsim.scene.loading import load_scene
from softsim.yardstick import LARGE, SECTION, measured_rate, yardstick


def test_a_device_that_fails_says_why():
    """The reason comes back from the other process."""
    if cuda_device_count():
        pytest.skip("this machine has a CUDA device")
    with pytest.raises(DeviceError, match="no CUDA device answers"):
        measured_rate("cuda", 1, SECTION, 0.1)


@pytest.mark.parametrize("work", [SECTION, LARGE])
def test_the_meshes_are_as_large_as_said(work):
    from softsim.builder.bodies import meshed_bodies

    cells = meshed_bodies(load_scene(*yardstick(work)))["skin"].mesh.cells
    assert len(cells) == pytest.approx(work.elements, rel=0.05)


@pytest.mark.slow
def test_the_rate_of_the_processor(kernel_cache, monkeypatch):
    """Compiled and run; faster than an interpreter could be by far."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    assert measured_rate("cpu", 1, SECTION, 0.2) > 1e6
