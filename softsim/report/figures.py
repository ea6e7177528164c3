"""All figures and texts of a run folder, made from its files alone."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.animation import FFMpegWriter
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from PIL import Image
from scipy.spatial import KDTree

from softsim.analysis.catalogue import CONTACT, DRIVE, MOTION, PRESSURE_CYCLES, RunMeasure
from softsim.analysis.travel import (
    STANDSTILL,
    History,
    displacement,
    has,
    travelling_column,
    travels,
    without_radius,
)
from softsim.errors import OutputError
from softsim.output.fields import Frames, read_frames
from softsim.output.folder import HISTORY, RESULTS, SUMMARY, read_summary, replacing
from softsim.output.history import read_history, read_units
from softsim.report.along_pipe import draw_layout
from softsim.report.body import is_axisymmetric
from softsim.report.curves import (
    QUANTITIES,
    TITLES,
    chamber_pressures,
    contact,
    motion,
    name_and_axis,
    probes,
    pull,
    signals,
    single_pressure,
)
from softsim.report.diagram import (
    FIELDS,
    FLAT,
    Diagram,
    Panel,
    PlotAxis,
    PlotSeries,
    Scale,
    refuse_missing_field,
    shared_scale,
)
from softsim.report.png import draw
from softsim.report.snapshots import (
    Pictures,
    add_scale,
    draw_snapshots,
    moments,
    pictures,
    show,
    state,
)
from softsim.report.style import PAGE_WIDTH, STYLE
from softsim.report.table import Row, Table, cell
from softsim.units import size_of, usual_unit

# -------------------------------------------------------------------------------------------------
# Readable text of the summary of a run and of single numbers.


def duration(seconds: float) -> str:
    """Return a readable time span."""
    if seconds < 90.0:
        return f"{seconds:.1f} s"
    minutes = int(seconds // 60)
    if minutes < 90:
        return f"{minutes} min {int(seconds % 60)} s"
    return f"{minutes // 60} h {minutes % 60} min"


def track(told: Mapping[str, float | None]) -> str:
    """Return the speed and curvature of a robot's track over the ground."""
    if told["speed"] is None or told["turning_rate"] is None:
        return "run too short to measure"
    side = "left" if told["turning_rate"] > 0.0 else "right"
    bent = told["curvature"]
    circle = "" if bent is None else f", curvature {1e-3 * abs(bent):.3g} 1/mm"
    turning = f"{abs(told['turning_rate']):.3g} rad/s to the {side}"
    return f"{1e3 * told['speed']:.3g} mm/s forward, {turning}{circle}"


def millimetres(length: float) -> str:
    """Return a length [m] in mm, rounded to 0 if it is round-off."""
    return f"{length * 1e3 if abs(length) > STANDSTILL else 0.0:.4g} mm"


@dataclass(frozen=True)
class Line:
    """Line of a readable summary; about: an explanation of its name, or empty."""

    name: str
    value: str
    about: str = ""


@dataclass(frozen=True)
class Entry:
    """Notation of a value of summary.json; label: its readable name, by default the key."""

    write: Callable[[Any], str]
    about: str = ""
    label: str = ""


THREE_DIGITS = ("m/s", "m^2", "N")
"""SI units of measures that are written with three digits; others have four."""

IN_WORDS: dict[str, Callable[[Any], str]] = {
    "rows_in_contact": lambda v: f"at most {v:g}",
    "row_contact_shares": lambda v: (
        ", ".join("-" if s is None else f"{100.0 * s:.0f}" for s in v) + " % of the time"
    ),
    "slip_share": lambda v: f"{100.0 * v:.0f} % of the normal impulse",
}
"""Notation of the measures that need more than a number with a unit."""


