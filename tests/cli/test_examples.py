"""What comes with softsim: listed by title, copied with the files that it names."""

import pytest
from typer.testing import CliRunner

from softsim.cli import app
from softsim.cli.about import (
    TEMPLATES,
    command_for,
    copy_example,
    example_files,
    example_title,
    examples_folder,
    find_example,
    needed_files,
    template_text,
)
from softsim.errors import OutputError, SceneError
from softsim.scene.loading import load_scene
from softsim.scene.text import entries
from softsim.study.loading import load_study

ROOT = examples_folder()


def test_every_example_has_a_title_and_a_name_of_its_own():
    files = example_files(ROOT)
    assert len({file.stem for file in files}) == len(files) > 30
    assert all(example_title(file) for file in files)


@pytest.mark.parametrize(
    "name, command",
    [
        ("first_look", "run"),
        ("c_bend", "assess"),
        ("riser_36mm", "reach"),
        ("tether", "sweep"),
        ("best_cycle", "optimize"),
    ],
)
def test_the_command_that_takes_it(name, command):
    example = find_example(ROOT, name)
    assert command_for(example, example).split()[1] == command


@pytest.mark.parametrize("name", ["skin_inflation_rings", "pfr_36mm", "bellows"])
def test_a_scene_loads_where_it_lands(name, tmp_path):
    example = find_example(ROOT, name)
    copy, *_ = copy_example(example, ROOT, tmp_path)
    assert load_scene(copy).scene == load_scene(example).scene


def test_a_study_brings_its_scenes(tmp_path):
    copy, *scenes = copy_example(find_example(ROOT, "tether"), ROOT, tmp_path)
    assert copy == tmp_path / "studies" / "tether.yaml"
    assert scenes == [tmp_path / f"pfr_{width}mm.yaml" for width in (30, 36, 41)]
    assert len(load_study(copy).cases()) == 15


def test_files_of_any_kind_come_along(tmp_path):
    (tmp_path / "wall.csv").write_text("0, 0\n1, 0\n")
    (tmp_path / "part.yaml").write_text("environment: {walls: {w: {file: wall.csv}}}\n")
    (tmp_path / "scene.yaml").write_text("include: [part.yaml]\ntitle: A scene\n")
    found = needed_files(tmp_path / "scene.yaml")
    assert [file.name for file in found] == ["scene.yaml", "part.yaml", "wall.csv"]


def test_a_mesh_brings_its_script():
    found = needed_files(find_example(ROOT, "worm"))
    assert [file.name for file in found] == ["worm.yaml", "worm.msh", "worm.geo"]


def test_a_second_copy_changes_nothing_and_overwrites_nothing(tmp_path):
    example = find_example(ROOT, "first_look")
    (copy,) = copy_example(example, ROOT, tmp_path)
    assert copy_example(example, ROOT, tmp_path) == [copy]
    copy.write_text("mine")
    with pytest.raises(
        OutputError, match="already exists, with content other than that of the example"
    ):
        copy_example(example, ROOT, tmp_path)
    assert copy.read_text() == "mine"


def test_a_misspelt_name_is_told():
    with pytest.raises(SceneError) as told:
        find_example(ROOT, "first_lok")
    assert "did you mean 'first_look'?" in str(told.value) and told.value.exit_code == 2


@pytest.mark.parametrize("name", TEMPLATES)
def test_a_template_is_its_example_with_all_keys_of_the_meshes(name, tmp_path):
    (tmp_path / "scene.yaml").write_text(template_text(ROOT, name))
    written = load_scene(tmp_path / "scene.yaml")
    assert written.scene == load_scene(find_example(ROOT, name)).scene
    for body, spec in written.scene.bodies.items():
        given = entries(written.tree, "bodies", body, "mesh")
        assert set(given) == {key for key, value in spec.mesh if value is not None}


def test_new_writes_a_template_and_overwrites_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = CliRunner().invoke
    assert "softsim new quadruped" in run(app, ["new"]).output
    assert run(app, ["new", "pneunet"]).exit_code == 0
    assert "chamber_length: 5 mm      # Inner length" in (tmp_path / "pneunet.yaml").read_text()
    again = run(app, ["new", "pneunet"])
    assert again.exit_code == 2 and "already exists" in again.output
    unknown = run(app, ["new", "pneu"])
    assert unknown.exit_code == 2 and "did you mean 'pneunet'?" in unknown.output
