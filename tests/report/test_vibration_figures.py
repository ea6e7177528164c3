"""Figures of natural modes: how large shapes are drawn, and bodies of every kind."""

import numpy as np
import pytest
from matplotlib.image import imread

from softsim.report.vibrations import FARTHEST, STEEPEST, amplitude, draw_modes, frames_of
from softsim.solver.natural_modes import NaturalMode, NaturalModes

LENGTH = 8e-3
BODIES = """
bodies:
  upper: {mesh: {generator: block, length: 8 mm, height: 1 mm, element_size: 1 mm},
          formulation: FORMULATION, material: dragon_skin_10, position: [4 mm, 0 mm]}
  lower: {mesh: {generator: block, length: 8 mm, height: 2 mm, element_size: 1 mm},
          formulation: FORMULATION, material: dragon_skin_10, position: [4 mm, -5 mm]}
time: {end: 1 ms}
"""
BOX = """
bodies:
  box: {mesh: {generator: box, length: 8 mm, width: 2 mm, height: 2 mm, element_size: 1 mm},
        formulation: solid, material: dragon_skin_10}
time: {end: 1 ms}
"""


def modes_of(body, *shapes) -> NaturalModes:
    modes = [NaturalMode(100.0, 120.0, shape, np.zeros(shape.shape[1])) for shape in shapes]
    return NaturalModes(body, modes, 0, 0, 1e-9)


def sheared(body, power: int) -> np.ndarray:
    """Displacements along y that grow with a power of x, to 1 at the end."""
    x = body.points[:, 0] - body.points[:, 0].min()
    shape = np.zeros_like(body.points)
    shape[:, 1] = (x / LENGTH) ** power
    return shape


def test_shapes_are_neither_too_far_nor_too_steep(build):
    """x / L goes as far as it may; of (x / L)^16 the last element is steep."""
    body = build(BODIES.replace("FORMULATION", "plane_strain, thickness: 1 mm")).bodies[0]
    found = modes_of(body, sheared(body, 1), sheared(body, 16))
    far, steep = (amplitude(found, mode) for mode in found.modes)
    assert far == pytest.approx(FARTHEST * LENGTH)
    assert steep == pytest.approx(STEEPEST * 1e-3 / (1.0 - (7.0 / 8.0) ** 16))
    rest, first, second = frames_of(found).point_data["displacement"].at(range(3))
    assert not rest.any()
    assert (first[:, 1].max(), second[:, 1].max()) == pytest.approx((far, steep))


@pytest.mark.parametrize(
    "text",
    [*(BODIES.replace("FORMULATION", f) for f in ("plane_strain, thickness: 1 mm", "axisymmetric")),
     BOX],
    ids=["plane", "axisymmetric", "space"],
)  # fmt: skip
@pytest.mark.physics
def test_every_kind_of_body_is_drawn(build, tmp_path, text):
    """A row or more a body: of its panels the last may be empty."""
    found = [modes_of(b, *(sheared(b, k) for k in (1, 2, 3))) for b in build(text).bodies]
    draw_modes(found, tmp_path / "modes.png")
    picture = imread(tmp_path / "modes.png")
    assert picture.shape[0] > 150 * len(found) and picture.shape[1] > 1200
    assert np.ptp(picture[..., :3], axis=(0, 1)).min() > 0.5
