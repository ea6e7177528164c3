"""Curved spikes, and skins with spikes on them: strips and patches, from which robots are made."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.mesh import Mesh, boundary_facets, facets_on, facets_touching, renumbered
from softsim.mesh.quality import check
from softsim.mesh.surface import BANDS, CellKind, stacked_bands
from softsim.robots.block import EXTRUSIONS
from softsim.robots.limits import (
    check_at_least_one,
    check_cell_count,
    check_counts,
    check_lean,
    check_pitch,
    check_positive,
    least_thickness,
)

# -------------------------------------------------------------------------------------------------
# Curved spike of the PufferFace Robot and of Leafbot: a fin between two circular arcs.
#
# It stands on a skin along x, its root centred on the origin. Both arcs bulge forward (+x), so that
# the front edge is convex and the rear edge concave; its tip face is parallel to the skin.

SHARPEST_TIP = np.radians(15)
"""Smallest angle [rad] between rear edge and tip face.

No cell fits into a sharper tip.
"""

EQUILATERAL = np.radians(60)

FLATTEST_MEETING = np.radians(30)
"""Smallest angle [rad] at which the line of the tip face may meet the front edge.

Below it the cells beside the tip's front corner are slivers.
"""


@dataclass(frozen=True)
class Arc:
    """Circular arc about `center` (2,) [m], counter-clockwise, angles [rad] from the x axis."""

    center: np.ndarray
    radius: float
    start: float
    end: float

    def at(self, fraction: float) -> np.ndarray:
        """Return the point (2,) at a fraction of the arc's length."""
        angle = self.start + fraction * (self.end - self.start)
        return self.center + self.radius * np.array([np.cos(angle), np.sin(angle)])

    def x_at(self, y: np.ndarray) -> np.ndarray:
        """Return x [m] on the half of the circle that faces +x, at the heights y."""
        rise = np.clip((y - self.center[1]) / self.radius, -1, 1)
        return self.center[0] + self.radius * np.sqrt(1 - rise**2)

    @property
    def length(self) -> float:
        """Length [m] along the arc."""
        return self.radius * (self.end - self.start)


@dataclass(frozen=True)
class Spike:
    """Front and rear edge of a spike, each from root to tip."""

    front: Arc
    rear: Arc


def spike(
    height: float,
    root_thickness: float,
    tip_thickness: float,
    lean: float,
    front_radius: float,
    rear_radius: float,
) -> Spike:
    """Return the spike of these dimensions [m]; its tip lies `lean` behind (-x) its root.

    Raises MeshError, naming the radius, if an arc cannot span its edge or bulges past its ends.
    """
    root, tip = root_thickness / 2, tip_thickness / 2
    return Spike(
        front=_edge("front_radius", front_radius, (root, 0), (tip - lean, height), 0.0),
        rear=_edge("rear_radius", rear_radius, (-root, 0), (-tip - lean, height), SHARPEST_TIP),
    )


def thickness(shape: Spike, heights: np.ndarray) -> np.ndarray:
    """Return the thickness [m] of the spike along the skin, at heights [m] above it."""
    return shape.front.x_at(heights) - shape.rear.x_at(heights)


def check_thickness(what: str, shape: Spike, height: float, least: float) -> None:
    """Raise MeshError if a spike or limb of this height is thinner than `least` [m] anywhere."""
    heights = np.linspace(0, height, 101)
    across = thickness(shape, heights)
    thinnest = int(np.argmin(across))
    if across[thinnest] < least * (1 - 1e-9):
        raise MeshError(
            f"the {what} is {1e3 * across[thinnest]:.4g} mm thick {1e3 * heights[thinnest]:.4g} mm "
            f"from its root; at least {1e3 * least:.4g} mm is needed for its cells",
            hint="increase root_thickness, tip_thickness or rear_radius, or reduce element_size",
        )


