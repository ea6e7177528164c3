"""Whole runs with Taichi's checks of every index: nothing reads or writes beside its field.

Extents are what the mesh has, not rounded up, so that an index one too far is beside the field.
"""

import io
from pathlib import Path

import numpy as np
import pytest
import taichi as ti
from rich.console import Console

from softsim.compute import backend, fields

SCENES = Path(__file__).parents[2] / "scenes"
BLOCK = """
bodies:
  block: {mesh: {generator: block, length: 10 mm, height: 6 mm, element_size: 2 mm},
          formulation: plane_strain, thickness: 10 mm, material: dragon_skin_30}
environment: {walls: {floor: {kind: plane}}}
contact: {friction_coefficient: 0.5}
time: {end: 1 ms}
"""
MOMENT = ["time.end=0.2 ms", "time.procedure=dynamic", "time.settle=null", "expect={}"]


@pytest.fixture
def checked(monkeypatch, tmp_path):
    """Taichi starts with every index checked, and without kernels that were kept unchecked."""
    plain_start = ti.init

    def start(**settings):
        plain_start(**settings | {"debug": True, "check_out_of_bound": True})

    monkeypatch.setattr(backend.ti, "init", start)
    monkeypatch.setattr(fields, "rounded", lambda extent: extent)
    monkeypatch.setenv("SOFTSIM_CACHE", str(tmp_path / "kernels"))


@pytest.mark.physics
def test_an_index_beside_its_field_is_found(checked, tmp_path):
    backend.start("cpu", cache=tmp_path)
    field = fields.real_field(np.zeros(11))

    @ti.kernel
    def read(i: int) -> float:
        return field[i]

    assert read(10) == 0.0
    with pytest.raises(ti.TaichiAssertionError, match="size \\(11\\) with indices \\(11\\)"):
        read(11)


@pytest.mark.physics
def test_no_index_of_a_block_on_a_floor_is_beside_its_field(checked, tmp_path, write_scene):
    from softsim.scene.loading import load_scene

    run_a_moment(load_scene(write_scene(BLOCK), MOMENT), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "first_look",  # quadrilaterals of rings, air, motor, round walls
        "pfr_36mm_3d",  # hexahedra, a cable
        "leafbot_ramp",  # walls on a grid
        "pfr_36mm_air_line",
        "layouts/elbow_90_36mm",  # self-contact, a pipe's path
    ],
)
def test_no_index_of_a_robot_is_beside_its_field(checked, tmp_path, name):
    from softsim.study.cases import Source, load_source

    source = Source(SCENES / f"{name}.yaml", "pfr" if name.startswith("layouts/") else None)
    run_a_moment(load_source(source, MOMENT), tmp_path)


def run_a_moment(loaded, folder):
    """Run a scene; Taichi raises at an index beside its field."""
    from softsim.run import run

    found = run(loaded, out=folder / "run", device="cpu", console=Console(file=io.StringIO()))
    assert found.summary["status"] == "done" and found.summary["increments"] >= 4
