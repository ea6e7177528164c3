"""Upper bound of the stiffness of a layer, the same for every component of its nodes.

With a = grad u along the facet its second variation is V (dS : dE + S : a^T a), dE the symmetric
part of F^T a. As |dE| <= |F^T a| <= lambda |a| with the largest stretch lambda, and dS : dE is at
most D dE : dE,
    V (D lambda^2 + S+) |a|^2,   S+ the largest principal stress if it is tensile, else 0.
The hoop direction adds V (D h^2 + S+) (dr / R)^2 (elements/layer.py).
"""

import numpy as np

from softsim.elements.layer import Layer


class LayerStiffness:
    """Stiffness of a layer in any configuration. stencils: nodes (c, m) of its facets."""

    def __init__(self, layer: Layer) -> None:
        self.layer, self.name = layer, f"layer '{layer.name}'"
        self.stencils = [layer.facets.T]

    def at(self, x: np.ndarray) -> list[np.ndarray]:
        """Return the stiffness (c, c, m) [N/m] of each facet with the nodes at x (n, d) [m]."""
        layer = self.layer
        F, hoop = layer.deformation(x), layer.hoop(x)
        pull = np.maximum(np.linalg.eigvalsh(layer.stress(x))[:, 1], 0.0)
        stretched = np.linalg.eigvalsh(np.einsum("mip,miq->mpq", F, F))[:, -1]
        along = layer.volumes * (layer.stiffest * stretched + pull)
        across = layer.volumes * (layer.stiffest * hoop**2 + pull)
        corners = layer.facets.shape[1]
        radial = np.broadcast_to(layer.around / corners, (corners, len(pull)))
        return [
            along * np.einsum("mak,mbk->abm", layer.gradients, layer.gradients)
            + across * radial[:, None] * radial
        ]
