"""The run of a scene, from its start to its end.

Read scenes.py first (a single scene, several side by side, or the steps of one, which may be
reused from another run), then loop.py (one run: blocks of increments, and callbacks between them),
batch.py (`assembled` describes the callbacks of a run in their order; runs that share a solver),
callbacks.py and record.py (the files of a run, or a record in memory). control.py controls a
pressure by the history, or loads by commands. statics.py has load steps by Newton's method and the
derivatives of their rows, equilibrium.py natural modes and harmonic response about equilibria.
simulation.py advances a run under the control of a program. pilot.py estimates the duration of a
run, cost.py measures wall times and the cost of an increment.
"""

from softsim.run.loop import Results
from softsim.run.scenes import run, run_batch, run_steps

__all__ = ["Results", "run", "run_batch", "run_steps"]
