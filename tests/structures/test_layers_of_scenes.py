"""Layers of scenes: their facets, and what is refused and where."""

import numpy as np
import pytest

from softsim.errors import SceneError

SCENE = """\
bodies:
  b: {mesh: {generator: box, length: 4 mm, height: 2 mm, width: 2 mm, element_size: 2 mm,
             cells: quad}, formulation: solid, material: dragon_skin_10}
layers:
  paper: {facets: b.bottom, thickness: 0.1 mm, youngs_modulus: 2 GPa, density: 800 kg/m^3}
time: {end: 1 s}
"""
FLAT = SCENE.replace("box,", "block,").replace(" width: 2 mm,", "")
RING = FLAT.replace("solid", "axisymmetric, position: [2 mm, 0 mm]")


def test_quadrilaterals_are_cut_along_both_diagonals(build):
    (layer,) = build(SCENE).structures
    assert layer.facets.shape == (8, 3)
    assert layer.volumes.sum() == pytest.approx(0.1e-3 * 4e-3 * 2e-3, rel=1e-12)
    np.testing.assert_allclose(layer.gradients.sum(axis=1), 0.0, atol=1e-9)
    assert layer.masses.sum() == pytest.approx(800.0 * layer.volumes.sum(), rel=1e-12)


def test_figures_are_given_the_facets_of_layers(build):
    from softsim.output.observation import description

    model = build(SCENE)
    np.testing.assert_array_equal(description(model, "")["layers"], model.structures[0].facets)
    without = "".join(line for line in SCENE.splitlines(True) if "paper" not in line)
    assert "layers" not in description(build(without.replace("layers:\n", "")), "")


def test_a_revolved_layer_goes_around(build):
    (layer,) = build(RING).structures
    np.testing.assert_allclose(np.sort(1.0 / layer.around), [1e-3, 3e-3])
    np.testing.assert_allclose(layer.volumes.sum(), 0.1e-3 * np.pi * 16e-6, rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "old", "new", "told", "line"),
    [
        (SCENE, "b.bottom", "b.base", "there is no facet set 'b.base'", 5),
        (SCENE, "c.bottom", "c.bottom", "", 5),
        (SCENE, "0.1 mm", "0 mm", "", 5),
        (SCENE, "density", "poisson_ratio: 0.5, density", "poisson_ratio", 5),
        (RING, "b.bottom", "b.left", "at (0.00, 1.00) mm lies on the axis", 5),
    ],
)
def test_what_cannot_be_a_layer_is_refused(build, text, old, new, told, line):
    with pytest.raises(SceneError) as raised:
        build(text.replace("b.bottom", old).replace(old, new))
    assert told in str(raised.value)
    assert raised.value.location.line == line
