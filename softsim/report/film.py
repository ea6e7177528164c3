"""A run as a film: its stored frames one after another, in one view and one scale of colours."""

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.animation import FFMpegWriter, PillowWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from softsim.errors import OutputError
from softsim.output.fields import Frames
from softsim.output.folder import explained
from softsim.report.colours import FIELDS, refuse_missing_field, shared_scale
from softsim.report.curves import single_pressure
from softsim.report.recorded import Recorded
from softsim.report.snapshots import add_scale, pictures, show, state
from softsim.report.style import PAGE_WIDTH, STYLE

RESOLUTION = 110
"""Dots an inch: of a film less than of a picture."""

HEIGHTS = 1.6, 6.0
"""Of a film, least and most [inch], with its title and its scale of colours."""

WRITERS: dict[str, type[PillowWriter | FFMpegWriter]] = {".gif": PillowWriter, ".mp4": FFMpegWriter}
"""Ending of a film's file -> what writes it."""


def draw_film(run: Recorded, field: str, pictures_a_second: int, most: int, path: Path) -> int:
    """Write a film of at most so many of the stored frames, evenly picked; returns how many.

    field: one of FIELDS. path: ends in one of WRITERS. Raises OutputError: the run has no frames,
    or not this field, there is no ffmpeg for an mp4, or the disk refuses.
    """
    frames = run.frames
    if frames is None or len(frames) == 0:
        raise OutputError("the run has stored no frames to make a film of")
    refuse_missing_field(frames, field)
    writer = WRITERS[path.suffix]
    if not writer.isAvailable():
        raise OutputError(
            f"there is no program to write {path.suffix}", hint="install ffmpeg, or write a .gif"
        )
    indices = picked(frames, most)
    pressure = single_pressure(run.history)
    body = pictures(frames, indices, field)
    colours, extend = shared_scale(body.values)
    view = body.view
    aspect = (view[3] - view[2]) / (view[1] - view[0])
    height = float(np.clip(PAGE_WIDTH * aspect + 1.2, *HEIGHTS))
    with matplotlib.rc_context(STYLE), explained(path):
        figure = Figure(figsize=(PAGE_WIDTH, height), layout="constrained", dpi=RESOLUTION)
        FigureCanvasAgg(figure)
        axes = figure.subplots()
        add_scale(figure, axes, colours, extend, FIELDS[field].label)
        film = writer(fps=pictures_a_second)
        with film.saving(figure, str(path), RESOLUTION):
            for number, index in enumerate(indices):
                axes.clear()
                show(axes, body, state(frames.times[index], run.history["time"], pressure))
                body.draw(axes, number, colours)
                body.label([axes], [axes])
                film.grab_frame()
    return len(indices)


def picked(frames: Frames, most: int) -> list[int]:
    """Frames in which a node still has a place, at most so many, evenly picked, both ends among
    them.
    """
    even = np.unique(np.linspace(0, len(frames) - 1, min(most, len(frames))).round().astype(int))
    displacement = frames.point_data["displacement"]
    return [int(k) for k in even if np.isfinite(displacement[int(k)]).all(axis=1).any()]
