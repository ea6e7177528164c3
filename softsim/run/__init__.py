"""The run of a scene, from its start to its end.

Read scenes.py first (a single scene, or several side by side), then batch.py (the loop over runs
that share a solver), course.py (one run from block to block of increments) and files.py (the files
of a run). steps.py runs the steps of a scene one after another, and handover.py transfers the state
between them; taken_steps.py reuses steps of another run. simulation.py advances a run in steps
under the control of a program, recorded in memory by record.py. control.py feeds rows of the
history back to the pressure, pilot.py estimates the duration of a run, cost.py measures the cost of
an increment.
"""

from softsim.run.course import Results
from softsim.run.scenes import PROFILE_AFTER, run, run_batch
from softsim.run.steps import run_steps

__all__ = ["PROFILE_AFTER", "Results", "run", "run_batch", "run_steps"]