def cross_lines(shape: Spike, edge: float, root_segments: int) -> list[np.ndarray]:
    """Return lines of points, (k, 2) from rear to front, stacked from root to tip, for triangles.

    edge: target length [m] of the sides of triangles between the lines; root_segments: number of
    segments of the first line, where the spike stands on the skin.
    """
    check_cell_count(_side(shape) / edge * root_segments, edge)
    bands = max(2, round(_side(shape) / (edge * np.sin(EQUILATERAL))))
    segments = [root_segments]
    for fraction in np.arange(1, bands + 1) / bands:
        rear, front = shape.rear.at(_neck(shape) * fraction), shape.front.at(fraction)
        segments.append(max(1, round(float(np.linalg.norm(front - rear)) / edge)))
    return _stacked_lines(shape, segments)


def grid_lines(shape: Spike, edge: float, root_segments: int) -> list[np.ndarray]:
    """Return lines as `cross_lines` does, all with as many segments, for quadrilaterals.

    edge: target length [m] of the sides of the quadrilaterals from root to tip.
    """
    check_cell_count(_side(shape) / edge * root_segments, edge)
    bands = max(1, round(_side(shape) / edge))
    return _stacked_lines(shape, [root_segments] * (bands + 1))


def _neck(shape: Spike) -> float:
    """Return the fraction of the rear edge up to which lines reach the front edge.

    A tip with a sharp rear corner, or with a front edge that meets its face at a small angle, is
    capped by lines that shrink to the rear corner, which keeps its cells in shape.
    """
    sharp = np.pi / 2 - shape.rear.end < EQUILATERAL
    flat = np.pi / 2 - shape.front.end < FLATTEST_MEETING
    if not (sharp or flat):
        return 1.0
    tip_length = float(np.linalg.norm(shape.front.at(1.0) - shape.rear.at(1.0)))
    return 1.0 - tip_length / shape.rear.length


def _side(shape: Spike) -> float:
    """Return the length [m] from the root to the last line that reaches the front edge."""
    return (shape.front.length + _neck(shape) * shape.rear.length) / 2


def _stacked_lines(shape: Spike, segments: list[int]) -> list[np.ndarray]:
    """Return lines of these numbers of segments up to the tip's front corner, and the cap."""
    neck, tip_rear, tip_front = _neck(shape), shape.rear.at(1.0), shape.front.at(1.0)
    fractions = np.arange(len(segments)) / (len(segments) - 1)
    lines = [
        _line(shape.rear.at(neck * fraction), shape.front.at(fraction), count)
        for fraction, count in zip(fractions, segments, strict=True)
    ]
    if neck < 1:
        for left in reversed(range(segments[-1])):
            fraction = left / segments[-1]
            rear = shape.rear.at(1 - fraction * (1 - neck))
            lines.append(_line(rear, tip_rear + fraction * (tip_front - tip_rear), left))
    return lines


CROSSINGS: dict[CellKind, Callable[[Spike, float, int], list[np.ndarray]]] = {
    "simplex": cross_lines,
    "quad": grid_lines,
}


def _line(rear: np.ndarray, front: np.ndarray, segments: int) -> np.ndarray:
    return np.linspace(rear, front, segments + 1)


def _edge(
    name: str,
    radius: float,
    root: tuple[float, float],
    tip: tuple[float, float],
    sharpest: float,
) -> Arc:
    """Return the arc from root to tip that bulges towards +x.

    sharpest: smallest angle [rad] that it may make with the skin's direction at its ends.
    """
    span = np.subtract(tip, root)
    chord = float(np.linalg.norm(span))
    bulge = np.array([span[1], -span[0]]) / chord
    tilt = float(np.arctan2(bulge[1], bulge[0]))
    room = np.pi / 2 - sharpest - abs(tilt)
    if room <= 0:
        raise MeshError(
            f"lean: the spike's edge of {name} leans {np.degrees(abs(tilt)):.3g} degrees; "
            f"less than {90 - np.degrees(sharpest):.3g} degrees is needed",
            hint="reduce lean or increase spike_height",
        )
    smallest = chord / (2 * np.sin(room))
    if radius < smallest:
        raise MeshError(
            f"{name} is {1e3 * radius:.4g} mm; an edge whose ends are {1e3 * chord:.4g} mm apart "
            f"needs at least {1e3 * smallest:.4g} mm, or it bulges past them"
        )
    half = float(np.arcsin(chord / (2 * radius)))
    center = np.add(root, tip) / 2 - bulge * radius * np.cos(half)
    return Arc(center=center, radius=radius, start=tilt - half, end=tilt + half)


