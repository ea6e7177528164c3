"""Facets under pressure: the nodal forces of a unit pressure, and the volume they bound.

Each formulation has one class, in its file. The force is the gradient of the volume, so a load
built on it follows the deformation, does not depend on the time step, and on a closed surface has
no resultant. Facets have the material to their left (an edge) or behind them (a triangle): the
chamber is on the other side.
"""

from typing import Any

import numpy as np

from softsim.fields import index_field
from softsim.nodes import Nodes


class Facets:
    """Kernel class of facets, with the nodes (k, corners) that a pressure on them acts on."""

    def __init__(self, nodes: Nodes, facets: np.ndarray) -> None:
        self.nodes, self.corner_nodes = nodes, facets
        self.count, self.corners = facets.shape
        self.node = index_field(facets)

    # `unit_forces(s, i)`: forces (corner, component) of a pressure of 1 Pa on facet i [m^2];
    # `volume(s, i)`: what facet i adds to the volume of its chamber [m^3].
    unit_forces: Any
    volume: Any
