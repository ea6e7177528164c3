"""Runs, and batches of one that can be begun, stopped and resumed."""

import io

import pytest
from rich.console import Console


@pytest.fixture
def batch_of(write_scene, tmp_path, kernel_cache, monkeypatch):
    """A batch of one: a scene text, with overrides, in a folder of that name."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)

    def start(scene, folder, *overrides, resume=False):
        from softsim.builder import build_model
        from softsim.compute.machine import choose
        from softsim.output.folder import RunFolder
        from softsim.run.scenes import opened
        from softsim.scene.loading import load_scene

        loaded, target = load_scene(write_scene(scene), overrides), RunFolder(tmp_path / folder)
        model, choice, quiet = build_model(loaded), choose("cpu", 1), Console(quiet=True)
        return opened(loaded, model, target, choice, quiet, resume)

    return start


@pytest.fixture
def run(kernel_cache, monkeypatch):
    """Run a scene quietly on the CPU."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run as run_scene

    def quiet(scene, *overrides, out, **options):
        options = {"console": Console(file=io.StringIO())} | options
        return run_scene(scene, overrides, out, "cpu", **options)

    return quiet


@pytest.fixture
def short_lists(monkeypatch):
    """Lists of facets near a node that are full as soon as SLIDING_BLOCK reaches its stop."""
    from softsim.contact import neighbour_lists

    monkeypatch.setattr(neighbour_lists, "MOST_FACETS", {2: 11})
