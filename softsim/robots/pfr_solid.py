"""The PufferFace Robot in three dimensions: its skin, a tube, with rows of curved spikes around."""

import math
from itertools import pairwise

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.band import CellKind
from softsim.mesh.mesh import Mesh, boundary_facets, facets_on, facets_touching, renumbered
from softsim.mesh.quality import check
from softsim.robots.extrusion import EXTRUSIONS
from softsim.robots.limits import (
    check_counts,
    check_positive,
    check_rows,
    check_skin,
    check_thickness,
    least_thickness,
)
from softsim.robots.spike import CROSSINGS, spike
from softsim.robots.strip import ROWS, Fin, Strip, even, even_columns, finned_strip

FEWEST_AROUND = 2
"""Fewest cells across a spike's width, and between neighbouring spikes."""

STRETCH_AROUND = 1.5
"""Length of the cells around over that along: the body bends in its sections through the axis."""


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
    """The skin between the knots with `rows` rows of `spikes_around` spikes on its outside.

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
    if not lean >= 0:
        raise MeshError(
            f"lean is {1e3 * lean:g} mm; spikes lean backward, 0 mm or more",
            hint="turn the body round for a robot that faces the other way",
        )
    check_rows("spike", rows, spike_pitch, root_thickness, element_size, free_length=free_length)
    shape = spike(spike_height, root_thickness, tip_thickness, lean, front_radius, rear_radius)
    check_thickness(
        "spike", shape, spike_height, least_thickness(cells, element_size, tip_thickness)
    )
    _check_around(spikes_around, spike_width, outer_diameter, element_size)

    skin = (outer_diameter - inner_diameter) / 2
    centers = (np.arange(rows) - (rows - 1) / 2) * spike_pitch
    edges = [*(centers - root_thickness / 2), *(centers + root_thickness / 2)]
    stations = np.sort([-free_length / 2, *edges, free_length / 2])
    across = even((root_thickness + tip_thickness) / 2 / element_size)
    columns = {"simplex": None, "quad": spike_columns or across}[cells]
    x, ends = even_columns(stations, element_size, columns)
    spikes = []
    for center, (start, end) in zip(centers, list(pairwise(ends))[1:-1:2], strict=True):
        lines = CROSSINGS[cells](shape, element_size, int(end - start))
        spikes.append(Fin(start, end, [line + np.array([center, skin]) for line in lines[1:]]))
    strip = finned_strip(x, skin, skin_rows or ROWS[cells](skin / element_size), spikes, cells)
    around = element_size * STRETCH_AROUND
    layers = spike_layers or max(FEWEST_AROUND, round(spike_width / around))
    body = renumbered(
        _swept(strip, inner_diameter / 2, skin, spikes_around, spike_width, layers, around, cells)
    )
    check(body)
    return body


def _check_around(count: int, width: float, outer_diameter: float, element_size: float) -> None:
    """Neighbouring spikes leave room for an element between their roots."""
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


def _swept(
    strip: Strip,
    inner: float,
    skin: float,
    count: int,
    width: float,
    across: int,
    length_around: float,
    kind: CellKind,
) -> Mesh:
    """The strip swept around the axis at the radius `inner`, its spikes within their width only.

    across: cells across the width of a spike. length_around [m]: of cells between spikes.
    """
    radius = inner + strip.points[:, 1]
    # Parallel flanks: the same distance from the spike's middle at every radius. The skin takes
    # the directions of the roots.
    offsets = np.linspace(-width / 2, width / 2, across + 1)
    spike_angles = np.arcsin(offsets[:, None] / np.maximum(radius, inner + skin))
    last = float(spike_angles[-1].max())
    first_of_next = 2 * math.pi / count - last
    gap = (first_of_next - last) * (inner + skin)
    between = max(FEWEST_AROUND, round(gap / length_around))
    gap_angles = np.linspace(last, first_of_next, between + 1)[1:-1]
    period = np.concatenate([spike_angles, np.repeat(gap_angles[:, None], len(radius), axis=1)])
    starts = 2 * math.pi * np.arange(count) / count
    angles = (starts[:, None, None] + period).reshape(-1, len(radius))

    points = np.stack(
        [
            np.broadcast_to(strip.points[:, 0], angles.shape),
            radius * np.cos(angles),
            radius * np.sin(angles),
        ],
        axis=-1,
    ).reshape(-1, 3)
    node = np.arange(angles.size).reshape(angles.shape)
    stations = np.concatenate([node, node[:1]])
    skin_cells = EXTRUSIONS[kind]([strip.skin_cells] * len(angles), stations)
    none = strip.fin_cells[:0]
    layers = ([strip.fin_cells] * across + [none] * between) * count
    spike_cells = EXTRUSIONS[kind](layers, stations)
    cells = np.concatenate([skin_cells, spike_cells])

    # Between the spikes the strip's fins stand for nothing; their nodes are left out.
    used = np.unique(cells)
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    cells = number[cells]

    def around(nodes: np.ndarray) -> np.ndarray:
        numbers = number[node[:, nodes].ravel()]
        return numbers[numbers >= 0]

    rear, front = (around(np.array([line[side] for line in strip.skin_lines])) for side in (0, -1))
    chamber, outer = strip.skin_lines[0], strip.skin_lines[-1]
    node_sets = {
        "knot_front": front,
        "knot_rear": rear,
        "knots": np.concatenate([front, rear]),
        "chamber": around(chamber),
        "outer": around(outer),
    }
    middle_inner, middle_outer = (strip.at_middle(line) for line in (chamber, outer))
    if len(middle_inner):
        node_sets["equator_inner"] = around(middle_inner)
        node_sets["equator_outer"] = np.setdiff1d(around(middle_outer), number[spike_cells])
    boundary = boundary_facets(cells, 3)
    facet_sets = {
        "chamber": facets_on(boundary, node_sets["chamber"]),
        "outer": facets_on(boundary, node_sets["outer"]),
    }
    cell_numbers = np.arange(len(cells))
    cell_sets = {"skin": cell_numbers[: len(skin_cells)]}
    if strip.fins:
        spikes = np.concatenate(strip.fins)
        height = strip.points[spikes, 1]
        node_sets |= {f"j{row}": around(s) for row, s in enumerate(reversed(strip.fins), start=1)}
        node_sets["tips"] = around(spikes[height > height.max() * (1 - 1e-9)])
        facet_sets["spikes"] = facets_touching(boundary, around(spikes))
        cell_sets["spikes"] = cell_numbers[len(skin_cells) :]
    return Mesh(points[used], cells, node_sets, facet_sets, cell_sets)
