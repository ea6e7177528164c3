"""Long elements beside a clamp of a nearly incompressible body."""

import pytest

from softsim.solver.plausibility import clamp_warnings, missing_deflection

STRIP = """
bodies:
  b: {mesh: {generator: block, length: 16 mm, height: 2 mm, element_size: SIZE, cells: quad},
      formulation: plane_strain, thickness: 5 mm, material: soft, fixed: [left]}
materials: {soft: {law: neo_hooke, density: 1000 kg/m^3, C10: 50 kPa, poisson_ratio: NU}}
environment: {gravity: 0 m/s^2}
time: {end: 1 s}
"""
BAR = """
bodies:
  b: {mesh: {generator: box, length: 16 mm, width: 6 mm, height: 2 mm, element_size: SIZE,
             cells: quad}, formulation: solid, material: soft, fixed: [left]}
materials: {soft: {law: neo_hooke, density: 1000 kg/m^3, C10: 50 kPa, poisson_ratio: NU}}
environment: {gravity: 0 m/s^2}
time: {end: 1 s}
"""


@pytest.mark.parametrize("scene", [STRIP, BAR])
@pytest.mark.parametrize(
    ("size", "poisson_ratio", "missing", "warned"),
    [
        ("2 mm", 0.475, 0.0, False),  # one element through the height
        ("1 mm", 0.475, 0.5 / 16.0, True),
        ("0.5 mm", 0.475, 0.25 / 16.0, False),
        ("1 mm", 0.3, 0.5 / 16.0, False),
    ],
)
def test_long_elements_at_a_clamp_are_warned_of(build, scene, size, poisson_ratio, missing, warned):
    model = build(scene.replace("SIZE", size).replace("NU", str(poisson_ratio)))
    held = ~model.is_free.any(axis=1)
    # The farthest node is a corner, farther than the length.
    assert missing_deflection(model.regions[0], held) == pytest.approx(missing, rel=0.03)
    assert list(clamp_warnings(model)) == (["clamp of b"] if warned else [])
