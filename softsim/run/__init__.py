"""The run of a scene, from its start to its end.

Read scenes.py first (a single scene, or several side by side), then batch.py (the loop over runs
that share a solver), course.py (one run from block to block of increments, with control of the
pressure by its history) and record.py (its files, or a record in memory). statics.py is the static
run by Newton's method, equilibrium.py natural modes and harmonic response about equilibria, and
gradient.py their derivatives. steps.py runs the steps of a scene one after another or reuses those
of another run. simulation.py advances a run in steps under the control of a program, and
commands.py changes its loads. pilot.py estimates the duration of a run, cost.py measures the cost
of an increment.
"""

from softsim.run.course import Results
from softsim.run.scenes import run, run_batch
from softsim.run.steps import run_steps

__all__ = ["Results", "run", "run_batch", "run_steps"]