def entry_of(measure: RunMeasure) -> Entry:
    """Return the notation of a measure of the catalogue: numbers in the usual unit, or words."""
    si = measure.kind.unit
    unit = usual_unit(si) if si else ""
    size = size_of(unit, si) if si else 1.0
    digits = 3 if si in THREE_DIGITS else 4

    def number(value: float | None) -> str:
        if value is None:
            return "no motion"
        return f"{value / size:.{digits}g} {unit}" if unit else f"{value:g}"

    def numbers(values: Sequence[float | None]) -> str:
        return ", ".join(map(number, values))

    write = IN_WORDS.get(measure.name, numbers if measure.kind.listed else number)
    return Entry(write, measure.about, measure.label)


def entries_of(measures: Iterable[RunMeasure]) -> dict[str, Entry]:
    """Return the notation of those measures that have a line on the page, by key."""
    return {measure.name: entry_of(measure) for measure in measures if measure.on_page}


MOVED = entries_of(MOTION) | {"track": Entry(track)}
"""Notation of the results on motion other than the displacement, by key."""

FOUND = {"ended_by": Entry(str)} | entries_of((*PRESSURE_CYCLES, *CONTACT, *DRIVE))
"""Notation of all other results, by key."""

COMPUTED = {
    "simulated_time": Entry(lambda v: f"{v:.4g} s"),
    "wall_time": Entry(duration),
    "element_count": Entry(str, label="elements"),
    "increments": Entry(str),
    "element_updates_per_second": Entry(lambda v: f"{v / 1e6:.1f} M"),
    "phases": Entry(
        lambda v: ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in v.items()),
        "Fractions of the time of an increment.",
    ),
    "energy_error": Entry(
        lambda v: f"{100.0 * v:.3f} %",
        "Largest error of the energy balance, relative to the largest energy.",
    ),
    "largest_penetration": Entry(
        lambda v: f"{100.0 * v:.2g} % of the element size",
        "Largest penetration of a node into a wall, relative to the element size there.",
        label="penetration of walls",
    ),
    "largest_body_penetration": Entry(
        lambda v: f"{100.0 * v:.2g} % of the element size",
        "Largest penetration of a body into another body, relative to the element size there.",
        label="penetration of bodies",
    ),
}
"""Notation of the data on how a run was computed, by key."""

NOTHING = (
    "cycles_done", "rows_in_contact", "mean_contact_area", "largest_penetration",
    "largest_body_penetration",
)  # fmt: skip
"""Keys that are omitted if zero: no pressure cycles, no contact."""

COMPONENTS = {"x": "in x", "y": "in y", "z": "in z", "radial": "in the mean radius"}
"""Direction in words by the last part of the key of a displacement."""


def findings(summary: Mapping[str, Any], units: Mapping[str, str]) -> Iterator[Line]:
    """Yield the results of a run: verdicts, displacements and probes first.

    Empty values are left out.

    Parameters
    ----------
    summary : mapping
        Content of summary.json.
    units : mapping of str to str
        Column of the history -> unit.
    """
    for name in ("layout", "crossing"):
        if summary.get(name) is not None:
            yield Line(name, summary[name]["sentence"])
    yield from displacements(summary)
    yield from written(summary, MOVED)
    yield from probe_lines(summary, units)
    yield from written(summary, FOUND)


def written(summary: Mapping[str, Any], entries: Mapping[str, Entry]) -> Iterator[Line]:
    """Yield the lines of the entries that a summary has values for."""
    for key, entry in entries.items():
        value = summary.get(key)
        if value not in (None, []) and not (key in NOTHING and value == 0):
            yield Line(entry.label or key.replace("_", " "), entry.write(value), entry.about)


