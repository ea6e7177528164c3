"""Tables that the commands print for a scene: its model, the planned run, its results.

The module imports Taichi, so commands import it only when they need it.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from softsim.compute.machine import Choice
from softsim.mesh.mesh import Mesh
from softsim.mesh.quality import quality
from softsim.model import Body, Model
from softsim.options import rows_of_sets
from softsim.output.acting import acting, not_read
from softsim.report.figures import bookkeeping, duration, findings
from softsim.report.table import Cell, Table, cell
from softsim.run.equilibrium import MotorResponse
from softsim.run.pilot import Duration
from softsim.scene.loading import LoadedScene
from softsim.solver.natural_modes import NaturalMode, NaturalModes
from softsim.solver.stable_step import StableStepEstimator, estimator, first_time_increment
from softsim.statics.modes import LoadedMode, LoadedModes
from softsim.units import format_quantity


def summary_table(summary: Mapping[str, Any], units: Mapping[str, str]) -> Table:
    """Return the table of results of a run, followed by how it was computed.

    units: column of the history -> unit.
    """
    lines = [*findings(summary, units), *bookkeeping(summary)]
    rows = [(line.name, line.value) for line in lines]
    warned = len(summary.get("warnings", []))
    if warned:
        rows.insert(0, ("warnings", f"{warned}, listed in summary.json and run.log"))
    return Table(rows)


def wall_time_table(wall_times: Mapping[str, float]) -> Table:
    """Return the table of the wall time of each part of a run, from its summary."""
    whole = sum(wall_times.values())
    rows = [
        [part, cell(seconds, ".2f", " s"), cell(100.0 * seconds / whole, ".1f", " %")]
        for part, seconds in [*wall_times.items(), ("whole", whole)]
    ]
    return Table(rows, ["part", "wall time", "fraction"])


def profile_table(profile: Mapping[str, Any]) -> Table:
    """Return the table of the cost of each pass of an increment, from `profile` of the summary.

    Each pass was measured alone. The remainder of a whole increment has its own row; it is
    negative if the passes alone are slower.
    """
    whole = profile["increment"]
    costs = [
        *sorted(profile["passes"], key=lambda cost: -cost["seconds"]),
        {"phase": "overhead", "name": "not part of a pass", "seconds": profile["unexplained"]},
        {"phase": "increment", "name": "whole increment", "seconds": whole},
    ]
    rows = [
        [
            cost["phase"], cost["name"], cell(cost.get("count"), ","),
            cell(1e6 * cost["seconds"], ".2f"), cell(100.0 * cost["seconds"] / whole, ".1f", " %"),
        ]
        for cost in costs
    ]  # fmt: skip
    return Table(rows, ["phase", "pass", "indices", "us", "fraction"])


def acting_tables(loaded: LoadedScene, model: Model) -> Iterator[Table]:
    """Yield a table of what acts on the bodies, and one of unread keywords of mesh files."""
    titles = "loads, supports and contact", "ignored in mesh files"
    for title, rows in zip(titles, (acting(loaded, model), not_read(model)), strict=True):
        if rows:
            yield Table(rows, title=title)


def model_table(model: Model) -> Table:
    """Return the table of the sizes and sets of bodies, of cables, and of the stable step."""
    rows: list[tuple[str, str]] = []
    for body in model.bodies:
        rows.append((f"body '{body.name}'", _size(body)))
        for region in body.regions:
            part = "" if region.cell_set is None else f" of {region.cell_set}"
            rows.append((f"  material{part}", region.material.describe()))
        rows += [("  changed", remark) for remark in body.remarks]
        sets = rows_of_sets(body.node_sets, body.facet_sets, body.cell_sets)
        rows += [(f"  {kind}", text) for kind, text in sets]
    for structure in model.all_structures:
        rows += structure.description().items()
    if model.mass_scaling is not None:
        unscaled = StableStepEstimator(replace(model, mass_scaling=None)).at_rest.value
        scaling = (
            f"{model.mass_scaling.describe()}; moments of inertia +"
            f"{100.0 * model.added_turning:.3g} %; stable step without it {unscaled * 1e6:.3g} us"
        )
        rows.append(("mass scaling", scaling))
    dt = first_time_increment(model)
    increments = (model.end_time - model.start_time) / dt
    rows += [
        ("stable step", estimator(model).at_rest.describe()),
        ("time step", f"{dt * 1e6:.3g} us, {increments:.3g} increments"),
    ]
    if model.cycles is not None:
        rows.append(("ends", _ending(model.cycles, model.end_time)))
    return Table(rows)


def _ending(cycles: int, end_time: float) -> str:
    plural = "s" if cycles > 1 else ""
    return f"after {cycles} pressure cycle{plural}, or at {end_time:.6g} s at the latest"


def _size(body: Body) -> str:
    q = quality(Mesh(body.points, body.cells))
    volume = sum(region.volumes.sum() for region in body.regions)
    sides = " x ".join(f"{1e3 * side:.4g}" for side in np.ptp(body.points, axis=0))
    return f"{sides} mm, {q.describe()}, {volume * 1e6:.4g} ml, {body.mass * 1e3:.4g} g"


def duration_table(predicted: Duration, model: Model, choice: Choice) -> Table:
    """Return the table of the predicted duration and the measured rates behind it."""
    workers = f"{predicted.threads} thread{'s' if predicted.threads > 1 else ''}"
    device = choice.device_for(model.corner_count)
    place = device if device == "cuda" else f"{device}, {workers}"
    steps, settling = "increments", ""
    if model.takes_load_steps:
        steps = "load steps"
    elif model.relaxation is not None:
        settling = ", plus the time to reach equilibrium"
    is_path = model.relaxation is not None and model.relaxation.follows_path
    expected = (
        f"{'at least' if is_path else 'about'} {duration(predicted.total)}{settling}: "
        f"start {duration(predicted.start)}, "
        f"{predicted.increment_count:.3g} {steps} {duration(predicted.loop)}, figures "
        f"{duration(predicted.figures)}"
    )
    part = "" if predicted.covered == 1.0 else f"the first {100.0 * predicted.covered:.0f} % of "
    measured = (
        f"{predicted.rate / 1e6:.1f} M element updates/s ({place}), in a short trial run with "
        f"{part}the load history compressed in time"
    )
    if model.takes_load_steps:
        each = duration(predicted.loop / predicted.increment_count)
        measured = f"{each} a load step ({place}), in a trial run over {part}the load history"
    return Table([("expected", expected), ("measured", measured)])


def modes_table(found: NaturalModes) -> Table:
    """Return the table of modes: frequencies, effective mass and place of the largest motion.

    For viscoelastic materials it has the frequencies of the static and of the dynamic
    stiffness, and about an equilibrium the damping ratios.
    """
    body = found.body
    viscoelastic = any(region.material.branches for region in body.regions)
    by_law = ["static\nHz", "stiffness\nratio", "dynamic\nHz"]
    if isinstance(found, LoadedModes):
        by_law.append("damping\nratio %")
    shares = f"effective mass\n{' '.join('xyz'[: body.points.shape[1]])} %"
    headings = [*(by_law if viscoelastic else ["frequency\nHz"]), shares]
    rows: list[list[Cell]] = []
    for number, mode in enumerate(found.modes, start=1):
        frequencies = [cell(mode.frequency)]
        if viscoelastic:
            frequencies += [cell(mode.stiffening, ".2f"), cell(mode.dynamic_frequency)]
        if viscoelastic and isinstance(mode, LoadedMode):
            frequencies.append(cell(100.0 * mode.damping_ratio, ".3g"))
        masses = [100.0 * share for share in mode.mass_shares]
        in_words = Cell(" ".join(f"{mass:.0f}" for mass in masses), masses[0])
        rows.append([cell(number), *frequencies, in_words, *_most_moved(body, mode)])
    return Table(rows, ["mode", *headings, "largest motion at\nmm", "set"])


def modes_remarks(found: NaturalModes) -> str:
    """Return in words the number of held nodes and rigid-body modes, and the stiffness error."""
    motions = found.rigid_motions
    loose = f", {motions} rigid-body mode{'s' if motions > 1 else ''} omitted" if motions else ""
    return (
        f"natural modes of '{found.body.name}': {found.held_count} nodes held (fixed or tied)"
        f"{loose}; relative error of the stiffness {found.stiffness_error:.0e}"
    )


def response_table(found: MotorResponse) -> Table:
    """Return the table of a harmonic response: at the motor's own frequency, and the largest."""
    own = int(np.abs(found.frequencies - found.own_frequency).argmin())
    rows: list[list[Cell | str]] = []
    for column, values in found.amplitudes.items():
        unit, largest = found.units[column], int(np.abs(values).argmax())
        at_own, highest = (
            Cell(format_quantity(float(f"{abs(values[k]):.4g}"), unit), abs(values[k]))
            for k in (own, largest)
        )
        phase = cell(np.degrees(np.angle(values[own])), ".0f")
        rows.append([column, at_own, phase, highest, cell(found.frequencies[largest])])
    at = f"at\n{found.frequencies[own]:.4g} Hz"
    return Table(rows, [found.motor, at, "phase\ndeg", "largest", "at\nHz"])


def _most_moved(body: Body, mode: NaturalMode) -> tuple[Cell, Cell]:
    """Return the position [mm] of the node that moves most, and its smallest named set."""
    node = mode.most_moved
    place = [1e3 * c for c in body.points[node]]
    sets = body.node_sets
    around = [name for name in sets if body.first_node + node in sets[name]]
    smallest = min(around, key=lambda name: len(sets[name]), default="")
    return Cell(", ".join(f"{c:.2f}" for c in place), place[0]), Cell(smallest)
