"""The PufferFace Robot's skin as a body of revolution: its half section."""

from itertools import pairwise

import numpy as np

from softsim.mesh.band import CellKind
from softsim.mesh.mesh import Mesh, boundary_facets, facets_on, facets_touching, renumbered
from softsim.mesh.quality import check
from softsim.robots.limits import check_counts, check_positive, check_rows, check_skin
from softsim.robots.strip import ROWS, Fin, even_columns, finned_strip, upright

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
