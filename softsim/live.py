"""Live view of a running simulation in a browser.

It requires the extra `live` (`pip install 'softsim[live]'`), the package viser. The server accepts
connections of this machine only. Its callbacks run in threads of their own: they change `Controls`
alone, which the run reads between its blocks of increments.
"""

import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import to_rgb

from softsim.errors import SimulationError
from softsim.model import Model
from softsim.output.fields import Frames
from softsim.output.observation import columns, description, present_frames, several_chambers
from softsim.report.body import (
    CAMERA,
    LINES,
    around,
    corners_of_box,
    crosses_at,
    is_axisymmetric,
    lines_at,
    mirrored,
    outlines_at,
    places_at,
    plane_picture,
    rigid_faces_at,
    rim,
    seen_walls,
    skin_of,
)
from softsim.report.diagram import FIELDS, MILLI, shades, shared_scale
from softsim.report.page.robot import (
    NO_VALUE,
    SEE_THROUGH,
    SHADES,
    triangles,
    walls_move,
)
from softsim.report.style import COLOURS, FRAME, INK, PALE, QUIET, WALL
from softsim.run.callbacks import Rows
from softsim.run.control import Adjustable, LoadCommands
from softsim.run.loop import Run
from softsim.run.record import CHANGED_BY_HAND
from softsim.run.simulation import Simulation
from softsim.scene.outputs import probe_columns
from softsim.units import KINDS, format_quantity, size_of, unit_of, usual_unit

if TYPE_CHECKING:
    from viser import (
        GuiApi,
        GuiUplotHandle,
        LineSegmentsHandle,
        MeshHandle,
        ViserServer,
    )

HOST, PORT = "127.0.0.1", 8080
"""Address that only this machine reaches, and the first port that is tried."""

POLLING = 0.1
"""Longest time [s] without a look at the controls while the run is held."""

PICTURE_INTERVAL, DRAWING_SHARE = 0.1, 0.2
"""Shortest wall time [s] between pictures, and largest fraction of it spent on them."""

TOLERANCE = 0.1
"""Fraction of a display interval by which a picture may be early: rows do not end exactly on it."""

RANGE = 1.5
"""Ratio of the end of a slider to the largest value in the scene."""

MOST_POINTS = 2000
"""Number of rows of a curve beyond which every second one is left out."""

SIZE = 10.0
"""Size of the body in the scene of the browser, whose camera sees from 0.01 to 1000."""

WIDE = 1.2
"""Ratio of width to height of the part of the window that the panel leaves free, about."""

FIELD_OF_VIEW = np.radians(25.0)
"""Vertical angle of the camera; small, so that plane models look flat."""

PRESSURES = "pressure of all chambers"

BY_HAND = (
    "Follows the scene until you move it; from then on your value acts, and the results are not "
    "those of the scene. A new value is reached within one display interval."
)


def view(simulation: Simulation, port: int = PORT) -> "LiveView":
    """Open a live view of a simulation.

    Parameters
    ----------
    simulation : Simulation
        Simulation, which the view shows during each `step`.
    port : int
        Port of the server; the next free one is taken.

    Returns
    -------
    LiveView
        View; a notebook shows it as the last expression of a cell.

    Raises
    ------
    SimulationError
        The package viser is not installed.

    Examples
    --------
    >>> from softsim import Simulation
    >>> from softsim.live import view
    >>> simulation = Simulation("block.yaml")
    >>> shown = view(simulation)
    >>> shown.address.startswith("http://127.0.0.1:")
    True
    >>> simulation.step(2e-3)
    >>> shown.close()
    """
    opened = LiveView(port)
    simulation.watch(opened)
    return opened


