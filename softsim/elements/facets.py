"""Facets under pressure: the force of a unit pressure on their corners, and the volume they bound.

One class a formulation, in its file. The force is the gradient of the volume, so a load built on it
follows the deformation, does not depend on the time step, and on a closed surface adds up to
nothing. Facets have the material to their left (an edge) or behind them (a triangle): the chamber
is on the other side.
"""

from typing import Any

import numpy as np

from softsim.fields import index_field
from softsim.nodes import Nodes


class Facets:
    """Facets with the nodes (k, corners) that a pressure on them acts on."""

    def __init__(self, nodes: Nodes, facets: np.ndarray) -> None:
        self.nodes, self.corner_nodes = nodes, facets
        self.count, self.corners = facets.shape
        self.node = index_field(facets)

    # `unit_forces(s, i)`: forces (corner, component) of a pressure of 1 Pa on facet i [m^2];
    # `volume(s, i)`: what facet i adds to the volume of its chamber [m^3].
    unit_forces: Any
    volume: Any
