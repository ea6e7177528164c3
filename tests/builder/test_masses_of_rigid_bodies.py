"""Rigid bodies whose mass is given with that of what they hold."""

import pytest

from softsim.errors import SceneError

SCENE = """\
bodies:
  b: {mesh: {generator: block, length: 20 mm, height: 10 mm, element_size: 10 mm},
      formulation: plane_strain, thickness: 10 mm, material: m}
materials: {m: {law: yeoh, C10: 36 kPa, density: 1 g/cm^3}}
rigid_bodies:
  hand: {total_mass: 5 g, inertia: 1 g*mm^2, tied: [b.left]}
  foot: {mass: 1 g, inertia: 1 g*mm^2, tied: [OTHER]}
  alone: {total_mass: 3 g, inertia: 1 g*mm^2}
time: {end: 1 s}
"""
FREE = SCENE.replace(", tied: [OTHER]", "")


def test_a_total_mass_holds_that_of_the_bodies_tied_to_it(build):
    """The block has 2 g."""
    masses = [body.mass for body in build(FREE).rigid_bodies]
    assert masses == pytest.approx([3e-3, 1e-3, 3e-3])


def test_a_total_mass_below_that_is_refused(build):
    with pytest.raises(SceneError, match=r"total_mass is 2 g.*'hand' have 2 g") as caught:
        build(FREE, "rigid_bodies.hand.total_mass=2 g")
    assert "rigid_bodies.hand.total_mass" in str(caught.value.location)


def test_a_body_that_two_hold_is_nobodys(build):
    with pytest.raises(SceneError, match="tied to hand and foot") as caught:
        build(SCENE.replace("OTHER", "b.right"))
    assert caught.value.location.line == 6
    assert "give rigid_bodies.hand.mass" in caught.value.hint


def test_layers_are_part_of_the_bodies(build):
    """Paper of 20 x 10 mm and 0.1 mm, 1 g/cm^3: 20 mg."""
    paper = """
layers:
  paper: {facets: b.bottom, thickness: 0.1 mm, youngs_modulus: 2 GPa, density: 1 g/cm^3}
"""
    assert build(FREE + paper).rigid_bodies[0].mass == pytest.approx(3e-3 - 20e-6)
