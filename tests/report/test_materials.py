"""The figure, the numbers and the scene lines of a fit."""

import numpy as np
import pytest
import yaml
from matplotlib.image import imread

from softsim.errors import OutputError
from softsim.materials.fitting import Fit, TensileTest, fit_law
from softsim.materials.laws import UNIAXIAL, Yeoh
from softsim.report.materials import fit_diagram, fit_rows, scene_snippet
from softsim.report.png import draw
from softsim.scene.materials import YeohMaterial

LAW = Yeoh(21.6e3, 3.03e3, -0.111e3)


@pytest.fixture
def test_and_fit() -> tuple[TensileTest, Fit]:
    strain = np.linspace(0.0, 3.0, 100)
    stress = UNIAXIAL.nominal_stress(LAW, 1.0 + np.minimum(strain, 2.7))
    test = TensileTest(strain, stress, "00 Soft-stuff (A)", 'where "it" was.csv')
    return test, fit_law(test, Yeoh, max_strain=2.0)


def lists(pair):
    """A test and its fit as the lists that the functions take."""
    return [pair[0]], [pair[1]]


def test_a_figure_is_drawn(test_and_fit, tmp_path):
    draw(tmp_path / "fit.png", fit_diagram(*test_and_fit))
    picture = imread(tmp_path / "fit.png")
    assert picture.shape[1] > 1400
    assert picture[..., :3].std() > 0.02


def test_a_fit_of_the_whole_curve_has_nothing_beyond(tmp_path):
    strain = np.linspace(0.0, 1.0, 40)
    test = TensileTest(strain, UNIAXIAL.nominal_stress(Yeoh(1e6), 1.0 + strain), "stiff")
    draw(tmp_path / "fit.png", fit_diagram(test, fit_law(test, Yeoh, 1.0)))
    assert (tmp_path / "fit.png").stat().st_size > 5000


def test_a_folder_that_is_not_there(test_and_fit, tmp_path):
    with pytest.raises(OutputError):
        draw(tmp_path / "none" / "fit.png", fit_diagram(*test_and_fit))


def test_the_rows_say_constants_and_instability(test_and_fit):
    rows = dict(fit_rows([test_and_fit[1]]))
    assert rows["C10"] == "21.60 kPa"
    assert rows["mu0"] == "43.20 kPa"
    assert rows["equibiaxial tension"] == "UNSTABLE from a stretch of 2.7"
    assert rows["compression"] == "stable: the stress rises up to a stretch of 0.2"


def test_the_snippet_is_a_material_of_a_scene(test_and_fit):
    materials = yaml.safe_load(scene_snippet(*lists(test_and_fit), "yeoh"))["materials"]
    (name,) = materials
    assert name == "material_00_soft_stuff_a"
    data = YeohMaterial.model_validate(materials[name])
    constants = data.C10, data.C20, data.C30
    assert constants == pytest.approx(LAW.constants)
    assert data.strain_range == pytest.approx(2.0)
    assert 'where "it" was.csv' in data.source
