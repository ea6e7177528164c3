"""Rates on a GPU against what its memory bandwidth allows."""

import subprocess
import sys
from pathlib import Path

import numpy as np

from benchmarks import scenes
from benchmarks.effort import Effort
from benchmarks.scenes import ROOT
from benchmarks.solver_process import SolverProcess
from benchmarks.table import Row
from softsim.builder import build_model
from softsim.model import Model
from softsim.scene.loading import load_scene

REAL, INDEX = 8, 4  # bytes


def bytes_an_increment(model: Model, scenarios: int) -> int:
    """What any increment has to move through memory [bytes], with a cache for all the rest.

    For each scenario positions, velocities and nodal J in and out, and each Maxwell branch's
    metric; for all scenarios of a mesh once: corners, gradients, volumes, masses.
    """
    d = model.dimension
    own = shared = 0
    for body in model.regions:
        nodes, cells = len(body.points), len(body.cells)
        metric = d * (d + 1) // 2 + (d == 2)
        own += nodes * (2 * d + 1) * 2 * REAL
        own += cells * len(body.material.branches) * metric * 2 * REAL
        shared += cells * ((d + 1) * INDEX + (d * d + 1) * REAL) + nodes * 2 * REAL
    return scenarios * own + shared


def bandwidth() -> float:
    """Measured by copying a large array on the GPU, read and written [bytes/s]."""
    command = [sys.executable, "-m", "benchmarks.gpu_bandwidth"]
    done = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)
    return float(done.stdout)


def gpu_rows(folder: Path, program: Path | None, effort: Effort) -> list[Row]:
    """Many scenarios of the robot's section, and large meshes in space."""
    measured = bandwidth()
    works = [(scenes.PFR, count) for count in (1, 64, 1024)]
    works += [(scenes.block(folder, "tetrahedra", n), 1) for n in (20_000, 200_000, 1_000_000)]
    rows = [Row("GPU: memory bandwidth", measured / 1e9, "GB/s")]
    for scene, scenarios in works:
        rows += _rate_rows(scene, scenarios, measured, effort)
    return rows


def _rate_rows(scene: Path, scenarios: int, measured: float, effort: Effort) -> list[Row]:
    model = build_model(load_scene(scene))
    with SolverProcess(scene, device="cuda", scenarios=scenarios) as solver:
        count = solver.increments_for(effort.seconds)
        rates = []
        for _ in range(effort.rounds):
            solver.start(count)
            rates.append(solver.rate())
    updates = model.element_count * scenarios
    highest = measured / bytes_an_increment(model, scenarios) * updates
    name = f"GPU: {model.element_count} elements, {scenarios} at once"
    best = float(np.max(rates))
    return [
        Row(
            name, best / 1e6, "M/s", highest / 1e6, best / highest,
            remark=f"{scene.stem}; ceiling: what the memory bandwidth allows",
        )
    ]  # fmt: skip
