"""Shared by all tests: one Taichi start a process, and small models built from scene texts."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def kernel_cache(tmp_path_factory):
    """The kernel cache that is given, else one for this session of tests and all its workers."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    return os.environ.get("SOFTSIM_CACHE") or str(shared / "kernels")


@pytest.fixture
def cpu(kernel_cache):
    """Taichi on the CPU, started anew: fields of earlier tests are gone."""
    from softsim import backend

    return backend.start("cpu", cache=Path(kernel_cache))


@pytest.fixture
def write_scene(tmp_path):
    """Write a scene text to a file of its own and return its path."""

    def write(text: str, name: str = "scene.yaml") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.fixture
def build(write_scene):
    """A model from a scene text and overrides."""
    from softsim.builder import build_model
    from softsim.scene.loading import load_scene

    def build_scene(text: str, *overrides: str):
        return build_model(load_scene(write_scene(text), overrides))

    return build_scene


@pytest.fixture
def start(cpu):
    """A solver at t = 0 with the stable step (or a given share of it)."""
    from softsim.solver.explicit import ExplicitSolver
    from softsim.solver.time_step import stable_increment

    def start_solver(*models, share: float = 0.9):
        solver = ExplicitSolver(list(models))
        solver.begin(share * min(stable_increment(m, m.points).value for m in models))
        return solver

    return start_solver