class Controls:
    """Settings of a view: its threads change them, and the run reads them between its blocks."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._paused, self._steps, self._goal = False, 0, -np.inf
        self._values: dict[str, float] = {}
        self._is_stale = False
        self.interval = 0.0
        """Simulated time [s] between pictures, and length of a step."""

    @property
    def paused(self) -> bool:
        """True if the run is to be held, but for single steps."""
        return self._paused

    def set_paused(self, paused: bool) -> None:
        """Hold the run at the end of its block of increments, or let it continue."""
        with self._changed:
            self._paused, self._steps, self._goal = paused, 0, -np.inf
            self._changed.notify_all()

    def step(self) -> None:
        """Let a run that is held advance by one display interval."""
        with self._changed:
            self._steps += self._paused
            self._changed.notify_all()

    def set_value(self, load: str, value: float) -> None:
        """Change the value of a load, in SI units."""
        with self._changed:
            self._values[load] = value
            self._changed.notify_all()

    def redraw(self) -> None:
        """Request a new picture, of a run that is held too."""
        with self._changed:
            self._is_stale = True
            self._changed.notify_all()

    def take_values(self) -> dict[str, float]:
        """Return the values set since the last call."""
        with self._changed:
            taken, self._values = self._values, {}
            return taken

    def take_redraw(self) -> bool:
        """Return True if a picture was requested since the last call."""
        with self._changed:
            stale, self._is_stale = self._is_stale, False
            return stale

    def holds(self, now: float) -> bool:
        """Return True if the run must not go on from `now` [s]; begin a requested step."""
        with self._changed:
            if not self._paused or now < self._goal - TOLERANCE * self.interval:
                return False
            if self._steps:
                self._steps -= 1
                self._goal = now + self.interval
                return False
            return True

    def wait(self, longest: float) -> None:
        """Wait until a setting changes, or for the given time [s]."""
        with self._changed:
            self._changed.wait(longest)


class LiveView:
    """Live view of a run or a simulation: a monitor with a server for browsers of this machine.

    Parameters
    ----------
    port : int
        Port of the server; if it is taken, the next free one is used.

    Raises
    ------
    SimulationError
        The package viser is not installed.

    Examples
    --------
    >>> from pathlib import Path
    >>> from softsim.live import LiveView
    >>> from softsim.run import run
    >>> with LiveView() as shown:
    ...     results = run("block.yaml", out=Path("runs/block"), monitors=[shown])
    >>> results.summary["status"]
    'done'
    """

    def __init__(self, port: int = PORT) -> None:
        self.controls = Controls()
        self._server = opened_server(port)
        self.panel = ControlPanel(self._server.gui, self.controls)
        self.shown: RunView | None = None

    @property
    def address(self) -> str:
        """Address for a browser on this machine."""
        return f"http://{HOST}:{self._server.get_port()}"

    def close(self) -> None:
        """Stop the server."""
        with quiet_viser():
            self._server.stop()

    def __enter__(self) -> "LiveView":
        """Return the view itself; the end of the block closes it."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop the server."""
        self.close()

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.address}" width="100%" height="600"></iframe>'

    def start(self, run: Run) -> None:
        """Show the start of a run in place of the one shown before.

        Parameters
        ----------
        run : Run
            Run at its beginning.
        """
        if self.shown is not None:
            self.shown.remove()
            self.controls.take_values()  # of its sliders, which come too late
        self.controls.interval = run.output.history_interval
        self.shown = RunView(run, self._server, self.panel, self.controls)
        self.shown.draw()

    def update(self, run: Run, signals: Sequence[int]) -> None:
        """Apply the controls, draw if that is due, and hold the run as long as it is paused.

        Parameters
        ----------
        run : Run
            Run between two blocks of increments.
        signals : sequence of int
            Signals received so far; the first one ends a pause.
        """
        if self.shown is None or self.shown.run is not run:
            self.start(run)
        assert self.shown is not None
        self.shown.update(signals)


def opened_server(port: int) -> "ViserServer":
    """Return a running server for this machine, on the first free port from `port` on.

    Raises SimulationError if viser is not installed.
    """
    try:
        import viser
    except ImportError as error:
        raise SimulationError(
            f"the live view needs the package viser ({error})", hint="pip install 'softsim[live]'"
        ) from None
    with quiet_viser():
        server = viser.ViserServer(host=HOST, port=port, verbose=False)
    server.gui.configure_theme(show_logo=False, show_share_button=False)
    server.gui.main_panel.dock_right()
    server.scene.set_up_direction("+y")
    return server


@contextmanager
def quiet_viser() -> Iterator[None]:
    """Suppress the messages that viser prints when a server starts or stops."""
    import rich

    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before


# -------------------------------------------------------------------------------------------------
# The panel: state, controls, sliders of loads, and a curve over time.


