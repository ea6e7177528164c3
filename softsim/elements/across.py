"""Elements of a section, and what happens across it: F_zz, and the force of the stress F_zz S_zz.

Plane strain: F_zz = 1, and the stress across does no work. Where something goes around F_zz follows
the nodes, see elements/axisymmetric.py and ring_section.py.
"""

import taichi as ti

from softsim import backend
from softsim.elements.metric import PlaneMetric
from softsim.elements.one_point import OnePointElements
from softsim.elements.region import Region
from softsim.nodes import Nodes
from softsim.term import Pass, Stage


class Across:
    """Of plane strain."""

    def __init__(self) -> None:
        self.lane = backend.lane_vector()

    def passes(self) -> dict[Stage, list[Pass]]:
        """Of an increment, beside those of the elements."""
        return {}

    @ti.func
    def measure(self, s, b, x: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Store what F_zz of block b follows from; x: lane vectors, of each corner."""

    @ti.func
    def stretch(self, s, b):
        """F_zz."""
        return self.lane(1.0)

    @ti.func
    def tension(self, s, b, S):
        """What the stress across, S_zz times V, pulls with, over `weight`."""
        return self.lane(0.0)

    @ti.func
    def weight(self, b, corner: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """What of the tension pulls at a corner along -x."""
        return self.lane(0.0)


class SectionElements(OnePointElements):
    """Elements of a section; across: what happens across it. Others as for OnePointElements."""

    def __init__(self, nodes: Nodes, region: Region, bulk_viscosity: float, across: Across) -> None:
        super().__init__(nodes, region, PlaneMetric(), bulk_viscosity)
        self.across = across

    def passes(self) -> dict[Stage, list[Pass]]:
        """Of an increment."""
        return stacked(super().passes(), self.across.passes())

    @ti.func
    def volume_ratio(self, s, b):
        """J."""
        ax, ay, bx, by = ti.static(self.edge)
        area = ax[s, b] * by[s, b] - ay[s, b] * bx[s, b]
        return area * self.inverse_determinant[b] * self.across.stretch(s, b)

    @ti.func
    def stretch(self, s, b):
        """C in the basis of the edges, and J."""
        ax, ay, bx, by = ti.static(self.edge)
        zz = self.across.stretch(s, b)
        C = self.metric.Symmetric(
            aa=ax[s, b] * ax[s, b] + ay[s, b] * ay[s, b],
            bb=bx[s, b] * bx[s, b] + by[s, b] * by[s, b],
            ab=ax[s, b] * bx[s, b] + ay[s, b] * by[s, b],
            zz=zz * zz,
        )
        return C, self.volume_ratio(s, b)


def stacked(*of_stages: dict[Stage, list[Pass]]) -> dict[Stage, list[Pass]]:
    """Passes of several, stage by stage."""
    stages = {stage for passes in of_stages for stage in passes}
    return {stage: [p for passes in of_stages for p in passes.get(stage, [])] for stage in stages}
