"""The PufferFace Robot in three models: plane section, body of revolution, solid."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.mesh import (
    SURFACE,
    Mesh,
    boundary_facets,
    facets_on,
    facets_touching,
    mirrored,
    renumbered,
    transformed,
)
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
from softsim.robots.spikes import (
    ROWS,
    Fin,
    Strip,
    check_thickness,
    even_columns,
    fineness_of,
    finned_strip,
    layers_across,
    section,
    spike,
    spiked_strip,
    swept,
    upright,
    whole,
)

# -------------------------------------------------------------------------------------------------
# Section along its axis, as in the plane model of the thesis.


def pfr_section(
    inner_diameter: float = 15e-3,
    outer_diameter: float = 17e-3,
    free_length: float = 30e-3,
    spikes_per_strip: int = 5,
    spike_pitch: float = 6e-3,
    spike_height: float = 5e-3,
    front_radius: float = 5e-3,
    rear_radius: float = 3.5e-3,
    root_thickness: float = 3e-3,
    tip_thickness: float = 1e-3,
    lean: float = 2.5e-3,
    element_size: float = 0.35e-3,
    cells: CellKind = "simplex",
    skin_rows: int | None = None,
    spike_columns: int | None = None,
) -> Mesh:
    """Return two skin strips with spikes on their outside, above and below the robot's axis.

    The axis is x, forward is +x; the strips span x in [-free_length/2, free_length/2] and |y| in
    [inner_diameter/2, outer_diameter/2]. The spikes lean backward: their tips lie `lean` behind
    their roots. Their edges are arcs of front_radius and rear_radius, both bulging forward. All
    lengths in m.

    element_size: altitude [m] aimed at for the triangles, which sets the stable time increment;
    their sides are about sqrt(2) times as long. The thinnest rows and the corners may lie below. Of
    quadrilaterals the length of their sides, across a spike on the average; where given, skin_rows
    is their number through the skin and spike_columns that across a spike.

    Each set X exists as X, X_top and X_bottom (both strips, upper, lower). Node sets: knot_front,
    knot_rear, knots (end faces, tied to the frame), chamber (inner face), j1, j2 ... (spikes above
    the skin, row by row from the front), tips. Facet sets: chamber, from rear to front. Cell sets:
    skin, spikes. Without spikes their sets are left out.

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
        element_size=element_size,
    )
    check_counts(cells, skin_rows=skin_rows, spike_columns=spike_columns)
    check_skin(inner_diameter, outer_diameter)
    skin = (outer_diameter - inner_diameter) / 2
    check_lean(lean)
    check_rows(
        "spike",
        spikes_per_strip,
        spike_pitch,
        root_thickness,
        element_size,
        free_length=free_length,
    )
    shape = spike(spike_height, root_thickness, tip_thickness, lean, front_radius, rear_radius)
    check_thickness(
        "spike", shape, spike_height, least_thickness(cells, element_size, tip_thickness)
    )

    centers = (np.arange(spikes_per_strip) - (spikes_per_strip - 1) / 2) * spike_pitch
    across = spike_columns or whole((root_thickness + tip_thickness) / 2 / element_size)
    fineness = fineness_of(cells, skin, element_size, skin_rows, across)
    strip = spiked_strip(free_length, skin, centers, root_thickness, shape, fineness)
    section = renumbered(_mirrored_pair(strip, distance=inner_diameter / 2))
    check(section)
    return section


def _mirrored_pair(strip: Mesh, distance: float) -> Mesh:
    """Return the strip moved outward to y = distance, and its mirror image below the axis."""
    top = transformed(strip, 0.0, np.array([0.0, distance]))
    bottom = mirrored(top, 1)
    nodes = {name: s for name, s in top.node_sets.items() if name != SURFACE}
    facets = {name: s for name, s in top.facet_sets.items() if name != SURFACE}
    node_count, cell_count = len(top.points), len(top.cells)
    return Mesh(
        points=np.concatenate([top.points, bottom.points]),
        cells=np.concatenate([top.cells, bottom.cells + node_count]),
        node_sets=_sided(nodes, {name: s + node_count for name, s in nodes.items()}),
        facet_sets=_sided(facets, {name: bottom.facet_sets[name] + node_count for name in facets}),
        cell_sets=_sided(
            strip.cell_sets, {name: s + cell_count for name, s in strip.cell_sets.items()}
        ),
    )


