"""softsim materials as a user types it, and the note of `softsim check` on sources."""

import re

import numpy as np
import pytest

from softsim.materials.laws import UNIAXIAL, Yeoh
from softsim.materials.library import silicones
from softsim.report.materials import COMPARED_FROM, sources_diagram

SCENE = """
bodies:
  b: {mesh: {generator: block, length: 2 mm, height: 1 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: MATERIAL}
time: {end: 1 ms}
"""


@pytest.fixture
def materials(softsim, tmp_path, monkeypatch):
    """The command in the folder of the test, with a wide terminal."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    return lambda *arguments: softsim("materials", *arguments)


@pytest.fixture
def own_test(tmp_path):
    """A test of a solid 1.5 times as stiff as the library's Ecoflex 00-50, pulled to 180 %."""
    strain = np.linspace(0.0, 1.8, 90)
    stress = UNIAXIAL.nominal_stress(Yeoh(1.5 * 10.7e3, 1.5 * 230.0), 1.0 + strain) / 1e3
    rows = [f"{e},{s}" for e, s in zip(strain, stress, strict=True)]
    path = tmp_path / "mine.csv"
    path.write_text("\n".join(["e,s [kPa]", *rows]))
    return path


def test_all_silicones_with_their_spread(materials, tmp_path):
    done = materials()
    assert done.exit_code == 0, done.stderr
    for silicone in silicones().values():
        assert silicone.title in done.stdout
        for source in silicone.sources:
            assert source.name in done.stdout
    for words in ("typical 22 (ecoflex_00_30_typical)", "one source: no spread", "10.1089/soro"):
        assert words in done.stdout, words
    assert not list(tmp_path.glob("*.png"))


def test_the_figure_of_a_silicone(materials, tmp_path):
    done = materials("ecoflex_00_30_typical")  # a material stands for its silicone
    assert done.exit_code == 0, done.stderr
    assert "Delory" in done.stdout and "dragon_skin" not in done.stdout
    assert (tmp_path / "ecoflex_00_30_sources.png").stat().st_size > 5000


def test_a_test_of_ones_own_beside_the_sources(materials, own_test, tmp_path):
    columns = ["--strain-column", "e", "--stress-column", "s"]
    done = materials("ecoflex_00_50", "--compare", own_test, *columns, "--out", tmp_path / "f.png")
    assert done.exit_code == 0, done.stderr
    assert re.search(r"ecoflex_00_50 +1\.5, strains 0\.1\d* to 1\.8", done.stdout), done.stdout
    assert (tmp_path / "f.png").stat().st_size > 5000


def test_refusals(materials, own_test):
    unknown = materials("ecoflx_00_30")
    assert unknown.exit_code == 2 and "did you mean 'ecoflex_00_30'" in unknown.stderr
    assert materials("--compare", own_test).exit_code == 2
    wrong = materials("ecoflex_00_50", "--compare", own_test)
    assert wrong.exit_code == 2 and "--strain-column" in wrong.stderr


def test_every_source_is_a_curve_up_to_its_range():
    diagram = sources_diagram(silicones()["ecoflex_00_30"])
    curves = {one.name.split(":")[0]: one for one in diagram.panels[0].left.series if one.name}
    assert list(curves) == [source.name for source in silicones()["ecoflex_00_30"].sources]
    assert curves["ecoflex_00_30"].x[-1] == 3.0 and curves["ecoflex_00_30"].kind == "-"
    assert curves["waves"].kind == "--" and curves["waves"].x[-1] < 1.0 + 4 * COMPARED_FROM
    for source, curve in zip(silicones()["ecoflex_00_30"].sources, curves.values(), strict=True):
        slope = 1e3 * (curve.y[1] - curve.y[0]) / (curve.x[1] - curve.x[0])
        assert slope == pytest.approx(3.0 * source.initial_shear_modulus, rel=0.02)


@pytest.mark.parametrize(("material", "differs"), [("dragon_skin_10", True),
                                                   ("dragon_skin_20", False),
                                                   ("dragon_skin_30", False)])  # fmt: skip
def test_check_notes_sources_that_differ(softsim, write_scene, material, differs):
    scene = write_scene(SCENE.replace("MATERIAL", material))
    done = softsim("check", scene, "--device", "cpu", "--no-duration")
    assert done.exit_code == 0, done.stderr
    said = re.sub(r"\s+", " ", done.stdout)
    assert ("note: material" in said) == differs
    assert "no warnings" in said
    if differs:
        assert "72 kPa; published sources of Dragon Skin 10 have 46 to 87.9 kPa" in said
        assert "softsim fit-material" in said


def test_check_has_no_note_on_constants_of_the_scene(softsim, write_scene):
    own = "materials: {dragon_skin_10: {law: neo_hooke, C10: 30 kPa, density: 1070 kg/m^3}}"
    scene = write_scene(SCENE.replace("MATERIAL", "dragon_skin_10") + own)
    done = softsim("check", scene, "--device", "cpu", "--no-duration")
    assert done.exit_code == 0, done.stderr
    assert "note:" not in done.stdout
