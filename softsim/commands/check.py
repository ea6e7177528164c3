"""What `softsim check` says of a model and of the run to come."""

from rich.table import Table

from softsim.mesh.mesh import Mesh
from softsim.mesh.quality import quality
from softsim.model import Body, Model
from softsim.report.readable import degrees
from softsim.stability.time_step import estimator, first_time_increment


def model_table(model: Model) -> Table:
    """Size and sets of each body, the stable step and what limits it."""
    table = Table(show_header=False, box=None)
    for body in model.bodies:
        table.add_row(f"body '{body.name}'", _size(body, model.dimension))
        for region in body.regions:
            part = "" if region.cell_set is None else f" of {region.cell_set}"
            table.add_row(f"  material{part}", region.material.describe())
        for remark in body.remarks:
            table.add_row("  from its file", remark)
        for kind, sets in (("node", body.node_sets), ("facet", body.facet_sets)):
            listed = ", ".join(f"{name} ({len(m)})" for name, m in sorted(sets.items()))
            table.add_row(f"  {kind} sets", listed)
    stable = estimator(model).at_rest
    dt = first_time_increment(model)
    table.add_row("stable step", stable.describe())
    table.add_row("time step", f"{dt * 1e6:.3g} us, {model.end_time / dt:.3g} increments")
    if model.cycles is not None:
        table.add_row("ends", _ending(model.cycles, model.end_time))
    return table


def _ending(cycles: int, end_time: float) -> str:
    plural = "s" if cycles > 1 else ""
    return f"after {cycles} pressure cycle{plural}, at {end_time:.6g} s at the latest"


def _size(body: Body, dimension: int) -> str:
    q = quality(Mesh(body.points, body.cells))
    shape = {2: "triangles", 3: "tetrahedra"}[dimension]
    volume = sum(region.volumes.sum() for region in body.regions)
    return (
        f"{q.node_count} nodes, {q.cell_count} {shape}, smallest altitude "
        f"{q.smallest_altitude * 1e3:.3g} mm, angles {degrees(q.smallest_angle)} to "
        f"{degrees(q.largest_angle)}, {volume * 1e6:.4g} ml, "
        f"{body.mass * 1e3:.4g} g"
        + (f", {q.piece_count} unconnected pieces" if q.piece_count > 1 else "")
    )
