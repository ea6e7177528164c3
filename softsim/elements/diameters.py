"""Diameters of the rings of a section: their lengths, and the forces of hoop tension on their ends.

    l = |x_c - x_c'|,  n = (x_c - x_c') / l    of the opposite nodes c and c'.
The rings of cells around them pull with the tension T, along n on c' and against it on c: two
forces on one line, so a ring has no resultant force or moment. l and n are computed
once per diameter, because the cells at both its ends share it.
"""

import numpy as np
import taichi as ti

from softsim import backend
from softsim.fields import index_field, lane_field, real_field
from softsim.nodes import NodeLists, Nodes, by_lane


class Diameters:
    """Diameters of one body, a lane vector of them at a time.

    ends: (k, 2) nodes c, c'. rings: (r, corners) number of the diameter at each corner of each ring
    cell. cell: (r,) its number among `cell_count` lanes of all cells, with padding.

    length: (scenarios, places + 1) [m], at `places` (k,); the last one stays zero: no diameter.
    tension: (scenarios, cell_count + 1) [N] tension of each cell at each of its nodes, to be
    set before `pull`; the last one stays zero.
    """

    def __init__(
        self, nodes: Nodes, ends: np.ndarray, rings: np.ndarray, cell: np.ndarray, cell_count: int
    ) -> None:
        self.nodes, lanes = nodes, backend.lanes()
        cell_of_corner = np.repeat(cell, rings.shape[1])
        self.cells = lists = NodeLists(rings.ravel(), cell_of_corner, len(ends), cell_count)
        self.blocks = lists.blocks
        listed = lists.member.ravel()
        self.places = np.empty(len(ends), dtype=int)
        self.places[listed[listed >= 0]] = np.flatnonzero(listed >= 0)
        # Spare lanes measure the last diameter once more and pull at nothing.
        self.end = index_field(by_lane(ends[listed]))
        owners = np.where(listed[:, None] >= 0, ends[listed], -1)
        self.first_slot = nodes.corner_forces.reserve(by_lane(owners))
        blocks = int(self.blocks)
        self.length = real_field(np.zeros((nodes.scenarios, blocks * lanes + 1)))
        self.direction = [lane_field((nodes.scenarios, blocks)) for _ in range(2)]
        self.tension = real_field(np.zeros((nodes.scenarios, cell_count + 1)))

    @property
    def pad_slot(self) -> int:
        """Index of a length that stays zero."""
        return int(self.blocks) * backend.lanes()

    @ti.func
    def measure(self, s, b, t, dt):
        """Compute lengths and directions of a block."""
        x = self.cells.lane(0.0)
        y = self.cells.lane(0.0)
        for lane in ti.static(range(backend.lanes())):
            d = self.nodes.position[s, self.end[b, 0, lane]]
            d -= self.nodes.position[s, self.end[b, 1, lane]]
            x[lane] = d[0]
            y[lane] = d[1]
        length = ti.sqrt(x * x + y * y)
        inverse = 1.0 / length
        self.direction[0][s, b] = x * inverse
        self.direction[1][s, b] = y * inverse
        for lane in ti.static(range(backend.lanes())):
            self.length[s, b * ti.static(backend.lanes()) + lane] = length[lane]

    @ti.func
    def pull(self, s, b, t, dt):
        """Write the forces -T n and T n on the ends of a block's diameters, T summed over cells."""
        tension = self.cells.sum(self.tension, s, b)
        first = self.first_slot + 2 * b * ti.static(backend.lanes())
        second = first + ti.static(backend.lanes())
        x = tension * self.direction[0][s, b]
        y = tension * self.direction[1][s, b]
        for lane in range(ti.static(backend.lanes())):  # unrolled it takes seconds to compile
            force = ti.Vector([x[lane], y[lane]])
            self.nodes.corner_forces.write(s, first + lane, -force)
            self.nodes.corner_forces.write(s, second + lane, force)