class ControlPanel:
    """Panel of a view: state, pause and step, and settings of the picture."""

    def __init__(self, gui: "GuiApi", controls: Controls) -> None:
        self._controls = controls
        self._state = gui.add_markdown("*compiling kernels ...*")
        self._pause: Any = gui.add_button(
            "Pause", hint="Hold the simulation at the end of its block of increments; it waits."
        )
        self._step = gui.add_button(
            "Step", disabled=True, hint="Advance by one display interval, while paused."
        )
        self._interval: Any = gui.add_number(
            "display interval [ms]", 1.0, min=0.0, hint="Simulated time between two pictures."
        )
        self._field: Any = gui.add_dropdown("colour", tuple(FIELDS), hint="Field shown by colours.")
        self._follow = gui.add_checkbox("follow the body", False, hint="Keep it at its place.")
        self._legend = gui.add_html("")
        self._pause.on_click(lambda _: self.set_paused(not controls.paused))
        self._step.on_click(lambda _: controls.step())
        self._interval.on_update(lambda _: self._set_interval())
        self._field.on_update(lambda _: controls.redraw())
        self._follow.on_update(lambda _: controls.redraw())

    @property
    def field(self) -> str:
        """Field shown by colours."""
        return str(self._field.value)

    @property
    def follows_body(self) -> bool:
        """True if the body stays in the middle of the picture."""
        return self._follow.value

    def set_paused(self, paused: bool) -> None:
        """Hold the run, or let it continue."""
        self._pause.label = "Continue" if paused else "Pause"
        self._step.disabled = not paused
        self._controls.set_paused(paused)

    def _set_interval(self) -> None:
        self._controls.interval = 1e-3 * self._interval.value

    def take_settings(self, field: str) -> None:
        """Show the settings of a run: its display interval, and the field of its figures."""
        self._interval.value = 1e3 * self._controls.interval
        self._field.value = field

    def show(self, state: str, low: float, high: float) -> None:
        """Show the state of the run, and the range of the colours."""
        self._state.content = state
        self._legend.content = legend(self.field, low, high)


class RunView:
    """View of one run: its picture, sliders of its loads, and a curve over time."""

    def __init__(
        self, run: Run, server: "ViserServer", panel: ControlPanel, controls: Controls
    ) -> None:
        self.run, self._server, self._panel, self._controls = run, server, panel, controls
        title = run.files.loaded.scene.title
        server.gui.set_panel_label(title or "softsim")
        panel.take_settings(run.output.snapshot_field)
        self.sliders = {
            load.name: LoadSlider(server.gui, load, controls)
            for load in LoadCommands(run).adjustable
        }
        self.curve = Curve(server.gui, run.model, controls)
        earlier = run.files.rows()  # of a run that is resumed, too
        for values in zip(*earlier.values(), strict=True):
            self.curve.note(dict(zip(earlier, values, strict=True)))
        self.curve.note(run.callback(Rows).row)
        self._described = description(run.model, title)
        self.picture = LivePicture(server, present_frames(run.scenario, self._described))
        self._latest = run.scenario.time
        self._drawn_at, self._next_picture = -np.inf, -np.inf
        self._restart_clock()

    def remove(self) -> None:
        """Remove everything that belongs to this run."""
        self.picture.remove()
        self.curve.remove()
        for slider in self.sliders.values():
            slider.handle.remove()

    def update(self, signals: Sequence[int]) -> None:
        """Apply the controls, draw if that is due, and hold the run as long as it is paused."""
        now = self.run.scenario.time
        if now < self._latest:
            self._return_to(now)
        self._latest = now
        self.curve.note(self.run.callback(Rows).row)
        self._apply()
        is_held = self._controls.holds(now)
        if is_held or self.run.outcome is not None or self._is_due(now):
            self.draw()
        while is_held and not signals:
            self._controls.wait(POLLING)
            self._apply()
            if self._controls.take_redraw():
                self.draw()
            is_held = self._controls.holds(now)
            self._restart_clock()

    def _return_to(self, now: float) -> None:
        """Show a simulation that has returned to an earlier time [s], with its loads then."""
        self.curve.forget_after(now)
        self._drawn_at = -np.inf
        for slider in self.sliders.values():
            slider.is_moved = False

    def _is_due(self, now: float) -> bool:
        interval = (1.0 - TOLERANCE) * self._controls.interval
        has_moved = now >= self._drawn_at + interval and bool(self._server.get_clients())
        return has_moved and time.monotonic() >= self._next_picture

    def _apply(self) -> None:
        """Pass the values of moved sliders to the run, which warns that they were changed."""
        values = self._controls.take_values()
        if self.run.outcome is not None:
            return  # nothing is computed any more
        step_start = self.run.model.start_time  # each step has warnings of its own
        for name, value in values.items():
            self.sliders[name].load.change(value, self._controls.interval)
            with self.run.files.logged():
                self.run.files.warn(
                    {
                        f"{CHANGED_BY_HAND} after {step_start} s: {name}": "t = "
                        f"{self.run.scenario.time:.6g} s: the load '{name}' was changed by hand "
                        "in the live view; the results are not those of the scene"
                    }
                )

    def draw(self) -> None:
        """Draw the present state, with its time, the values of loads, and the curve."""
        began = time.monotonic()
        self._controls.take_redraw()
        frames = present_frames(self.run.scenario, self._described)
        with self._server.atomic():
            low, high = self.picture.draw(frames, self._panel.field, self._panel.follows_body)
            self._panel.show(self._state(), low, high)
            for slider in self.sliders.values():
                slider.follow()
            self.curve.draw()
        self._restart_clock()
        self._drawn_at = self.run.scenario.time
        ended = time.monotonic()
        self._next_picture = ended + max(PICTURE_INTERVAL, (ended - began) / DRAWING_SHARE)

    def _restart_clock(self) -> None:
        """Measure the speed of the run from now on."""
        self._clock = time.monotonic(), self.run.scenario.time

    def _state(self) -> str:
        """Return time, end time and speed of the run as text."""
        now, end = self.run.scenario.time, self.run.model.end_time
        if self.run.outcome is not None:
            progress = "ended"
        elif self._controls.paused:
            progress = "paused"
        else:
            speed = (now - self._clock[1]) / (time.monotonic() - self._clock[0])
            progress = f"{speed:.3g} s/s"
        return f"**t = {now:.4g} of {end:.4g} s**, {progress}"


