"""Explicit finite elements for soft robots.

`load_scene` reads and checks a scene file, `softsim.run.run` runs it and returns `Results`, a
`Simulation` is a run under the control of a program, a `SimulationBatch` several of them side by
side, and a `Study` runs many scenes.

Notes
-----
Importing this package does not import Taichi: names are loaded at first use.
"""

import os
from importlib import import_module
from importlib.metadata import version
from typing import Any

# Taichi reads these as it is imported.
os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
os.environ.setdefault("TI_SKIP_VERSION_CHECK", "ON")  # no news from the network at each start

_HOMES = {
    "load_scene": "softsim.scene.loading",
    "Results": "softsim.run",
    "Simulation": "softsim.run.simulation",
    "SimulationBatch": "softsim.run.simulation",
    "Study": "softsim.sweep.study",
}

__version__ = version("softsim")

__all__ = ["Results", "Simulation", "SimulationBatch", "Study", "__version__", "load_scene"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'softsim' has no attribute '{name}'")
    return getattr(import_module(_HOMES[name]), name)
