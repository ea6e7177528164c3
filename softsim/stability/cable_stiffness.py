"""Upper bound of the stiffness of a cable, the same for every component of its nodes.

A segment under the tension T has the stiffness EA / l_0 along itself and T / l across, which is
less.

A joint stores E = 2 B tan^2(theta / 2), B = EI / h (elements/cable.py). With T = tan^2(theta / 2)
and psi the rotations of its edges, the differences of their transverse displacements over their
lengths,
    in the plane of the bend  B (1 + T) (1 + 3 T) (psi_2 - psi_1)^2,
    out of it  B (1 + T) ((1 + T) (psi_2 - psi_1)^2 - 2 T (psi_1^2 + psi_2^2)),
the second less than the first. The angle of an edge e has a second variation of its own, at most
|de|^2 / l^2, which enters with the factor E' = 2 B sqrt(T) (1 + T).
"""

import numpy as np

from softsim.elements.cable import Cable


class CableStiffness:
    """Stiffness of a cable in any configuration.

    stencils: nodes (a, m) of its segments, then of its joints.
    """

    def __init__(self, cable: Cable) -> None:
        self.cable, self.name = cable, f"cable '{cable.name}'"
        self.stencils = [cable.segments.T, cable.joints.T]

    def at(self, x: np.ndarray) -> list[np.ndarray]:
        """Return the stiffness (a, a, m) [N/m] of each stencil with the nodes at x (n, d) [m]."""
        return [self.of_segments(), self.of_joints(x)]

    def of_segments(self) -> np.ndarray:
        """Return the stiffness (2, 2, k - 1) [N/m] of the segments."""
        return self.cable.spring_stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])[:, :, None]

    def of_joints(self, x: np.ndarray) -> np.ndarray:
        """Return the stiffness (3, 3, k - 2) [N/m] of the joints with the nodes at x (n, d) [m]."""
        _, lengths = self.cable.tangents(x)
        T, B = self.cable.folding(x), self.cable.joint_stiffness
        nothing = np.zeros(len(T))
        before = np.stack([-1.0 / lengths[:-1], 1.0 / lengths[:-1], nothing])
        after = np.stack([nothing, -1.0 / lengths[1:], 1.0 / lengths[1:]])
        bend = after - before
        turning = B * (1.0 + T) * (1.0 + 3.0 * T) * squares(bend)
        return turning + 2.0 * B * np.sqrt(T) * (1.0 + T) * (squares(before) + squares(after))


def squares(b: np.ndarray) -> np.ndarray:
    """Return b b^T (a, a, m) of b (a, m)."""
    return b[:, None] * b
