"""The command line: softsim run, check, fit-material, report, schema, devices."""

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from softsim.errors import SoftsimError

app = typer.Typer(
    no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False,
    help="Explicit finite elements for soft robots.",
)  # fmt: skip

ScenePath = Annotated[Path, typer.Argument(help="Scene file (YAML).", show_default=False)]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Override a value, such as time.end='2 s'."),
]

# Element updates a second assumed by `check` for the predicted duration, until a later version
# measures it: what a two-core machine of 2024 does with the whole increment.
ASSUMED_RATE = 35e6


class DeviceName(str, Enum):
    """Where to run."""

    auto = "auto"
    cpu = "cpu"
    cuda = "cuda"


class LawName(str, Enum):
    """Which law to fit: the names in `softsim.materials.laws.LAWS`."""

    yeoh = "yeoh"
    neo_hooke = "neo_hooke"


class Precision(str, Enum):
    """Precision of state and forces."""

    f64 = "f64"


@app.command()
def run(
    scene: ScenePath,
    overrides: Overrides = None,
    out: Annotated[Path | None, typer.Option(help="Run folder; default: runs/SCENE.")] = None,
    device: Annotated[DeviceName, typer.Option(help="Where to run.")] = DeviceName.auto,
    precision: Annotated[Precision, typer.Option(help="Number format.")] = Precision.f64,
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the checkpoint.")] = False,
) -> None:
    """Run a scene: numbers, curves and pictures into a run folder."""
    with _explained() as console:
        from softsim.run import run as run_scene  # Taichi starts here, not for --help

        folder = out or Path("runs") / scene.stem
        try:
            run_scene(scene, overrides or [], folder, device.value, resume, console)
        finally:
            # A stopped run keeps its pictures too; nothing to draw is no second failure.
            _draw(folder, console)
        _print_summary(console, folder)


@app.command()
def check(scene: ScenePath, overrides: Overrides = None) -> None:
    """Check a scene and say how large it is, its stable step, and how long it will take."""
    with _explained() as console:
        from softsim.builder import build_model
        from softsim.mesh.mesh import Mesh
        from softsim.mesh.quality import quality
        from softsim.scene.loading import load_scene
        from softsim.solver.time_step import stable_increment

        loaded = load_scene(scene, overrides or [])
        model = build_model(loaded)
        stable = stable_increment(model, model.points)
        increment = model.increment or model.safety_factor * stable.value
        increments = model.end_time / increment
        table = Table(show_header=False, box=None)
        shape = {2: "triangles", 3: "tetrahedra"}[model.dimension]
        for body in model.bodies:
            q = quality(Mesh(body.points, body.cells))
            table.add_row(
                f"body '{body.name}'",
                f"{q.node_count} nodes, {q.cell_count} {shape}, smallest altitude "
                f"{q.smallest_altitude * 1e3:.3g} mm, angles {_degrees(q.smallest_angle)} to "
                f"{_degrees(q.largest_angle)}, {body.volumes.sum() * 1e6:.4g} ml, "
                f"{body.volumes.sum() * body.material.density * 1e3:.4g} g"
                + (f", {q.piece_count} unconnected pieces" if q.piece_count > 1 else ""),
            )
            for remark in body.remarks:
                table.add_row("  from its file", remark)
            sets = ", ".join(f"{k} ({len(v)})" for k, v in sorted(body.node_sets.items()))
            table.add_row("  node sets", sets)
            sets = ", ".join(f"{k} ({len(v)})" for k, v in sorted(body.facet_sets.items()))
            table.add_row("  facet sets", sets)
        table.add_row("stable step", stable.describe())
        table.add_row("time step", f"{increment * 1e6:.3g} us, {increments:.3g} increments")
        seconds = increments * model.element_count / ASSUMED_RATE
        table.add_row(
            "expected", f"about {_duration(seconds)} at {ASSUMED_RATE / 1e6:g} M element updates/s"
        )
        console.print(table)
        console.print(f"{scene}: fine")


