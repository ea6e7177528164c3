"""Interface of an element formulation.

It gives volumes, deformation gradients, mass fractions and facets in numpy. Each formulation has
its own file with its Geometry and the Taichi classes that this creates in `elements` and `facets`.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from softsim.elements.quadrature import quadrature
from softsim.mesh.batches import batches

if TYPE_CHECKING:  # Taichi is for those who compute forces
    from softsim.elements.facets import Facets
    from softsim.elements.region import Region
    from softsim.nodes import Nodes
    from softsim.term import Term


class Hoop(ABC):
    """Hoop stretch F_zz of the elements of a section, and its derivatives by nodal positions."""

    @abstractmethod
    def stretch(self, points: np.ndarray, cells: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return F_zz (m,) of the elements with their nodes at x (n, d) [m]."""

    @abstractmethod
    def stencil(self, cells: np.ndarray) -> np.ndarray:
        """Return all nodes (m, movers) whose motion strains each cell, its own nodes first."""

    @abstractmethod
    def gradient(self, points: np.ndarray, cells: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return dF_zz/dx / F_zz (m, movers, d) [1/m] of these nodes, at x."""

    @abstractmethod
    def curvature(self, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return an upper bound (m, movers, movers) [1/m^2] of d^2F_zz/dx^2 / F_zz.

        It is the same for all components.
        """


class Geometry(ABC):
    """Kinematics of the elements of one formulation."""

    name: ClassVar[str]
    dimension: ClassVar[int]

    @property
    def hoop(self) -> Hoop | None:
        """Hoop stretch of a section that has one, else None."""
        return None

    @abstractmethod
    def depths(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return the depth of the section at its nodes (m, corners) or (1, 1) [m]; 1 in space.

        It is interpolated linearly between nodes.
        """

    def volumes(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return the volume of each element (m,) [m^3]."""
        return self.corner_volumes(points, cells).sum(axis=1)

    def corner_volumes(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return int N_a dV (m, corners) [m^3].

        These are row sums of the consistent mass matrix over the density, so that weight and
        inertia do the same work as in the continuous body.
        """

        def of(cells: np.ndarray, depths: np.ndarray) -> np.ndarray:
            return quadrature(points, cells).integrals(depths)

        return self._with_depths(of, points, cells)

    def mass_shares(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return the fraction (m, corners) of an element's mass that each node carries."""
        volumes = self.corner_volumes(points, cells)
        return volumes / volumes.sum(axis=1, keepdims=True)

    def gradients(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return the mean of grad N_a over each element's volume (m, corners, d) [1/m].

        With it the forces of a uniform stress cancel at every inner node, whatever the shape of the
        elements (Flanagan and Belytschko 1981, Int. J. Numer. Meth. Engng 17:679-706).
        """

        def of(cells: np.ndarray, depths: np.ndarray) -> np.ndarray:
            return quadrature(points, cells).mean_gradients(depths)

        return self._with_depths(of, points, cells)

    def _with_depths(
        self,
        of: Callable[[np.ndarray, np.ndarray], np.ndarray],
        points: np.ndarray,
        cells: np.ndarray,
    ) -> np.ndarray:
        """Return the values of a function of cells and their depths for all cells, batch by batch.

        The depths are computed for all cells at once: a ring section identifies rings by number.
        """
        depths = self.depths(points, cells)
        found = [
            of(cells[batch], depths if len(depths) == 1 else depths[batch])
            for batch in batches(len(cells))
        ]
        return np.concatenate(found)

    def of_cells(self, numbers: np.ndarray, thickness: float | None) -> "Geometry":
        """Return the geometry of some of the elements, with another thickness [m] if given."""
        return self

    def bounds_with(self, other: "Geometry") -> bool:
        """Return True if facets of elements of both geometries may enclose one volume."""
        return self == other

    def pressed(self, facets: np.ndarray, first_node: int) -> np.ndarray:
        """Return the nodes (k, corners) loaded by a pressure on facets; first_node: the body's."""
        return facets

    @abstractmethod
    def enclosed_volume(self, x: np.ndarray, facets: np.ndarray) -> float:
        """Return the volume [m^3] on the free side of a closed surface of facets from `pressed`."""

    @abstractmethod
    def corner_areas(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """Return the tributary area (k, corners) [m^2] of each node of facets (k, corners)."""

    @abstractmethod
    def volume_gradient(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """Return d(enclosed volume)/dx (k, nodes, d) [m^2] of the nodes of facets from `pressed`:
        forces of a pressure of 1 Pa.
        """

    @abstractmethod
    def elements(self, nodes: "Nodes", region: "Region", bulk_viscosity: float) -> "Term":
        """Return the force term of a region's elements; bulk_viscosity: b1 [-]."""

    @abstractmethod
    def facets(self, nodes: "Nodes", facets: np.ndarray) -> "Facets":
        """Return the kernel class that applies a pressure to facets from `pressed`."""


def edge_lengths(x: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return the length (k,) [m] of edges (k, 2)."""
    return np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1)


def weighted_ends(ends: np.ndarray) -> np.ndarray:
    """Return the value at each of two ends (k, 2) plus half of that at the other."""
    return ends + 0.5 * ends[:, ::-1]


def nodal_sums(cells: np.ndarray, per_corner: np.ndarray, node_count: int) -> np.ndarray:
    """Return the sum (n,) over the elements at each node of their nodal values (m, corners)."""
    return np.bincount(cells.ravel(), np.broadcast_to(per_corner, cells.shape).ravel(), node_count)
