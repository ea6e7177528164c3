"""Tables that the commands print for a scene: its model, the planned run, its results.

The module imports Taichi, so commands import it only when they need it.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from rich.markup import escape
from rich.table import Table

from softsim.compute.machine import Choice
from softsim.mesh.mesh import Mesh
from softsim.mesh.quality import quality
from softsim.model import Body, Model
from softsim.options import rows_of_sets, unheaded
from softsim.output.acting import acting, not_read
from softsim.report.figures import bookkeeping, duration, findings, segments
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
    return unheaded(rows)


def wall_time_table(wall_times: Mapping[str, float]) -> Table:
    """Return the table of the wall time of each part of a run, from its summary."""
    whole = sum(wall_times.values())
    table = Table("part", box=None)
    for heading in ("wall time", "fraction"):
        table.add_column(heading, justify="right")
    for part, seconds in [*wall_times.items(), ("whole", whole)]:
        table.add_row(part, f"{seconds:.2f} s", f"{100 * seconds / whole:.1f} %")
    return table


def profile_table(profile: Mapping[str, Any]) -> Table:
    """Return the table of the cost of each pass of an increment, from `profile` of the summary.

    Each pass was measured alone. The remainder of a whole increment has its own row; it is
    negative if the passes alone are slower.
    """
    whole = profile["increment"]
    table = Table("phase", "pass", box=None)
    for heading in ("indices", "us", "fraction"):
        table.add_column(heading, justify="right")

    def row(phase: str, name: str, indices: str, seconds: float) -> None:
        table.add_row(
            phase, name, indices, f"{seconds * 1e6:.2f}", f"{100 * seconds / whole:.1f} %"
        )

    for cost in sorted(profile["passes"], key=lambda cost: -cost["seconds"]):
        row(cost["phase"], cost["name"], f"{cost['count']:,}", cost["seconds"])
    row("overhead", "not part of a pass", "", profile["unexplained"])
    row("increment", "whole increment", "", whole)
    return table


def acting_tables(loaded: LoadedScene, model: Model) -> Iterator[Table]:
    """Yield a table of what acts on the bodies, and one of unread keywords of mesh files."""
    titles = "loads, supports and contact", "ignored in mesh files"
    for title, rows in zip(titles, (acting(loaded, model), not_read(model)), strict=True):
        if rows:
            table = unheaded([[escape(text) for text in row] for row in rows])
            table.title, table.title_justify = title, "left"
            yield table


def model_table(model: Model) -> Table:
    """Return the table of the sizes and sets of bodies, of cables, and of the stable step."""
    table = Table(show_header=False, box=None)
    for body in model.bodies:
        table.add_row(f"body '{body.name}'", _size(body))
        for region in body.regions:
            part = "" if region.cell_set is None else f" of {region.cell_set}"
            table.add_row(f"  material{part}", region.material.describe())
        for remark in body.remarks:
            table.add_row("  changed", remark)
        for kind, text in rows_of_sets(body.node_sets, body.facet_sets, body.cell_sets):
            table.add_row(f"  {kind}", text)
    for structure in model.all_structures:
        for title, text in structure.description().items():
            table.add_row(title, text)
    if model.mass_scaling is not None:
        unscaled = StableStepEstimator(replace(model, mass_scaling=None)).at_rest.value
        table.add_row(
            "mass scaling",
            f"{model.mass_scaling.describe()}; moments of inertia +"
            f"{100.0 * model.added_turning:.3g} %; stable step without it {unscaled * 1e6:.3g} us",
        )
    stable = estimator(model).at_rest
    dt = first_time_increment(model)
    table.add_row("stable step", stable.describe())
    table.add_row(
        "time step", f"{dt * 1e6:.3g} us, {(model.end_time - model.start_time) / dt:.3g} increments"
    )
    if model.cycles is not None:
        table.add_row("ends", _ending(model.cycles, model.end_time))
    return table


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
    table = Table(show_header=False, box=None)
    workers = f"{predicted.threads} thread{'s' if predicted.threads > 1 else ''}"
    device = choice.device_for(model.corner_count)
    place = device if device == "cuda" else f"{device}, {workers}"
    steps, settling = "increments", ""
    if model.takes_load_steps:
        steps = "load steps"
    elif model.relaxation is not None:
        settling = ", plus the time to reach equilibrium"
    is_path = model.relaxation is not None and model.relaxation.follows_path
    table.add_row(
        "expected",
        f"{'at least' if is_path else 'about'} {duration(predicted.total)}{settling}: "
        f"start {duration(predicted.start)}, "
        f"{predicted.increment_count:.3g} {steps} {duration(predicted.loop)}, figures "
        f"{duration(predicted.figures)}",
    )
    part = "" if predicted.covered == 1.0 else f"the first {100.0 * predicted.covered:.0f} % of "
    measured = (
        f"{predicted.rate / 1e6:.1f} M element updates/s ({place}), in a short trial run with "
        f"{part}the load history compressed in time"
    )
    if model.takes_load_steps:
        each = duration(predicted.loop / predicted.increment_count)
        measured = f"{each} a load step ({place}), in a trial run over {part}the load history"
    table.add_row("measured", measured)
    return table


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
    table = Table("mode", box=None)
    shares = f"effective mass\n{' '.join('xyz'[: body.points.shape[1]])} %"
    for heading in [*(by_law if viscoelastic else ["frequency\nHz"]), shares]:
        table.add_column(heading, justify="right")
    table.add_column("largest motion at\nmm", no_wrap=True)
    table.add_column("set")
    for number, mode in enumerate(found.modes, start=1):
        stiffened = [f"{mode.stiffening:.2f}", f"{mode.dynamic_frequency:.4g}"]
        if isinstance(mode, LoadedMode):
            stiffened.append(f"{100.0 * mode.damping_ratio:.3g}")
        frequencies = [f"{mode.frequency:.4g}", *(stiffened if viscoelastic else [])]
        shares = " ".join(f"{100.0 * share:.0f}" for share in mode.mass_shares)
        table.add_row(str(number), *frequencies, shares, *_most_moved(body, mode))
    return table


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
    table = Table(found.motor, box=None)
    own = int(np.abs(found.frequencies - found.own_frequency).argmin())
    for heading in (f"at {found.frequencies[own]:.4g} Hz", "phase\ndeg", "largest", "at\nHz"):
        table.add_column(heading, justify="right")
    for column, values in found.amplitudes.items():
        unit, largest = found.units[column], int(np.abs(values).argmax())
        shown = [format_quantity(float(f"{abs(values[k]):.4g}"), unit) for k in (own, largest)]
        phase = f"{np.degrees(np.angle(values[own])):.0f}"
        table.add_row(column, shown[0], phase, shown[1], f"{found.frequencies[largest]:.4g}")
    return table


def _most_moved(body: Body, mode: NaturalMode) -> tuple[str, str]:
    """Return the position [mm] of the node that moves most, and its smallest named set."""
    node = mode.most_moved
    place = ", ".join(f"{c * 1e3:.2f}" for c in body.points[node])
    sets = body.node_sets
    around = [name for name in sets if body.first_node + node in sets[name]]
    return place, min(around, key=lambda name: len(sets[name]), default="")


def segments_table(report: Mapping[str, Any]) -> Table:
    """Return the table of segments from `layout` of the summary, with units below the headings."""
    content = segments(report)
    first, *others = content.headings
    table = Table(box=None, caption=content.caption, caption_justify="left")
    table.add_column(first, no_wrap=True)
    for heading in others:
        name, _, unit = heading.rstrip("]").partition(" [")
        table.add_column("\n".join([*name.split(), unit]), justify="right")
    for row in content.rows:
        table.add_row(*(cell.text for cell in row))
    return table