def displacements(summary: Mapping[str, Any]) -> Iterator[Line]:
    """Yield the distance and direction of the displacement of the frame, or else of the body."""
    name = "frame" if summary.get("frame_displacement") is not None else "body"
    key = f"{name}_displacement"
    value, axis = summary.get(key), summary.get(f"{key}_axis")
    if value is None:
        return
    direction = "" if axis is None else f" {COMPONENTS[axis]}"
    words = [f"{millimetres(value)}{direction}"]
    for end, other_direction in COMPONENTS.items():
        other = summary.get(f"{key}_{end}") or 0.0
        if end != axis and abs(other) > STANDSTILL:
            words.append(f"{millimetres(other)} {other_direction}")
    of = "the frame" if name == "frame" else "the centre of mass of all meshed bodies"
    yield Line(
        f"{name} displacement",
        ", ".join(words),
        f"Displacement of {of} from the start to the end of the run.",
    )
    speed = summary.get("body_speed")
    if name == "body" and speed is not None and abs(value) > STANDSTILL:
        about = "Mean velocity of the centre of mass over the last tenth of the run."
        yield Line("body speed at the end", f"{speed * 1e3:.3g} mm/s{direction}", about)


def probe_lines(summary: Mapping[str, Any], units: Mapping[str, str]) -> Iterator[Line]:
    """Yield the last reading of each probe and its range."""
    lowest, highest = summary.get("probes_min", {}), summary.get("probes_max", {})
    for column, last in summary.get("probes", {}).items():
        unit = units.get(column, "")
        _, factor, shown = QUANTITIES.get(unit, ("", 1.0, unit))
        none = STANDSTILL if unit == "m" else 0.0  # what round-off explains
        values = [
            f"{value * factor if abs(value) > none else 0.0:.4g}"
            for value in (last, lowest.get(column), highest.get(column))
            if value is not None
        ]
        if last is None:
            continue
        words = f"{values[0]} {shown}".rstrip()
        if len(values) == 3:
            words += f" at the end, from {values[1]} to {values[2]}"
        yield Line(" ".join(name_and_axis(column, unit)).rstrip(), words)


# -------------------------------------------------------------------------------------------------
# Table of a robot's path through a layout, for a page or a console.


SEGMENT_COLUMNS = {
    "from [mm]": ("start", 1e3, ".0f"),
    "to [mm]": ("end", 1e3, ".0f"),
    "centre enters [s]": ("entered", 1.0, ".2f"),
    "centre leaves [s]": ("left", 1.0, ".2f"),
    "mean speed [mm/s]": ("mean_speed", 1e3, ".1f"),
    "most rows": ("most_rows_in_contact", 1.0, ".0f"),
    "least gap [mm]": ("least_clearance", 1e3, ".2f"),
}
"""Name in the report, factor to the unit and format, by heading.

from, to: arc lengths of the centre line; speed: mean; rows: of spikes; gap: between frame and wall.
"""

SEGMENTS_CAPTION = (
    "Path of the centre of the robot through the layout. Most rows: largest number of rows "
    "of spikes in contact at once. Least gap: smallest distance between frame and wall"
)


def segments(report: Mapping[str, Any]) -> Table:
    """Return the table of a robot's path through a layout, one row per segment.

    report: `layout` of the summary. Cells of segments that were not reached are empty.
    """
    rows: list[Row] = []
    for segment in report["segments"]:
        numbers = [
            cell(None if segment[name] is None else segment[name] * factor, written)
            for name, factor, written in SEGMENT_COLUMNS.values()
        ]
        branch = f" ({segment['branch']})" if len(report["exits"]) > 1 else ""
        rows.append([f"{segment['segment']}{branch}  {segment['what']}", *numbers])
    return Table(rows, ["segment", *SEGMENT_COLUMNS], SEGMENTS_CAPTION)


# -------------------------------------------------------------------------------------------------
# Content of a run folder for its report.


@dataclass(frozen=True)
class Recorded:
    """Recorded run.

    history: columns (rows,) with their units; frames: None if the run wrote no fields; summary:
    empty if there is none yet.
    """

    history: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    frames: Frames | None
    summary: Mapping[str, Any]

    @property
    def layout(self) -> Mapping[str, Any] | None:
        """Report of a run along a pipe if its frames can be located in the pipe, otherwise None."""
        shows = self.frames is not None and "path" in self.frames.described and len(self.frames) > 0
        return self.summary.get("layout") if shows and has(self.history, "arc_length") else None


