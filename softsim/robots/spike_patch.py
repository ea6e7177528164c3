"""A patch of the PufferFace Robot's sleeve, laid flat: rows and columns of spikes on a skin."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from softsim.mesh.mesh import Mesh, boundary_facets, facets_on, facets_touching, renumbered
from softsim.mesh.quality import check
from softsim.mesh.surface import CellKind
from softsim.robots.block import EXTRUSIONS
from softsim.robots.limits import (
    check_at_least_one,
    check_counts,
    check_lean,
    check_pitch,
    check_positive,
    least_thickness,
)
from softsim.robots.spike import CROSSINGS, Spike, check_thickness, spike
from softsim.robots.spiked_strip import ROWS, Fin, Strip, even, even_columns, finned_strip

# -------------------------------------------------------------------------------------------------
# Skin with curved spikes in space: the section along its rows, swept across them.
#
# The spikes fill only some layers of the sweep, those of their width; the skin fills all.

FEWEST_ACROSS = 2
"""Smallest number of cells across a spike's width, and between neighbouring spikes."""

STRETCH_ACROSS = 1.5
"""Length of the cells along the sweep over that in the section, in which the body bends."""


def section(
    length: float,
    skin: float,
    centers: np.ndarray,
    root: float,
    tip: float,
    shape: Spike,
    element_size: float,
    kind: CellKind,
    skin_rows: int | None,
    spike_columns: int | None,
) -> Strip:
    """Return the section of a skin [m] `length` long and `skin` thick, spikes upward on `centers`.

    root, tip: thickness of a spike [m]. element_size: target length [m] of the sides of the cells.
    skin_rows: of cells through the skin, spike_columns: across a spike, where given.
    """
    edges = [*(centers - root / 2), *(centers + root / 2)]
    stations = np.sort([-length / 2, *edges, length / 2])
    across = even((root + tip) / 2 / element_size)
    columns = {"simplex": None, "quad": spike_columns or across}[kind]
    x, ends = even_columns(stations, element_size, columns)
    spikes = []
    for center, (start, end) in zip(centers, list(pairwise(ends))[1:-1:2], strict=True):
        lines = CROSSINGS[kind](shape, element_size, int(end - start))
        spikes.append(Fin(start, end, [line + np.array([center, skin]) for line in lines[1:]]))
    return finned_strip(x, skin, skin_rows or ROWS[kind](skin / element_size), spikes, kind)


def layers_across(length: float, element_size: float) -> int:
    """Return the number of layers of the sweep over this length [m], a spike's width or a gap."""
    return max(FEWEST_ACROSS, round(length / (element_size * STRETCH_ACROSS)))


