"""Commands on small vibrations about an equilibrium: natural modes and harmonic response."""

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.console import Console

from softsim.cli.options import DeviceName, Overrides, Threads, explained
from softsim.errors import ModesError, Option, SceneError, StabilityError

if TYPE_CHECKING:  # Taichi is for those who compute forces
    from softsim.compute.machine import Choice
    from softsim.run.equilibrium import LoadRange, MotorResponse
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
    device: Annotated[DeviceName, typer.Option(help="Device to run on.")] = DeviceName.auto,
    threads: Threads = "auto",
) -> None:
    """Compute the natural modes of a scene about its equilibrium under load.

    The scene is loaded statically, without its motors. Prestress, pressure and contact take part:
    what touches stays in contact. Files: modes.json, modes.csv and modes.png with the shapes; with
    --over frequencies.csv and frequencies.png.
    """
    with explained() as console:
        from softsim.compute.machine import choose
        from softsim.run.equilibrium import LoadRange

        choice = choose(device.value, threads)
        loads = [LoadRange.read(text, "--load") for text in load or []]
        folder = out or Path("runs") / f"{scene.stem}_loaded_modes"
        if over is None:
            _modes_at(scene, overrides or [], loads, at, count, friction, folder, choice, console)
        else:
            varied = LoadRange.read(over, "--over")
            if varied.low == varied.high:
                raise SceneError(
                    f"'{over}' is one value", "write two: --over air='0..23 kPa'",
                    Option(f"--over {over}"),
                )  # fmt: skip
            _modes_over(
                scene, overrides or [], loads, at, varied, points, count, friction, folder, choice,
                console,
            )  # fmt: skip


