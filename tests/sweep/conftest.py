"""A crew that the tests of a module share, and a study of a block."""

import os

import pytest

from softsim.sweep.crew import local_crew

BLOCK = """
bodies:
  block:
    mesh: {generator: block, length: 4 mm, height: 4 mm, element_size: 2 mm}
    formulation: plane_strain
    thickness: 10 mm
    material: dragon_skin_30
time: {end: 10 ms}
output: {history_interval: 0.1 ms}
"""

STUDY = """
title: A block falls
scene: block.yaml
factors:
  time: {key: time.end, range: [2 ms, 12 ms], count: 6}
measures:
  energy: {of: energy_error}
"""

WORKERS = 2


@pytest.fixture(scope="module")
def crew(kernel_cache):
    """Two workers."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(os.environ, "SOFTSIM_CACHE", kernel_cache)
        with local_crew(WORKERS) as crew:
            yield crew


@pytest.fixture
def study_file(write_scene):
    """The file of a study of six cases."""
    write_scene(BLOCK, "block.yaml")
    return write_scene(STUDY, "study.yaml")
