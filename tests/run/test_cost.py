"""Costs of passes, and the rate of a device, measured in a process of its own."""

import numpy as np
import pytest

from softsim.compute.machine import cuda_device_count
from softsim.errors import DeviceError
from softsim.run.cost import LARGE, SECTION, measured_rate, reference_scene
from softsim.scene.loading import load_scene

STRIP = """
bodies:
  strip: {mesh: {generator: block, length: 10 mm, height: 1 mm, element_size: 0.5 mm},
          formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10, fixed: [left]}
environment: {walls: {floor: {kind: plane, point: [0 mm, -0.01 mm]}}}
time: {end: 1 s}
"""


def test_a_device_that_fails_says_why():
    """The reason comes back from the other process."""
    if cuda_device_count():
        pytest.skip("this machine has a CUDA device")
    with pytest.raises(DeviceError, match="no CUDA device was found"):
        measured_rate("cuda", 1, SECTION, 0.1)


@pytest.mark.parametrize("work", [SECTION, LARGE])
def test_the_meshes_are_as_large_as_said(work):
    from softsim.builder.bodies import meshed_bodies

    cells = meshed_bodies(load_scene(*reference_scene(work)))["skin"].mesh.cells
    assert len(cells) == pytest.approx(work.elements, rel=0.05)


@pytest.mark.slow
def test_the_rate_of_the_processor(kernel_cache, monkeypatch):
    """Compiled and run; faster than an interpreter could be by far."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    assert measured_rate("cpu", 1, SECTION, 0.2) > 1e6


def test_the_solver_goes_on_to_the_same_bits(build, start):
    """Everything a checkpoint keeps: contact anchors, branches, energies, half-step velocities."""
    from softsim.run.cost import measured_profile

    model = build(STRIP)
    undisturbed = start(model)
    for _ in range(2):
        undisturbed.advance(1500)
    expected = undisturbed.state()
    assert expected["contacts/0/damping_dissipation"].any()  # it has hit the floor
    solver = start(model)
    solver.advance(1500)
    measured_profile(solver)
    assert solver.increment_count == 1500
    solver.advance(1500)
    assert solver.time == pytest.approx(undisturbed.time, rel=1e-12)
    for name, array in solver.state().items():
        np.testing.assert_array_equal(array, expected[name], err_msg=name)


def test_every_pass_has_its_cost(build, start):
    from softsim.run.cost import measured_profile

    solver = start(build(STRIP))
    profile = measured_profile(solver)
    passes = solver.kernels.passes
    assert len(profile.passes) == sum(len(p.functions) for p in passes)
    assert all(cost.seconds > 0.0 for cost in profile.passes)
    assert profile.passes[0].name == "Nodes.drift"
    shares = profile.shares()
    assert set(shares) == {"integration", "elements", "contact"}
    assert sum(shares.values()) == pytest.approx(1.0, rel=1e-12)
    whole = sum(cost.seconds for cost in profile.passes) + profile.unexplained
    assert whole == pytest.approx(profile.increment, rel=1e-12)
