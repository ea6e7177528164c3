"""Run of a chain, from its scene to the folder of results."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from softsim.chain.building import build_chain
from softsim.chain.loading import LoadedChain
from softsim.chain.motion import Motion, measures, simulate, track_measures, yaw
from softsim.output.folder import HISTORY, SCENE, SUMMARY, RunFolder, claimed
from softsim.output.history import History

MODEL = "chain"
"""Value of `model` in the summary of a chain."""


AXES = {2: "xz", 3: "xyz"}
"""Names of the components of a vector, by their number."""


@dataclass(frozen=True, eq=False)
class ChainResults:
    """Results of a chain.

    Attributes
    ----------
    motion : Motion
        Times (k,) [s], positions and velocities (k, n, d) [m, m/s] of all nodes.
    summary : dict
        Content of summary.json, in SI units.
    """

    motion: Motion
    summary: dict[str, Any]


def run_chain(loaded: LoadedChain, folder: Path) -> ChainResults:
    """Simulate a chain, and write scene, history and summary into a folder.

    Parameters
    ----------
    loaded : LoadedChain
        Chain from `load_chain`.
    folder : Path
        Folder of the results.

    Returns
    -------
    ChainResults
        Motion and summary.

    Raises
    ------
    SceneError
        The chain cannot be built.
    StabilityError
        The motion cannot be computed.
    OutputError
        The folder cannot be written, or another run uses it.

    Examples
    --------
    >>> from pathlib import Path
    >>> from softsim.chain.loading import load_chain
    >>> from softsim.chain.running import run_chain
    >>> loaded = load_chain("leafbot5", ["time.end=0.1 s"])
    >>> results = run_chain(loaded, Path("runs/leafbot5"))
    >>> results.summary["status"]
    'done'
    >>> results.motion.p.shape[1:]  # nodes, x and z [m]
    (4, 2)
    """
    chain = build_chain(loaded)
    target = RunFolder(folder)
    with claimed(folder):
        (folder / SUMMARY).unlink(missing_ok=True)  # of a run before: this one is not done
        target.write_text_atomic(SCENE, loaded.resolved())
        began = time.monotonic()
        motion = simulate(chain, loaded.scene.time)
        told = measures(motion)
        further = {
            name: measures(simulate(chain.driven_at(frequency), loaded.scene.time))["speed"]
            for name, frequency in loaded.scene.motor.further.items()
        }
        summary = {
            "status": "done",
            "model": MODEL,
            "scene": loaded.path,
            "title": loaded.scene.title,
            "node_count": chain.node_count,
            "heads": (chain.heads + 1).tolist(),
            "motor_frequency": loaded.scene.motor.frequency,
            "time_increment": motion.times[1],
            "increments": len(motion.times) - 1,
            "simulated_time": motion.times[-1],
            "wall_time": time.monotonic() - began,
            **told,
            **(track_measures(motion) if loaded.scene.sides is not None else {}),
            "further_speeds": further,
        }
        _write_history(motion, loaded.scene.time.row_interval, folder / HISTORY)
        target.write_json_atomic(SUMMARY, summary)
    return ChainResults(motion, summary)


def _write_history(motion: Motion, interval: float, path: Path) -> None:
    """Write history.csv with rows about `interval` [s] apart."""
    stride = max(round(interval / motion.times[1]), 1)
    axes = AXES[motion.p.shape[-1]]
    columns: dict[str, tuple[str, np.ndarray]] = {"time": ("s", motion.times)}
    for node in range(motion.chain.node_count):
        for axis, name in enumerate(axes):
            columns[f"{name}{node + 1}"] = ("m", motion.p[:, node, axis])
    head = motion.chain.heads[0]
    for axis, name in enumerate(axes):
        columns[f"head_velocity_{name}"] = ("m/s", motion.v[:, head, axis])
    if "y" in axes:
        columns["centre_x"] = ("m", motion.centre[:, 0])
        columns["centre_y"] = ("m", motion.centre[:, 1])
        columns["yaw"] = ("rad", yaw(motion))
    columns |= {f"{name}_energy": ("J", energy) for name, energy in motion.energies.items()}
    columns |= {f"{name}_work": ("J", work) for name, work in motion.works.items()}
    history = History(path, {name: unit for name, (unit, _) in columns.items()})
    table = np.column_stack([values[::stride] for _, values in columns.values()])
    for row in table:
        history.append(dict(zip(columns, row, strict=True)))
    history.close()