class LoadSlider:
    """Slider of a load: it shows the present value until it is moved."""

    def __init__(self, gui: "GuiApi", load: Adjustable, controls: Controls) -> None:
        self.load, self.is_moved, self._controls = load, False, controls
        unit = unit_of(format_quantity(load.high, load.unit)) if load.high else load.unit
        self._size = size_of(unit, load.unit)
        high = RANGE * load.high / self._size or SIZE
        step = 10.0 ** np.floor(np.log10(high) - 2.0)
        self._high = min(np.ceil(high / step) * step, load.limit / self._size)
        self._low = min(0.0, RANGE * load.low / self._size)
        self.handle: Any = gui.add_slider(
            f"{load.name} [{unit}]", self._low, self._high, step, self._shown(), hint=BY_HAND
        )
        self.handle.on_update(self._moved)

    def _shown(self) -> float:
        return float(np.clip(self.load.value() / self._size, self._low, self._high))

    def _moved(self, event: Any) -> None:
        if event.client is not None:  # not by `follow`
            self.move(event.target.value)

    def move(self, value: float) -> None:
        """Set the load to a value, in the unit of the slider."""
        self.is_moved = True
        value = float(np.clip(value, self._low, self._high))
        self._controls.set_value(self.load.name, min(value * self._size, self.load.limit))

    def follow(self) -> None:
        """Show the present value of the load, unless the slider was moved."""
        if not self.is_moved:
            self.handle.value = self._shown()