def swept(
    strip: Strip,
    places: np.ndarray,
    stations: np.ndarray,
    spiked: Sequence[bool],
    kind: CellKind,
    inside: str,
) -> Mesh:
    """Return the strip swept through space, with spikes only in the layers that are `spiked`.

    places: positions (m, n, 3) [m] of the strip's n nodes at each of m stations. stations: (layers
    + 1, n) their numbers at the ends of the layers; where the sweep closes, the first ones are the
    last. inside: name of the side without spikes.

    Node sets: rear, front (ends of the skin along x), `inside`, outer (the spikes' roots included),
    j1, j2 ... (spikes above the skin, row by row from the front), tips. Facet sets: `inside`, outer
    (between the spikes), spikes (their free sides). Cell sets: skin, spikes. Without spikes their
    sets are left out.
    """
    node = np.arange(places.size // 3).reshape(places.shape[:2])
    skin_cells = EXTRUSIONS[kind]([strip.skin_cells] * len(spiked), stations)
    fins = [strip.fin_cells if here else strip.fin_cells[:0] for here in spiked]
    cells = np.concatenate([skin_cells, EXTRUSIONS[kind](fins, stations)])

    # Between the spikes the strip's fins stand for nothing; their nodes are left out.
    used = np.unique(cells)
    number = np.full(node.size, -1)
    number[used] = np.arange(len(used))
    cells = number[cells]

    def everywhere(nodes: np.ndarray) -> np.ndarray:
        numbers = number[node[:, nodes].ravel()]
        return numbers[numbers >= 0]

    rear, front = (np.array([line[side] for line in strip.skin_lines]) for side in (0, -1))
    sides = {
        "rear": rear, "front": front, inside: strip.skin_lines[0], "outer": strip.skin_lines[-1],
    }  # fmt: skip
    node_sets = {name: everywhere(nodes) for name, nodes in sides.items()}
    boundary = boundary_facets(cells, 3)
    facet_sets = {name: facets_on(boundary, node_sets[name]) for name in (inside, "outer")}
    cell_numbers = np.arange(len(cells))
    cell_sets = {"skin": cell_numbers[: len(skin_cells)]}
    if strip.fins:
        spikes = np.concatenate(strip.fins)
        height = strip.points[spikes, 1]
        rows = enumerate(reversed(strip.fins), start=1)
        node_sets |= {f"j{row}": everywhere(nodes) for row, nodes in rows}
        node_sets["tips"] = everywhere(spikes[height > height.max() * (1 - 1e-9)])
        facet_sets["spikes"] = facets_touching(boundary, everywhere(spikes))
        cell_sets["spikes"] = cell_numbers[len(skin_cells) :]
    return Mesh(places.reshape(-1, 3)[used], cells, node_sets, facet_sets, cell_sets)


def spike_patch(
    rows: int,
    columns: int,
    spike_pitch: float,
    column_pitch: float,
    skin_thickness: float,
    spike_height: float,
    front_radius: float,
    rear_radius: float,
    root_thickness: float,
    tip_thickness: float,
    lean: float,
    spike_width: float,
    element_size: float,
    cells: CellKind = "quad",
    skin_rows: int | None = None,
    spike_columns: int | None = None,
    spike_layers: int | None = None,
) -> Mesh:
    """Return a flat skin on y = 0 with `rows` spikes along x in each of `columns` columns along z.

    Spikes point up, +y, and lean backward: their tips lie `lean` behind their roots (-x). Each has
    its own piece of skin, spike_pitch long and column_pitch wide; the patch's middle is x = z = 0.
    Their section is that of `pfr_solid`, and so are element_size and the numbers of cells. All
    lengths in m.

    Node sets: underside (y = 0), outer (the skin's upper side, the roots included), front, rear
    (ends across x), j1, j2 ... (spikes above the skin, row by row from the front), tips. Facet
    sets: underside, outer (the skin's upper side between the spikes), spikes (their free sides).
    Cell sets: skin, spikes.

    Raises MeshError, naming the parameter and its limit, for dimensions that make no such body.
    """
    check_positive(
        spike_pitch=spike_pitch,
        column_pitch=column_pitch,
        skin_thickness=skin_thickness,
        spike_height=spike_height,
        front_radius=front_radius,
        rear_radius=rear_radius,
        root_thickness=root_thickness,
        tip_thickness=tip_thickness,
        spike_width=spike_width,
        element_size=element_size,
    )
    check_at_least_one(rows=rows, columns=columns)
    check_counts(cells, skin_rows=skin_rows, spike_columns=spike_columns, spike_layers=spike_layers)
    check_lean(lean)
    check_pitch("spike", spike_pitch, root_thickness, element_size)
    check_pitch("column", column_pitch, spike_width, element_size)
    shape = spike(spike_height, root_thickness, tip_thickness, lean, front_radius, rear_radius)
    check_thickness(
        "spike", shape, spike_height, least_thickness(cells, element_size, tip_thickness)
    )

    centers = (np.arange(rows) - (rows - 1) / 2) * spike_pitch
    strip = section(
        rows * spike_pitch, skin_thickness, centers, root_thickness, tip_thickness, shape,
        element_size, cells, skin_rows, spike_columns,
    )  # fmt: skip
    layers = spike_layers or layers_across(spike_width, element_size)
    # Of the layers between two spikes half belong to the column of each.
    beside = math.ceil(layers_across(column_pitch - spike_width, element_size) / 2)
    edges = np.array([-column_pitch, -spike_width, spike_width, column_pitch]) / 2
    counts = np.array([beside, layers, beside])
    column = np.interp(np.arange(counts.sum()), np.cumsum([0, *counts]), edges)
    middles = (np.arange(columns) - (columns - 1) / 2) * column_pitch
    z = np.append(middles[:, None] + column, columns * column_pitch / 2)
    places = np.dstack([*np.broadcast_arrays(*strip.points.T[:, None], z[:, None])])
    stations = np.arange(places.size // 3).reshape(places.shape[:2])
    spiked = np.tile(np.repeat([False, True, False], counts), columns)
    body = renumbered(swept(strip, places, stations, spiked.tolist(), cells, inside="underside"))
    check(body)
    return body
