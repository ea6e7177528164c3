"""A pool that the tests of a module share, and a study of a block."""

import os

import pytest
from falling_block import BLOCK, STUDY

from softsim.sweep.engine import local_pool

WORKERS = 2


@pytest.fixture(scope="module")
def pool(kernel_cache):
    """Two workers."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(os.environ, "SOFTSIM_CACHE", kernel_cache)
        with local_pool(WORKERS) as pool:
            yield pool


@pytest.fixture
def study_file(write_scene):
    """The file of a study of six cases."""
    write_scene(BLOCK, "block.yaml")
    return write_scene(STUDY, "study.yaml")