def recorded(folder: Path) -> Recorded:
    """Open a run folder.

    Raises OutputError if the history is missing or empty, or a file is damaged.
    """
    history, units = dict(read_history(folder / HISTORY)), read_units(folder / HISTORY)
    if len(history["time"]) == 0:
        raise OutputError(
            f"{folder / HISTORY} has no rows yet, so there is nothing to draw",
            hint="the run was stopped before its first sample: run longer, or reduce "
            "output.history_interval",
        )
    frames = read_frames(folder / RESULTS) if (folder / RESULTS).exists() else None
    if frames is not None and is_axisymmetric(frames):
        history = without_radius(history)
    return Recorded(history, units, frames, read_summary(folder))


SNAPSHOTS, LAYOUT = "snapshots.png", "layout.png"


def draw_all(folder: Path, snapshot_field: str) -> list[Path]:
    """Draw the figures for which the files of `folder` have data; return the figures' paths.

    snapshot_field: the field that colours the snapshots: stretch, von_mises, pressure,
    displacement. A run without field output has no snapshots, one without contact no contact
    figure; such a figure left by an earlier run is deleted. Raises OutputError if the history
    is missing or empty, the results lack `snapshot_field`, or a file cannot be written.
    """
    run = recorded(folder)
    history, frames = run.history, run.frames
    drawn, curves = [], signals(history, run.units)
    for name in TITLES:
        path = folder / f"{name}.png"
        if name in curves:
            draw(path, curves[name])
            drawn.append(path)
        else:
            path.unlink(missing_ok=True)
    if frames is not None:
        time = history["time"]
        # Only a robot, which has a frame, starts to move; a body that merely deforms does not.
        walks = travels(history) and travelling_column(history).startswith("frame")
        moved = displacement(history) if walks else np.zeros(len(time))
        at, air = moments(time, chamber_pressures(history), moved), single_pressure(history)
        draw_snapshots(frames, at, time, air, snapshot_field, folder / SNAPSHOTS)
        drawn.append(folder / SNAPSHOTS)
    if frames is not None and run.layout is not None:
        draw_layout(history, frames, run.layout, folder / LAYOUT)
        drawn.append(folder / LAYOUT)
    else:
        (folder / LAYOUT).unlink(missing_ok=True)
    return drawn


# -------------------------------------------------------------------------------------------------
# Film of a run: its stored frames with a common view and colour scale.

RESOLUTION = 110
"""Resolution of a film [dots per inch], lower than that of a picture."""

HEIGHTS = 1.6, 6.0
"""Smallest and largest height of a film [inch], including title and colour scale."""

LAYOUTS = 3
"""Number of layout passes until the layout converges.

Axes of equal scale change size after the first pass.
"""

PALETTE_FRAMES = 5
"""Number of evenly spaced frames that define the palette of a GIF."""


def draw_film(run: Recorded, field: str, pictures_a_second: int, most: int, path: Path) -> int:
    """Write a film of at most `most` evenly spaced stored frames; return their number.

    field: one of FIELDS. path: ends in one of WRITERS. Raises OutputError if the run has no
    frames or lacks the field, ffmpeg is missing for an mp4, or the file cannot be written.
    """
    frames = run.frames
    if frames is None or len(frames) == 0:
        raise OutputError("the run has no stored frames, so there is no film")
    refuse_missing_field(frames, field)
    if path.suffix == ".mp4" and not FFMpegWriter.isAvailable():
        raise OutputError(
            f"no program to write {path.suffix} files was found",
            hint="install ffmpeg, or write a .gif",
        )
    indices = picked(frames, most)
    pressure = single_pressure(run.history)
    body = pictures(frames, indices, field)
    colours, extend = shared_scale(body.values)
    view = body.view
    aspect = (view[3] - view[2]) / (view[1] - view[0])
    height = float(np.clip(PAGE_WIDTH * aspect + 1.2, *HEIGHTS))
    with matplotlib.rc_context(STYLE), replacing(path) as partial:
        figure = Figure(figsize=(PAGE_WIDTH, height), layout="constrained", dpi=RESOLUTION)
        axes = figure.subplots()
        add_scale(figure, axes, colours, extend, FIELDS[field].label)
        titles = [state(frames.times[k], run.history["time"], pressure) for k in indices]
        images = drawn(figure, axes, body, titles, colours)
        WRITERS[path.suffix](images, pictures_a_second, partial)
    return len(indices)


