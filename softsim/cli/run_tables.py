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
from softsim.mesh.surface import sharp_edges
from softsim.model import Body, Model
from softsim.options import rows_of_sets
from softsim.report.figures import COMPUTED, duration, findings, written
from softsim.report.table import Cell, Row, Table, cell
from softsim.run.equilibrium import MotorResponse
from softsim.run.pilot import Duration
from softsim.scene.loading import LoadedScene, flow_text, phrase
from softsim.scene.text import Key, entries, nearest
from softsim.solver.natural_modes import NaturalMode, NaturalModes
from softsim.solver.stable_step import StableStepEstimator, estimator, first_time_increment
from softsim.statics.modes import LoadedMode, LoadedModes
from softsim.units import count_text, format_quantity


def summary_table(summary: Mapping[str, Any], units: Mapping[str, str]) -> Table:
    """Return the table of results of a run, followed by how it was computed.

    units: column of the history -> unit.
    """
    lines = [*findings(summary, units), *written(summary, COMPUTED)]
    rows = [(line.name, line.value) for line in lines]
    warned = len(summary.get("warnings", []))
    if warned:
        rows.insert(0, ("warnings", f"{warned}, listed in summary.json and run.log"))
    return Table(rows)


def wall_time_table(wall_times: Mapping[str, float]) -> Table:
    """Return the table of the wall time of each part of a run, from its summary."""
    whole = sum(wall_times.values())
    rows: list[Row] = [
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
        after = count_text(model.cycles, "pressure cycle")
        rows.append(("ends", f"after {after}, or at {model.end_time:.6g} s at the latest"))
    return Table(rows)


def _size(body: Body) -> str:
    q = quality(Mesh(body.points, body.cells))
    volume = sum(region.volumes.sum() for region in body.regions)
    sides = " x ".join(f"{1e3 * side:.4g}" for side in np.ptp(body.points, axis=0))
    return f"{sides} mm, {q.describe()}, {volume * 1e6:.4g} ml, {body.mass * 1e3:.4g} g"


def duration_table(predicted: Duration, model: Model, choice: Choice) -> Table:
    """Return the table of the predicted duration and the measured rates behind it."""
    device = choice.device_for(model.corner_count)
    place = device if device == "cuda" else f"{device}, {count_text(predicted.threads, 'thread')}"
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
    loose = f", {count_text(motions, 'rigid-body mode')} omitted" if motions else ""
    return (
        f"natural modes of '{found.body.name}': {found.held_count} nodes held (fixed or tied)"
        f"{loose}; relative error of the stiffness {found.stiffness_error:.0e}"
    )


def response_table(found: MotorResponse) -> Table:
    """Return the table of a harmonic response: at the motor's own frequency, and the largest."""
    own = int(np.abs(found.frequencies - found.own_frequency).argmin())
    rows: list[Row] = []
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


# -------------------------------------------------------------------------------------------------
# What acts on the bodies of a scene: loads, gravity, walls, contact and supports.
#
# Defaults that a scene does not mention are listed too, and marked.

SHARP = np.radians(45.0)
"""Angle between the normals on both sides of an edge beyond which it counts as sharp."""

CROSSING_DEPTH = 0.4
"""Measured depth of two crossing beams, over the side of their elements
(tests/verification/test_body_contact_in_space.py)."""


def acting(loaded: LoadedScene, model: Model) -> list[tuple[str, str]]:
    """Return the loads, supports, walls and contact of a scene as (title, text) pairs.

    Parameters
    ----------
    loaded: the scene, whose own words and units are used.
    model: the model that was built from it, which knows areas, resultants and the direction of
        gravity.
    """
    return [
        *_loads(loaded, model),
        *(
            (f"{part[:-1]} '{name}'", phrase(tree))
            for part in ("nodes", "edges")
            for name, tree in entries(loaded.tree, "pneumatics", part).items()
        ),
        ("gravity", _gravity(loaded, model)),
        *_held(loaded),
        *(
            (f"condition '{name}'", phrase(tree))
            for name, tree in entries(loaded.tree, "conditions").items()
            if name in loaded.scene.conditions
        ),
        *(
            (f"wall '{name}'", phrase(tree))
            for name, tree in entries(loaded.tree, "environment", "walls").items()
        ),
        *_contact(loaded),
        *_crossing_edges(model),
    ]


def not_read(model: Model) -> list[tuple[str, str]]:
    """Return the unsupported keywords of mesh files, as (body, keywords) pairs."""
    return [(f"body '{b.name}'", ", ".join(b.not_read)) for b in model.bodies if b.not_read]


def _loads(loaded: LoadedScene, model: Model) -> Iterator[tuple[str, str]]:
    """Yield a row for each load of the scene, or the row "none"."""
    remarks = model.named_loads
    trees = entries(loaded.tree, "loads")
    for name in loaded.scene.loads:
        remark = remarks[name].remark(model.points) if name in remarks else ""
        yield f"load '{name}'", phrase(trees[name]) + (f"; {remark}" if remark else "")
    if not loaded.scene.loads:
        yield "loads", "none"


def _gravity(loaded: LoadedScene, model: Model) -> str:
    keys = ("gravity", "gravity_profile", "inclination", "roll")
    given = entries(loaded.tree, "environment")
    said = [f"{key} {flow_text(given[key])}" for key in keys[1:] if key in given]
    vector = ", ".join(f"{component + 0.0:.4g}" for component in model.gravity)
    return "; ".join(
        [
            _value(loaded, "environment", keys[0]),
            *said,
            f"as a vector ({vector}) m/s^2",
        ]
    )


def _held(loaded: LoadedScene) -> Iterator[tuple[str, str]]:
    for name, body in loaded.scene.bodies.items():
        if body.fixed:
            yield "held", (f"{', '.join(f'{name}.{one}' for one in body.fixed)}, in all directions")
    for name, rigid in loaded.scene.rigid_bodies.items():
        tied = ", ".join(rigid.tied) or "no nodes"
        free = "" if rigid.free is None else f"; free: {', '.join(rigid.free) or 'nothing'}"
        if rigid.surface is not None:
            free += f"; surface: {rigid.surface.file or 'a polygon'}"
        yield f"rigid body '{name}'", f"moves with {tied}{free}"
    for name, tree in entries(loaded.tree, "ties").items():
        yield f"tie '{name}'", phrase(tree)


def _contact(loaded: LoadedScene) -> Iterator[tuple[str, str]]:
    scene = loaded.scene
    contact, touching = scene.contact, scene.contact.self_contact
    outlines = [name for name, rigid in scene.rigid_bodies.items() if rigid.supports]
    pairs = ["bodies with walls"] if scene.environment.walls else []
    pairs += [f"outline of '{name}' with its supports" for name in outlines]
    if touching:
        pairs.append(f"{', '.join(touching)} with themselves and each other")
    pairs += [" with ".join(pair.between) for pair in contact.pairs]
    named = touching or contact.pairs
    missing = (
        "" if named else ("; no self_contact: bodies can pass through themselves and each other")
    )
    yield "contact", ("; ".join(pairs) or "none: no walls") + missing
    if not pairs:
        return
    law = [f"mu {_value(loaded, 'contact', 'friction_coefficient')}"]
    if contact.friction_memory == 0.0:
        law.append(f"Coulomb's law, memory {_value(loaded, 'contact', 'friction_memory')}")
    else:
        law.append(
            "the friction limit follows the normal force with a memory of "
            f"{_value(loaded, 'contact', 'friction_memory')} and a slip length of "
            f"{_value(loaded, 'contact', 'friction_slip_length')}"
        )
    if touching and contact.self_friction_coefficient is not None:
        law.append(f"mu {contact.self_friction_coefficient:g} in self_contact")
    law += [
        f"mu {pair.friction_coefficient:g} between {' and '.join(pair.between)}"
        for pair in contact.pairs
        if pair.friction_coefficient is not None
    ]
    yield "friction", ", ".join(law)
    for name, tree in entries(loaded.tree, "contact", "adhesion").items():
        yield f"adhesion '{name}'", phrase(tree)


def _crossing_edges(model: Model) -> Iterator[tuple[str, str]]:
    """Yield a warning if sharp edges of several bodies in space may cross: contact misses that."""
    data = model.self_contact
    if data is None or model.dimension == 2:
        return
    nodes = np.unique(sharp_edges(model.points, data.facets, SHARP))
    owners = {b.name: np.r_[b.nodes] for b in model.bodies}
    owners |= {b.name: np.unique(b.facets) for b in model.rigid_bodies}
    sharp = [f"'{name}'" for name, own in owners.items() if np.isin(nodes, own).any()]
    if len(sharp) > 1:
        yield (
            "sharp edges",
            f"of {', '.join(sharp)}: contact between two edges is not detected; where edges cross "
            f"between nodes, they penetrate by up to {CROSSING_DEPTH:g} of an element side "
            "before contact acts; use smaller elements there, or round the edges",
        )


def _value(loaded: LoadedScene, *keys: Key) -> str:
    """Return a value as written in the scene, or its default, marked as default."""
    held, depth = nearest(loaded.tree, keys)
    if depth == len(keys):
        return flow_text(held)
    part = getattr(loaded.scene, str(keys[0]))
    return f"{flow_text(type(part).model_fields[str(keys[1])].default)} (default)"
