"""Elements of a plane section, their out-of-plane stretch F_zz and the force of its stress.

In plane strain F_zz = 1, and the out-of-plane stress does no work. In sections with a hoop
direction F_zz depends on the nodal positions, see elements/axisymmetric.py and ring_section.py.
"""

import taichi as ti

from softsim import backend
from softsim.elements.metric import PlaneMetric
from softsim.elements.one_point import OnePointElements
from softsim.elements.region import Region
from softsim.nodes import Nodes
from softsim.term import Pass, Stage


class Across:
    """Out-of-plane kinematics of plane strain: F_zz = 1."""

    def __init__(self) -> None:
        self.lane = backend.lane_vector()

    def passes(self) -> dict[Stage, list[Pass]]:
        """Return the passes of an increment in addition to those of the elements."""
        return {}

    @ti.func
    def measure(self, s, b, x: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Store F_zz of block b where it is not constant; x: lane vector of x of each node."""

    @ti.func
    def stretch(self, s, b):
        """Return F_zz of block b."""
        return self.lane(1.0)

    @ti.func
    def tension(self, s, b, S):
        """Return the nodal force of the out-of-plane stress, V F_zz S_zz, divided by `weight`."""
        return self.lane(0.0)

    @ti.func
    def weight(self, b, corner: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return the factor of `tension` in the force on a node along -x [1/m]."""
        return self.lane(0.0)


class SectionElements(OnePointElements):
    """Elements of a section; across: out-of-plane kinematics, others as for OnePointElements."""

    def __init__(self, nodes: Nodes, region: Region, bulk_viscosity: float, across: Across) -> None:
        super().__init__(nodes, region, PlaneMetric(), bulk_viscosity)
        self.across = across

    def passes(self) -> dict[Stage, list[Pass]]:
        return stacked(super().passes(), self.across.passes())

    @ti.func
    def volume_ratio(self, s, b):
        """Return J of block b."""
        ax, ay, bx, by = ti.static(self.edge)
        area = ax[s, b] * by[s, b] - ay[s, b] * bx[s, b]
        return area * self.inverse_determinant[b] * self.across.stretch(s, b)

    @ti.func
    def stretch(self, s, b):
        """Return C in the basis of the edges, and J."""
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
    """Return the passes of several terms, merged stage by stage."""
    stages = {stage for passes in of_stages for stage in passes}
    return {stage: [p for passes in of_stages for p in passes.get(stage, [])] for stage in stages}
