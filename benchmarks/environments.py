"""Rates of the vector environment: what a learning agent waits for."""

import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.effort import Effort
from benchmarks.scenes import ROOT
from benchmarks.table import Row
from softsim.compute.machine import cuda_device_count

if TYPE_CHECKING:
    from softsim.gym import PressureVectorEnv

COUNTS = (1, 8, 64)
SCENE = ROOT / "scenes" / "first_look.yaml"
INTERVAL = 2e-3  # of an action [s]
STEPS = 20  # of each environment; an episode has 75
OVERRIDES = ("output.history_interval=2 ms", "time.settle=null")


def rates(count: int, device: str) -> tuple[float, float]:
    """Steps and increments a second of `count` environments together, with random pressures.

    Over the first part of an episode, where inspections are most frequent. On one thread: the mesh
    is small.
    """
    from softsim.gym import make_vec

    envs = make_vec(
        SCENE, count, "air", lowest=0.0, highest=10e3, interval=INTERVAL,
        observed=("pressure",), progress="frame_x", overrides=OVERRIDES, device=device,
        threads=1,
    )  # fmt: skip
    envs.action_space.seed(1)
    envs.reset(seed=1)
    envs.step(envs.action_space.sample())  # the first one loads kernels
    before, began = increments(envs), time.perf_counter()
    for _ in range(STEPS):
        envs.step(envs.action_space.sample())
    took = time.perf_counter() - began
    return count * STEPS / took, (increments(envs) - before) / took


def increments(envs: "PressureVectorEnv") -> int:
    """Increments that all environments have done."""
    return sum(simulation.increment_count for simulation in envs.batch.simulations)


def environment_rows(folder: Path, program: Path | None, effort: Effort) -> list[Row]:
    """Environments of the first look side by side, each in a process of its own."""
    rows = []
    for device in ("cpu", "cuda")[: 2 if cuda_device_count() > 0 else 1]:
        for count in COUNTS:
            with ProcessPoolExecutor(1, get_context("spawn")) as pool:
                steps, done = pool.submit(rates, count, device).result()
            name = f"{count} environments, {device}"
            remark = f"{done:.4g} increments a second, actions of {1e3 * INTERVAL:g} ms"
            rows.append(Row(name, steps, "steps/s", remark=remark))
    return rows
