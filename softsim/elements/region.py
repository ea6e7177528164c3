"""Regions of a body: elements of one material and one geometry."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from softsim.elements.geometry import Geometry, nodal_sums
from softsim.materials.material import Material
from softsim.mesh.mesh import signed_volumes


@dataclass(frozen=True)
class Region:
    """Cell set of a body, or the cells in no set with its own region: then cell_set is None.

    Regions share nodes, so displacements are continuous. Each has pressures of its own, see
    elements/pressure_points.py: at an interface a node has one for each region, as a stiffer
    material may hold another one than what it is bonded to.

    body: name. first_node: of the body's nodes in the model. points (n, d) [m]: of the whole body.
    cells (m, corners): numbered within the body. numbers (m,): which of the body's cells they are.
    """

    body: str
    cell_set: str | None
    first_node: int
    points: np.ndarray
    cells: np.ndarray
    numbers: np.ndarray
    geometry: Geometry
    material: Material

    @property
    def nodes(self) -> slice:
        """Slice of the body's nodes in the model."""
        return slice(self.first_node, self.first_node + len(self.points))

    @property
    def has_hourglass_modes(self) -> bool:
        """True for quadrilaterals and hexahedra, which have hourglass modes."""
        return self.cells.shape[1] > self.points.shape[1] + 1

    @property
    def pressure_points(self) -> np.ndarray:
        """Numbers (m, k), below `pressure_count`, of the pressures of each element.

        Triangles and tetrahedra, which would lock with one pressure each, have those of their
        nodes; an element with hourglass modes has one of its own. In a region of the latter,
        collapsed elements have those of their nodes, numbered after the elements' own; the others
        then list their own once for each node of a triangle or tetrahedron.
        """
        if not self.has_hourglass_modes:
            return self.cells
        own = np.arange(len(self.cells))[:, None]
        if not self._is_simplex.any():
            return own
        points = np.repeat(own, self.points.shape[1] + 1, axis=1)
        corners = np.sort(self.cells[self._is_simplex], axis=1)
        last_of_its_node = np.diff(corners, append=-1, axis=1) != 0
        points[self._is_simplex] = len(own) + corners[last_of_its_node].reshape(-1, points.shape[1])
        return points

    @property
    def pressure_count(self) -> int:
        """Number of pressures of the region."""
        if not self.has_hourglass_modes:
            return len(self.points)
        return len(self.cells) + (len(self.points) if self._is_simplex.any() else 0)

    @property
    def _is_simplex(self) -> np.ndarray:
        """True (m,) for cells that have collapsed to triangles or tetrahedra."""
        corners = np.sort(self.cells, axis=1)
        distinct = 1 + (corners[:, 1:] != corners[:, :-1]).sum(axis=1)
        simplexes: np.ndarray = distinct == self.points.shape[1] + 1
        return simplexes

    @property
    def pressure_sizes(self) -> np.ndarray:
        """Length (k,) [m] of each pressure: the root of its area or volume.

        It is zero for nodes outside the region.
        """
        points = self.pressure_points
        volume = signed_volumes(self.points, self.cells)[:, None] / points.shape[1]
        return nodal_sums(points, volume, self.pressure_count) ** (1.0 / self.points.shape[1])

    @cached_property
    def volumes(self) -> np.ndarray:
        """Reference volume of each element (m,) [m^3]."""
        return self.geometry.volumes(self.points, self.cells)

    @cached_property
    def gradients(self) -> np.ndarray:
        """Mean of grad N_a over each element's reference volume (m, corners, d) [1/m].

        In memory the elements of each component are contiguous, for fast sums over elements.
        """
        found = self.geometry.gradients(self.points, self.cells)
        return np.ascontiguousarray(found.transpose(1, 2, 0)).transpose(2, 0, 1)

    @property
    def nodal_volumes(self) -> np.ndarray:
        """Reference volume (n,) [m^3] of the elements around each of the body's nodes."""
        return nodal_sums(self.cells, self.volumes[:, None], len(self.points))

    def deformation(self, x: np.ndarray) -> np.ndarray:
        """Return F (m, 3, 3) with the body's nodes at x (n, d) [m]; zz is out of plane."""
        d, hoop = self.geometry.dimension, self.geometry.hoop
        F = np.zeros((len(self.cells), 3, 3))
        F[:, 2, 2] = 1.0 if hoop is None else hoop.stretch(self.points, self.cells, x)
        F[:, :d, :d] = np.einsum("eai,eaj->eij", x[self.cells], self.gradients)
        return F


def joined_regions(regions: Sequence[Region], points: np.ndarray) -> list[Region]:
    """Return the regions of a model, merged across bodies.

    Regions with the same material, geometry and cell set are merged, so that kernels are compiled
    once and not for each body.

    points (n, d) [m]: of all nodes. Nodes that lie between those of joined bodies belong to no
    element of the region, as do a body's nodes outside a region.
    """
    kinds: dict[Hashable, list[Region]] = {}
    for region in regions:
        kind = (region.geometry, region.material, region.cell_set)
        kinds.setdefault(kind, []).append(region)
    return [_joined(alike, points) for alike in kinds.values()]


def _joined(alike: Sequence[Region], points: np.ndarray) -> Region:
    first = alike[0]
    if len(alike) == 1:
        return first
    return replace(
        first,
        body=" + ".join(r.body for r in alike),
        points=points[first.nodes.start : alike[-1].nodes.stop],
        cells=np.concatenate([r.cells + r.first_node - first.first_node for r in alike]),
        numbers=np.concatenate([r.numbers for r in alike]),
    )
