"""The PufferFace Robot in three dimensions: its skin, a tube, with rows of curved spikes around."""

import math
from dataclasses import replace

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.mesh import Mesh, renumbered
from softsim.mesh.quality import check
from softsim.mesh.surface import CellKind
from softsim.robots.limits import (
    check_cell_count,
    check_counts,
    check_lean,
    check_positive,
    check_rows,
    check_skin,
    least_thickness,
)
from softsim.robots.spike import check_thickness, spike
from softsim.robots.spike_patch import layers_across, section, swept
from softsim.robots.spiked_strip import Strip


def pfr_solid(
    inner_diameter: float = 15e-3,
    outer_diameter: float = 17e-3,
    free_length: float = 30e-3,
    spikes_around: int = 14,
    rows: int = 5,
    spike_pitch: float = 6e-3,
    spike_height: float = 5e-3,
    front_radius: float = 5e-3,
    rear_radius: float = 3.5e-3,
    root_thickness: float = 3e-3,
    tip_thickness: float = 1e-3,
    lean: float = 2.5e-3,
    spike_width: float = 2e-3,
    element_size: float = 0.7e-3,
    cells: CellKind = "simplex",
    skin_rows: int | None = None,
    spike_columns: int | None = None,
    spike_layers: int | None = None,
) -> Mesh:
    """Return the skin between the knots with `rows` rows of `spikes_around` spikes outside.

    The axis is x, forward is +x, y is up; the skin spans x in [-free_length/2, free_length/2], and
    the first spike of each row points up. Through the axis, skin and spikes have the section of
    `pfr_section`: tips `lean` behind the roots, edges that are arcs of front_radius and
    rear_radius. Across it a spike keeps its width: its flanks are parallel planes. rows = 0 is the
    plain tube, with the same cells around. All lengths in m.

    element_size: length [m] aimed at for the sides of the cells in the sections through the axis;
    around they are about one and a half times as long. The tips have sharper cells. Of hexahedra,
    where given, skin_rows is the number through the skin, spike_columns that across a spike along
    the axis, and spike_layers that across its width.

    Node sets: knot_front, knot_rear, knots (end faces, tied to the frame), chamber and outer (the
    skin's inner and outer side, the spikes' roots included), equator_inner (chamber at x = 0),
    equator_outer (outer at x = 0, without the roots), j1, j2 ... (spikes above the skin, row by row
    from the front), tips (outer ends of the spikes). Facet sets: chamber, outer (the skin's outer
    side between the spikes), spikes (their free sides). Cell sets: skin, spikes. Without spikes
    their sets are left out, and without nodes at x = 0, as below a spike of odd columns, those of
    the equator.

    Raises MeshError, naming the parameter and its limit, for dimensions that make no such body.
    """
    check_positive(
        inner_diameter=inner_diameter,
        free_length=free_length,
        spike_pitch=spike_pitch,
        spike_height=spike_height,
        front_radius=front_radius,
        rear_radius=rear_radius,
        root_thickness=root_thickness,
        tip_thickness=tip_thickness,
        spike_width=spike_width,
        element_size=element_size,
    )
    check_counts(cells, skin_rows=skin_rows, spike_columns=spike_columns, spike_layers=spike_layers)
    check_skin(inner_diameter, outer_diameter)
    check_lean(lean)
    check_rows("spike", rows, spike_pitch, root_thickness, element_size, free_length=free_length)
    shape = spike(spike_height, root_thickness, tip_thickness, lean, front_radius, rear_radius)
    check_thickness(
        "spike", shape, spike_height, least_thickness(cells, element_size, tip_thickness)
    )
    _check_around(spikes_around, spike_width, outer_diameter, element_size)

    skin = (outer_diameter - inner_diameter) / 2
    centers = (np.arange(rows) - (rows - 1) / 2) * spike_pitch
    strip = section(
        free_length, skin, centers, root_thickness, tip_thickness, shape, element_size, cells,
        skin_rows, spike_columns,
    )  # fmt: skip
    layers = spike_layers or layers_across(spike_width, element_size)
    body = renumbered(
        _around(
            strip, inner_diameter / 2, skin, spikes_around, spike_width, layers, element_size, cells
        )
    )
    check(body)
    return body


def _check_around(count: int, width: float, outer_diameter: float, element_size: float) -> None:
    """Raise MeshError unless neighbouring spikes have an element between their roots."""
    if count < 1:
        raise MeshError(
            f"spikes_around is {count}; it must be 1 or more",
            hint="for a plain tube set rows to 0",
        )
    if width < element_size:
        raise MeshError(
            f"spike_width is {1e3 * width:.4g} mm; "
            f"at least element_size, {1e3 * element_size:.4g} mm, is needed"
        )
    room = math.pi * outer_diameter / count - element_size
    widest = outer_diameter * math.sin(min(max(room, 0) / outer_diameter, math.pi / 2))
    if width > widest:
        raise MeshError(
            f"spike_width is {1e3 * width:.4g} mm and the spikes overlap; {count} around, and "
            f"an element between them, leave {1e3 * widest:.4g} mm",
            hint="reduce spike_width or spikes_around, or increase outer_diameter",
        )


def _around(
    strip: Strip,
    inner: float,
    skin: float,
    count: int,
    width: float,
    across: int,
    element_size: float,
    kind: CellKind,
) -> Mesh:
    """Return the strip swept around the axis at the radius `inner`, spikes in their width only.

    across: cells across the width of a spike. element_size [m]: of those in the section.
    """
    radius = inner + strip.points[:, 1]
    # Parallel flanks: the same distance from the spike's middle at every radius. The skin takes
    # the directions of the roots.
    offsets = np.linspace(-width / 2, width / 2, across + 1)
    spike_angles = np.arcsin(offsets[:, None] / np.maximum(radius, inner + skin))
    last = float(spike_angles[-1].max())
    first_of_next = 2 * math.pi / count - last
    between = layers_across((first_of_next - last) * (inner + skin), element_size)
    check_cell_count(len(strip.points) * count * (across + between), element_size)
    gap_angles = np.linspace(last, first_of_next, between + 1)[1:-1]
    period = np.concatenate([spike_angles, np.repeat(gap_angles[:, None], len(radius), axis=1)])
    starts = 2 * math.pi * np.arange(count) / count
    angles = (starts[:, None, None] + period).reshape(-1, len(radius))

    places = np.stack(
        [
            np.broadcast_to(strip.points[:, 0], angles.shape),
            radius * np.cos(angles),
            radius * np.sin(angles),
        ],
        axis=-1,
    )
    node = np.arange(angles.size).reshape(angles.shape)
    spiked = ([True] * across + [False] * between) * count
    body = swept(strip, places, np.concatenate([node, node[:1]]), spiked, kind, inside="chamber")
    return replace(body, node_sets=_with_knots_and_equators(body))


def _with_knots_and_equators(body: Mesh) -> dict[str, np.ndarray]:
    """Return the node sets of the swept strip with knots at its ends and equators at its middle."""
    sets = dict(body.node_sets)
    rear, front = sets.pop("rear"), sets.pop("front")
    sets |= {"knot_front": front, "knot_rear": rear, "knots": np.concatenate([front, rear])}
    x = body.points[:, 0]
    middle = np.flatnonzero(np.abs(x) < 1e-9 * np.ptp(x))
    inner, outer = (np.intersect1d(middle, sets[side]) for side in ("chamber", "outer"))
    if len(inner):
        spikes = body.cells[body.cell_sets.get("spikes", [])]
        sets |= {"equator_inner": inner, "equator_outer": np.setdiff1d(outer, spikes)}
    return sets
