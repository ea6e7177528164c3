"""How long a run will take, from a second of it and one of everything it does between increments.

Assumed: the step and the time of an increment stay what they are at rest, and nothing else keeps
the machine busy. A static run goes on past its end time until forces balance, which nobody knows
beforehand: that part is not in.
"""

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil
from rich.console import Console

from softsim.machine import Choice
from softsim.model import Model
from softsim.output.folder import RunFolder
from softsim.run import INSPECT_EVERY, STATION, Simulation
from softsim.scene.loading import LoadedScene
from softsim.solver.rate import increment_time

MEASURED_TIME = 1.0  # seconds of real increments
# A start that took longer [s] compiled kernels; the run finds them in the cache, so that it is
# measured once more. Only very large models are read and built in this time.
COLD_START = 6.0
# Figures at the end [s]: matplotlib's import and some four pictures.
FIGURES_TIME = 4.0


@dataclass(frozen=True)
class Duration:
    """The parts of a run [s]: `start` up to the first increment, `increments`, `output` (history,
    frames, inspections, checkpoints), `figures`. threads: CPU threads it was measured with.
    rate: element updates a second of the increments alone.
    """

    start: float
    increments: float
    output: float
    figures: float
    rate: float
    threads: int

    @property
    def total(self) -> float:
        """All of it [s]."""
        return self.start + self.increments + self.output + self.figures


def predicted_duration(loaded: LoadedScene, model: Model, choice: Choice) -> Duration:
    """Start the run in a folder that goes away again, measure its pieces, and count them.

    Raises DeviceError where the device does not start.
    """
    built_after = time.time() - psutil.Process().create_time()
    with tempfile.TemporaryDirectory() as folder:
        target = RunFolder(Path(folder))
        simulation, started_in = _first_increment(loaded, model, target, choice)
        if started_in > COLD_START:
            simulation.close()
            simulation, started_in = _first_increment(loaded, model, target, choice)
        duration = _counted(simulation, built_after + started_in)
        simulation.close()
    return duration


def _first_increment(
    loaded: LoadedScene, model: Model, target: RunFolder, choice: Choice
) -> tuple[Simulation, float]:
    """The run after its first increment, and how long that took [s]."""
    began = time.perf_counter()
    simulation = Simulation(loaded, model, target, choice, False, Console(quiet=True))
    simulation.solver.advance(1)
    return simulation, time.perf_counter() - began


def _counted(simulation: Simulation, start: float) -> Duration:
    """Pieces, measured one by one, times how often the run does them."""
    solver, output, end = simulation.solver, simulation.output, simulation.model.end_time
    rows, frames = (end / t + 1.0 for t in (output.history_interval, output.frame_interval))
    increments = end / solver.increment
    rows, frames = min(rows, increments), min(frames, increments)
    # A station ends after so many increments, or where a row is due.
    stations = rows * np.ceil(increments / rows / STATION)

    each = increment_time(solver, MEASURED_TIME)
    between = (
        stations * _time_of(simulation, lambda: solver.advance(0))
        + rows * _time_of(simulation, simulation.write_row)
        + frames * _time_of(simulation, simulation.write_frame)
        + stations / INSPECT_EVERY * _time_of(simulation, simulation.inspect)
    )
    loop = increments * each + between
    checkpoints = 1.0 + loop // output.checkpoint_interval
    between += checkpoints * _time_of(simulation, simulation.checkpoint)
    return Duration(
        start,
        increments * each,
        between,
        FIGURES_TIME,
        simulation.model.element_count / each,
        simulation.device.threads,
    )


def _time_of(simulation: Simulation, act: Callable[[], object]) -> float:
    """Median time [s] of what a run does between increments, each time an increment later."""
    times = []
    for _ in range(5):
        simulation.solver.advance(1)
        began = time.perf_counter()
        act()
        times.append(time.perf_counter() - began)
    return float(np.median(times))
