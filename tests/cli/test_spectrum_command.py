"""softsim spectrum as a user types it."""

import os

import pytest
from matplotlib.image import imread
from typer.testing import CliRunner

from softsim.cli import app

SCENE = """
bodies:
  b: {mesh: {generator: block, length: 2 mm, height: 1 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: ecoflex_00_30}
materials:
  given: {law: neo_hooke, C10: 20 kPa, density: 1000 kg/m^3,
          prony: [{g: 0.2, relaxation_time: 1 ms}]}
time: {end: 1 s}
"""


@pytest.fixture
def spectrum(tmp_path, monkeypatch):
    """Run it in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: CliRunner().invoke(app, ["spectrum", *arguments])


def test_a_scene_and_a_material_of_the_library(spectrum, write_scene):
    done = spectrum(str(write_scene(SCENE)), "dragon_skin_10", "--set", "materials.given.C10=9 kPa")
    assert done.exit_code == 0, done.output
    for words in ("given", "18 kPa", "g = 0.2", "ecoflex_00_30", "dragon_skin_10", "3.4 %"):
        assert words in done.output, words
    picture = imread("scene_spectrum.png")
    assert picture.shape[1] > 1400 and picture[..., :3].std() > 0.02


def test_what_there_is_not(spectrum, write_scene):
    unknown = spectrum("dragon_skn_10")
    assert unknown.exit_code == 2 and "did you mean 'dragon_skin_10'" in unknown.output
    elastic = write_scene(SCENE.replace("material: ecoflex_00_30", "material: given"))
    nothing = spectrum(str(elastic), "--set", "materials.given.prony=[]")
    assert nothing.exit_code == 2 and "no viscoelastic material" in nothing.output
    assert not [name for name in os.listdir() if name.endswith(".png")]