# -------------------------------------------------------------------------------------------------
# Plane section of a skin with fins on its outside: spikes or rings.


@dataclass(frozen=True)
class Fin:
    """Fin on a strip's outside: its root from column `start` to `end`, its lines above the root.

    lines: points (k, 2) [m] of each line, in the direction of the strip, from root to tip.
    """

    start: int
    end: int
    lines: Sequence[np.ndarray]


@dataclass(frozen=True)
class Strip:
    """Strip of cells along x with its inner side on y = 0 and its fins upward.

    points: (n, 2) [m]. skin_lines: node numbers from -x to +x of the skin's lines, from the inner
    side to the outer one. fins: node numbers of each fin above the skin. skin_cells, fin_cells: (m,
    3) triangles or (m, 4) quadrilaterals.
    """

    points: np.ndarray
    skin_lines: list[np.ndarray]
    fins: list[np.ndarray]
    skin_cells: np.ndarray
    fin_cells: np.ndarray

    @property
    def cells(self) -> np.ndarray:
        """All cells (m, corners), those of the skin first."""
        return np.concatenate([self.skin_cells, self.fin_cells])

    def at_middle(self, nodes: np.ndarray) -> np.ndarray:
        """Return those of the nodes that lie on x = 0, where even columns place a node."""
        x = self.points[:, 0]
        return nodes[np.abs(x[nodes]) < 1e-9 * np.ptp(x)]


