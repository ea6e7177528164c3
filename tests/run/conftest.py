"""Batches of one, to be begun, stopped and resumed."""

import pytest
from rich.console import Console


@pytest.fixture
def batch_of(write_scene, tmp_path, kernel_cache, monkeypatch):
    """A batch of one: a scene text, with overrides, in a folder of that name."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)

    def start(scene, folder, *overrides, resume=False):
        from softsim.builder import build_model
        from softsim.machine import choose
        from softsim.output.folder import RunFolder
        from softsim.run.batch import Batch
        from softsim.run.files import RunFiles
        from softsim.run.scenes import resumed
        from softsim.scene.loading import load_scene

        loaded, target = load_scene(write_scene(scene), overrides), RunFolder(tmp_path / folder)
        model, choice, quiet = build_model(loaded), choose("cpu", 1), Console(quiet=True)
        if resume:
            return resumed(loaded, model, target, choice, quiet)
        return Batch([RunFiles(loaded, model, target, quiet)], choice, [()])

    return start
