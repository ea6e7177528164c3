"""Data of a rigid body, in numpy."""

from dataclasses import dataclass

import numpy as np


def in_space(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (..., 2) or (..., 3) as vectors of space (..., 3)."""
    missing = 3 - vectors.shape[-1]
    return np.concatenate([vectors, np.zeros((*vectors.shape[:-1], missing))], axis=-1)


def point_inertia(mass: np.ndarray, arms: np.ndarray) -> np.ndarray:
    """Return the inertia tensor (3, 3) [kg m^2] of masses (k,) at arms (k, 3)."""
    squares = (arms**2).sum(axis=1)
    return (mass * squares).sum() * np.eye(3) - np.einsum("k,ki,kj->ij", mass, arms, arms)


@dataclass(frozen=True)
class RigidBodyData:
    """Data of one rigid body.

    mass [kg], inertia (3, 3) [kg m^2] about `centre`: without the tied nodes. centre, velocity:
    (d,) [m, m/s]. tied: node numbers. angular_velocity: (3,) [rad/s], in a plane model about z
    only. free: which of x, y, z and of the rotations about x, y, z may move. facets (f, d): of its
    mesh surface, of tied nodes without mass; faces (m, d): coarser ones of the same shape, for
    drawing. Neither has a row if the body has no such surface.
    """

    name: str
    mass: float
    inertia: np.ndarray
    centre: np.ndarray
    tied: np.ndarray
    velocity: np.ndarray
    angular_velocity: np.ndarray
    free: tuple[bool, ...]
    facets: np.ndarray
    faces: np.ndarray

    def with_tied_mass(
        self, points: np.ndarray, node_mass: np.ndarray
    ) -> tuple[float, np.ndarray, np.ndarray]:
        """Return mass, centre of mass (d,) and inertia about it, including the tied nodes."""
        m, x = node_mass[self.tied], points[self.tied]
        mass = self.mass + m.sum()
        centre = (self.mass * self.centre + m @ x) / mass
        inertia = (
            self.inertia
            + point_inertia(np.array([self.mass]), in_space((self.centre - centre)[None]))
            + point_inertia(m, in_space(x - centre))
        )
        return mass, centre, inertia
