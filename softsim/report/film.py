"""Film of a run: its stored frames with a common view and colour scale."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.animation import FFMpegWriter
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from PIL import Image
from scipy.spatial import KDTree

from softsim.errors import OutputError
from softsim.output.fields import Frames
from softsim.output.folder import replacing
from softsim.report.colours import FIELDS, refuse_missing_field, shared_scale
from softsim.report.curves import single_pressure
from softsim.report.recorded import Recorded
from softsim.report.snapshots import Pictures, add_scale, pictures, show, state
from softsim.report.style import PAGE_WIDTH, STYLE

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
