"""The run of a scene, from its start to its end.

Read scenes.py first (a scene alone, or several side by side), then batch.py (the loop over runs
that share a solver), course.py (one run from block to block of increments) and files.py (what it
leaves in its folder). steps.py runs the steps of a scene one after another, with what handover.py
passes on; taken_steps.py takes steps from another run. simulation.py is a run in steps, which
record.py keeps in memory. control.py feeds rows of the history back to the pressure, pilot.py
foretells the duration of a run, cost.py measures what an increment costs.
"""

from softsim.run.course import Results
from softsim.run.scenes import PROFILE_AFTER, run, run_batch
from softsim.run.steps import run_steps

__all__ = ["PROFILE_AFTER", "Results", "run", "run_batch", "run_steps"]
