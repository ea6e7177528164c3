"""Element class of a section by the number of nodes of its cells."""

from softsim.elements.across import Across, SectionElements
from softsim.elements.quadrilaterals import Quadrilaterals
from softsim.elements.region import Region
from softsim.elements.triangles import Triangles
from softsim.nodes import Nodes

BY_CORNERS: dict[int, type[SectionElements]] = {3: Triangles, 4: Quadrilaterals}


def section_elements(
    nodes: Nodes, region: Region, bulk_viscosity: float, across: Across
) -> SectionElements:
    """Return the force term of a region's elements; bulk_viscosity: b1 [-]."""
    kind = BY_CORNERS[region.cells.shape[1]]
    return kind(nodes, region, bulk_viscosity, across)
