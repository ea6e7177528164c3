"""Entry points of the applications in `softsim/apps`: what they add to the rest of the program.

An entry point is the text "module:name". It is imported at first use, so that the engine depends on
no application and a command that needs none loads none.
"""

from importlib import import_module
from typing import Any

COMMANDS = (
    "softsim.apps.reach.command:reach",
    "softsim.apps.calibration.command:calibrate_section",
    "softsim.apps.chain.command:chain",
)
"""Commands of the command line. Their modules import the application itself only when they run."""

STUDY_MODELS = {"chain": "softsim.apps.chain.running:ChainSource"}
"""Value of a study's `model` -> subclass of `Source`. The command of that name runs its files."""

DRAWINGS = (
    "softsim.apps.chain.report:draw_chain",
    "softsim.apps.reach.report:draw_reach",
)
"""Functions that redraw the figure in a folder and return its path.

They return None if the folder is not one of their application.
"""


def entry(point: str) -> Any:
    """Return the object of an entry point."""
    module, _, name = point.partition(":")
    return getattr(import_module(module), name)
