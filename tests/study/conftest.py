"""A small scene and a study of it, in a folder of their own."""

from pathlib import Path

import pytest

from softsim.study.cases import forget_files

SCENE = """\
bodies:
  block:
    mesh: {generator: block, length: 10 mm, height: 5 mm, element_size: 1 mm}
    formulation: plane_strain
    thickness: 10 mm
    material: dragon_skin_10
contact: {friction_coefficient: 0.5}
time:
  end: 24 s
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with block.yaml, in which one works, so that messages name files alone."""
    monkeypatch.chdir(tmp_path)
    Path("block.yaml").write_text(SCENE, encoding="utf-8")
    forget_files()  # another test's block.yaml, in another folder
    return tmp_path
