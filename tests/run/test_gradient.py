"""Parameters of derivatives that a scene asks for."""

import pytest

from softsim.errors import SceneError
from softsim.run.statics import asked_parameters
from softsim.scene.loading import load_scene

SCENE = """
bodies:
  b: {mesh: {generator: block, length: 2 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 5 mm, material: soft, fixed: [bottom]}
materials: {soft: {law: neo_hooke, C10: 36 kPa, density: 1000 kg/m^3}}
time: {end: 1 s, procedure: static}
output:
  derivatives:
    parameters:
      - materials.soft.C10
      - PATH
"""


def test_parameters_have_values_in_si_units(write_scene):
    scene = load_scene(write_scene(SCENE.replace("PATH", "bodies.b.thickness")))
    found = [(p.path, p.value, p.unit) for p in asked_parameters(scene)]
    assert found == [("materials.soft.C10", 36e3, "Pa"), ("bodies.b.thickness", 5e-3, "m")]


@pytest.mark.parametrize(
    "path, says",
    [("materials.soft.C1", "there is no"), ("bodies.b.fixed", "a derivative needs a number")],
)
def test_a_wrong_parameter_is_reported_at_its_place_in_the_scene(write_scene, path, says):
    file = write_scene(SCENE.replace("PATH", path))
    with pytest.raises(SceneError, match=says) as error:
        asked_parameters(load_scene(file))
    assert str(error.value.location) == f"{file}:11:9"


def test_a_wrong_parameter_of_an_option_is_reported_at_the_option(write_scene):
    text = SCENE.split("output:")[0]
    option = "output.derivatives={parameters: [materials.soft.C1]}"
    with pytest.raises(SceneError, match="there is no") as error:
        asked_parameters(load_scene(write_scene(text), [option]))
    assert str(error.value).startswith(f"--set {option}: ")
