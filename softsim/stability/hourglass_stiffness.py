"""Upper bound of the stiffness of the hourglass modes of a region's elements.

U = 1/2 mu |A q|^2, q_ki = e_i . h~_k (elements/hourglass.py), where mu includes all branches. With
the largest eigenvalue a of A^T A, |p| <= mu a |q| in an element that was deformed straight from
rest, whose branches carry no more than if they were unrelaxed. A displacement of the nodes gives
    dq_ki = e_i . dh~_k + h~_k . (dd_i across d_i) / |d_i|,
    |d^2 q_ki| <= 2 |dh~_k| |dd_i| / |d_i| + 3 |h~_k| |dd_i|^2 / |d_i|^2.
With r^2 = sum |h~_k|^2 / min |d_i|^2, g the largest row sum of the |e_i . e_j|, whose root bounds
|q| by |h~|, and 2 r x y <= r (x^2 + y^2), that is
    d^2 U <= mu a [(g (1 + r) + sqrt(g) r) sum |dh~_k|^2
                   + (r + r^2 + sqrt(g) (r + 3 r^2)) sum |dd_i|^2].
"""

import numpy as np

from softsim.elements.hourglass import amplitudes, hourglass_modes
from softsim.elements.region import Region
from softsim.mesh.batches import batches


class HourglassStiffness:
    """Stiffness of the hourglass modes of a region in any configuration.

    Arrays have the elements last, as in element_stiffness.py. of_modes (k, corners, m), of_edges
    (d, corners, m): derivatives of h~_k and d_i with respect to the positions of the nodes.
    modulus (m,) [N/m]: mu a.
    """

    def __init__(self, region: Region) -> None:
        modes = hourglass_modes(region)
        self.of_modes = np.ascontiguousarray(modes.of_modes.transpose(1, 2, 0))
        self.of_edges = np.ascontiguousarray(modes.of_edges.transpose(1, 2, 0))
        parts = batches(len(region.cells))
        norms = [np.linalg.norm(amplitudes(modes.of(part)), ord=2, axis=(1, 2)) for part in parts]
        squares = np.concatenate(norms) ** 2
        self.modulus = region.material.instantaneous_shear_modulus * squares

    def at(self, x: np.ndarray, batch: slice) -> np.ndarray:
        """Return the stiffness (corners, corners, batch) [N/m] between the nodes of each element.

        It is the same for every component. x (d, corners, batch) [m]: positions of the nodes.
        """
        H, D = self.of_modes[:, :, batch], self.of_edges[:, :, batch]
        modes = np.einsum("kam,iam->kim", H, x)
        edges = np.einsum("jam,iam->jim", D, x)
        lengths = np.sqrt((edges**2).sum(axis=1))
        with np.errstate(invalid="ignore", divide="ignore"):
            directions = edges / lengths[:, None]
            leaning = np.abs((directions[:, None] * directions).sum(axis=2)).sum(axis=0)
            r = np.sqrt((modes**2).sum(axis=(0, 1))) / lengths.min(axis=0)
        g = leaning.max(axis=0)
        of_modes = g * (1.0 + r) + np.sqrt(g) * r
        of_edges = r + r**2 + np.sqrt(g) * (r + 3.0 * r**2)
        return self.modulus[batch] * (
            of_modes * np.einsum("kam,kbm->abm", H, H) + of_edges * np.einsum("jam,jbm->abm", D, D)
        )
