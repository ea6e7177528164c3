"""Commands on small vibrations about an equilibrium: natural modes and harmonic response."""

from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.console import Console

from softsim.errors import ModesError, Option, SceneError, StabilityError
from softsim.options import Device, DeviceName, Overrides, ScenePath, Threads, explained
from softsim.report.table import Row, Table, cell

if TYPE_CHECKING:  # Taichi is for those who compute forces
    from softsim.compute.machine import Choice
    from softsim.run.equilibrium import LoadRange, MotorResponse, Preloaded
    from softsim.scene.loading import LoadedScene
    from softsim.statics.modes import LoadedModes

SceneOrRun = Annotated[
    Path, typer.Argument(help="Scene file, or folder of a static run.", show_default=False)
]
At = Annotated[
    str | None,
    typer.Option(metavar="TIME", help="Load time of the equilibrium; default: the end."),
]
Loads = Annotated[
    list[str] | None,
    typer.Option(
        "--load", metavar="NAME=VALUE",
        help="Value of a load, such as air='18 kPa', applied in proportion to time instead of its "
        "profile.",
    ),
]  # fmt: skip


class FrictionState(str, Enum):
    """Friction in small vibrations: points that touch stick, or slide freely."""

    stick = "stick"
    slip = "slip"


FrictionOption = Annotated[
    FrictionState,
    typer.Option(help="Points that touch stick in small vibrations, or slide without friction."),
]


def modes(
    scene: SceneOrRun,
    overrides: Overrides = None,
    at: At = None,
    load: Loads = None,
    over: Annotated[
        str | None,
        typer.Option(
            metavar="NAME=LOW..HIGH",
            help="Load over which frequencies are drawn, such as air='0..23 kPa'.",
        ),
    ] = None,
    points: Annotated[int, typer.Option(min=2, help="Number of values with --over.")] = 12,
    count: Annotated[int, typer.Option(min=1, help="Number of modes.")] = 6,
    friction: FrictionOption = FrictionState.stick,
    out: Annotated[
        Path | None, typer.Option(help="Output folder; default: runs/SCENE_loaded_modes.")
    ] = None,
    device: Device = DeviceName.auto,
    threads: Threads = "auto",
) -> None:
    """Compute the natural modes of a scene about its equilibrium under load.

    The scene is loaded statically, without its motors. Prestress, pressure and contact take part:
    what touches stays in contact. Files: modes.json, modes.csv and modes.png with the shapes; with
    --over frequencies.csv and frequencies.png.
    """
    with explained() as console:
        preload = Preload(scene, overrides or [], at, load or [], friction, device, threads)
        folder = out or Path("runs") / f"{scene.stem}_loaded_modes"
        if over is None:
            _modes_at(preload, count, folder, console)
        else:
            _modes_over(preload, over, points, count, folder, console)


def response(
    scene: ScenePath,
    overrides: Overrides = None,
    at: At = None,
    load: Loads = None,
    frequencies: Annotated[
        str | None,
        typer.Option(
            metavar="LOW..HIGH",
            help="Frequencies, such as '20..250 Hz'; default: up to twice that of the motor.",
        ),
    ] = None,
    points: Annotated[int, typer.Option(min=2, help="Number of frequencies.")] = 100,
    friction: FrictionOption = FrictionState.stick,
    out: Annotated[
        Path | None, typer.Option(help="Output folder; default: runs/SCENE_response.")
    ] = None,
    device: Device = DeviceName.auto,
    threads: Threads = "auto",
) -> None:
    """Compute how far bodies and probes vibrate under the motors of a scene, over frequency.

    The scene is loaded statically. About this equilibrium the response is linear: it is valid for
    small amplitudes, with contact that neither opens nor closes. Files: response.csv with
    amplitudes and phases, and response.png.
    """
    with explained() as console:
        from rich.progress import track

        from softsim.cli.run_tables import response_table
        from softsim.output.folder import RunFolder
        from softsim.report.vibrations import draw_responses
        from softsim.run.equilibrium import Preloaded, frequency_range, motors
        from softsim.statics.modes import HarmonicResponse

        bounds = None if frequencies is None else frequency_range(frequencies, "--frequencies")
        preload = Preload(scene, overrides or [], at, load or [], friction, device, threads)
        loaded = preload.scene()
        acting = motors(loaded)
        state = Preloaded(loaded, preload.choice)
        state.reach(state.end)
        harmonic = HarmonicResponse(state.vibrations(friction.value))
        _say(
            console,
            f"equilibrium at t = {state.end:.6g} s; {harmonic.vibrations.contact.in_words()}",
        )
        responses: list[MotorResponse] = []
        for name, motor in acting.items():
            own = motor.rotor.frequency
            low, high = bounds or (0.1 * own, 2.0 * own)
            computed = np.linspace(low, high, points)
            if low < own < high:
                computed = np.union1d(computed, own)
            tracked = track(computed, name, console=console, transient=True)
            responses.append(state.response(harmonic, name, motor, tracked))
            console.print(response_table(responses[-1]))
            _say(console, *(f"warning: {text}" for text in responses[-1].warnings()))
        folder = RunFolder(out or Path("runs") / f"{scene.stem}_response")
        folder.write_text_atomic("response.csv", _response_rows(responses))
        draw_responses(responses, folder.path / "response.png")
        console.print(f"results in {folder.path}", highlight=False)


