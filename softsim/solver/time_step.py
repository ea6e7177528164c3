"""The stable increment of central differences, and which element limits it.

dt < 2 / omega_max, and omega_max is at most that of the worst element alone (Irons). For a linear
triangle with gradients g_a, lumped mass and moduli kappa, mu:
    omega^2 <= (3 / rho) [ (kappa - 2 mu/3) J tr G(now) + 2 mu lambda_max(G(now)) ],
    G = sum_a g_a (x) g_a;
the volumetric term is that of the element without nodal averaging, an upper bound. Penalty
springs add max k / m, more where they are damped. Linear bulk viscosity b1 takes the factor
sqrt(1 + b1^2) - b1.
"""

from dataclasses import dataclass

import numpy as np

from softsim.elements.geometry import reference_gradients
from softsim.model import Body, Model


@dataclass(frozen=True)
class StableIncrement:
    """The stable increment [s], without safety factor, and the element that limits it."""

    value: float
    body: str
    element: int
    place: np.ndarray
    altitude: float

    def describe(self) -> str:
        """One line for people."""
        x, y = self.place * 1e3
        return (
            f"{self.value * 1e6:.3g} us, limited by element {self.element} of '{self.body}' "
            f"at ({x:.2f}, {y:.2f}) mm, altitude {self.altitude * 1e3:.3g} mm"
        )


def element_frequencies(body: Body, x: np.ndarray) -> np.ndarray:
    """Upper bound of omega^2 [1/s^2] of each element with its nodes at x (n, 2)."""
    material = body.material
    gradients, area = reference_gradients(x, body.cells)
    _, rest_area = reference_gradients(body.points, body.cells)
    J = area / rest_area
    G = np.einsum("eai,eaj->eij", gradients, gradients)
    trace = G[:, 0, 0] + G[:, 1, 1]
    spread = np.hypot(G[:, 0, 0] - G[:, 1, 1], 2.0 * G[:, 0, 1])
    largest = 0.5 * (trace + spread)
    F = np.einsum("eai,eaj->eij", x[body.cells], reference_gradients(body.points, body.cells)[0])
    b = np.einsum("eij,ekj->eik", F, F)
    b_largest = 0.5 * (
        b[:, 0, 0] + b[:, 1, 1] + np.hypot(b[:, 0, 0] - b[:, 1, 1], 2.0 * b[:, 0, 1])
    )
    with np.errstate(invalid="ignore"):
        I1_bar = np.abs(J) ** (-2.0 / 3.0) * (b[:, 0, 0] + b[:, 1, 1] + 1.0)
    c = material.law.constants
    slope = 2.0 * material.law.energy_slope(I1_bar, c)
    stiffening = 4.0 * np.maximum(material.law.energy_curvature(I1_bar, c), 0.0) * I1_bar
    branches = sum(branch.shear_modulus for branch in material.branches)
    # The Cauchy shear stiffness of a stretched rubber grows with the stretch squared.
    mu = (slope + stiffening + branches) * np.maximum(b_largest, 1.0)
    dilation = material.bulk_modulus - 2.0 / 3.0 * mu
    return 3.0 / material.density * J * (np.maximum(dilation, 0.0) * trace + 2.0 * mu * largest)


def contact_frequency(model: Model) -> float:
    """Upper bound of omega^2 [1/s^2] that contact adds: the largest k / m.

    A dashpot of damping ratio z, whose velocity lags half a step, divides the stable step by
    sqrt(1 + z^2) - z, as bulk viscosity does.
    """
    largest = 0.0
    contacts = [model.contact] if len(model.walls.points) else []
    contacts += [o.support for o in model.outlines if o.support is not None]
    for contact in contacts:
        k = np.maximum(contact.penalty_stiffness, contact.tangential_stiffness)
        m = contact.effective_mass
        z = np.where(np.isfinite(m), contact.damping / (2.0 * np.sqrt(k * m)), 0.0)
        shortened = np.sqrt(1.0 + z * z) - z
        largest = max(largest, float((k / m / shortened**2).max(initial=0.0)))
    return largest


def stable_increment(model: Model, x: np.ndarray) -> StableIncrement:
    """The stable increment with all nodes at x (n, 2) [m]."""
    worst = (-np.inf, model.bodies[0], 0)
    for body in model.bodies:
        frequencies = element_frequencies(body, x[body.nodes])
        element = int(np.argmax(frequencies))
        if frequencies[element] > worst[0]:
            worst = (float(frequencies[element]), body, element)
    omega_squared, body, element = worst
    b1 = model.bulk_viscosity
    damping = np.sqrt(1.0 + b1 * b1) - b1
    value = 2.0 / np.sqrt(omega_squared + contact_frequency(model)) * damping
    corners = x[body.nodes][body.cells[element]]
    return StableIncrement(
        float(value), body.name, element, corners.mean(axis=0), smallest_altitude(corners)
    )


def smallest_altitude(corners: np.ndarray) -> float:
    """Twice the area over the longest edge of a triangle (3, 2) [m]."""
    edges = np.roll(corners, -1, axis=0) - corners
    area = 0.5 * abs(edges[0, 0] * edges[1, 1] - edges[0, 1] * edges[1, 0])
    return float(2.0 * area / np.linalg.norm(edges, axis=1).max())
