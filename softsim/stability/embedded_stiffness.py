"""What lines through bodies add to the stiffness at most: fibres, and cables in their eyelets.

Both hang on nodes by shape functions, x_b - x_a = sum_j B_j x_j between two places. A bar of a
fibre (elements/fibre.py) resists along itself with EA / l_0, across with T / l, which is less,
pressed even negative: at most EA / l_0 B B^T between its nodes, the same for every component,
whatever the configuration. A slack one, which resists nothing, is counted as taut.

A cable (loads/pulled_cable.py) resists along itself with k dL/dx (x) dL/dx, for all eyelets at
once, counted as taut too; across, a piece of the length l between two eyelets with T / l B B^T at
most, T being the largest tension that the winch ever makes at this length.
"""

import numpy as np

from softsim.elements.fibre import Fibre
from softsim.loads.pulled_cable import PulledCable


class FibreStiffness:
    """The stiffness of a fibre in any configuration. stencils: nodes (2 c, m) of its bars."""

    def __init__(self, fibre: Fibre) -> None:
        self.name = f"fibre '{fibre.name}'"
        self.stencils = [fibre.bar_nodes.T]
        B = fibre.bar_weights.T
        self.of_bars = fibre.spring_stiffness * B[:, None] * B

    def at(self, x: np.ndarray) -> list[np.ndarray]:
        """Stiffness (2 c, 2 c, m) [N/m] between the nodes of each bar."""
        return [self.of_bars]


class PulledCableStiffness:
    """The stiffness across a cable. stencils: nodes (2 c, k - 1) of its pieces."""

    def __init__(self, cable: PulledCable) -> None:
        self.name, self.cable = f"cable '{cable.name}'", cable
        self.stencils = [np.concatenate([cable.corners[:-1], cable.corners[1:]], axis=1).T]
        self.B = np.concatenate([-cable.weights[:-1], cable.weights[1:]], axis=1).T

    def at(self, x: np.ndarray) -> list[np.ndarray]:
        """Stiffness (2 c, 2 c, k - 1) [N/m] between the nodes of each piece, all nodes at x (n, d)
        [m].
        """
        lengths = np.linalg.norm(np.diff(self.cable.places(x), axis=0), axis=1)
        across = self.cable.largest_tension(float(lengths.sum())) / lengths
        return [across * self.B[:, None] * self.B]

    def along(self, x: np.ndarray) -> np.ndarray:
        """sqrt(k) dL/dx (n, d) [(N/m)^1/2], whose square is the stiffness along it."""
        return np.sqrt(self.cable.stiffness) * self.cable.length_gradient(x)
