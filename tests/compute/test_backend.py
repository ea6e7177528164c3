"""Starting Taichi: what is asked for is what is used, or it is said."""

import pytest

from softsim.compute import backend, machine
from softsim.errors import DeviceError


def test_auto_takes_what_is_there(kernel_cache, tmp_path):
    device = backend.start("auto", cache=tmp_path)
    assert device.name == ("cuda" if machine.cuda_device_count() else "cpu")


def test_an_unknown_device_is_refused():
    with pytest.raises(DeviceError, match="unknown device 'tpu'"):
        backend.start("tpu")


def test_lane_blocks_round_up(fresh_taichi):
    assert backend.lane_blocks(1) == 1
    assert backend.lane_blocks(backend.CPU_LANES + 1) == 2


@pytest.mark.physics
def test_lanes_are_as_many_as_suit_the_elements(build, kernels_of_users, tmp_path):
    """Four of quadrilaterals and hexahedra, eight of others, and where both are."""
    scene = """
bodies:
  b: {mesh: {generator: block, length: 2 mm, height: 2 mm, element_size: 1 mm, cells: CELLS},
      formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10}
time: {end: 1 s}
"""
    for cells, lanes in (("quad", 4), ("simplex", 8)):
        model = build(scene.replace("CELLS", cells))
        assert backend.start("cpu", cache=tmp_path, most_lanes=model.most_lanes).lanes == lanes