def _sided(top: dict[str, np.ndarray], bottom: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return each set X as X_top, X_bottom and X, which has both."""
    sets = {}
    for name in top:
        sets[name] = np.concatenate([top[name], bottom[name]])
        sets[f"{name}_top"], sets[f"{name}_bottom"] = top[name], bottom[name]
    return sets


# -------------------------------------------------------------------------------------------------
# The PufferFace Robot's skin as a body of revolution: its half section.

FEWEST_ROWS: dict[CellKind, int] = {"simplex": 4, "quad": 1}
"""Smallest number of rows of cells through the skin, required for its bending."""


def pfr_meridian(
    inner_diameter: float = 15e-3,
    outer_diameter: float = 17e-3,
    free_length: float = 30e-3,
    ring_rows: int = 0,
    ring_pitch: float = 6e-3,
    ring_height: float = 5e-3,
    ring_thickness: float = 3e-3,
    element_size: float = 0.25e-3,
    cells: CellKind = "simplex",
    skin_rows: int | None = None,
) -> Mesh:
    """Return the skin's half section for an axisymmetric model: x is the radius r, y the axis z.

    The skin spans r in [inner_diameter/2, outer_diameter/2] and z in [-free_length/2,
    free_length/2]. Rings stand for the rows of spikes: rectangles, ring_thickness along z and
    ring_height outward, ring_pitch apart and centred about z = 0. A ring is whole where the
    spikes have gaps between them, so that it is stiffer around and heavier. All lengths in m.

    element_size: length [m] aimed at for the sides of the cells. skin_rows: number of
    quadrilaterals through the skin; None: as many as element_size gives. The mesh has nodes at
    z = 0 and its cells mirror each other about it.

    Node sets: end_low, end_high (z = -/+ free_length/2), ends (both), chamber and outer (the
    skin's inner and outer side, the rings' roots included), equator_inner and equator_outer (their
    nodes at z = 0), j1, j2 ... (tips of the rings, from low to high z). Facet sets: chamber, from
    high to low z; outer (the skin's outer side between the rings), rings (their free sides). Cell
    sets: skin, rings. Without rings their sets are left out.

    Raises MeshError, naming the parameter and its limit, for dimensions that make no such body.
    """
    check_positive(
        inner_diameter=inner_diameter,
        free_length=free_length,
        ring_pitch=ring_pitch,
        ring_height=ring_height,
        ring_thickness=ring_thickness,
        element_size=element_size,
    )
    check_counts(cells, skin_rows=skin_rows)
    check_skin(inner_diameter, outer_diameter)
    check_rows("ring", ring_rows, ring_pitch, ring_thickness, element_size, free_length=free_length)

    # Along x from high to low z, so that the strip's outside faces away from the axis.
    centers = (np.arange(ring_rows) - (ring_rows - 1) / 2) * ring_pitch
    edges = [*(centers - ring_thickness / 2), *(centers + ring_thickness / 2)]
    x, ends = even_columns(np.sort([-free_length / 2, *edges, free_length / 2]), element_size)
    skin = (outer_diameter - inner_diameter) / 2
    bands = ROWS[cells](ring_height / element_size)
    rings = [
        Fin(start, end, upright(x[start : end + 1], skin, skin + ring_height, bands, cells))
        for start, end in list(pairwise(ends))[1:-1:2]
    ]
    rows = skin_rows or max(FEWEST_ROWS[cells], ROWS[cells](skin / element_size))
    strip = finned_strip(x, skin, rows, rings, cells)

    end_high, end_low = (np.array([line[side] for line in strip.skin_lines]) for side in (0, -1))
    chamber, outer = strip.skin_lines[0], strip.skin_lines[-1]
    node_sets = {
        "end_low": end_low,
        "end_high": end_high,
        "ends": np.concatenate([end_low, end_high]),
        "chamber": chamber,
        "outer": outer,
        "equator_inner": strip.at_middle(chamber),
        "equator_outer": strip.at_middle(outer),
    }
    boundary = boundary_facets(strip.cells, 2)
    facet_sets = {
        "chamber": np.column_stack([chamber[:-1], chamber[1:]]),
        "outer": facets_on(boundary, outer),
    }
    cell_numbers = np.arange(len(strip.cells))
    cell_sets = {"skin": cell_numbers[: len(strip.skin_cells)]}
    if rings:
        columns = [len(ring.lines[-1]) for ring in rings]
        tips = [nodes[-count:] for nodes, count in zip(strip.fins, columns, strict=True)]
        node_sets |= {f"j{row}": nodes for row, nodes in enumerate(reversed(tips), start=1)}
        facet_sets["rings"] = facets_touching(boundary, np.concatenate(strip.fins))
        cell_sets["rings"] = cell_numbers[len(strip.skin_cells) :]
    section = renumbered(
        Mesh(
            points=np.column_stack([inner_diameter / 2 + strip.points[:, 1], -strip.points[:, 0]]),
            cells=strip.cells,
            node_sets=node_sets,
            facet_sets=facet_sets,
            cell_sets=cell_sets,
        )
    )
    check(section)
    return section


# -------------------------------------------------------------------------------------------------
# The PufferFace Robot in three dimensions: its skin, a tube, with rows of curved spikes around.


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
