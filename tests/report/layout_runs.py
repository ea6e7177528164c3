"""Run folders of a robot that is bent along its pipe, without a simulation."""

from pathlib import Path

import numpy as np

from softsim.analysis.passage import layout_report, path_samples
from softsim.contact.pipe_layout import Bend, DiameterStep, Straight, Taper, path_of_items
from softsim.contact.pipe_network import PipeNetwork
from softsim.mesh.mesh import Mesh
from softsim.model import Passage
from softsim.output.fields import FieldWriter
from softsim.output.folder import HISTORY, RESULTS, RunFolder
from softsim.output.history import History

QUARTER = 0.5 * np.pi
ITEMS = [
    Straight(0.10), Bend(QUARTER, 0.06, 0.0), Straight(0.06), Taper(0.03, 41e-3), Straight(0.05),
    Bend(QUARTER, 0.06, np.pi), DiameterStep(36e-3), Straight(0.06),
]  # fmt: skip
SAID = (
    "straight 100 mm", "bend 90 deg, radius 60 mm", "straight 60 mm", "taper 30 mm, to 41 mm",
    "straight 50 mm", "bend -90 deg, radius 60 mm", "step 36 mm", "straight 60 mm",
)  # fmt: skip
END, PERIOD = 24.0, 6.0
UNITS = {
    "time": "s", "pressure": "Pa", "frame_x": "m", "frame_y": "m", "rows_in_contact": "-",
    "wall_force_normal": "N", "arc_length": "m", "cycles_done": "-", "clearance": "m",
    "frame_wall_force": "N", "frame_pinch": "N", "frame_drag": "N", "thrust": "N", "drag": "N",
    "narrowing_drag": "N", "branch": "-",
}  # fmt: skip


def write_layout_run(folder: Path, mesh: Mesh, farthest: float, wedged: bool) -> None:
    """A robot that comes from 25 mm to `farthest` [m] in four cycles of the pressure: it walks
    while the pressure falls. Wedged, it does all of its way in the first two.
    """
    d = mesh.points.shape[1]
    path = path_of_items("pipe", ITEMS, 36e-3, np.zeros(d), (False, False))
    times = np.arange(0.0, END + 1e-9, 0.04)
    moves = np.interp(times % PERIOD, [0.0, 2.0, PERIOD], [0.0, 0.0, 1.0]) + times // PERIOD
    s = 0.025 + (farthest - 0.025) * np.minimum(moves / (2.0 if wedged else 4.0), 1.0)
    s += 1e-4 * np.sin(2.0 * np.pi * 5.0 * times)
    pressure = 8e3 * np.interp(times % PERIOD, [0.0, 1.0, 2.0, PERIOD], [0.6, 1.0, 1.0, 0.6])
    centre, tangent = path.axis_place(s)
    history = History(folder / HISTORY, UNITS)
    for k, time in enumerate(times):
        row = dict.fromkeys(UNITS, 0.0)
        row |= {
            "time": time, "pressure": pressure[k], "frame_x": centre[k, 0],
            "frame_y": centre[k, 1], "rows_in_contact": 2.0 + round(pressure[k] / 4e3),
            "arc_length": s[k], "cycles_done": float(time // PERIOD), "clearance": 4e-3,
            "wall_force_normal": 1.0,
        }  # fmt: skip
        if wedged:
            row |= {"clearance": -1e-6, "frame_wall_force": 2.0, "frame_pinch": 0.9}
        history.append(row)
    history.close()
    writer = FieldWriter(folder / RESULTS, mesh.points, mesh.cells)
    writer.describe(
        **path_samples(PipeNetwork.of_one(path)),
        gravity=np.array([0.0, -9.81, 0.0])[:d],
        outlines=np.array([[0.0, 0.0, 33e-3, 15e-3]]),
        title="a robot in a layout",
    )
    for time in np.arange(0.0, END + 1e-9, 0.4):
        now = float(np.interp(time, times, s))
        angle = np.arctan2(*np.array([np.interp(time, times, tangent[:, i]) for i in (1, 0)]))
        pose = [np.interp(time, times, centre[:, i]) for i in range(2)]
        writer.append(
            time,
            {"displacement": bent(mesh.points, path, now) - mesh.points},
            {"stretch": np.ones(len(mesh.cells))},
            extra={"frame_pose": np.array([[*pose, angle]])},
        )
    given = Passage(
        network=PipeNetwork.of_one(path), items=SAID, body=0, length=33e-3,
        outline=np.arange(4), start=float(s[0]),
        goals=(path.segments[-1].start + 16.5e-3,), in_cycles=True, patience=2, patience_time=3.0,
        least_progress=5e-3,
    )  # fmt: skip
    columns = {name: np.zeros(len(times)) for name in UNITS} | {
        "time": times, "arc_length": s, "cycles_done": times // PERIOD,
        "clearance": np.full(len(times), -1e-6 if wedged else 4e-3),
        "frame_wall_force": np.full(len(times), 2.0 * wedged),
        "frame_pinch": np.full(len(times), 0.9 * wedged),
    }  # fmt: skip
    report = layout_report(given, columns)
    RunFolder(folder).write_json_atomic("summary.json", {"layout": report})


def bent(points: np.ndarray, path, s: float) -> np.ndarray:
    """Points (n, d) [m] of a body about the origin, bent along the path at the arc length s."""
    centre, tangent = path.axis_place(s + points[:, 0])
    left = np.zeros_like(points)
    left[:, :2] = tangent[:, :2] @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    result = centre + points[:, 1:2] * left
    if points.shape[1] == 3:
        result[:, 2] += points[:, 2]
    return result
