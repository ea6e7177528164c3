"""The PufferFace Robot: its section along its axis, as in the plane model of the thesis."""

from itertools import pairwise

import numpy as np

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
    check_counts,
    check_lean,
    check_positive,
    check_rows,
    check_skin,
    least_thickness,
)
from softsim.robots.spike import check_thickness, spike
from softsim.robots.spiked_strip import (
    ROWS,
    Fin,
    even_columns,
    fineness_of,
    finned_strip,
    spiked_strip,
    upright,
    whole,
)


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