def drawn(
    figure: Figure,
    axes: Axes,
    body: Pictures,
    titles: Sequence[str],
    colours: ScalarMappable,
) -> Iterator[np.ndarray]:
    """Draw the frames of `body` in sequence as RGB images (height, width, 3).

    Axes and colour scale are laid out and drawn once. Only the body, its walls, the title and
    the spines between them are redrawn for each frame.
    """
    canvas = FigureCanvasAgg(figure)
    show(axes, body, titles[0])
    title = axes.set_title(titles[0], y=1.0)  # placed here, not by each layout anew
    kept = set(axes.get_children())
    body.draw(axes, 0, colours)
    of_frame = [artist for artist in axes.get_children() if artist not in kept]
    body.label([axes], [axes])
    for _ in range(LAYOUTS):
        figure.draw_without_rendering()
    figure.set_layout_engine("none")
    spines = axes.spines.values() if axes.axison else ()
    between = [title, *(spine for spine in spines if spine.get_visible())]
    for artist in (*of_frame, *between):
        artist.set_visible(False)
    canvas.draw()
    background = canvas.copy_from_bbox(figure.bbox)
    for artist in between:
        artist.set_visible(True)
    for number, words in enumerate(titles):
        for artist in of_frame:
            artist.remove()
        there = set(axes.get_children())
        body.draw(axes, number, colours)
        of_frame = [artist for artist in axes.get_children() if artist not in there]
        title.set_text(words)
        canvas.restore_region(background)
        for artist in sorted([*of_frame, *between], key=lambda artist: artist.get_zorder()):
            axes.draw_artist(artist)
        yield np.array(canvas.buffer_rgba())[..., :3]


def write_gif(images: Iterable[np.ndarray], pictures_a_second: int, path: Path) -> None:
    """Write RGB images (height, width, 3) as a looping GIF with one palette for all."""
    shown = list(images)
    samples = np.unique(np.linspace(0, len(shown) - 1, PALETTE_FRAMES).astype(int))
    sample = Image.fromarray(np.concatenate([shown[k] for k in samples]))
    palette = sample.quantize().getpalette() or []
    nearest = nearest_colours(np.array(palette).reshape(-1, 3))
    first, *others = (Image.fromarray(nearest[tuple(np.moveaxis(i >> 2, 2, 0))]) for i in shown)
    for picture in (first, *others):
        picture.putpalette(palette)
    duration = 1000 // pictures_a_second
    first.save(path, "GIF", save_all=True, append_images=others, duration=duration, loop=0)


def nearest_colours(palette: np.ndarray) -> np.ndarray:
    """Return the index of the nearest of the colours (n, 3), 0 to 255, for each RGB colour.

    The table (64, 64, 64) is indexed by the upper six bits of red, green and blue.
    """
    every = np.indices((64, 64, 64)).reshape(3, -1).T * (255.0 / 63.0)
    return KDTree(palette).query(every)[1].astype(np.uint8).reshape(64, 64, 64)


def write_mp4(images: Iterable[np.ndarray], pictures_a_second: int, path: Path) -> None:
    """Write RGB images (height, width, 3) with ffmpeg, through a figure that shows each."""
    film = FFMpegWriter(fps=pictures_a_second, extra_args=["-f", "mp4"])
    screen = Figure(dpi=RESOLUTION)
    first, *others = images
    screen.set_size_inches(first.shape[1] / RESOLUTION, first.shape[0] / RESOLUTION)
    with film.saving(screen, str(path), RESOLUTION):
        for image in (first, *others):
            screen.images.clear()
            screen.figimage(image)
            film.grab_frame()


