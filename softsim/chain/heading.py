"""Where the parts of a chain look: along their links, level."""

from dataclasses import dataclass

import numpy as np

from softsim.chain.lattice import Lattice
from softsim.chain.vectors import level, size


@dataclass(frozen=True, eq=False)
class Heading:
    """From the node behind each node to the one in front, on its side; in the plane always x."""

    lattice: Lattice

    def of_nodes(self, p: np.ndarray) -> np.ndarray:
        """Unit vectors along the ground (..., n, d)."""
        ahead = level(self.lattice.chords @ p)
        return ahead / size(ahead)[..., None]