@dataclass(frozen=True)
class Preload:
    """Scene under loads, or folder of a static run, as the options of a command give it."""

    path: Path
    overrides: list[str]
    at: str | None
    load: list[str]
    friction: FrictionState
    device: DeviceName
    threads: str

    @cached_property
    def choice(self) -> "Choice":
        """Device and threads."""
        from softsim.compute.machine import choose

        return choose(self.device.value, self.threads)

    @cached_property
    def loads(self) -> "list[LoadRange]":
        """Loads that the options give. Raises SceneError."""
        from softsim.run.equilibrium import LoadRange

        return [LoadRange.read(text, "--load") for text in self.load]

    def scene(self, over: "LoadRange | None" = None) -> "LoadedScene":
        """Return the scene with its loads, `over` rising last. Raises SceneError."""
        from softsim.run.equilibrium import scene_with_loads

        return scene_with_loads(self.path, self.overrides, self.loads, over, self.at)

    def equilibrium(self) -> "tuple[Preloaded, str]":
        """Return the equilibrium, and its time and loads in words."""
        from softsim.run.equilibrium import Preloaded, refuse_dynamic, scene_of_run

        if not self.path.is_dir():
            state = Preloaded(self.scene(), self.choice)
            state.reach(state.end)
            under = [f"{load.name} = {load.shown(load.high)}" for load in self.loads]
            return state, ", ".join([f"at t = {state.end:.6g} s", *under])
        given = {"--set": self.overrides, "--load": self.load, "--at": self.at}
        for option, value in given.items():
            if value:
                raise ModesError(
                    f"{option} does not go with a run folder, whose run has its loads",
                    hint="give the scene file instead",
                )
        loaded = scene_of_run(self.path)
        refuse_dynamic(loaded, self.path)
        state = Preloaded(loaded, self.choice)
        state.take_up(self.path)
        return state, f"of {self.path} at t = {state.time:.6g} s"


def _modes_at(preload: Preload, count: int, folder: Path, console: Console) -> None:
    """Print and draw the modes at one equilibrium."""
    from softsim.cli.run_tables import modes_remarks, modes_table
    from softsim.output.folder import RunFolder
    from softsim.report.vibrations import draw_modes

    state, where = preload.equilibrium()
    modes = state.vibrations(preload.friction.value).modes(count)
    _say(console, f"equilibrium {where}", modes_remarks(modes), *_contact_and_warnings(modes))
    console.print(modes_table(modes))
    target = RunFolder(folder)
    content = _content(modes) | {"scene": str(preload.path), "at": where}
    target.write_json_atomic("modes.json", content)
    target.write_text_atomic("modes.csv", _rows([(None, modes)], None))
    draw_modes([modes], target.path / "modes.png", f"equilibrium {where}")
    console.print(f"results in {folder}", highlight=False)


