"""Points sorted into the cells of a grid, so that near ones can be found."""

import numpy as np
import taichi as ti

from softsim.fields import Number, index_field, real_field, vector_field

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
