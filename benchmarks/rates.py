"""Rates of the solver against the ceiling, measured in turn.

The speed of a shared machine drifts. Ours and the ceiling's are measured one after the other in
several rounds of many short pieces, and the best piece of each counts: the one disturbed least.
"""

import functools
from pathlib import Path

from benchmarks import scenes
from benchmarks.ceiling import Ceiling, Problem, finished, write_problem
from benchmarks.effort import Effort
from benchmarks.solver_process import SolverProcess
from benchmarks.table import Row, limit_row, ratio_row
from softsim.builder import build_model
from softsim.scene.loading import load_scene
from softsim.solver.stable_step import stable_step

MEGA = 1e6
# Of a round [s]. Other processes interrupt every few milliseconds; the ceiling's pieces can be
# shorter, as no call from Python starts them. That it is disturbed less does not flatter us.
PIECE = 4e-3
CEILING_PIECE = 2e-3
OF_A_ROBOT = "the ceiling has its elements and material, not its contact, loads and rigid frame"


def bare_problem(scene: Path, folder: Path) -> Problem:
    """The bare work of a scene, at the time step its run begins with."""
    model = build_model(load_scene(scene))
    increment = model.safety_factor * stable_step(model, model.points).value
    return write_problem(folder / f"{scene.stem}.bin", model, increment)


def one_run(folder: Path, program: Path | None, effort: Effort) -> list[Row]:
    """The robot's section with everything its scene has, of a thousand triangles, on one core: of
    the hundred quadrilaterals that it ships with, elements take less than half of the time.
    """
    scene = scenes.pfr_of_triangles(folder)
    with SolverProcess(scene) as solver:
        ceiling = _ceiling(scene, folder, program, threads=1)
        rate, highest = _in_turn(solver, ceiling, effort)
        name = f"PFR, {solver.element_count} triangles, 1 thread"
    return [ratio_row(name, rate, highest, 0.5, OF_A_ROBOT)]


def robot_in_space(folder: Path, program: Path | None, effort: Effort) -> list[Row]:
    """The whole robot with everything its scene has, on one thread and on two: what the bare bar
    of `tetrahedra` leaves out.
    """
    rows, scene = [], scenes.pfr_in_space(folder)
    for threads in (1, 2):
        with SolverProcess(scene, threads=threads) as solver:
            ceiling = _ceiling(scene, folder, program, threads)
            rate, highest = _in_turn(solver, ceiling, effort)
            name = f"PFR in space, {solver.element_count} hexahedra, {_counted(threads)}"
        rows.append(ratio_row(name, rate, highest, 0.4, OF_A_ROBOT))
    return rows


def two_runs(folder: Path, program: Path | None, effort: Effort) -> list[Row]:
    """Two such runs at once, one a core, against one alone."""
    scene = scenes.pfr_of_triangles(folder)
    ceiling = _ceiling(scene, folder, program, threads=1)
    alone, together, highest_alone, highest_together = [], [], [], []
    with SolverProcess(scene) as one, SolverProcess(scene) as other:
        count = one.increments_for(effort.seconds)
        ceiling_count = 1 if ceiling is None else ceiling.increments_for(effort.seconds)
        for _ in range(effort.rounds):
            one.start(count)
            alone.append(one.rate())
            for solver in (one, other):
                solver.start(count)
            together.append(one.rate() + other.rate())
            if ceiling is not None:
                highest_alone.append(finished(ceiling.started(ceiling_count, 1))["best"])
                both = [ceiling.started(ceiling_count, 1) for _ in range(2)]
                highest_together.append(sum(finished(run)["best"] for run in both))
    ratio = max(together) / max(alone)
    remark = f"the ratio is over one alone, {max(alone) / MEGA:.4g} M/s"
    highest = None
    if ceiling is not None:
        highest = max(highest_together) / MEGA
        remark += f"; the ceiling's two over one: {max(highest_together) / max(highest_alone):.3g}"
    return [
        Row(
            "two PFR runs at once, their sum", max(together) / MEGA, "M/s",
            highest, ratio, ">= 1.9", ratio >= 1.9, remark,
        )
    ]  # fmt: skip


def large_meshes(
    kind: str, target: float, folder: Path, program: Path | None, effort: Effort
) -> list[Row]:
    """Two sizes of plain mesh on two threads, and the memory that they take."""
    rows, sizes = [], []
    for count in effort.counts:
        scene = scenes.block(folder, kind, count)
        with SolverProcess(scene, threads=2) as solver:
            sizes.append((solver.element_count, solver.peak_memory))
            ceiling = _ceiling(scene, folder, program, threads=2)
            rate, highest = _in_turn(solver, ceiling, effort)
            name = f"{solver.element_count} {kind}, 2 threads"
        rows.append(ratio_row(name, rate, highest, target))
    return rows + _memory_rows(kind, *sizes)


def _memory_rows(
    kind: str, small: tuple[int, int | None], large: tuple[int, int | None]
) -> list[Row]:
    """Peak memory is a base and a share for each element; measured with its solver ready."""
    if small[1] is None or large[1] is None:
        return []
    each = (large[1] - small[1]) / (large[0] - small[0])
    base = small[1] - each * small[0]
    return [
        limit_row(f"memory of one of the {kind}", each / 1e3, "kB", 1.5),
        limit_row(f"memory besides ({kind})", base / MEGA, "MB", 300.0),
    ]


def _counted(threads: int) -> str:
    return "1 thread" if threads == 1 else f"{threads} threads"


def _ceiling(scene: Path, folder: Path, program: Path | None, threads: int) -> Ceiling | None:
    return None if program is None else Ceiling(program, bare_problem(scene, folder), threads)


def _in_turn(
    solver: SolverProcess, ceiling: Ceiling | None, effort: Effort
) -> tuple[float, float | None]:
    """Best rates [M element updates/s] of the solver and the ceiling."""
    count, pieces = solver.increments_for(PIECE), round(effort.seconds / PIECE)
    ceiling_pieces = round(effort.seconds / CEILING_PIECE)
    ceiling_count = 1 if ceiling is None else ceiling.increments_for(CEILING_PIECE)
    ours, highest = [], []
    for _ in range(effort.rounds):
        solver.start(count, pieces)
        ours.append(solver.rate())
        if ceiling is not None:
            highest.append(finished(ceiling.started(ceiling_count, ceiling_pieces))["best"])
    return max(ours) / MEGA, max(highest) / MEGA if highest else None


triangle_rows = functools.partial(large_meshes, "triangles", 0.5)
quadrilateral_rows = functools.partial(large_meshes, "quadrilaterals", 0.5)
tetrahedron_rows = functools.partial(large_meshes, "tetrahedra", 0.4)
hexahedron_rows = functools.partial(large_meshes, "hexahedra", 0.4)