WRITERS: dict[str, Callable[[Iterable[np.ndarray], int, Path], None]] = {
    ".gif": write_gif, ".mp4": write_mp4,
}  # fmt: skip
"""Writer of a film by file suffix."""


def picked(frames: Frames, most: int) -> list[int]:
    """Return at most `most` evenly spaced frames with a finite position, including both ends."""
    even = np.unique(np.linspace(0, len(frames) - 1, min(most, len(frames))).round().astype(int))
    displacement = frames.point_data["displacement"]
    return [int(k) for k in even if np.isfinite(displacement[int(k)]).all(axis=1).any()]


# -------------------------------------------------------------------------------------------------
# Figure of a run in steps: the joined histories and the time of each step.

FIGURE = "steps.png"

OF_A_STATIC_STEP = "unbalanced_share"
"""Column that only static steps have."""

A_NAME = 0.12
"""Height of the panel of steps per name, relative to an ordinary panel."""


def draw_steps(folder: Path) -> Path | None:
    """Draw the figure steps.png of the steps in a folder and return it.

    The result is None if no step has started, or nothing changed in any. Raises OutputError if
    a history has no rows, a file is damaged, or the file cannot be written.
    """
    path, diagram = folder / FIGURE, steps_diagram(recorded_steps(folder))
    if diagram is None:
        path.unlink(missing_ok=True)
        return None
    draw(path, diagram)
    return path


def recorded_steps(folder: Path) -> dict[str, Recorded]:
    """Return the steps in a folder that have started, by name."""
    paths = {step["name"]: folder / step["folder"] for step in read_summary(folder)["steps"]}
    # A step that has not has no summary, but maybe the history of an earlier course of the run.
    return {name: recorded(path) for name, path in paths.items() if (path / SUMMARY).is_file()}


def steps_diagram(runs: Mapping[str, Recorded]) -> Diagram | None:
    """Return the diagram of all steps over time, or None if there is nothing to show.

    It shows position, pressure, contact, pull and probes, and below them the time of each step.
    Energies are omitted, because each step starts a new energy balance.
    """
    if not runs:
        return None
    history = joined([run.history for run in runs.values()])
    units = {name: unit for run in runs.values() for name, unit in run.units.items()}
    panels = [*motion(history), *contact(history), *pull(history), *probes(history, units)]
    if not panels:
        return None
    spans = {name: run.history["time"][[0, -1]] for name, run in runs.items()}
    bounds = tuple(float(span[0]) for span in spans.values())[1:]
    is_static = any(OF_A_STATIC_STEP in run.history for run in runs.values())
    time = Scale("time, of a static step that of its loads [s]" if is_static else "time [s]")
    shown = [*panels, when(spans)]
    return Diagram("All steps", time, shown, over_time=True, bounds=bounds)


def joined(histories: Sequence[History]) -> History:
    """Return the joined histories of steps, with NaN in those that lack a column.

    The first row of a later step is omitted: it is the same moment as the last row before,
    without mean values.
    """
    columns = {name for history in histories for name in history} - {OF_A_STATIC_STEP}
    begins = [0] + [1] * (len(histories) - 1)

    def parts(column: str) -> list[np.ndarray]:
        return [
            history.get(column, np.full_like(history["time"], np.nan))[begin:]
            for history, begin in zip(histories, begins, strict=True)
        ]

    return {column: np.concatenate(parts(column)) for column in columns}


def when(spans: Mapping[str, np.ndarray]) -> Panel:
    """Return the panel with a line per step from its start to its end (2,) [s], first on top."""
    names = tuple(spans)[::-1]
    lines = [PlotSeries("", spans[name], np.full(2, float(k))) for k, name in enumerate(names)]
    return Panel(
        PlotAxis(Scale("step", labels=names), lines), height=max(FLAT, A_NAME * len(names))
    )
