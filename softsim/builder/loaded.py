"""Data of the model that the builders of loads need."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from softsim.builder.names import Names
from softsim.model import Body
from softsim.stability.time_step import element_frequencies


@dataclass(frozen=True)
class Loaded:
    """Bodies and nodes on which loads act.

    points (n, d) [m], mass (n,) [kg] and is_free (n, d): of all nodes. tied: nodes tied to each
    rigid body. total_mass [kg]: of everything in the model.
    """

    names: Names
    bodies: tuple[Body, ...]
    points: np.ndarray
    mass: np.ndarray
    is_free: np.ndarray
    tied: list[np.ndarray]
    total_mass: float

    @cached_property
    def stiffest(self) -> float:
        """Largest omega^2 [1/s^2] of an element at rest."""
        regions = (region for body in self.bodies for region in body.regions)
        return max(float(element_frequencies(region).max()) for region in regions)