class Curve:
    """Curve of columns of the history over time: pressures of all chambers, or one column."""

    def __init__(self, gui: "GuiApi", model: Model, controls: Controls) -> None:
        self._gui, self._units = gui, columns(model)
        self.rows: list[dict[str, float]] = []
        self._stride, self._passed = 1, 0
        several = {PRESSURES: list(several_chambers(model))} if len(model.pressures) > 1 else {}
        self._choices = several | {name: [name] for name in self._units if name != "time"}
        probes = [probe_columns(p.name, p.kind, "xyz"[: model.dimension])[0] for p in model.probes]
        first = [*several, *(["pressure"] if "pressure" in self._units else []), *probes]
        self._chosen = gui.add_dropdown(
            "curve", tuple(self._choices), initial_value=(*first, "kinetic_energy")[0]
        )
        self._chosen.on_update(lambda _: controls.redraw())
        self._drawn, self._plot = "", self._new_plot()

    def remove(self) -> None:
        """Remove the curve from the panel."""
        self._chosen.remove()
        self._plot.remove()

    def note(self, row: dict[str, float]) -> None:
        """Add a row of the history, unless it is the last one or left out among many."""
        if not row or (self.rows and row["time"] <= self.rows[-1]["time"]):
            return
        self._passed += 1
        if self._passed % self._stride == 0:
            self.rows.append(row)
        if len(self.rows) > MOST_POINTS:
            self.rows = self.rows[::2]
            self._stride *= 2

    def forget_after(self, now: float) -> None:
        """Remove the rows after a time [s]."""
        self.rows = [row for row in self.rows if row["time"] <= now]

    def draw(self) -> None:
        """Show the rows so far."""
        if self._drawn != self._chosen.value:
            self._plot.remove()
            self._plot = self._new_plot()
        self._plot.data = self._data()

    def _data(self) -> tuple[np.ndarray, ...]:
        """Return times [s] and values of the chosen columns in their usual units, (rows,) each."""
        names = self._choices[self._chosen.value]
        table = [np.array([row[name] for row in self.rows]) for name in ("time", *names)]
        return (table[0], *(t / self._unit(n)[1] for n, t in zip(names, table[1:], strict=True)))

    def _unit(self, name: str) -> tuple[str, float]:
        """Return the usual unit of a column and its size in SI units."""
        si = self._units[name]
        return (usual_unit(si), size_of(usual_unit(si), si)) if si in KINDS else ("", 1.0)

    def _new_plot(self) -> "GuiUplotHandle":
        self._drawn = self._chosen.value
        names = self._choices[self._drawn]
        lines: list[Any] = [
            {"label": f"{name} [{self._unit(name)[0]}]".removesuffix(" []"), "stroke": colour,
             "width": 2}
            for name, colour in zip(names, cycle(COLOURS), strict=False)
        ]  # fmt: skip
        return self._gui.add_uplot(
            self._data(), ({"label": "time [s]"}, *lines), scales={"x": {"time": False}},
            legend={"show": True}, aspect=1.6,
        )  # fmt: skip


def legend(field: str, low: float, high: float) -> str:
    """Return the colour scale of a field with its range, as HTML."""
    colours = ", ".join(
        f"{colour} {100 * k / SHADES:g}% {100 * (k + 1) / SHADES:g}%"
        for k, colour in enumerate(shades(SHADES))
    )
    return (
        f'<div style="font-size: 0.8em; padding: 0.3em 1em">{FIELDS[field].label}'
        f'<div style="height: 1em; background: linear-gradient(to right, {colours})"></div>'
        f'<div style="display: flex; justify-content: space-between"><span>{low:.4g}</span>'
        f"<span>{high:.4g}</span></div></div>"
    )


# -------------------------------------------------------------------------------------------------
# The picture: bodies, walls and lines of one frame, from the extraction of figures and page.

MODEL = "/model"
"""Node of the browser's scene that holds everything."""

AMBIENT = 0.6
"""Fraction of the light in space that comes from all sides."""

BEHIND, ABOVE = -0.02, 0.002
"""Depth of walls, and height of lines, relative to plane bodies as a fraction of their size."""


