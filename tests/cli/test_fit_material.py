"""softsim fit-material as a user types it."""

import subprocess
import sys

import numpy as np
import pytest
import yaml

from softsim.materials.fitting import TensileTest
from softsim.materials.laws import LAWS, UNIAXIAL, Yeoh

NAMED = ["--strain-column", "e", "--stress-column", "s"]


@pytest.fixture
def fit_material(softsim, tmp_path, monkeypatch):
    """The command, as a user types it in the folder of the test."""
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: softsim("fit-material", *arguments)


@pytest.fixture
def curve(tmp_path):
    """A Yeoh solid pulled to 200 %, as a table with commas."""
    strain = np.linspace(0.0, 2.0, 60)
    stress = UNIAXIAL.nominal_stress(Yeoh(20e3, 1e3, 30.0), 1.0 + strain) / 1e6
    rows = [f"{e},{s}" for e, s in zip(strain, stress, strict=True)]
    path = tmp_path / "My_Rubber.csv"
    path.write_text("\n".join(["e,s", *rows]))
    return path


def test_constants_figure_and_snippet(fit_material, curve, tmp_path):
    done = fit_material(curve, "--max-strain", 2, *NAMED, "--stress-unit", "MPa")
    assert done.exit_code == 0, done.stderr
    for words in ("20.00 kPa", "R^2", "planar tension", "compression", "My_Rubber_yeoh.png"):
        assert words in done.stdout, words
    snippet = yaml.safe_load(done.stdout[done.stdout.index("materials:") :])
    assert snippet["materials"]["my_rubber"]["C30"] == "0.0300 kPa"
    assert (tmp_path / "My_Rubber_yeoh.png").stat().st_size > 5000


def test_another_law_range_and_figure(fit_material, curve, tmp_path):
    done = fit_material(
        curve, "--max-strain", 1, "--min-strain", 0.2, "--law", "neo_hooke", *NAMED,
        "--stress-unit", "MPa", "--delimiter", ",", "--out", tmp_path / "here.png",
    )  # fmt: skip
    assert done.exit_code == 0, done.stderr
    assert "law: neo_hooke" in done.stdout
    assert (tmp_path / "here.png").exists()


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ([], "--stress-unit MPa"),
        (["--stress-unit", "mm"], "is a length"),
        (["--stress-unit", "MPa", "--min-strain", "5"], "0 points"),
        (["--stress-unit", "MPa", "--terms", "7"], "this law has 3"),
        (["--stress-unit", "MPa", "--strain-column", "x"], "no column 'x'"),
    ],
)
def test_refusals_exit_with_2(fit_material, curve, tmp_path, options, says):
    done = fit_material(curve, "--max-strain", 2, *NAMED, *options)
    assert done.exit_code == 2
    assert says in done.stderr
    assert not list(tmp_path.glob("*.png"))


def test_a_cell_that_is_no_number_is_shown_with_its_line(fit_material, curve, tmp_path):
    curve.write_text(curve.read_text() + "\n2.1,broken\n")
    done = fit_material(curve, "--max-strain", 2, *NAMED, "--stress-unit", "MPa")
    assert done.exit_code == 2
    assert f"{curve}:62:5: 'broken' is not a number" in done.stderr


def test_every_law_is_on_the_command_line(fit_material, curve, tmp_path):
    done = fit_material(curve, "--max-strain", 2, "--law", "hooke", *NAMED,
                        "--stress-unit", "MPa")  # fmt: skip
    assert done.exit_code == 2
    assert "there is no law 'hooke'" in done.stderr
    assert all(name in done.stderr for name in LAWS)


def test_taichi_is_not_imported(curve, tmp_path):
    arguments = ["fit-material", str(curve), "--max-strain", "2", *NAMED, "--stress-unit", "MPa"]
    code = (
        "import sys; from softsim.cli import app\n"
        f"try: app({arguments!r})\nexcept SystemExit as done: assert not done.code\n"
        "sys.exit(7 if 'taichi' in sys.modules else 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr


@pytest.fixture
def modes(tmp_path):
    """A Mooney-Rivlin solid in three modes: file names by mode."""
    law, paths = LAWS["mooney_rivlin"](20e3, 10e3), {}
    for mode, largest in (("uniaxial", 1.0), ("equibiaxial", 0.8), ("compression", 0.5)):
        strain = np.linspace(0.0, largest, 40)
        stress = TensileTest(strain, strain, "", mode=mode).stress_of(law, strain)
        rows = [f"{e},{s}" for e, s in zip(strain, stress, strict=True)]
        paths[mode] = tmp_path / f"{mode}.csv"
        paths[mode].write_text("\n".join(["e,s [Pa]", *rows]))
    return paths


def test_several_modes_at_once(fit_material, modes, tmp_path):
    of_each = [word for mode in modes for word in ("--mode", mode)]
    options = ["--max-strain", 1, *NAMED, *of_each, "--law"]
    done = fit_material(*modes.values(), *options, "mooney_rivlin")
    assert done.exit_code == 0, done.stderr
    assert "warning" not in done.stdout and "10.00 kPa" in done.stdout
    for mode in modes:
        assert done.stdout.count(f"\n {mode}") >= 2  # errors of the fit, and of predictions
    snippet = yaml.safe_load(done.stdout[done.stdout.index("materials:") :])
    assert snippet["materials"]["uniaxial"]["strain_range"] == 1.0
    assert "equibiaxial.csv, equibiaxial; " in snippet["materials"]["uniaxial"]["source"]
    assert (tmp_path / "uniaxial_mooney_rivlin.png").stat().st_size > 5000
    done = fit_material(*modes.values(), *options, "neo_hooke", *["--weight", 1] * 3)
    assert done.exit_code == 0, done.stderr
    said = " ".join(done.stdout.split())
    assert "warning: constants fitted to 'uniaxial' alone miss equibiaxial by" in said
    assert "warning: the constants fitted to all tests miss" in said


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--mode", "planar"], "3 files and 1 times --mode"),
        (["--weight", "2"], "3 files and 1 times --weight"),
        (["--mode", "shear"] * 3, "no mode 'shear'"),
        (["--weight", "0"] * 3, "one positive weight"),
    ],
)
def test_modes_and_weights_that_do_not_fit(fit_material, modes, options, says):
    done = fit_material(*modes.values(), "--max-strain", 1, *NAMED, *options)
    assert done.exit_code == 2
    assert says in done.stderr
