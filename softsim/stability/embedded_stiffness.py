"""Upper bound of the stiffness of lines through bodies: fibres, and cables in their eyelets.

Both are coupled to nodes by shape functions, x_b - x_a = sum_j B_j x_j between two points. A bar of
a fibre (elements/fibre.py) has the stiffness EA / l_0 along itself and T / l across, which is less,
and negative in compression: at most EA / l_0 B B^T between its nodes, the same for every component,
in any configuration. A slack bar, which has no stiffness, counts as taut.

A cable (loads/pulled_cable.py) has the stiffness k dL/dx (x) dL/dx along itself, for all eyelets
together, and counts as taut too. Across, a piece of the length l between two eyelets has at most
T / l B B^T, where T is the largest tension that the winch ever produces at this length.
"""

import numpy as np

from softsim.elements.fibre import Fibre
from softsim.loads.pulled_cable import PulledCable


class FibreStiffness:
    """Stiffness of a fibre in any configuration. stencils: nodes (2 c, m) of its bars."""

    def __init__(self, fibre: Fibre) -> None:
        self.name = f"fibre '{fibre.name}'"
        self.stencils = [fibre.bar_nodes.T]
        B = fibre.bar_weights.T
        self.of_bars = fibre.spring_stiffness * B[:, None] * B

    def at(self, x: np.ndarray) -> list[np.ndarray]:
        """Return the stiffness (2 c, 2 c, m) [N/m] between the nodes of each bar."""
        return [self.of_bars]


class PulledCableStiffness:
    """Transverse stiffness of a pulled cable. stencils: nodes (2 c, k - 1) of its pieces."""

    def __init__(self, cable: PulledCable) -> None:
        self.name, self.cable = f"cable '{cable.name}'", cable
        self.stencils = [np.concatenate([cable.corners[:-1], cable.corners[1:]], axis=1).T]
        self.B = np.concatenate([-cable.weights[:-1], cable.weights[1:]], axis=1).T

    def at(self, x: np.ndarray) -> list[np.ndarray]:
        """Return the stiffness (2 c, 2 c, k - 1) [N/m] between the nodes of each piece.

        x (n, d) [m]: positions of all nodes.
        """
        lengths = np.linalg.norm(np.diff(self.cable.places(x), axis=0), axis=1)
        across = self.cable.largest_tension(float(lengths.sum())) / lengths
        return [across * self.B[:, None] * self.B]

    def along(self, x: np.ndarray) -> np.ndarray:
        """Return sqrt(k) dL/dx (n, d) [(N/m)^1/2], whose square is the axial stiffness."""
        return np.sqrt(self.cable.stiffness) * self.cable.length_gradient(x)
