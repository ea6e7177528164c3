"""The stable increment of central differences, and which element limits it.

dt < 2 / omega_max, and omega_max is at most that of the worst element alone (Irons). For a linear
element with gradients g_a of its corners, lumped mass shares s_a and moduli kappa, mu:
    omega^2 <= J / (rho min s_a) [ (kappa - 2 mu/3) (tr G + h^2) + 2 mu (lambda_max(G) + h^2) ],
    G = sum_a g_a (x) g_a now,  h^2 = 3 (1/(3 r))^2 for the hoop strain of a revolved triangle;
the volumetric term is that of the element without nodal averaging, an upper bound. Penalty
springs add max k / m, more where they are damped; a chamber whose pressure falls with its volume
adds (-dp/dV) sum_a |dV/dx_a|^2 / m_a. Linear bulk viscosity b1 takes the factor
sqrt(1 + b1^2) - b1.
"""

from dataclasses import dataclass

import numpy as np

from softsim.elements.geometry import Geometry, shape_gradients
from softsim.elements.measures import largest_eigenvalue
from softsim.mesh.mesh import Mesh
from softsim.mesh.quality import quality
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
        place = ", ".join(f"{c * 1e3:.2f}" for c in self.place)
        return (
            f"{self.value * 1e6:.3g} us, limited by element {self.element} of '{self.body}' "
            f"at ({place}) mm, altitude {self.altitude * 1e3:.3g} mm"
        )


def element_frequencies(body: Body, x: np.ndarray) -> np.ndarray:
    """Upper bound of omega^2 [1/s^2] of each element with its nodes at x (n, d)."""
    material, geometry = body.material, body.geometry
    F = geometry.deformation(body.points, body.cells, x)
    J = np.linalg.det(F)
    b = np.einsum("eij,ekj->eik", F, F)
    gradients = shape_gradients(x, body.cells)
    G = np.zeros_like(F)
    G[:, : geometry.dimension, : geometry.dimension] = np.einsum(
        "eai,eaj->eij", gradients, gradients
    )
    hoop = body.cells.shape[1] * geometry.hoop_gradient(x, body.cells) ** 2
    trace = np.trace(G, axis1=1, axis2=2) + hoop
    largest = largest_eigenvalue(G) + hoop
    with np.errstate(invalid="ignore"):
        I1_bar = np.abs(J) ** (-2.0 / 3.0) * np.trace(b, axis1=1, axis2=2)
    c = material.law.constants
    slope = 2.0 * material.law.energy_slope(I1_bar, c)
    stiffening = 4.0 * np.maximum(material.law.energy_curvature(I1_bar, c), 0.0) * I1_bar
    branches = sum(branch.shear_modulus for branch in material.branches)
    # The Cauchy shear stiffness of a stretched rubber grows with the stretch squared.
    mu = (slope + stiffening + branches) * np.maximum(largest_eigenvalue(b), 1.0)
    dilation = material.bulk_modulus - 2.0 / 3.0 * mu
    smallest_share = geometry.mass_shares(body.points, body.cells).min(axis=1)
    stiffness = J * (np.maximum(dilation, 0.0) * trace + 2.0 * mu * largest)
    return stiffness / (material.density * smallest_share)


def contact_frequency(model: Model) -> float:
    """Upper bound of omega^2 [1/s^2] that contact adds: the largest k / m.

    A dashpot of damping ratio z, whose velocity lags half a step, divides the stable step by
    sqrt(1 + z^2) - z, as bulk viscosity does.
    """
    largest = 0.0
    contacts = [model.contact] if model.walls.count else []
    contacts += [o.support for o in model.outlines if o.support is not None]
    for contact in contacts:
        k = np.maximum(contact.penalty_stiffness, contact.tangential_stiffness)
        m = contact.effective_mass
        z = np.where(np.isfinite(m), contact.damping / (2.0 * np.sqrt(k * m)), 0.0)
        shortened = np.sqrt(1.0 + z * z) - z
        largest = max(largest, float((k / m / shortened**2).max(initial=0.0)))
    return largest


def chamber_frequency(model: Model, x: np.ndarray) -> float:
    """Upper bound of omega^2 [1/s^2] that chambers add whose pressure falls with their volume.

    Their stiffness is of rank one, (-dp/dV) dV/dx (x) dV/dx, with the chamber as full as its
    profile ever makes it.
    """
    total = 0.0
    for load in model.pressures:
        stiffness = load.drive.stiffness(load.volume(x), load.drive.fullest)
        if stiffness > 0.0:
            yielding = volume_yield(load.geometry, load.facets, x, model.mass, model.is_free)
            total += stiffness * yielding
    return total


def volume_yield(
    geometry: Geometry, facets: np.ndarray, x: np.ndarray, mass: np.ndarray, is_free: np.ndarray
) -> float:
    """sum |dV/dx_a|^2 / m_a [m^4/kg] over free components: how fast a chamber's volume
    accelerates under a pressure of 1 Pa on its facets.
    """
    gradient = np.zeros_like(x)
    np.add.at(gradient, facets, geometry.volume_gradient(x, facets))
    inverse_mass = np.where(is_free, 1.0 / np.maximum(mass, 1e-30)[:, None], 0.0)
    return float((gradient**2 * inverse_mass).sum())


def stable_increment(model: Model, x: np.ndarray) -> StableIncrement:
    """The stable increment with all nodes at x (n, d) [m]."""
    worst = (-np.inf, model.bodies[0], 0)
    for body in model.bodies:
        frequencies = element_frequencies(body, x[body.nodes])
        element = int(np.argmax(frequencies))
        if frequencies[element] > worst[0]:
            worst = (float(frequencies[element]), body, element)
    omega_squared, body, element = worst
    b1 = model.bulk_viscosity
    damping = np.sqrt(1.0 + b1 * b1) - b1
    omega_squared += contact_frequency(model) + chamber_frequency(model, x)
    value = 2.0 / np.sqrt(omega_squared) * damping
    corners = x[body.nodes][body.cells[element]]
    alone = Mesh(corners, np.arange(len(corners))[None])
    return StableIncrement(
        float(value),
        body.name,
        element,
        corners.mean(axis=0),
        quality(alone).smallest_altitude,
    )
