"""Wall sampled on a grid of signed distances, with linear interpolation.

Any wall of straight facets becomes one table. Near the wall the values at the nodes are exact;
farther away each node continues from the nearest exact one: it takes its sign, and the distance is
right to within a diagonal of a cell.

Between the nodes the gap is interpolated linearly along each axis. On a straight wall that is
exact. Where the wall has the curvatures k1, k2 (circle: k1 = 1/R, k2 = 0) the gap is off by at most
spacing^2 (|k1| + |k2|) / 8, because the second derivatives of the distance along the axes add up to
no more. At an edge or a corner, which the grid rounds off, it is off by half a cell's diagonal at
most, because a distance changes by no more than the displacement.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
import taichi as ti
from scipy.ndimage import distance_transform_edt

from softsim.compute import backend
from softsim.compute.fields import index_field, real_field, vector_field
from softsim.compute.term import PerScenario
from softsim.compute.vectors import KERNEL, NUMPY
from softsim.contact.wall import Obstacle, Wall
from softsim.errors import MeshError
from softsim.mesh.surface import read_surface
from softsim.scene.names import Names
from softsim.scene.walls import SurfaceWall

# -------------------------------------------------------------------------------------------------
# Walls on grids of distances in kernels: gap and normal by interpolation between the nodes.


class GriddedObstacle(Obstacle):
    """Wall on a grid, one entry of `walls` per scenario.

    Scenarios with the same grid share it.
    """

    count = 1

    def __init__(self, walls: Sequence["DistanceGrid"]) -> None:
        self.place_in_grid, self.interpolated, self.gap_beyond = map(
            ti.func, (place_in_grid, interpolated, gap_beyond)
        )
        self.dimension = walls[0].values.ndim
        self.value, first = joined([w.values for w in walls])
        self.first = index_field(first)
        self.nodes = vector_field(np.array([w.values.shape for w in walls], dtype=float))
        self.origin = vector_field(np.stack([w.origin for w in walls]))
        self.spacing = real_field(np.array([w.spacing for w in walls]))

    @ti.func
    def gap_and_normal(self, s, i, w, x):
        """Return the signed gap [m] of contact node i at x, and the unit normal.

        The gap is negative in the wall. The normal has the direction of the gradient of the gap.
        """
        h = self.spacing[s]
        cell, fraction, beyond = self.place_in_grid(x, self.origin[s], h, self.nodes[s], KERNEL)
        values = ti.Vector.zero(backend.real, ti.static(2**self.dimension))
        for corner in ti.static(range(2**self.dimension)):
            number = 0
            for a in ti.static(range(self.dimension)):
                number = number * ti.cast(self.nodes[s][a], ti.i32) + (
                    ti.cast(cell[a], ti.i32) + (corner >> a) % 2
                )
            values[corner] = self.value[self.first[s] + number]
        gap, slope = self.interpolated(values, fraction, KERNEL)
        gap = self.gap_beyond(gap, beyond, h, KERNEL)
        return gap, slope / ti.max(slope.norm(), 1e-12)


def place_in_grid(x, origin, spacing, nodes, m):
    """Return the cell of points x, the place in it, and the vector from the grid to x.

    All are in spacings. Outside the grid the cell and the place in it are those of the nearest
    point of its boundary.
    """
    u = (x - origin) / spacing
    rim = m.minimum(m.maximum(u, 0.0), nodes - 1.0)
    cell = m.minimum(m.floor(rim), nodes - 2.0)
    return cell, rim - cell, u - rim


def interpolated(values, fraction, m):
    """Return the gap [m] at a place in a cell, and its slope along each axis in spacings.

    values: gaps g_c at the corners c of the cell; bit a of c is its side along axis a. g = sum of
    w_c g_c; w_c is the product, over the axes, of the fraction of the path across the cell, or its
    complement. The derivative of w_c along an axis is the product over the other axes, with the
    sign of the corner's side.
    """
    d = ti.static(len(fraction))
    gap, slope = 0.0 * fraction[0], 0.0 * fraction
    for corner in ti.static(range(2**d)):
        weight = 1.0
        for a in ti.static(range(d)):
            weight *= fraction[a] if ti.static((corner >> a) % 2) else 1.0 - fraction[a]
            of_slope = values[corner] if ti.static((corner >> a) % 2) else -values[corner]
            for b in ti.static(range(d)):
                if ti.static(b != a):
                    weight_b = fraction[b] if ti.static((corner >> b) % 2) else 1.0 - fraction[b]
                    of_slope = of_slope * weight_b
            slope[a] += of_slope
        gap += weight * values[corner]
    return gap, slope


def gap_beyond(gap, beyond, spacing, m):
    """Return the gap [m] of points by the vector `beyond`, in spacings, outside the grid."""
    distance = spacing * m.norm(beyond)
    return gap + m.where(gap < 0.0, -distance, distance)


def joined(tables: Sequence[np.ndarray]) -> tuple[ti.ScalarField, np.ndarray]:
    """Return one field of the numbers of all different tables, and the start of each table."""
    kept: list[np.ndarray] = []
    begins: list[int] = []
    for table in tables:
        alike = [k for k, one in enumerate(kept) if np.array_equal(one, table)]
        if not alike:
            kept.append(table)
        number = alike[0] if alike else len(kept) - 1
        begins.append(sum(one.size for one in kept[:number]))
    return real_field(np.concatenate([one.ravel() for one in kept])), np.array(begins)


# -------------------------------------------------------------------------------------------------
# Wall that is a closed surface of triangles in space, with exact signed distances.
#
# The sign of the distance is that of the vector from the nearest point of the surface, projected on
# the pseudonormal there: a triangle's normal inside it, the sum of both on an edge, at a corner the
# sum of those around it, each weighted by its angle there. It is right whichever triangle is taken
# as the nearest (Baerentzen and Aanaes, IEEE Trans. Vis. Comput. Graph. 11 (2005) 243).

# A triangle whose height is below this share of its longest edge has no normal of its own.
FLAT = 1e-9


@dataclass(frozen=True, eq=False)
class TriangleSurface:
    """Closed surface of triangles (m, 3) with points (n, 3) [m].

    Normals follow the right-hand rule into the free side. Each edge has two triangles, which pass
    it in opposite directions.
    """

    points: np.ndarray
    triangles: np.ndarray

    @cached_property
    def corners(self) -> np.ndarray:
        """Positions of the triangles' corners (m, 3, 3) [m]."""
        return self.points[self.triangles]

    @cached_property
    def ways(self) -> np.ndarray:
        """Vectors from each corner of the triangles to the next (m, 3, 3) [m]."""
        return np.roll(self.corners, -1, axis=1) - self.corners

    @cached_property
    def normals(self) -> np.ndarray:
        """Unit normals (m, 3); zero for a degenerate triangle."""
        across = np.cross(self.ways[:, 0], self.ways[:, 1])
        size = np.linalg.norm(across, axis=1)
        is_flat = size <= FLAT * (self.ways**2).sum(axis=2).max(axis=1)
        return np.where(is_flat[:, None], 0.0, across / np.where(is_flat, 1.0, size)[:, None])

    @cached_property
    def edge_normals(self) -> np.ndarray:
        """Sum of the normals on both sides (m, 3, 3) of the edge after each corner."""
        begin, end = self.triangles, np.roll(self.triangles, -1, axis=1)
        keys = (np.minimum(begin, end) * len(self.points) + np.maximum(begin, end)).ravel()
        edge = np.unique(keys, return_inverse=True)[1].reshape(-1)
        return _sums(np.repeat(self.normals, 3, axis=0), edge)[edge].reshape(-1, 3, 3)

    @cached_property
    def corner_normals(self) -> np.ndarray:
        """Sum of the normals around each corner (m, 3, 3), weighted by their angles."""
        before = -np.roll(self.ways, 1, axis=1)
        across = np.linalg.norm(np.cross(self.ways, before), axis=2)
        angle = np.arctan2(across, (self.ways * before).sum(axis=2))
        weighted = (angle[..., None] * self.normals[:, None]).reshape(-1, 3)
        return _sums(weighted, self.triangles.ravel(), len(self.points))[self.triangles]

    def boxes(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest and highest coordinates (m, 3) [m] of each triangle."""
        return self.corners.min(axis=1), self.corners.max(axis=1)

    def spheres(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the centre (m, 3) [m] and radius (m,) [m] of a sphere around each triangle."""
        centres = self.corners.mean(axis=1)
        return centres, np.linalg.norm(self.corners - centres[:, None], axis=2).max(axis=1)

    def plane_distances(self, x: np.ndarray, triangle: np.ndarray) -> np.ndarray:
        """Return the distances (k,) [m] of points x (k, 3) to the planes of triangles (k,)."""
        arm = x - self.corners[triangle, 0]
        return np.abs((arm * self.normals[triangle]).sum(axis=1))

    def signed_distances(self, x: np.ndarray, triangle: np.ndarray) -> np.ndarray:
        """Return the signed distances (k,) [m] of points x (k, 3) to triangles (k,).

        The sign is right where no other triangle is nearer.
        """
        normal, ways = self.normals[triangle], self.ways[triangle]
        arms = x[:, None] - self.corners[triangle]
        # Nearest point of each edge, then of the nearest edge.
        length_squared = (ways**2).sum(axis=2)
        share = np.clip((arms * ways).sum(axis=2) / length_squared, 0.0, 1.0)
        from_edges = arms - share[..., None] * ways
        squared = (from_edges**2).sum(axis=2)
        edge, one = squared.argmin(axis=1), np.arange(len(x))
        arm, share, distance = from_edges[one, edge], share[one, edge], squared[one, edge] ** 0.5
        side = np.where(
            (share == 0.0)[:, None],
            self.corner_normals[triangle, edge],
            np.where(
                (share == 1.0)[:, None],
                self.corner_normals[triangle, (edge + 1) % 3],
                self.edge_normals[triangle, edge],
            ),
        )
        result = distance * np.where((arm * side).sum(axis=1) < 0.0, -1.0, 1.0)
        # Beside the triangle's inside, where it has one, the plane is nearer than the edges.
        left_of = (np.cross(ways, arms) * normal[:, None]).sum(axis=2)
        is_beside = (left_of > 0.0).all(axis=1)
        return np.where(is_beside, (arms[:, 0] * normal).sum(axis=1), result)


def _sums(vectors: np.ndarray, group: np.ndarray, groups: int = 0) -> np.ndarray:
    """Return the sums (groups, 3) of the vectors (k, 3) of each group (k,)."""
    sums = [np.bincount(group, weights=column, minlength=groups) for column in vectors.T]
    return np.stack(sums, axis=1)


# -------------------------------------------------------------------------------------------------
# Grids of distances in numpy: the wall, and the distances at its nodes.

# Distances are exact within so many spacings of the wall. More than a cell's diagonal, so that this
# holds for all nodes of a cell that the wall passes: and no wall lies between a node outside the
# band and the nearest one inside, since there is a node within half a diagonal of anywhere.
BAND = 3
# Nodes of the largest grid: 130 MB of values, under 1 GB while they are computed.
MOST_NODES = 2**24
# Pairs of a node and a facet that are looked at together: some 100 MB.
CHUNK = 2**18


class SpacingError(MeshError):
    """Error of a grid whose spacing is too small or too large."""


@dataclass(frozen=True, eq=False)
class DistanceGrid(Wall):
    """Wall `name` given by its signed distances on a grid.

    values (nx, ny) or (nx, ny, nz) [m] are the distances at the nodes origin (d,) + spacing * (i,
    j, k) [m], negative in the wall. Outside the grid's box the gap is that of the nearest point of
    the box, enlarged in magnitude by the distance to it, so free space remains free and solid
    remains solid. picture: arrays that `drawn` returns.
    """

    name: PerScenario[str]
    origin: PerScenario[np.ndarray]
    spacing: PerScenario[float]
    values: PerScenario[np.ndarray]
    picture: PerScenario[dict[str, np.ndarray]]

    @property
    def names(self) -> tuple[str, ...]:
        return (self.name,)

    def band(self) -> float:
        return float(BAND * self.spacing)

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        nodes = np.array(self.values.shape)
        cell, fraction, beyond = place_in_grid(
            x.T, self.origin[:, None], self.spacing, nodes[:, None], NUMPY
        )
        corners = (np.arange(2 ** len(nodes))[:, None] >> np.arange(len(nodes))) % 2
        at = cell.astype(int)[:, None] + corners.T[..., None]
        gap, _ = interpolated(self.values[tuple(at)], fraction, NUMPY)
        return {self.name: gap_beyond(gap, beyond, self.spacing, NUMPY)}

    def obstacle(self, scenarios: Sequence["DistanceGrid"], places: np.ndarray) -> GriddedObstacle:
        return GriddedObstacle(scenarios)

    def touched_at_once(self) -> tuple[float, float]:
        """Return the slope of the gap of the one surface for both bounds."""
        return self.steepest(), self.steepest()

    def steepest(self) -> float:
        """Return the largest slope |grad g| [-] of the gap in cells that reach into the wall.

        It is 1 where the wall is straight and up to the square root of d at an edge.
        """
        axes, least = range(self.values.ndim), self.values
        for axis in axes:
            least = _of_neighbours(np.minimum, least, axis)
        # Farther in than the band is exact, nothing gets.
        touched = (least < 0.0) & (least > -BAND * self.spacing)
        squared = np.zeros(int(touched.sum()))
        for axis in axes:
            # Of the edges of a cell along an axis the steepest; of a straight wall all are alike.
            steps = np.abs(np.diff(self.values, axis=axis))
            for other in axes:
                if other != axis:
                    steps = _of_neighbours(np.maximum, steps, other)
            squared += (steps[touched] / self.spacing) ** 2
        return float(np.sqrt(squared.max(initial=1.0)))

    def drawn(self) -> dict[str, np.ndarray]:
        """Return the facets from which the grid was made."""
        return self.picture


def _of_neighbours(function: np.ufunc, values: np.ndarray, axis: int) -> np.ndarray:
    """Apply a function to each two neighbours along an axis."""
    count = values.shape[axis]
    return np.asarray(
        function(values.take(range(count - 1), axis), values.take(range(1, count), axis))
    )


def tabulated(
    wall: TriangleSurface, low: np.ndarray, high: np.ndarray, spacing: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the origin (d,) [m] and the values [m] of the grid of a wall.

    The grid covers the box from low to high (d,) [m], enlarged by the band on all sides. Raises
    SpacingError if the grid would be too large (with a spacing that would do) or the wall is too
    thin for it, and MeshError if the wall has no clear inside.
    """
    shape = shape_of_grid(low, high, spacing)
    if np.prod([float(n) for n in shape]) > MOST_NODES:
        raise SpacingError(
            f"a grid of {' x '.join(str(n) for n in shape)} nodes, {spacing * 1e3:.3g} mm apart, "
            f"is too large: at most {MOST_NODES:,} nodes",
            hint=f"set the spacing of the wall to {least_spacing(low, high) * 1e3:.3g} mm, or "
            "remove parts of the surface that nothing can touch",
        )
    origin = low - BAND * spacing
    values = distances_in_band(wall, origin, spacing, shape)
    carry_on(values, spacing)
    refuse_unclear_sides(values, origin, spacing)
    refuse_too_thin(values, origin, spacing, wall)
    return origin, values


def shape_of_grid(low: np.ndarray, high: np.ndarray, spacing: float) -> tuple[int, ...]:
    """Return the number of nodes along each axis of the box (d,) [m] with the band around it."""
    return tuple(int(n) for n in np.ceil((high - low) / spacing) + 2 * BAND + 1)


def least_spacing(low: np.ndarray, high: np.ndarray) -> float:
    """Return a spacing [m], rounded up to two digits, with which the grid is not too large."""
    spacing = float(np.ptp(np.stack([low, high]), axis=0).max()) / MOST_NODES
    while np.prod([float(n) for n in shape_of_grid(low, high, spacing)]) > MOST_NODES:
        spacing *= 1.02
    digit = 10.0 ** (np.floor(np.log10(spacing)) - 1.0)
    return float(np.ceil(spacing / digit) * digit)


def distances_in_band(
    wall: TriangleSurface, origin: np.ndarray, spacing: float, shape: tuple[int, ...]
) -> np.ndarray:
    """Return the signed distances [m] at the nodes in the band, infinite at the others."""
    farthest = farthest_facets(wall, origin, spacing, shape)
    centres, radii = wall.spheres()
    values = np.full(len(farthest), np.inf)
    for node, facet in pairs_nearby(wall, origin, spacing, shape):
        x = places_of(node, origin, spacing, shape)
        near = np.linalg.norm(x - centres[facet], axis=1) - radii[facet] <= farthest[node]
        node, facet, x = node[near], facet[near], x[near]
        near = wall.plane_distances(x, facet) <= farthest[node]
        node, distance = node[near], wall.signed_distances(x[near], facet[near])
        # Of each node the nearest facet: the first one in the order of the nodes.
        order = np.lexsort((np.abs(distance), node))
        node, distance = node[order], distance[order]
        first = np.append(True, node[1:] != node[:-1])[: len(node)]
        node, distance = node[first], distance[first]
        nearer = (np.abs(distance) <= farthest[node]) & (np.abs(distance) < np.abs(values[node]))
        values[node[nearer]] = distance[nearer]
    return values.reshape(shape)


def farthest_facets(
    wall: TriangleSurface, origin: np.ndarray, spacing: float, shape: tuple[int, ...]
) -> np.ndarray:
    """Return an upper bound (nodes,) [m] of the distance from each node to its nearest facet.

    It follows from the facets' centres and is at most the width of the band; facets farther away
    need not be tested.
    """
    centres, _ = wall.spheres()
    farthest = np.full(int(np.prod(shape)), BAND * spacing)
    for node, facet in pairs_nearby(wall, origin, spacing, shape):
        x = places_of(node, origin, spacing, shape)
        np.minimum.at(farthest, node, np.linalg.norm(x - centres[facet], axis=1))
    return farthest + 1e-6 * spacing  # for what rounding makes of the nearest one


def places_of(
    node: np.ndarray, origin: np.ndarray, spacing: float, shape: tuple[int, ...]
) -> np.ndarray:
    """Return the positions (k, d) [m] of nodes (k,), numbered along the last axis first."""
    return np.asarray(origin + spacing * np.stack(np.unravel_index(node, shape), axis=1))


def pairs_nearby(
    wall: TriangleSurface, origin: np.ndarray, spacing: float, shape: tuple[int, ...]
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield, in parts, pairs (k,) of a node and a facet whose enlarged box contains the node.

    Boxes are enlarged by the band. Nodes are numbered along the last axis first.
    """
    low, high = wall.boxes()
    last = np.array(shape) - 1
    begin = np.ceil((low - origin) / spacing - BAND).clip(0, last + 1).astype(int)
    end = np.floor((high - origin) / spacing + BAND).clip(-1, last).astype(int)
    sizes = np.maximum(end - begin + 1, 0)
    ends = np.cumsum(sizes.prod(axis=1))
    for first in range(0, int(ends[-1]), CHUNK):
        pair = np.arange(first, min(first + CHUNK, int(ends[-1])))
        facet = np.searchsorted(ends, pair, side="right")
        rest = pair - (ends[facet] - sizes[facet].prod(axis=1))
        index = np.empty((len(pair), len(shape)), dtype=int)
        for axis in reversed(range(len(shape))):
            index[:, axis] = begin[facet, axis] + rest % sizes[facet, axis]
            rest //= sizes[facet, axis]
        yield np.ravel_multi_index(tuple(index.T), shape), facet


def carry_on(values: np.ndarray, spacing: float) -> None:
    """Extend the distances to the nodes outside the band.

    Each takes the sign of the nearest node inside, and the sum of that node's distance from the
    wall and the distance between both [m]: too much by a cell's diagonal at most.
    """
    outside = np.isinf(values)
    if not outside.any():
        return
    nearest = distance_transform_edt(outside, return_distances=False, return_indices=True)
    for i in range(len(values)):  # layer by layer: all at once would take ten times the grid
        here = np.nonzero(outside[i])
        there = np.stack([axis[i][here] for axis in nearest])
        steps = there - np.stack([np.full(len(here[0]), i), *here])
        way, seen = spacing * np.linalg.norm(steps, axis=0), values[tuple(there)]
        values[i][here] = seen + np.where(seen < 0.0, -way, way)


def refuse_unclear_sides(values: np.ndarray, origin: np.ndarray, spacing: float) -> None:
    """Raise MeshError if the signs of the distances contradict each other.

    Between neighbours of opposite signs lies the wall, so their distances from it add up to no more
    than the spacing.
    """
    for axis in range(values.ndim):
        count = values.shape[axis]
        one, other = values.take(range(count - 1), axis), values.take(range(1, count), axis)
        wrong = ((one < 0.0) != (other < 0.0)) & (np.abs(one - other) > (1.0 + 1e-9) * spacing)
        if wrong.any():
            place = origin + spacing * np.argwhere(wrong)[0]
            raise MeshError(
                f"the surface has no unique inside near {_in_mm(place)}",
                hint="it crosses itself there, or part of it is turned inside out: make it one "
                "solid with all normals outwards",
            )


def refuse_too_thin(
    values: np.ndarray, origin: np.ndarray, spacing: float, wall: TriangleSurface
) -> None:
    """Raise SpacingError if the wall is too thin for its grid.

    Within two cells of the centre of every facet there must be a node half a spacing deep in the
    wall; otherwise the grid would have holes where the wall is thinner than a cell.
    """
    u, last = (wall.spheres()[0] - origin) / spacing, np.array(values.shape) - 1
    cell = u[((u >= 0.0) & (u <= last)).all(axis=1)].astype(int)
    deepest = np.full(len(cell), np.inf)
    for step in product(range(-2, 4), repeat=len(last)):
        node = np.clip(cell + step, 0, last)
        deepest = np.minimum(deepest, values[tuple(node.T)])
    thin = np.flatnonzero(deepest > -0.5 * spacing)
    if len(thin):
        raise SpacingError(
            f"near {_in_mm(origin + spacing * cell[thin[0]])} the wall is too thin for its grid, "
            f"whose nodes are {spacing * 1e3:.3g} mm apart",
            hint="set the spacing to half the thickness of the wall there, or make the wall "
            "thicker",
        )


def _in_mm(place: np.ndarray) -> str:
    return "(" + ", ".join(f"{c * 1e3:.4g}" for c in place) + ") mm"


def gridded(name: str, surface: TriangleSurface, spacing: float) -> DistanceGrid:
    """Return the wall `name` on a grid of the spacing [m] that holds the whole surface.

    Raises SpacingError if the grid is too large or the wall too thin for it, and MeshError if the
    wall has no clear inside.
    """
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    origin, values = tabulated(surface, low, high, spacing)
    # Faces of four corners, as those of other walls: the third one twice.
    picture = {"wall_faces": surface.corners[:, [0, 1, 2, 2]]}
    return DistanceGrid(name, origin, spacing, values, picture)


# -------------------------------------------------------------------------------------------------
# Surfaces of a scene.


def surface_walls(names: Names, motions: Collection[str]) -> list[DistanceGrid]:
    """Return the surface walls of a scene."""
    return [surface_wall(names, *named) for named in names.walls(SurfaceWall).items()]


def surface_wall(names: Names, name: str, wall: SurfaceWall) -> DistanceGrid:
    """Return a closed surface in space, with normals that point to the free side."""
    keys = ("environment", "walls", name)
    if names.dimension != 3:
        raise names.loaded.error(
            (*keys, "kind"),
            "a surface file describes a wall in 3D, but this model is 2D",
            "give the section of the wall as points: kind: polyline",
        )
    try:
        mesh = read_surface(names.loaded.resolve_file((*keys, "file")), wall.length_unit)
        outwards = mesh.triangles
        triangles = {"outside": outwards, "inside": outwards[:, ::-1]}[wall.free_side]
        points = mesh.points + names.vector(wall.position, (*keys, "position"))
        surface = TriangleSurface(points, triangles)
        return gridded(name, surface, grid_spacing(names, wall))
    except SpacingError as error:
        raise names.loaded.error((*keys, "spacing"), error.message, error.hint) from None
    except MeshError as error:
        raise names.loaded.error((*keys, "file"), error.message, error.hint) from None


def grid_spacing(names: Names, wall: SurfaceWall) -> float:
    """Return the grid spacing [m]: the user's, or the median edge of the surfaces of all bodies.

    Nodes at that distance do not resolve anything finer.
    """
    if isinstance(wall.spacing, float):
        return wall.spacing
    return names.median_side