@app.command()
def fit_material(
    file: Annotated[Path, typer.Argument(help="Table of a uniaxial test.", show_default=False)],
    max_strain: Annotated[float, typer.Option(help="Fit up to this strain; 1 is 100 %.")],
    law: Annotated[LawName, typer.Option(help="Strain-energy law.")] = LawName.yeoh,
    min_strain: Annotated[float, typer.Option(help="Leave out the slack below it.")] = 0.1,
    terms: Annotated[int | None, typer.Option(help="Fit so many constants; default: all.")] = None,
    out: Annotated[Path | None, typer.Option(help="Figure; default: FILE_LAW.png here.")] = None,
    strain_column: Annotated[str, typer.Option(help="Its heading.")] = "Engineering Strain",
    stress_column: Annotated[str, typer.Option(help="Its heading.")] = "Engineering Stress",
    stress_unit: Annotated[
        str | None, typer.Option(help="Such as MPa; default: as the heading says.")
    ] = None,
    delimiter: Annotated[str | None, typer.Option(help="Default: ; or , or tab.")] = None,
) -> None:
    """Fit a material's constants to a tensile test, and say how well and how far they hold."""
    with _explained() as console:
        from softsim.materials.fitting import fit_law
        from softsim.materials.laws import LAWS
        from softsim.materials.tensile import read_tensile_test
        from softsim.report.fit import draw_fit, fit_rows, scene_snippet

        test = read_tensile_test(file, strain_column, stress_column, stress_unit, delimiter)
        fit = fit_law(test, LAWS[law.value], max_strain, min_strain, terms)
        figure = out or Path(f"{file.stem}_{law.value}.png")
        draw_fit(test, fit, figure)
        table = Table(show_header=False, box=None)
        for row in fit_rows(fit):
            table.add_row(*row)
        console.print(table)
        console.print(f"figure  {figure}", highlight=False)
        print(f"\n{scene_snippet(test, fit, law.value)}")


@app.command()
def report(folder: Annotated[Path, typer.Argument(help="Run folder.")]) -> None:
    """Draw the figures of a run folder again."""
    with _explained() as console:
        _draw(folder, console)


@app.command()
def schema() -> None:
    """Print the JSON schema of scene files, with which an editor completes and checks keys."""
    from softsim.scene.schema import scene_json_schema

    print(json.dumps(scene_json_schema(), indent=2))


@app.command()
def devices() -> None:
    """Say which devices there are and which one `auto` takes."""
    with _explained() as console:
        from softsim import backend

        has_cuda = backend.cuda_is_present()
        console.print(f"cpu   {backend.processor_count()} cores")
        console.print(f"cuda  {'present' if has_cuda else 'none answers'}")
        console.print(f"auto takes {'cuda' if has_cuda else 'cpu'}")


def _draw(folder: Path, console: Console) -> None:
    """All figures of a run folder that has something to draw."""
    if not (folder / "history.csv").is_file():
        return
    from softsim.report.figures import draw_all

    summary_file = folder / "summary.json"
    field = "stretch"
    if summary_file.is_file():
        field = json.loads(summary_file.read_text("utf-8")).get("snapshot_field", field)
    for figure in draw_all(folder, field):
        console.print(f"figure  {figure}", highlight=False)


def _print_summary(console: Console, folder: Path) -> None:
    summary = json.loads((folder / "summary.json").read_text("utf-8"))
    table = Table(show_header=False, box=None)
    shown: dict[str, Callable[[Any], str]] = {
        "simulated_time": lambda v: f"{v:.4g} s",
        "wall_time": _duration,
        "element_count": str,
        "increments": str,
        "element_updates_per_second": lambda v: f"{v / 1e6:.1f} M",
        "energy_error": lambda v: f"{100.0 * v:.3f} %",
        "rows_in_contact": lambda v: f"at most {v:g}",
        "frame_displacement": lambda v: f"{v * 1e3:.4g} mm",
        "displacement_per_cycle": lambda v: ", ".join(f"{x * 1e3:.4g} mm" for x in v),
    }
    for name, write in shown.items():
        if summary.get(name) is not None:
            table.add_row(name.replace("_", " "), write(summary[name]))
    console.print(table)
    console.print(f"results in {folder}", highlight=False)


@contextmanager
def _explained() -> Iterator[Console]:
    """A console for the command; an error for the user ends it with its exit code."""
    console = Console()
    try:
        yield console
    except SoftsimError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(error.exit_code) from error


def _degrees(angle: float) -> str:
    return f"{angle * 57.29577951308232:.0f} deg"


def _duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.1f} s"
    return f"{int(seconds // 60)} min {int(seconds % 60)} s"


def main() -> None:
    """Entry point of the `softsim` command."""
    app()


if __name__ == "__main__":
    main()