class LivePicture:
    """Picture of a run in the scene of a server.

    Cells of a plane model are drawn in the plane z = 0, the body in space by its surface. Faces of
    one colour of the scale are one mesh. The scale covers the values of all pictures since the
    field was chosen.
    """

    def __init__(self, server: "ViserServer", frames: Frames) -> None:
        self._server, self.scene, self.d = server, server.scene, frames.points.shape[1]
        self.skin, self.is_mirrored = skin_of(frames), is_axisymmetric(frames)
        self.size = float(np.ptp(frames.points, axis=0).max()) * MILLI
        self._meshes: dict[str, MeshHandle] = {}
        self._lines: dict[str, LineSegmentsHandle] = {}
        self._field, self._range = "", (np.inf, -np.inf)
        self._seen = np.full((2, self.d), np.nan)  # box around which walls are drawn
        self.root = self.scene.add_frame(MODEL, show_axes=False)
        self._light()
        self._aim(frames)

    def remove(self) -> None:
        """Remove everything from the scene."""
        self.root.remove()

    def draw(self, frames: Frames, field: str, follows_body: bool) -> tuple[float, float]:
        """Draw the frame, coloured by a field; return the range of the scale."""
        places = places_at(frames, 0)[self.skin.nodes]
        places = places[np.isfinite(places).all(axis=1)]
        if len(places):
            around_it = np.concatenate([places, rigid_places(frames)])
            box = np.stack([around_it.min(axis=0), around_it.max(axis=0)])
            self._draw_walls(frames, box, field)
            centre = places.mean(axis=0) if follows_body else self.centre
            self.root.position = tuple(-SIZE / self.size * self._in_space(centre))
        self._draw_bodies(frames, field)
        self._draw_lines(frames)
        return self._range

    def _draw_bodies(self, frames: Frames, field: str) -> None:
        corners = places_at(frames, 0)[self.skin.faces]
        values = self.skin.values(frames, [0], field)[0]
        low, high = self._widened(values, field)
        colours = (*shades(SHADES), NO_VALUE)
        with np.errstate(invalid="ignore"):
            levels = np.floor((values - low) / ((high - low) or 1.0) * SHADES)
        levels = np.where(np.isfinite(values), levels.clip(0, SHADES - 1), SHADES).astype(int)
        known = np.isfinite(corners).all(axis=(1, 2))
        for k, colour in enumerate(colours):
            faces = corners[known & (levels == k)]
            self._mesh(f"body/{k}", faces, to_rgb(colour))
            if self.is_mirrored:
                pale = np.array(to_rgb(colour))
                self._mesh(f"mirror/{k}", mirrored(faces), pale + PALE * (1.0 - pale))
        if self.d == 3:
            vertices, faces = rigid_faces_at(frames, 0)
            self._mesh("rigid", vertices[faces], to_rgb(FRAME))

    def _widened(self, values: np.ndarray, field: str) -> tuple[float, float]:
        """Return the range of the scale, widened to the values of this picture."""
        low, high = self._range if field == self._field else (np.inf, -np.inf)
        if np.isfinite(values).any():
            now = shared_scale(values)[0].get_clim()
            low, high = min(low, now[0]), max(high, now[1])
        self._field, self._range = field, (low, high)
        return low, high

    def _draw_lines(self, frames: Frames) -> None:
        edges = places_at(frames, 0)[self.skin.rim]
        if self.is_mirrored:
            edges = np.concatenate([edges, mirrored(edges)])
        self._line("edges", edges, INK, 1.0)
        if self.d == 2:
            self._line("outlines", line_segments(outlines_at(frames, 0), 2), INK, 2.0)
        for kind, lines in lines_at(frames, 0).items():
            look = LINES[kind]
            self._line(kind, line_segments(lines, self.d), look.colour, look.pixels)

    def _draw_walls(self, frames: Frames, box: np.ndarray, field: str) -> None:
        """Draw the walls near a body in a box (2, d) [mm], unless the last ones still serve."""
        is_inside = bool(((box >= self._seen[0]) & (box <= self._seen[1])).all())
        if is_inside and not walls_move(frames, np.array([0])):
            return
        corners = around(corners_of_box(box)) if self.d == 3 else box
        self._seen = box + np.array([[-0.25], [0.25]]) * np.ptp(box, axis=0).max()
        if self.d == 3:
            flat, curved = seen_walls(frames, corners, 0)
            for name, faces in (("flat", flat), ("curved", curved)):
                self._mesh(f"walls/{name}", faces, to_rgb(QUIET), SEE_THROUGH)
            self._line("rims", rim(flat), QUIET, 1.0)
            return
        picture = plane_picture(frames, [0], field)
        solids = picture.solids(self._seen.T.ravel(), 0)
        quads = np.concatenate([np.zeros((0, 4, 2)), *(solid.quads for solid in solids)])
        self._mesh("walls", quads, to_rgb(WALL), depth=BEHIND)
        self._line("faces", line_segments([solid.face for solid in solids], 2), INK, 2.0)
        self._line("centre lines", picture.centre_lines, QUIET, 1.0)

    def _light(self) -> None:
        """Light a plane body evenly, one in space from above; no face is lighter than the scale.

        three.js divides the light that a surface reflects by pi.
        """
        self.scene.configure_default_lights(False)
        self.scene.configure_environment_map(None)
        ambient = 1.0 if self.d == 2 else AMBIENT
        self.scene.add_light_ambient(f"{MODEL}/ambient", intensity=np.pi * ambient)
        self.scene.add_light_directional(
            f"{MODEL}/sun", intensity=np.pi * (1.0 - ambient), position=tuple(CAMERA.source)
        )

    def _aim(self, frames: Frames) -> None:
        """Point the cameras of present and later browsers at the body and what is around it."""
        if self.d == 2:
            view = plane_picture(frames, [0], next(iter(frames.cell_data))).view.reshape(2, 2)
            self.centre, reach, towards = view.mean(axis=1), np.ptp(view, axis=1), np.eye(3)[2]
            reach = max(reach[1], reach[0] / WIDE)
        else:
            body = places_at(frames, 0)[self.skin.nodes]
            places = np.concatenate([body, rigid_places(frames)])
            self.centre = 0.5 * (places.min(axis=0) + places.max(axis=0))
            reach, towards = 1.2 * float(np.linalg.norm(np.ptp(places, axis=0))), CAMERA.towards
        distance = 0.5 * reach * SIZE / self.size / np.tan(0.5 * FIELD_OF_VIEW)
        cameras = [client.camera for client in self._server.get_clients().values()]
        camera: Any
        for camera in (self._server.initial_camera, *cameras):
            camera.up = (0.0, 1.0, 0.0)
            camera.position = tuple(distance * towards)
            camera.look_at = (0.0, 0.0, 0.0)
            camera.fov = FIELD_OF_VIEW

    # --- nodes of the scene ----------------------------------------------------------------------

    def _mesh(
        self, name: str, faces: np.ndarray, colour: Any, opacity: float | None = None,
        depth: float = 0.0,
    ) -> None:  # fmt: skip
        """Show faces (k, 3|4, d) [mm] of a colour, 0 to 1, in place of the mesh of that name."""
        if len(faces) == 0 and name not in self._meshes:
            return
        vertices = self._in_browser(triangles(faces).reshape(-1, self.d), depth)
        numbers = np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)
        if name not in self._meshes:
            self._meshes[name] = self.scene.add_mesh_simple(
                f"{MODEL}/{name}", vertices, numbers, color=tuple(colour), opacity=opacity,
                flat_shading=True, side="double", cast_shadow=False, receive_shadow=False,
            )  # fmt: skip
            return
        mesh = self._meshes[name]
        mesh.visible = len(faces) > 0
        if len(faces):
            mesh.vertices, mesh.faces = vertices, numbers

    def _line(self, name: str, lines: np.ndarray, colour: str, width: float) -> None:
        """Show lines (k, 2, d) [mm] of a width [px] in place of those of that name."""
        known = lines[np.isfinite(lines).all(axis=(1, 2))]
        before = self._lines.get(name)
        if len(known) == 0:
            if before is not None:
                before.visible = False
            return
        points = self._in_browser(known, ABOVE)
        if before is not None and before.points.shape == points.shape:
            before.points, before.visible = points, True
            return
        self._lines[name] = self.scene.add_line_segments(
            f"{MODEL}/lines/{name}", points, to_rgb(colour), thickness=width,
            thickness_units="screen",
        )  # fmt: skip

    def _in_browser(self, places: np.ndarray, depth: float) -> np.ndarray:
        """Return places (..., d) [mm] in the units of the browser's scene (..., 3).

        depth: coordinate z of a plane model, as a fraction of its size.
        """
        found = self._in_space(places)
        if self.d == 2:
            found[..., 2] = depth * self.size
        return (SIZE / self.size * found).astype(np.float32)

    def _in_space(self, places: np.ndarray) -> np.ndarray:
        """Return places (..., d) with three coordinates."""
        return np.concatenate([places, np.zeros((*places.shape[:-1], 3 - self.d))], axis=-1)


def rigid_places(frames: Frames) -> np.ndarray:
    """Return the places (n, d) [mm] of the surfaces and crosses of rigid bodies."""
    vertices, crosses = rigid_faces_at(frames, 0)[0], crosses_at(frames, 0)
    return np.concatenate([vertices, crosses.reshape(-1, vertices.shape[1])])


def line_segments(lines: Sequence[np.ndarray], d: int) -> np.ndarray:
    """Return polylines (n, d) as single lines (k, 2, d)."""
    found = [np.stack([line[:-1], line[1:]], axis=1) for line in lines]
    return np.concatenate([np.zeros((0, 2, d)), *found])
