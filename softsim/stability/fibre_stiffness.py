"""What a fibre adds to the stiffness at most, the same for every component of its nodes.

A bar resists along itself with EA / l_0, across with T / l, which is less, pressed even negative;
with x_b - x_a = sum_j B_j x_j (elements/fibre.py) that is at most EA / l_0 B B^T between its nodes,
whatever the configuration. A slack one, which resists nothing, is counted as taut.
"""

import numpy as np

from softsim.elements.fibre import Fibre


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
