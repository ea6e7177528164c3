"""The scene of a case, and the key of its result."""

from pathlib import Path

import pytest

from softsim.errors import SceneError
from softsim.scene.loading import file_keys, load_scene
from softsim.study.cases import (
    Case,
    Source,
    case_key,
    forget_files,
    key_of,
    load_source,
    resolved,
)
from softsim.study.loading import study_from

BLOCK = Source(Path("block.yaml"))
MESH = "{generator: block, length: 10 mm, height: 5 mm, element_size: 1 mm}"


def key(*overrides, source=BLOCK):
    return case_key(resolved(Case(1, source, overrides)))


def test_a_case_is_the_scene_with_its_overrides(folder):
    overrides = ("time.end=3 s", "solver={safety_factor: 0.5}")
    scene = resolved(Case(1, BLOCK, overrides)).scene
    assert scene == load_scene("block.yaml", overrides).scene
    assert scene == load_source(BLOCK, overrides).scene


def test_the_key_is_that_of_the_scene_not_of_how_it_is_written(folder):
    Path("other.yaml").write_text(Path("block.yaml").read_text().replace("24 s", "3000 ms"))
    assert key("time.end=3 s") == key("time.end=1 s", "time.end=3000 ms")
    assert key("time.end=3 s") == key(source=Source(Path("other.yaml")))
    assert key("time.end=3 s") != key("time.end=3.001 s") != key()
    assert key("contact.friction_coefficient=0.5") == key()


def test_a_mesh_file_is_part_of_the_key(folder):
    scene = Path("block.yaml")
    scene.write_text(scene.read_text().replace(MESH, "{file: a.msh}"))
    Path("a.msh").write_text("one")
    Path("b.msh").write_text("one")
    forget_files()
    one = key()
    assert one != key("bodies.block.mesh.file=b.msh")  # another name, which the summary says
    Path("a.msh").write_text("another")
    assert key() != one
    with pytest.raises(SceneError, match=r"there is no file c\.msh"):
        key("bodies.block.mesh.file=c.msh")


def test_a_case_that_is_no_scene_has_a_key_too(folder):
    """As loading checks no combination of values, one of them may fail."""
    wrong, other = (Case(1, BLOCK, (f"bodies.block.thickness=-{n} mm",)) for n in (1, 2))
    assert key_of(wrong) == key_of(wrong) != key_of(other)
    assert key_of(Case(1, BLOCK)) == key()


def test_files_of_bodies_and_walls_are_found(folder):
    walls = "environment.walls={w: {kind: polyline, file: x.txt}, s: {kind: pipe, diameter: 1 m}}"
    loaded = load_scene("block.yaml", ["bodies.block.mesh={file: a.msh}", walls])
    found = list(file_keys(loaded.scene))
    assert found == [("bodies", "block", "mesh", "file"), ("environment", "walls", "w", "file")]


def test_a_study_reads_its_files_anew(folder):
    content = {
        "scene": "block.yaml",
        "factors": {"end": {"key": "time.end", "values": ["1 s"]}},
        "measures": {"moved": {"of": "body_displacement"}},
    }
    before = case_key(resolved(study_from(content, folder).cases()[0]))
    scene = folder / "block.yaml"
    scene.write_text(scene.read_text().replace("10 mm", "11 mm"))
    assert case_key(resolved(study_from(content, folder).cases()[0])) != before