def even_columns(
    stations: np.ndarray, size: float, of_fins: int | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return positions with an even number of equal steps between stations, and stations' indices.

    size: approximate length of a step. of_fins: number of steps between the first and the second
    station, the third and the fourth ... of those inside; None: like all others.

    An even number puts a position in the middle between two stations, and gives mirrored stations
    mirrored tetrahedra.
    """
    check_cell_count(float(np.ptp(stations)) / size, size)
    steps = np.array([even(piece / size) for piece in np.diff(stations)])
    if of_fins is not None:
        steps[1::2] = of_fins
    ends = np.concatenate([[0], np.cumsum(steps)])
    return np.interp(np.arange(ends[-1] + 1), ends, stations), ends


def even(count: float) -> int:
    """Return the even number nearest to a count, 2 or more."""
    return 2 * max(1, math.floor(count / 2 + 0.5))


def whole(count: float) -> int:
    """Return the whole number nearest to a count, 1 or more."""
    return max(1, math.floor(count + 0.5))


ROWS: dict[CellKind, Callable[[float], int]] = {"simplex": even, "quad": whole}
"""Functions that round a count to a number of rows of cells."""


def staggered(x: np.ndarray, count: int) -> list[np.ndarray]:
    """Return `count` lines of positions; the first is x, and neighbours are half a cell apart.

    Staggered rows have triangles of nearly equal sides, whose altitude is that of the row. The
    midpoints next to the ends are left out: they would make small cells in the corners.
    """
    midpoints = (x[:-1] + x[1:]) / 2
    between = np.concatenate([x[:1], midpoints[1:-1], x[-1:]])
    return [x if line % 2 == 0 else between for line in range(count)]


def straight(x: np.ndarray, count: int) -> list[np.ndarray]:
    """Return `count` lines of the positions x."""
    return [x] * count


LINES: dict[CellKind, Callable[[np.ndarray, int], list[np.ndarray]]] = {
    "simplex": staggered,
    "quad": straight,
}


def finned_strip(
    x: np.ndarray, thickness: float, rows: int, fins: Sequence[Fin], kind: CellKind
) -> Strip:
    """Return a skin of this thickness [m] with columns at x [m], and fins that stand on it.

    rows: of cells through the skin; an even number of triangles, for nodes at x on its inner side
    too.
    """
    check_cell_count(rows * len(x), float(np.ptp(x)) / len(x))
    skin = _rows(LINES[kind](x, rows + 1), np.linspace(0, thickness, rows + 1))
    blocks, skin_lines = list(skin), node_lines(0, skin)
    outer, first_free = skin_lines[-1], sum(map(len, skin))
    stacks = []
    for fin in fins:
        above = node_lines(first_free, fin.lines)
        first_free += sum(map(len, above))
        blocks += fin.lines
        stacks.append([outer[fin.start : fin.end + 1], *above])
    points = np.concatenate(blocks)
    skin_cells = stacked_bands(points, skin_lines, BANDS[kind])
    of_fins = [stacked_bands(points, stack, BANDS[kind]) for stack in stacks]
    return Strip(
        points=points,
        skin_lines=skin_lines,
        fins=[np.concatenate(stack[1:]) for stack in stacks],
        skin_cells=skin_cells,
        fin_cells=np.concatenate([skin_cells[:0], *of_fins]),
    )


def upright(x: np.ndarray, low: float, high: float, rows: int, kind: CellKind) -> list[np.ndarray]:
    """Return the lines above the root of a rectangular fin: columns at x, y in [low, high] [m]."""
    return _rows(LINES[kind](x, rows + 1), np.linspace(low, high, rows + 1))[1:]


def _rows(lines: list[np.ndarray], heights: np.ndarray) -> list[np.ndarray]:
    return [
        np.column_stack([line, np.full(len(line), y)])
        for line, y in zip(lines, heights, strict=True)
    ]


def node_lines(first: int, lines: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return the node numbers of lines of points, numbered from `first` on."""
    ends = first + np.cumsum([0, *map(len, lines)])
    return [np.arange(start, end) for start, end in pairwise(ends)]


FEWEST_ROWS = 3
"""Smallest number of rows of triangles through the skin, required for its bending."""

FLATTEST_CELL = 1.5
"""Largest length of a triangle of the skin over the height of its row."""


@dataclass(frozen=True)
class Fineness:
    """Mesh sizes of a strip.

    rows: of cells through the skin. longest [m]: of cells along the skin. edge [m]: side of a
    spike's cells. columns: of cells across a spike; None: as many as `longest` gives.
    """

    kind: CellKind
    rows: int
    longest: float
    edge: float
    columns: int | None


def fineness_of(
    kind: CellKind, skin: float, element_size: float, rows: int | None, columns: int
) -> Fineness:
    """Return the mesh sizes for a skin of this thickness [m].

    rows: number through it, where given. columns: of quadrilaterals across a spike.
    """
    if kind == "quad":
        rows = rows or whole(skin / element_size)
        return Fineness(kind, rows, element_size, element_size, columns)
    edge = math.sqrt(2) * element_size
    rows = max(FEWEST_ROWS, int(skin / (edge * math.sin(math.pi / 3))))
    return Fineness(kind, rows, min(edge, FLATTEST_CELL * skin / rows), edge, None)


def spiked_strip(
    length: float,
    skin: float,
    centers: np.ndarray,
    root: float,
    shape: Spike,
    fineness: Fineness,
) -> Mesh:
    """Return a strip with its inner face on y = 0 and spikes upward on `centers`, from the rear.

    All cells lie in bands between lines of nodes: along the skin, and across each spike.
    """
    kind, rows = fineness.kind, fineness.rows
    check_cell_count(rows * length / fineness.longest, fineness.edge)
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
    """Return positions along the skin, equally spaced between stations, and the stations' indices.

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


# -------------------------------------------------------------------------------------------------
# Patch of the PufferFace Robot's sleeve, laid flat: rows and columns of spikes on a skin.


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