def response(
    scene: Annotated[Path, typer.Argument(help="Scene file (YAML).", show_default=False)],
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
    device: Annotated[DeviceName, typer.Option(help="Device to run on.")] = DeviceName.auto,
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
        from softsim.compute.machine import choose
        from softsim.output.folder import RunFolder
        from softsim.report.vibrations import draw_responses
        from softsim.run.equilibrium import (
            LoadRange,
            Preloaded,
            frequency_range,
            motors,
            scene_with_loads,
        )
        from softsim.statics.response import HarmonicResponse

        asked = None if frequencies is None else frequency_range(frequencies, "--frequencies")
        loads = [LoadRange.read(text, "--load") for text in load or []]
        loaded = scene_with_loads(scene, overrides or [], loads, at=at)
        acting = motors(loaded)
        state = Preloaded(loaded, choose(device.value, threads))
        state.reach(state.end)
        of = HarmonicResponse(state.vibrations(friction.value))
        console.print(
            f"equilibrium at t = {state.end:.6g} s; {of.vibrations.contact.in_words()}",
            highlight=False, soft_wrap=True,
        )  # fmt: skip
        found = []
        for name, motor in acting.items():
            own = motor.rotor.frequency
            low, high = asked or (0.1 * own, 2.0 * own)
            several = np.linspace(low, high, points)
            if low < own < high:
                several = np.union1d(several, own)
            taken = track(several, name, console=console, transient=True)
            found.append(state.response(of, name, motor, taken))
            console.print(response_table(found[-1]))
            for text in found[-1].remarks():
                console.print(text, highlight=False, soft_wrap=True)
        folder = RunFolder(out or Path("runs") / f"{scene.stem}_response")
        folder.write_text_atomic("response.csv", _response_rows(found))
        draw_responses(found, folder.path / "response.png")
        console.print(f"results in {folder.path}", highlight=False)


def _modes_at(
    scene: Path, overrides: list[str], loads: "list[LoadRange]", at: str | None, count: int,
    friction: FrictionState, folder: Path, choice: "Choice", console: Console,
) -> None:  # fmt: skip
    """Print and draw the modes at one equilibrium."""
    from softsim.cli.run_tables import modes_remarks, modes_table
    from softsim.output.folder import RunFolder
    from softsim.report.vibrations import draw_modes

    state, where = _preloaded(scene, overrides, loads, at, choice)
    found = state.vibrations(friction.value).modes(count)
    console.print(f"equilibrium {where}", highlight=False)
    console.print(modes_remarks(found), highlight=False, soft_wrap=True)
    for text in found.remarks():
        console.print(text, highlight=False, soft_wrap=True)
    console.print(modes_table(found))
    target = RunFolder(folder)
    target.write_json_atomic("modes.json", _content(found) | {"scene": str(scene), "at": where})
    target.write_text_atomic("modes.csv", _rows([(None, found)], None))
    draw_modes([found], target.path / "modes.png", f"equilibrium {where}")
    console.print(f"results in {folder}", highlight=False)


def _preloaded(
    scene: Path, overrides: list[str], loads: "list[LoadRange]", at: str | None, choice: "Choice"
) -> tuple[Any, str]:
    """Return the equilibrium of a scene or run folder, and its loads in words."""
    from softsim.run.equilibrium import (
        Preloaded,
        refuse_dynamic,
        scene_of_run,
        scene_with_loads,
    )

    if scene.is_dir():
        given = {"--set": overrides, "--load": loads, "--at": at}
        for option, value in given.items():
            if value:
                raise ModesError(
                    f"{option} does not go with a run folder, whose run has its loads",
                    hint="give the scene file instead",
                )
        loaded = scene_of_run(scene)
        refuse_dynamic(loaded, scene)
        state = Preloaded(loaded, choice)
        state.take_up(scene)
        return state, f"of {scene} at t = {state.time:.6g} s"
    state = Preloaded(scene_with_loads(scene, overrides, loads, at=at), choice)
    state.reach(state.end)
    under = [f"{load.name} = {load.shown(load.high)}" for load in loads]
    return state, ", ".join([f"at t = {state.end:.6g} s", *under])


def _modes_over(
    scene: Path, overrides: list[str], loads: "list[LoadRange]", at: str | None,
    over: "LoadRange", points: int, count: int, friction: FrictionState, folder: Path,
    choice: "Choice", console: Console,
) -> None:  # fmt: skip
    """Print and draw the frequencies of modes over a load, as far as there are equilibria."""
    from softsim.output.folder import RunFolder
    from softsim.report.vibrations import draw_frequencies
    from softsim.run.equilibrium import Preloaded, motor_frequencies, scene_with_loads
    from softsim.statics.modes import lines_of, zero_crossings

    if scene.is_dir():
        raise ModesError("--over needs a scene file, not a run folder")
    loaded = scene_with_loads(scene, overrides, loads, over, at)
    state, target = Preloaded(loaded, choice), RunFolder(folder)
    values: list[float] = []
    found: list[LoadedModes] = []
    stopped: StabilityError | None = None
    for value in over.values(points).tolist():
        try:
            state.reach(over.fraction_of_time(value) * state.end)
        except StabilityError as error:
            stopped = error
            break
        found.append(state.vibrations(friction.value).modes(count))
        values.append(value)
        shown = ", ".join(f"{f:.4g}" for f in sorted(m.dynamic_frequency for m in found[-1].modes))
        touching = found[-1].contact.touching
        contact = f", {touching} points touch" if touching else ""
        console.print(
            f"{over.name} = {over.shown(value)}: {shown} Hz{contact}",
            highlight=False,
            soft_wrap=True,
        )
    if stopped is not None and not found:
        raise stopped
    for text in found[-1].remarks():
        console.print(text, highlight=False, soft_wrap=True)
    lines = lines_of(found)
    buckling = zero_crossings(values, found, lines)
    for value in buckling:
        console.print(
            f"a frequency goes through zero at {over.name} = {over.shown(value)}: there the model "
            "buckles, or passes a limit point",
            highlight=False, soft_wrap=True,
        )  # fmt: skip
    title = f"{over.name} [{over.unit}]" if over.unit else over.name
    target.write_text_atomic(
        "frequencies.csv", _rows(list(zip(values, found, strict=True)), title, lines)
    )
    motors = motor_frequencies(loaded)
    draw_frequencies(values, found, lines, title, motors, buckling, target.path / "frequencies.png")
    console.print(f"results in {folder}", highlight=False)
    if stopped is not None:
        raise stopped


def _content(found: "LoadedModes") -> dict[str, Any]:
    """Return the content of modes.json, in SI units."""
    return {
        "contact": vars(found.contact),
        "held_nodes": found.held_count,
        "rigid_motions": found.rigid_motions,
        "stiffness_error": found.stiffness_error,
        "asymmetry": found.asymmetry,
        "modes": [
            {
                "frequency": mode.frequency,
                "dynamic_frequency": mode.dynamic_frequency,
                "damping_ratio": mode.damping_ratio,
                "omega_squared": mode.square,
                "effective_mass_shares": mode.mass_shares,
            }
            for mode in found.loaded
        ],
    }


def _rows(
    found: "list[tuple[float | None, LoadedModes]]", load: str | None, lines: Any = None
) -> str:
    """Return modes as CSV: one row a mode, with the value of the load and its line if given."""
    axes = "xyz"[: found[0][1].body.points.shape[1]]
    head = ["mode", "frequency [Hz]", "dynamic_frequency [Hz]", "damping_ratio"]
    head += [f"effective_mass_{axis}" for axis in axes]
    rows = [",".join([*([load, "line"] if load else []), *head])]
    for k, (value, modes) in enumerate(found):
        for number, mode in enumerate(modes.loaded, start=1):
            cells = [mode.frequency, mode.dynamic_frequency, mode.damping_ratio, *mode.mass_shares]
            first = [f"{value:.8g}", str(lines[k][number - 1] + 1)] if load else []
            rows.append(",".join([*first, str(number), *(f"{cell:.8g}" for cell in cells)]))
    return "\n".join(rows) + "\n"


def _response_rows(found: "list[MotorResponse]") -> str:
    """Return responses as CSV, in SI units and degrees: one row a motor and frequency."""
    columns = list(found[0].amplitudes)
    head = ["motor", "frequency [Hz]", "force [N]", "contact_changes"]
    for column in columns:
        head += [f"{column} amplitude [{found[0].units[column]}]", f"{column} phase [deg]"]
    rows = [",".join(head)]
    for response in found:
        for k, frequency in enumerate(response.frequencies):
            cells = [f"{frequency:.8g}", f"{response.force[k]:.8g}"]
            cells.append(str(response.contact_changes[k]))
            for values in response.amplitudes.values():
                cells += [f"{abs(values[k]):.8g}", f"{np.degrees(np.angle(values[k])):.6g}"]
            rows.append(",".join([response.motor, *cells]))
    return "\n".join(rows) + "\n"