def _modes_over(
    preload: Preload, over: str, points: int, count: int, folder: Path, console: Console
) -> None:
    """Print and draw the frequencies of modes over a load, as far as there are equilibria."""
    from softsim.output.folder import RunFolder
    from softsim.report.vibrations import draw_frequencies
    from softsim.run.equilibrium import LoadRange, Preloaded, motor_frequencies
    from softsim.statics.modes import lines_of, zero_crossings

    varied = LoadRange.read(over, "--over")
    if varied.low == varied.high:
        raise SceneError(
            f"'{over}' is one value", "write two: --over air='0..23 kPa'", Option(f"--over {over}")
        )
    if preload.path.is_dir():
        raise ModesError("--over needs a scene file, not a run folder")
    loaded = preload.scene(varied)
    state, target = Preloaded(loaded, preload.choice), RunFolder(folder)
    values: list[float] = []
    computed: list[LoadedModes] = []
    stopped: StabilityError | None = None
    for value in varied.values(points).tolist():
        try:
            state.reach(varied.fraction_of_time(value) * state.end)
        except StabilityError as error:
            stopped = error
            break
        modes = state.vibrations(preload.friction.value).modes(count)
        computed.append(modes)
        values.append(value)
        shown = ", ".join(f"{f:.4g}" for f in sorted(m.dynamic_frequency for m in modes.modes))
        touching = modes.contact.touching
        contact = f", {touching} points touch" if touching else ""
        _say(console, f"{varied.name} = {varied.shown(value)}: {shown} Hz{contact}")
    if stopped is not None and not computed:
        raise stopped
    _say(console, *_contact_and_warnings(computed[-1]))
    lines = lines_of(computed)
    buckling = zero_crossings(values, computed, lines)
    for value in buckling:
        _say(
            console,
            f"a frequency goes through zero at {varied.name} = {varied.shown(value)}: there the "
            "model buckles, or passes a limit point",
        )
    title = f"{varied.name} [{varied.unit}]" if varied.unit else varied.name
    rows = _rows(list(zip(values, computed, strict=True)), title, lines)
    target.write_text_atomic("frequencies.csv", rows)
    figure = target.path / "frequencies.png"
    draw_frequencies(values, computed, lines, title, motor_frequencies(loaded), buckling, figure)
    console.print(f"results in {folder}", highlight=False)
    if stopped is not None:
        raise stopped


def _say(console: Console, *sentences: str) -> None:
    """Print sentences, which the terminal wraps."""
    for sentence in sentences:
        console.print(sentence, highlight=False, soft_wrap=True)


def _contact_and_warnings(modes: "LoadedModes") -> list[str]:
    return [modes.contact.in_words(), *(f"warning: {text}" for text in modes.warnings())]


def _content(modes: "LoadedModes") -> dict[str, Any]:
    """Return the content of modes.json, in SI units."""
    return {
        "contact": vars(modes.contact),
        "held_nodes": modes.held_count,
        "rigid_motions": modes.rigid_motions,
        "stiffness_error": modes.stiffness_error,
        "asymmetry": modes.asymmetry,
        "modes": [
            {
                "frequency": mode.frequency,
                "dynamic_frequency": mode.dynamic_frequency,
                "damping_ratio": mode.damping_ratio,
                "omega_squared": mode.square,
                "effective_mass_shares": mode.mass_shares,
            }
            for mode in modes.loaded
        ],
    }


def _rows(
    computed: "list[tuple[float | None, LoadedModes]]", load: str | None, lines: Any = None
) -> str:
    """Return modes as CSV: one row a mode, with the value of the load and its line if given."""
    axes = "xyz"[: computed[0][1].body.points.shape[1]]
    head = ["mode", "frequency [Hz]", "dynamic_frequency [Hz]", "damping_ratio"]
    head += [f"effective_mass_{axis}" for axis in axes]
    rows: list[Row] = []
    for k, (value, modes) in enumerate(computed):
        for number, mode in enumerate(modes.loaded, start=1):
            first = [cell(value, ".8g"), cell(lines[k][number - 1] + 1)] if load else []
            numbers = [mode.frequency, mode.dynamic_frequency, mode.damping_ratio]
            cells = (cell(one, ".8g") for one in (*numbers, *mode.mass_shares))
            rows.append([*first, cell(number), *cells])
    return Table(rows, [*([load, "line"] if load else []), *head]).csv()


def _response_rows(responses: "list[MotorResponse]") -> str:
    """Return responses as CSV, in SI units and degrees: one row a motor and frequency."""
    columns = list(responses[0].amplitudes)
    head = ["motor", "frequency [Hz]", "force [N]", "contact_changes"]
    for column in columns:
        head += [f"{column} amplitude [{responses[0].units[column]}]", f"{column} phase [deg]"]
    rows: list[Row] = []
    for response in responses:
        for k, frequency in enumerate(response.frequencies):
            cells = [cell(number, ".8g") for number in (frequency, response.force[k])]
            cells.append(cell(response.contact_changes[k], "d"))
            for values in response.amplitudes.values():
                phase = cell(np.degrees(np.angle(values[k])), ".6g")
                cells += [cell(abs(values[k]), ".8g"), phase]
            rows.append([response.motor, *cells])
    return Table(rows, head).csv()
