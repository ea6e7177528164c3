"""What elements of any formulation are to the rest of the program.

In numpy: volumes, deformation gradients, mass shares, facets. A formulation has a file of its own
with its Geometry and the Taichi classes that this makes: `elements` and `facets`.
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
    """What of a section goes around: F_zz of its elements, and how nodes that move change it."""

    @abstractmethod
    def stretch(self, points: np.ndarray, cells: np.ndarray, x: np.ndarray) -> np.ndarray:
        """F_zz (m,) of the elements with their nodes now at x."""

    @abstractmethod
    def stencil(self, cells: np.ndarray) -> np.ndarray:
        """Nodes (m, movers) whose motion strains each cell, its corners first: no others."""

    @abstractmethod
    def gradient(self, points: np.ndarray, cells: np.ndarray, x: np.ndarray) -> np.ndarray:
        """dF_zz/dx / F_zz (m, movers, d) [1/m] of these nodes, now at x."""

    @abstractmethod
    def curvature(self, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Of d^2F_zz/dx^2 / F_zz an upper bound (m, movers, movers) [1/m^2] that is the same for
        every component.
        """


class Geometry(ABC):
    """Kinematics of the elements of one formulation."""

    name: ClassVar[str]
    dimension: ClassVar[int]

    @property
    def hoop(self) -> Hoop | None:
        """What goes around, of a section in which something does."""
        return None

    @abstractmethod
    def depths(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """How deep the body is at the corners of its section (m, corners) or (1, 1) [m], a linear
        function between them; in space one.
        """

    def volumes(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Volume of each element (m,) [m^3]."""
        return self.corner_volumes(points, cells).sum(axis=1)

    def corner_volumes(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """int N_a dV (m, corners) [m^3]: row sums of the consistent mass matrix, over the density,
        so that weight and inertia do the work of the continuous body.
        """

        def of(cells: np.ndarray, depths: np.ndarray) -> np.ndarray:
            return quadrature(points, cells).integrals(depths)

        return self._with_depths(of, points, cells)

    def mass_shares(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Share (m, corners) of an element's mass that each corner carries."""
        volumes = self.corner_volumes(points, cells)
        return volumes / volumes.sum(axis=1, keepdims=True)

    def gradients(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Mean of grad N_a over each element's volume (m, corners, d) [1/m]. With it the forces of
        a uniform stress cancel at every inner node, whatever the shape of the elements (Flanagan
        and Belytschko 1981, Int. J. Numer. Meth. Engng 17:679-706).
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
        """Return what a function of cells and their depths finds of all cells, batch by batch.

        The depths are those of all cells: a ring section knows which of them are rings by number.
        """
        depths = self.depths(points, cells)
        found = [
            of(cells[batch], depths if len(depths) == 1 else depths[batch])
            for batch in batches(len(cells))
        ]
        return np.concatenate(found)

    def of_cells(self, numbers: np.ndarray, thickness: float | None) -> "Geometry":
        """That of some of the elements, of another thickness [m] where one is given."""
        return self

    def bounds_with(self, other: "Geometry") -> bool:
        """Whether facets of elements of both enclose one volume."""
        return self == other

    def pressed(self, facets: np.ndarray, first_node: int) -> np.ndarray:
        """Nodes (k, corners) that a pressure on facets acts on; first_node: the body's."""
        return facets

    @abstractmethod
    def enclosed_volume(self, x: np.ndarray, facets: np.ndarray) -> float:
        """Volume [m^3] on the free side of a closed surface of facets, as `pressed` gives them."""

    @abstractmethod
    def corner_areas(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """Area (k, corners) [m^2] of facets (k, corners) that each of their corners stands for."""

    @abstractmethod
    def volume_gradient(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """d(enclosed volume)/dx of the nodes of facets, as `pressed` gives them, (k, nodes, d)
        [m^2]: forces of a pressure of 1 Pa.
        """

    @abstractmethod
    def elements(self, nodes: "Nodes", region: "Region", bulk_viscosity: float) -> "Term":
        """What computes the forces of a region's elements; bulk_viscosity: b1 [-]."""

    @abstractmethod
    def facets(self, nodes: "Nodes", facets: np.ndarray) -> "Facets":
        """What a pressure on facets, as `pressed` gives them, does."""


def edge_lengths(x: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Length (k,) [m] of edges (k, 2)."""
    return np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1)


def weighted_ends(ends: np.ndarray) -> np.ndarray:
    """Of two ends (k, 2) each with half of the other."""
    return ends + 0.5 * ends[:, ::-1]


def nodal_sums(cells: np.ndarray, per_corner: np.ndarray, node_count: int) -> np.ndarray:
    """Sum over each node's elements (n,) of the values (m, corners) at its corners."""
    return np.bincount(cells.ravel(), np.broadcast_to(per_corner, cells.shape).ravel(), node_count)
