"""Fixtures that all tests share; tests/tiers.py describes the three tiers of tests."""

import gc
import os

# Workers of pytest-xdist share the processors: more threads of each would only wait.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from pathlib import Path

import pytest
from hypothesis import settings
from tiers import StartCount, in_default_tier, starts_of

from softsim.compute import backend

# How long an example takes is the machine's matter, which may be busy: no test is timed. A change
# is judged by the same examples wherever it is tested; `--hypothesis-profile explore` draws new
# ones.
settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.register_profile("explore", deadline=None)
settings.load_profile("repeatable")

LANES = backend.CPU_LANES
"""Elements in a lane vector, at most, as users have them."""

START_COUNT = StartCount()

FEWER_LANES = 1
"""Elements in a lane vector of the fast suite's kernels. Taichi writes vector arithmetic out
lane by lane: with the eight of users, and of the slow suite, hexahedra take twice as long to
compile. `tests/solver/test_lanes.py` compares all kinds of elements.
"""

OPTIMIZATION = "TI_ADVANCED_OPTIMIZATION"
"""Taichi reads it at each start. Without, kernels of the fast suite, and of the processes that it
starts, compile in two thirds of the time and run at two thirds of the speed.
"""


def pytest_addoption(parser):
    parser.addoption("--device", default="cpu", choices=("cpu", "cuda"), help="where solvers run")


def pytest_configure(config):
    backend.start_taichi = START_COUNT.watch(backend.start_taichi)
    if config.option.markexpr != "slow":
        backend.CPU_LANES = FEWER_LANES
        os.environ[OPTIMIZATION] = "0"


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Put the tests that start a solver into the tier physics, before markers select tests."""
    for item in items:
        starts_a_solver = "kernel_cache" in item.fixturenames
        if starts_a_solver and in_default_tier(item) and not starts_of(item):
            item.add_marker(pytest.mark.physics)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    START_COUNT.begin(item)


def pytest_collection_finish():
    gc.freeze()  # what is imported by now stays, and is no longer searched for garbage


@pytest.fixture
def kernels_of_users(monkeypatch):
    """Kernels as users have them."""
    monkeypatch.setattr(backend, "CPU_LANES", LANES)
    monkeypatch.delenv(OPTIMIZATION, raising=False)


@pytest.fixture(scope="session")
def kernel_cache(kernel_folder):
    """Folder of compiled kernels, for tests that start a solver; see `kernel_folder`."""
    return kernel_folder


@pytest.fixture(scope="session")
def kernel_folder(tmp_path_factory):
    """Folder of compiled kernels: $SOFTSIM_CACHE, else one that all workers of a session share.

    For fixtures of which only some uses start a solver; such a use has a marker of its own.
    """
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    return os.environ.get("SOFTSIM_CACHE") or str(shared / "kernels")


@pytest.fixture
def restart(kernel_cache, request):
    """Start Taichi anew, on the CPU or where `--device` says: fields made before are gone, kernels
    compiled before are found again. (Two solvers beside each other share no kernels.)
    """
    from softsim.compute import backend

    def started(threads: int = 1, device: str = request.config.getoption("device")):
        return backend.start(device, cache=Path(kernel_cache), threads=threads)

    return started


@pytest.fixture
def fresh_taichi(restart):
    """Taichi started anew: fields of earlier tests are gone."""
    return restart()


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
def start(restart):
    """A solver at t = 0 with the stable step (or a given share of it), the only one there is: what
    one started before it has found is read before.
    """
    from softsim.solver.explicit import ExplicitSolver
    from softsim.solver.stable_step import stable_step

    def start_solver(*models, share: float = 0.9):
        restart()
        solver = ExplicitSolver(list(models))
        solver.begin(share * min(stable_step(m, m.points).value for m in models))
        return solver

    return start_solver


@pytest.fixture
def start_settled(restart):
    """As `start`, with the stable step, whose models have settled."""
    import numpy as np

    from softsim.solver.energy import EnergyReader, settle
    from softsim.solver.explicit import ExplicitSolver
    from softsim.solver.stable_step import stable_step

    def start_solver(*models):
        restart()
        solver = ExplicitSolver(list(models))
        step = 0.9 * min(stable_step(m, m.points).value for m in models)
        settle(solver, EnergyReader(solver), np.full(len(models), step))
        solver.begin(step)
        return solver

    return start_solver


# The table of verification results: each test records what it compared; pytest prints it last.
# Under pytest-xdist every worker hands its rows to the process that reports, which has read this
# conftest only.

COLLECTED: list[list] = []


@pytest.fixture
def equilibria(kernel_cache, monkeypatch, write_scene):
    """Make the equilibria of a scene text, with loads as for `softsim modes`."""
    from softsim.compute.machine import Choice
    from softsim.run.equilibrium import Preloaded, scene_with_loads

    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)

    def made(text, *loads, over=None):
        return Preloaded(scene_with_loads(write_scene(text), [], loads, over), Choice("cpu", 1))

    return made


@pytest.fixture
def record_verification(request):
    """Record a comparison: case, exact and computed value, observed order of convergence or None.

    The relative error is (computed - exact) / exact; where exact is zero, the computed value.
    """

    def record(case: str, exact: float, computed: float, order: float | None = None) -> None:
        error = (computed - exact) / exact if exact else computed
        # Plain floats: what pytest-xdist sends between processes.
        row = [case, float(exact), float(computed), float(error), order and float(order)]
        request.node.user_properties.append(("verification", row))

    return record


def pytest_runtest_logreport(report):
    if report.when == "call":
        COLLECTED.extend(row for name, row in report.user_properties if name == "verification")


def pytest_terminal_summary(terminalreporter):
    if not COLLECTED:
        return
    terminalreporter.section("verification")
    width = max(len(row[0]) for row in COLLECTED)
    terminalreporter.write_line(
        f"{'case':{width}}  {'exact':>12}  {'computed':>12}  {'error':>9}  order"
    )
    for case, exact, computed, error, order in sorted(COLLECTED):
        shown = "" if order is None else f"{order:5.2f}"
        terminalreporter.write_line(
            f"{case:{width}}  {exact:12.6g}  {computed:12.6g}  {100 * error:8.3f}%  {shown}"
        )
