"""What every fixed wall is to the rest of the program, in numpy."""

from typing import Protocol

import numpy as np


class Wall(Protocol):
    """Fixed surfaces of one kind, free on one side. Kernels meet them as an obstacle of the same
    kind, with as many surfaces as there are names (solver/terms.py says which).
    """

    @property
    def names(self) -> tuple[str, ...]:
        """Of the surfaces; before a dot, if there is one, the name of the wall in the scene."""

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Signed gap (n,) [m] of places x (n, d) to each surface, negative inside, by its name."""

    def touched_at_once(self) -> tuple[float, float]:
        """Most surfaces that one node can touch at once, and an upper bound of the largest
        eigenvalue of the sum of n (x) n over their normals n; both times the slope |grad g| of the
        gap where that is not 1.
        """

    @property
    def stored_numbers(self) -> int:
        """How many numbers kernels keep of it that grow with its detail: of a table."""

    def drawn(self) -> dict[str, np.ndarray]:
        """What a run's results keep of it for the figures, by the names that
        output/fields.FieldWriter.describe documents. Arrays of several walls are joined.
        """
