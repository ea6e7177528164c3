"""What a cable through eyelets adds to the stiffness at most (loads/pulled_cable.py).

Along it k dL/dx (x) dL/dx, for all eyelets at once; a slack one is counted as taut. Across, a piece
of the length l between two eyelets resists with T / l, T being the largest tension that the winch
ever makes at this length; with x_(a+1) - x_a = sum_j B_j x_j that is at most T / l B B^T between
its nodes.
"""

import numpy as np

from softsim.loads.pulled_cable import PulledCable


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
