"""Lists of the facets that each point of a surface may touch soon, and of the points of each facet.

Verlet lists: a pair is listed when it is closer than DEPTH of the longest facet plus a margin. The
lists are valid until two nodes have moved by the margin relative to each other; this is checked in
every increment, before any force (by the box that holds all displacements, so a body that moves as
a whole costs nothing). Every pair closer than DEPTH is therefore listed at all times, however fast
it moves, and with it all facets that may be closer, short ones too: without these the closest facet
would not be known, nor on which side of it a node is. The only condition on the increment is that
nothing gets deeper than DEPTH at once: v dt < DEPTH h. At the stable step, dt about h/c with the
speed of sound c, that is a speed of 0.7 c (here some 27 m/s), and a plane impact at 2 v penetrates
by 2 v/c facets.

The lists only save work: they are ordered by number, and what is farther than DEPTH has no effect,
so a run has the same bits whenever they are renewed.
"""

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import Number, index_field, real_field, vector_field
from softsim.compute.nodes import PARTS
from softsim.contact.deformable_surface import DEPTH, DeformableSurface, corner

# -------------------------------------------------------------------------------------------------
# Points sorted into the cells of a grid, so that near ones can be found.

# Hash of a cell: Teschner et al. 2003, Optimized spatial hashing for collision detection of
# deformable objects, VMV, section 3.1.
PRIMES = (73856093, 19349663, 83492791)


class CellLists:
    """Lists of `count` points by the cell that they lie in; distant cells may share a list.

    Fields: place (scenarios, count, d) [m], which the owner writes before `sort`; size of a cell
    (scenarios,) [m]; members (scenarios, count), those of list b from first[s, b] on, in their
    order.
    """

    def __init__(self, scenarios: int, count: int, dimension: int) -> None:
        self.count, self.dimension = Number(count), dimension
        # A power of two, which meshes of about the same size share.
        self.lists = 1 << int(np.ceil(np.log2(2 * count)))
        self.place = vector_field(np.zeros((scenarios, count, dimension)))
        self.size = real_field(np.ones(scenarios))
        self.first = index_field(np.zeros((scenarios, self.lists + 1)))
        self.member = index_field(np.zeros((scenarios, count)))

    @ti.func
    def cell(self, s, x):
        """Return the cell that x lies in."""
        return ti.cast(ti.floor(x / self.size[s]), ti.i32)

    @ti.func
    def list_of(self, cell):
        """Return the number of the list of the members of a cell."""
        key = 0
        for k in ti.static(range(self.dimension)):
            key ^= cell[k] * PRIMES[k]
        return key & (self.lists - 1)

    @ti.func
    def around(self, cell, q):
        """Return cell q of the 3^d cells at and around a cell."""
        result = cell
        for k in ti.static(range(self.dimension)):
            result[k] += q // 3**k % 3 - 1
        return result

    @ti.func
    def sort(self, s, size):
        """Sort all points into cells of this size [m], by counting."""
        self.size[s] = size
        for b in range(self.lists + 1):
            self.first[s, b] = 0
        for i in range(self.count.read()):
            b = self.list_of(self.cell(s, self.place[s, i]))
            self.first[s, b] = self.first[s, b] + 1
        for b in range(self.lists):
            self.first[s, b + 1] = self.first[s, b + 1] + self.first[s, b]
        count = self.count.read()
        for k in range(count):  # backwards: lists end at first[b] and are filled from there
            i = count - 1 - k
            b = self.list_of(self.cell(s, self.place[s, i]))
            self.first[s, b] = self.first[s, b] - 1
            self.member[s, self.first[s, b]] = i


# The margin over the mean side. Wider: more to look at in each increment. Narrower: made anew more
# often. With DEPTH it is less than NEIGHBOURHOOD, so that lists are empty at rest.
MARGIN = 1.5
# Facets that a node may have near it, nodes that a facet may, in facets of equal length: those of
# both sides of a fin pressed to half its length, twice over, in the plane; in space as many across.
MOST_FACETS = {2: 32, 3: 128}
MOST_NODES = {2: 64, 3: 288}


