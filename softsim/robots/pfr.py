"""The PufferFace Robot: its section along its axis, as in the plane model of the thesis."""

import math
from dataclasses import dataclass

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.band import BANDS, CellKind, stacked_bands
from softsim.mesh.mesh import SURFACE, Mesh, renumbered, turned
from softsim.mesh.quality import check
from softsim.robots.limits import (
    check_counts,
    check_positive,
    check_rows,
    check_skin,
    check_thickness,
    least_thickness,
)
from softsim.robots.spike import CROSSINGS, Spike, spike
from softsim.robots.strip import LINES, node_lines, whole

FEWEST_ROWS = 3
"""Fewest rows of triangles through the skin: what its bending needs."""

FLATTEST_CELL = 1.5
"""Largest length of a triangle of the skin over the height of its row."""


@dataclass(frozen=True)
class Fineness:
    """How finely a strip is cut.

    rows: of cells through the skin. longest [m]: of cells along the skin. edge [m]: side of a
    spike's cells. columns: of cells across a spike; None: as many as `longest` gives.
    """

    kind: CellKind
    rows: int
    longest: float
    edge: float
    columns: int | None


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
    """Two skin strips with spikes on their outside, above and below the robot's axis.

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
    if not lean >= 0:
        raise MeshError(
            f"lean is {1e3 * lean:g} mm; spikes lean backward, 0 mm or more",
            hint="turn the body round for a robot that faces the other way",
        )
    check_rows("spike", spikes_per_strip, spike_pitch, root_thickness, free_length, element_size)
    shape = spike(spike_height, root_thickness, tip_thickness, lean, front_radius, rear_radius)
    check_thickness(shape, spike_height, least_thickness(cells, element_size, tip_thickness))

    centers = (np.arange(spikes_per_strip) - (spikes_per_strip - 1) / 2) * spike_pitch
    across = spike_columns or whole((root_thickness + tip_thickness) / 2 / element_size)
    fineness = _fineness(cells, skin, element_size, skin_rows, across)
    strip = _strip(free_length, skin, centers, root_thickness, shape, fineness)
    section = renumbered(_mirrored_pair(strip, distance=inner_diameter / 2))
    check(section)
    return section


def _fineness(
    kind: CellKind, skin: float, element_size: float, rows: int | None, columns: int
) -> Fineness:
    """What a skin of this thickness [m] is cut into; rows: through it, where given; columns: of
    quadrilaterals across a spike.
    """
    if kind == "quad":
        rows = rows or whole(skin / element_size)
        return Fineness(kind, rows, element_size, element_size, columns)
    edge = math.sqrt(2) * element_size
    rows = max(FEWEST_ROWS, int(skin / (edge * math.sin(math.pi / 3))))
    return Fineness(kind, rows, min(edge, FLATTEST_CELL * skin / rows), edge, None)


def _strip(
    length: float,
    skin: float,
    centers: np.ndarray,
    root: float,
    shape: Spike,
    fineness: Fineness,
) -> Mesh:
    """A strip with its inner face on y = 0, its spikes upward, centred on `centers` from the rear.

    All cells lie in bands between lines of nodes: along the skin, and across each spike.
    """
    kind, rows = fineness.kind, fineness.rows
    stations = np.sort([-length / 2, *(centers - root / 2), *(centers + root / 2), length / 2])
    x, ends = _columns(stations, fineness.longest, fineness.columns)
    coordinates = [
        np.column_stack([line, np.full(len(line), y)])
        for line, y in zip(
            LINES[kind](x, rows + 1)[::-1], np.linspace(0, skin, rows + 1), strict=True
        )
    ]
    lines = node_lines(0, coordinates)
    blocks, stacks = [*coordinates], [lines]
    outer, first_free = lines[-1], sum(map(len, coordinates))
    for center, start, end in zip(centers, ends[1:-1:2], ends[2:-1:2], strict=True):
        across = CROSSINGS[kind](shape, fineness.edge, end - start)
        above = node_lines(first_free, across[1:])
        first_free += sum(map(len, above))
        blocks += [line + np.array([center, skin]) for line in across[1:]]
        stacks.append([outer[start : end + 1], *above])

    points = np.concatenate(blocks)
    cells = [stacked_bands(points, stack, BANDS[kind]) for stack in stacks]
    knot_rear, knot_front = (np.array([line[side] for line in lines]) for side in (0, -1))
    node_sets = {
        "knot_front": knot_front,
        "knot_rear": knot_rear,
        "knots": np.concatenate([knot_front, knot_rear]),
        "chamber": lines[0],
    }
    cell_numbers = np.arange(sum(map(len, cells)))
    cell_sets = {"skin": cell_numbers[: len(cells[0])]}
    if len(centers):
        spikes = [np.concatenate(stack[1:]) for stack in reversed(stacks[1:])]
        node_sets |= {f"j{row}": nodes for row, nodes in enumerate(spikes, start=1)}
        node_sets["tips"] = _highest(points, np.concatenate(spikes))
        cell_sets["spikes"] = cell_numbers[len(cells[0]) :]
    return Mesh(
        points=points,
        cells=np.concatenate(cells),
        node_sets=node_sets,
        facet_sets={"chamber": np.column_stack([lines[0][:-1], lines[0][1:]])},
        cell_sets=cell_sets,
    )


def _columns(
    stations: np.ndarray, longest_cell: float, of_spikes: int | None
) -> tuple[np.ndarray, np.ndarray]:
    """Positions along the skin, equally spaced between stations, and where the stations lie.

    of_spikes: number of cells below a spike; None: as many as cells of longest_cell [m] give.
    """
    pieces = np.diff(stations)
    # Rounded down, for cells a little longer: the rows' height is the shorter measure.
    segments = np.maximum(1, np.floor(pieces / longest_cell + 1e-9)).astype(int)
    if of_spikes is not None:
        segments[1::2] = of_spikes
    ends = np.concatenate([[0], np.cumsum(segments)])
    return np.interp(np.arange(ends[-1] + 1), ends, stations), ends


def _highest(points: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    y = points[nodes, 1]
    return nodes[y > y.max() * (1 - 1e-9)]


def _mirrored_pair(strip: Mesh, distance: float) -> Mesh:
    """The strip moved outward to y = distance, and its mirror image below the axis."""
    top = strip.points + np.array([0, distance])
    nodes = {name: s for name, s in strip.node_sets.items() if name != SURFACE}
    facets = {name: s for name, s in strip.facet_sets.items() if name != SURFACE}
    node_count, cell_count = len(strip.points), len(strip.cells)
    # A mirror turns cells and facets round; listing them backwards turns them back.
    return Mesh(
        points=np.concatenate([top, top * np.array([1, -1])]),
        cells=np.concatenate([strip.cells, turned(strip.cells, 2) + node_count]),
        node_sets=_sided(nodes, {name: s + node_count for name, s in nodes.items()}),
        facet_sets=_sided(facets, {name: s[:, ::-1] + node_count for name, s in facets.items()}),
        cell_sets=_sided(
            strip.cell_sets, {name: s + cell_count for name, s in strip.cell_sets.items()}
        ),
    )


def _sided(top: dict[str, np.ndarray], bottom: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Each set X as X_top, X_bottom and X, the two together."""
    sets = {}
    for name in top:
        sets[name] = np.concatenate([top[name], bottom[name]])
        sets[f"{name}_top"], sets[f"{name}_bottom"] = top[name], bottom[name]
    return sets
