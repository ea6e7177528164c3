"""`softsim mesh`: from a STEP file to a run and a film."""

import numpy as np
import pytest
import yaml
from solids import cup, finger, plate, two_blocks

from softsim.builder import build_model
from softsim.mesh.reading import MILLIMETRE, read_mesh
from softsim.output.history import read_history
from softsim.scene.loading import load_scene


@pytest.fixture
def mesh(softsim, tmp_path, monkeypatch):
    """Run `softsim mesh` in a folder of its own and return what it printed."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments, code=0):
        done = softsim("mesh", *arguments)
        assert done.exit_code == code, done.output
        return done.output

    return run


def test_a_finger_becomes_a_mesh_a_figure_and_a_scene(tmp_path, mesh):
    finger(tmp_path / "finger.step")
    output = mesh("finger.step", "--size", "6mm", "--material", "ecoflex_00_30")
    for line in ("60 x 16 x 14 mm", "9.696 ml", "chamber1: 3.744 ml, closed", "smallest altitude"):
        assert line in output
    assert "one tetrahedron thick" in output
    made = {path.name for path in tmp_path.iterdir()}
    assert made == {"finger.step", "finger.msh", "finger.png", "finger.yaml"}
    scene = yaml.safe_load((tmp_path / "finger.yaml").read_text())
    body = scene["bodies"]["finger"]
    assert body["material"] == "ecoflex_00_30" and body["fixed"] == ["x_min"]
    assert scene["loads"]["air"]["facets"] == ["finger.chamber1"]
    assert scene["output"]["probes"]["tip"]["nodes"] == "finger.x_max"


def test_a_scene_that_exists_is_kept(tmp_path, mesh):
    plate(tmp_path / "plate.step")
    mesh("plate.step", "--size", "5mm")
    changed = (tmp_path / "plate.yaml").read_text().replace("fixed: [x_min]", "fixed: [y_min]")
    (tmp_path / "plate.yaml").write_text(changed)
    assert "was not changed" in mesh("plate.step", "--size", "4mm")
    assert (tmp_path / "plate.yaml").read_text() == changed


def test_the_new_mesh_is_printed_whatever_the_scene_contains(tmp_path, mesh):
    plate(tmp_path / "plate.step")
    (tmp_path / "plate.yaml").write_text("bodies: {other: {mesh: {file: missing.msh}}}\n")
    output = mesh("plate.step", "--size", "5mm")
    made = read_mesh(tmp_path / "plate.msh", MILLIMETRE).mesh
    assert f"{len(made.points)} nodes, {len(made.cells)} tetrahedra" in output
    assert "z_max" in output and "other" not in output


def test_a_pocket_is_held_at_its_opening(tmp_path, mesh):
    """The lid of a pocket is held, although the longest side would offer another end first."""
    cup(tmp_path / "3 cup.step")
    assert "open at y_min" in mesh("3 cup.step", "--size", "5mm")
    loaded = load_scene(tmp_path / "3 cup.yaml")
    assert loaded.scene.bodies["part_3_cup"].fixed == ("y_min",)
    build_model(loaded)  # the held rim closes the chamber


def test_a_part_without_a_chamber_bends_under_its_weight(tmp_path, mesh):
    plate(tmp_path / "plate.step")
    assert "no chamber" in mesh("plate.step", "--size", "3mm", "--cells", "quad")
    loaded = load_scene(tmp_path / "plate.yaml")
    assert not loaded.scene.loads and loaded.scene.environment.gravity == (0.0, -9.81, 0.0)


def test_ends_that_are_not_planar_are_sets_of_the_scene(tmp_path, mesh):
    (tmp_path / "ball.geo").write_text(
        'SetFactory("OpenCASCADE");\nSphere(1) = {0, 0, 0, 10};\nSphere(2) = {0, 0, 0, 5};\n'
        "BooleanDifference{ Volume{1}; Delete; }{ Volume{2}; Delete; }\n"
        "Dilate{ {0, 0, 0}, {2, 1, 1} } { Volume{:}; }\n"
    )
    mesh("ball.geo", "--size", "6mm", "--unit", "mm", "-o", "shell.msh")
    loaded = load_scene(tmp_path / "shell.yaml")
    assert set(loaded.scene.bodies["shell"].sets) == {"x_min", "x_max"}
    build_model(loaded)  # an empty set is an error


def test_an_existing_mesh_gets_names(tmp_path, mesh):
    two_blocks(tmp_path / "two.step")
    mesh("two.step", "--size", "5mm")
    output = mesh("two.msh", "-o", "named.msh")
    assert "solid1" in output and "z_max" in output


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["part.step"], "the size of the elements is missing"),
        (["part.step", "--size", "3"], 'write "3 mm"'),
        (["part.step", "--size", "0 mm"], "must be greater than zero"),
        (["part.step", "--size", "3mm", "--unit", "m"], "states its unit of length itself"),
        (["part.step", "--size", "3mm", "--material", "dragonskin"], "there is no material"),
        (["part.step", "--size", "3mm", "-o", "part.vtu"], "the mesh is written as .msh"),
        (["part.msh"], "would overwrite the part"),
        (["part.msh", "-o", "a.msh", "--size", "3mm"], "is a mesh already"),
        (["part.dwg", "--size", "3mm"], "this mesh format is not supported"),
        (["missing.step", "--size", "3mm"], "file not found"),
    ],
)
def test_refusals(tmp_path, mesh, arguments, said):
    for name in ("part.step", "part.msh", "part.dwg"):
        (tmp_path / name).write_text("")
    assert said in mesh(*arguments, code=2)


@pytest.mark.physics
def test_from_a_step_file_to_a_film(tmp_path, mesh, softsim, kernel_cache):
    """The chamber lies above the centre line: the finger elongates and bends down, in its plane of
    symmetry, by more at each pressure.
    """
    finger(tmp_path / "finger.step")
    mesh("finger.step", "--size", "5mm")
    assert softsim("run", "finger.yaml").exit_code == 0
    history = read_history(tmp_path / "runs/finger/history.csv")
    x, y, z = (history[f"tip_{axis}"] for axis in "xyz")
    assert np.all(np.diff(history["pressure"]) > 0.0) and np.all(np.diff(y) < 0.0)
    assert x[-1] > 0.0 and y[-1] < -0.2e-3 and abs(z[-1]) < 0.1 * abs(y[-1])
    assert softsim("render", "runs/finger").exit_code == 0
    assert (tmp_path / "runs/finger/film.gif").stat().st_size > 10_000
