"""Stand-ins for the runs of trials: a worker imports them."""

import json

import numpy as np

from softsim.errors import StabilityError

PULL = 0.1  # N, with less drag it gets on


def history(progress):
    """The text of a history.csv: the pressure falls twice, x grows by `progress` [m]."""
    time = np.arange(9.0)
    pressure = np.array([0, 1, 1, 0.6, 0.2, 1, 1, 0.8, 0.6]) * 20e3
    place = np.where(time < 4.0, 0.0, progress)
    rows = "\n".join(f"{t},{p},{x}" for t, p, x in zip(time, pressure, place, strict=True))
    return f"time,pressure,frame_x\ns,Pa,m\n{rows}\n"


def pulling(jobs):
    """A robot that pulls PULL, level and upright."""
    for job in jobs:
        progress = 5e-3 if job.case.values["drag"] < PULL else -1e-3
        (job.folder / "history.csv").write_text(history(progress))
        (job.folder / "summary.json").write_text(json.dumps({"status": "done"}))
    return [None for _ in jobs]


def breaking(jobs):
    """The same robot breaks at less than 60 mN."""
    pulling(jobs)
    return [
        StabilityError("element 7 is inverted") if job.case.values["drag"] < 0.06 else None
        for job in jobs
    ]
