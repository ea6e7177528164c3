"""`python -m benchmarks [--json FILE] [--quick]`: the numbers that softsim's speed is judged by."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from benchmarks import environments, rates, studies, sweep_overhead, whole_runs
from benchmarks.ceiling import CeilingError, compiled
from benchmarks.effort import FULL, QUICK, Effort
from benchmarks.flex import OLDEST, flex_rows, mujoco_version
from benchmarks.gpu import gpu_rows
from benchmarks.table import Row, machine, show, write_json
from softsim.compute.machine import cuda_device_count

Measurement = Callable[[Path, Path | None, Effort], list[Row]]
ON_THE_CPU: dict[str, Measurement] = {
    "pfr": rates.one_run,
    "space": rates.robot_in_space,
    "pair": rates.two_runs,
    "triangles": rates.triangle_rows,
    "quadrilaterals": rates.quadrilateral_rows,
    "tetrahedra": rates.tetrahedron_rows,
    "hexahedra": rates.hexahedron_rows,
    "start": whole_runs.start_rows,
    "run": whole_runs.whole_run_rows,
    "study": studies.study_rows,
    "overhead": sweep_overhead.overhead_rows,
    "environments": environments.environment_rows,
}


def main(
    json: Annotated[Path | None, typer.Option(help="Write the rows to this file too.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer rounds, rougher numbers.")] = False,
    only: Annotated[
        list[str] | None, typer.Option(help=f"Of: {', '.join(ON_THE_CPU)}, flex, gpu; repeatable.")
    ] = None,
) -> None:
    """Measure softsim on this machine against a hand-written C++ program."""
    console = Console()
    measurements = dict(ON_THE_CPU)
    if mujoco_version() is not None:
        measurements["flex"] = flex_rows
    else:
        console.print(f"MuJoCo {OLDEST} or later is not installed: the row flex is left out")
    if cuda_device_count() > 0:
        measurements["gpu"] = gpu_rows
    else:
        console.print("no CUDA device answers: the rows of a GPU are left out")
    unknown = sorted(set(only or ()) - set(measurements))
    if unknown:
        raise typer.BadParameter(f"{', '.join(unknown)}: there is {', '.join(measurements)}")
    about, rows = machine(), []
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        program = compiled(folder)
        if program is None:
            console.print("no C++ compiler ($CXX, c++, g++, clang++): no ceiling, no ratios")
        try:
            for name in only or measurements:
                console.print(f"measuring: {name}")
                rows += measurements[name](folder, program, QUICK if quick else FULL)
        except CeilingError as error:
            console.print(f"{name}: {error}", markup=False, highlight=False, soft_wrap=True)
            raise typer.Exit(error.exit_code) from None
        finally:  # what was measured before an error took its time too
            show(console, rows, about)
            if json is not None:
                write_json(json, rows, about)


if __name__ == "__main__":
    typer.run(main)
