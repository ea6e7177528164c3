"""The rate of a device: element updates a second of a scene that softsim carries with it."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from softsim import backend
from softsim.builder import build_model
from softsim.errors import DeviceError
from softsim.scene.loading import load_scene
from softsim.solver.explicit import ExplicitSolver
from softsim.solver.rate import increment_time
from softsim.stability.time_step import stable_increment


@dataclass(frozen=True)
class Workload:
    """A mesh of the yardstick: the size its elements aim at, and about how many there are."""

    element_size: str
    elements: int


SECTION = Workload("0.35 mm", 1_700)  # of the PFR's own scenes
LARGE = Workload("0.095 mm", 20_000)


def measured_rate(device: str, threads: int, work: Workload, seconds: float) -> float:
    """Element updates a second on a device, in a process of its own: if it dies, that is an answer.

    device: "cpu" or "cuda". seconds: to measure, beside the start.

    Raises DeviceError: the device fails; it says how.
    """
    fresh = multiprocessing.get_context("spawn")
    try:
        with ProcessPoolExecutor(1, fresh) as process:
            return process.submit(_rate, device, threads, work, seconds).result()
    except BrokenProcessPool:
        raise DeviceError(f"the process that used {device} died") from None
    except RuntimeError as fault:  # what Taichi and the CUDA driver raise
        raise DeviceError(str(fault)) from fault


def yardstick(work: Workload) -> tuple[Path, list[str]]:
    """The scene and its overrides."""
    scene = Path(str(resources.files("softsim").joinpath("yardstick.yaml")))
    return scene, [f"bodies.skin.mesh.element_size={work.element_size}"]


def _rate(device: str, threads: int, work: Workload, seconds: float) -> float:
    model = build_model(load_scene(*yardstick(work)))
    backend.start(device, threads=threads)
    solver = ExplicitSolver([model])
    solver.begin(model.safety_factor * stable_increment(model, model.points).value)
    return model.element_count / increment_time(solver, seconds)