def margin_and_room(facet_size: np.ndarray, dimension: int) -> tuple[float, float, int]:
    """Return margin and longest side [m] for facets of these sides (f,) [m], and a capacity factor.

    The factor is the capacity of lists relative to that for facets of equal sides, from the ratio
    of the lengths or areas within reach.
    """
    mean, longest = float(facet_size.mean()), float(facet_size.max())
    margin = MARGIN * mean
    wider = (DEPTH * longest + margin) / (DEPTH * mean + margin)
    return margin, longest, int(np.ceil(wider ** (dimension - 1)))


@ti.func
def part_of(count, p):
    """Return the first index and the end of part p of `count` indices."""
    return count * p // PARTS, count * (p + 1) // PARTS


class NeighbourLists:
    """Pairs of points and facets of surfaces that may touch.

    Work is done in PARTS of the nodes or facets, so that most of it is skipped at once while
    nothing is near.

    Fields: near_facet (scenarios, k, room), near_facet_count; near_node (scenarios, f, room), the
    points near a facet, and near_node_count, in increasing order. travel (scenarios,): upper bound
    of the length [m] of the path of any two of the watched nodes relative to each other; due
    (scenarios, k): travel at which a point may touch, at the earliest. renewed (scenarios,): 1 if
    the lists are renewed in this increment. stale (scenarios,): set to 1 by the solver when it
    moves nodes to other positions. overfull (scenarios,): 1 if a list was full, which the solver
    checks.
    """

    def __init__(self, surface: DeformableSurface, margin: float, longest: float, room: int):
        """Allocate the fields.

        margin [m]. longest: longest side of a facet at rest [m]. room: factor on MOST_FACETS and
        MOST_NODES.
        """
        nodes = surface.nodes
        scenarios, d = nodes.scenarios, nodes.dimension
        self.surface, self.nodes = surface, nodes
        self.margin = real_field(np.array([margin]))
        self.deepest = real_field(np.array([DEPTH * longest]))  # that anything gets
        by_point = (scenarios, int(surface.point_count))
        by_facet = (scenarios, int(surface.facet_count))
        self.cells = CellLists(*by_facet, d)  # of the facets' centroids
        self.place = vector_field(np.zeros((scenarios, int(surface.watched_count), d)))
        self.radius = real_field(np.zeros(by_facet))
        self.facet_room, self.node_room = room * MOST_FACETS[d], room * MOST_NODES[d]
        self.near_facet = index_field(np.zeros((*by_point, self.facet_room)))
        self.near_facet_count = index_field(np.zeros(by_point))
        self.near_node = index_field(np.zeros((*by_facet, self.node_room)))
        self.near_node_count = index_field(np.zeros(by_facet))
        by_part = np.zeros((scenarios, PARTS, d))
        self.least, self.most = vector_field(by_part), vector_field(by_part)
        self.slowest, self.fastest = vector_field(by_part), vector_field(by_part)
        self.travel, self.due = real_field(np.zeros(scenarios)), real_field(np.zeros(by_point))
        self.stale, self.renewed = index_field(np.ones(scenarios)), index_field(np.zeros(scenarios))
        self.overfull = index_field(np.zeros(scenarios))

    @ti.func
    def watch(self, s, p, t, dt):
        """Compute the bounds of the displacements since the last renewal and of the velocities.

        They are those of the watched nodes of part p.
        """
        first, end = part_of(self.surface.watched_count.read(), p)
        least = ti.Vector.one(backend.real, self.nodes.dimension) * 1e30
        most, slowest, fastest = -least, least, -least
        for i in range(first, end):
            moved = self.surface.watched_place(s, i) - self.place[s, i]
            least, most = ti.min(least, moved), ti.max(most, moved)
            v = self.surface.watched_velocity(s, i)
            slowest, fastest = ti.min(slowest, v), ti.max(fastest, v)
        self.least[s, p], self.most[s, p] = least, most
        self.slowest[s, p], self.fastest[s, p] = slowest, fastest

    @ti.func
    def sort(self, s, p, t, dt):
        """Decide if lists are renewed and, if so, sort the facets into cells.

        A single thread does this, in order.
        """
        least, most = self.least[s, 0], self.most[s, 0]
        slowest, fastest = self.slowest[s, 0], self.fastest[s, 0]
        for part in range(1, PARTS):
            least = ti.min(least, self.least[s, part])
            most = ti.max(most, self.most[s, part])
            slowest = ti.min(slowest, self.slowest[s, part])
            fastest = ti.max(fastest, self.fastest[s, part])
        self.travel[s] = self.travel[s] + dt * (fastest - slowest).norm()
        self.renewed[s] = self.stale[s]
        if (most - least).norm_sqr() > self.margin[0] * self.margin[0]:
            self.renewed[s] = 1
        if self.renewed[s] == 1:
            if self.stale[s] == 1:
                self.stale[s], self.travel[s] = 0, 0.0
                for i in range(self.surface.point_count.read()):
                    self.due[s, i] = 0.0
            for k in range(self.surface.watched_count.read()):
                self.place[s, k] = self.surface.watched_place(s, k)
            widest = 0.0
            for f in range(self.surface.facet_count.read()):
                widest = ti.max(widest, self._place_facet(s, f))
            self.cells.sort(s, self.deepest[0] + self.margin[0] + widest)

    @ti.func
    def _place_facet(self, s, f):
        """Set the place of facet f to its centroid; return the distance of its farthest corner."""
        X = self.surface.corners(s, f)
        d = ti.static(self.nodes.dimension)
        centre = X.transpose() @ ti.Vector([1.0 / d for _ in ti.static(range(d))])
        square = 0.0
        for c in ti.static(range(d)):
            arm = corner(X, c) - centre
            square = ti.max(square, arm.norm_sqr())
        self.cells.place[s, f] = centre
        self.radius[s, f] = ti.sqrt(square)
        return self.radius[s, f]

    @ti.func
    def find_facets(self, s, p, t, dt):
        """Renew the lists of the nodes of part p if lists are due."""
        if self.renewed[s] == 1:
            first, end = part_of(self.surface.point_count.read(), p)
            for i in range(first, end):
                self.near_facet_count[s, i] = self._find_facets_of(s, i)

    @ti.func
    def _find_facets_of(self, s, i):
        """Renew the list of node i and return its number of facets."""
        count = 0
        x = self.surface.place(s, i)
        cell = self.cells.cell(s, x)
        reach = self.deepest[0] + self.margin[0]
        for q in range(3**self.nodes.dimension):
            there = self.cells.around(cell, q)
            b = self.cells.list_of(there)
            for e in range(self.cells.first[s, b], self.cells.first[s, b + 1]):
                f = self.cells.member[s, e]
                centre = self.cells.place[s, f]
                outside = reach + self.radius[s, f]
                # Cells that share a list are told apart last: most facets are too far anyway.
                if (
                    (x - centre).norm_sqr() <= outside * outside
                    and self._is_near(s, i, f, x, reach)
                    and (self.cells.cell(s, centre) == there).all()
                ):
                    count = self._insert(s, i, count, f)
        return count

    @ti.func
    def _is_near(self, s, i, f, x, reach):
        """Return True if facet f is within reach of point i at x, and no neighbour at rest."""
        X = self.surface.corners(s, f)
        w = self.surface.shape.closest_weights(X, x)
        result = False
        if (x - X.transpose() @ w).norm_sqr() <= reach * reach:
            result = self.surface.never_touch(i, f) == 0
        return result

    @ti.func
    def _insert(self, s, i, count, f):
        """Insert facet f into the list of node i, in order, and return the new number of facets."""
        result = count
        if count == self.facet_room:
            self.overfull[s] = 1
        else:
            k = count
            while k > 0 and self.near_facet[s, i, k - 1] > f:
                self.near_facet[s, i, k] = self.near_facet[s, i, k - 1]
                k -= 1
            self.near_facet[s, i, k] = f
            result = count + 1
        return result

    @ti.func
    def holds(self, s, i, f):
        """Return True if facet f is in the list of point i."""
        found = False
        for k in range(self.near_facet_count[s, i]):
            if self.near_facet[s, i, k] == f:
                found = True
        return found

    @ti.func
    def find_nodes(self, s, p, t, dt):
        """Renew the lists of the facets from those of the nodes if lists are due.

        A single thread does this, in order.
        """
        if self.renewed[s] == 1:
            for f in range(self.surface.facet_count.read()):
                self.near_node_count[s, f] = 0
            for i in range(self.surface.point_count.read()):
                for k in range(self.near_facet_count[s, i]):
                    f = self.near_facet[s, i, k]
                    count = self.near_node_count[s, f]
                    if count == self.node_room:
                        self.overfull[s] = 1
                    else:
                        self.near_node[s, f, count] = i
                        self.near_node_count[s, f] = count + 1
