"""Natural modes and harmonic response of a whole model about an equilibrium.

Loads, prestress and contact take part.

K phi = omega^2 M phi with the tangent stiffness of all forces at the equilibrium (tangent.py) and
the masses of nodes, with mass scaling, and of rigid bodies. The pressure of a chamber that depends
on its volume has no mass, and neither has the elongation of a pulled cable. Both border the matrix,

    [ K   B ] [u]   [f]
    [ B^T -D] [p] = [0],

so that eliminating them gives K + B D^-1 B^T without a dense matrix. The number of negative pivots
of K - sigma M is the number of eigenvalues below sigma (Sylvester): no unstable mode is missed.

Contact stays as it is: what touches has its penalty springs in both senses, what does not touch is
free. A node that friction holds is held by the spring of its friction. Small vibrations do not
exceed the friction limit, so by default all nodes that touch stick, also those that the load has
moved to their limit; with "slip" they slide freely.

Maxwell branches that have relaxed at the equilibrium add a stiffness K_b, which is found by keeping
their viscous strain in the differences of forces. For this material it is exact that vibration
multiplies the K_b of a region by g_b(omega), the sum of mu_k i omega tau_k / (1 + i omega tau_k)
over the sum of mu_k. A mode keeps its shape without branches; its frequency and its damping ratio
follow from

    omega^2 = phi (K + sum_b Re g_b K_b) phi,   zeta = phi (sum_b Im g_b K_b) phi / (2 omega^2).
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp
from scipy.linalg import cholesky
from scipy.optimize import brentq, linear_sum_assignment
from scipy.sparse.linalg import LinearOperator, SuperLU, eigsh, norm, splu
from scipy.spatial.transform import Rotation

from softsim.compute import fields
from softsim.contact.corner_contact import AT_LIMIT, CornerContact
from softsim.contact.surface_contact import SurfaceContact
from softsim.errors import ModesError
from softsim.loads.nodal import CarriedRotor, Rotor, RotorForce
from softsim.loads.tether import EndDragTerm, TetherTerm
from softsim.materials.material import branch_moduli
from softsim.model import Body, Model
from softsim.solver.natural_modes import (
    SHIFT,
    NaturalMode,
    NaturalModes,
    joined,
    refuse_too_large,
    refuse_too_many,
    wave_frequency,
)
from softsim.statics.forces import StaticForces
from softsim.statics.tangent import Tangent

Friction = Literal["stick", "slip"]

FRICTION_FACTORS = {"stick": 1e6, "slip": 0.0}
"""Factor of the friction limits for small vibrations."""

ALLOWED_ERROR = 1e-3
"""Largest relative error of the assembled stiffness against the forces along one displacement."""

SYMMETRIC = 1e-3
"""Relative antisymmetric part of the stiffness, above which it is reported."""

FROZEN = 1e-9
"""Duration over the shortest relaxation time, in which Maxwell branches do not relax."""

LEAST_OVERLAP = 0.5
"""Cosine between the motions of two modes above which they are one mode at two loads."""

MOST_SHIFTS = 40
"""Number of times that the shift is multiplied by 4 to get below all eigenvalues."""


@dataclass(frozen=True)
class ContactState:
    """Contact at an equilibrium.

    touching: number of points that touch, at_limit: those of them at their friction limit, open:
    those that do not touch. friction: "stick" or "slip", as points that touch do in small
    vibrations; "slip" if nothing has friction.
    """

    touching: int
    at_limit: int
    open: int
    friction: Friction

    def in_words(self) -> str:
        """Return a sentence on the contact that the modes have."""
        if self.touching + self.open == 0:
            return "no contact"
        if not self.touching:
            return f"contact: none of {self.open} points touches"
        moves = "stick" if self.friction == "stick" else "slide without friction"
        limit = f", {self.at_limit} of them at their friction limit" if self.at_limit else ""
        return (
            f"contact: {self.touching} of {self.touching + self.open} points touch{limit}; in the "
            f"modes all that touch {moves} and stay in contact, all others stay open"
        )


@dataclass(frozen=True, eq=False)
class LoadedMode(NaturalMode):
    """Natural mode about an equilibrium.

    Of an unstable mode the frequencies are -sqrt(-omega^2) / (2 pi). square: omega^2 of the law
    alone [1/s^2]. damping_ratio: by the Maxwell branches [-]. motion (u,): the mode in the free
    coordinates, times the root of their inertia, of length 1.
    """

    square: float
    damping_ratio: float
    motion: np.ndarray

    @property
    def stiffening(self) -> float:
        return 1.0 if self.square <= 0.0 else super().stiffening


@dataclass(frozen=True, eq=False)
class LoadedModes(NaturalModes):
    """Natural modes of a whole model about an equilibrium.

    body: all bodies as one, at the equilibrium. asymmetry: antisymmetric over symmetric part of the
    stiffness [-].
    """

    asymmetry: float
    contact: ContactState

    @property
    def loaded(self) -> list[LoadedMode]:
        """The modes, with what they have about an equilibrium."""
        return [mode for mode in self.modes if isinstance(mode, LoadedMode)]

    @property
    def unstable(self) -> list[LoadedMode]:
        """Modes with negative omega^2, along which the equilibrium is unstable."""
        return [mode for mode in self.loaded if mode.square < 0.0]

    def warnings(self) -> list[str]:
        """Return sentences on a stiffness that is not symmetric and on unstable modes."""
        sentences = []
        if self.asymmetry > SYMMETRIC:
            sentences.append(
                f"the stiffness is not symmetric: its antisymmetric part is {self.asymmetry:.1g} "
                "of it, from pressure on an open surface or from sliding friction; the modes are "
                "those of the symmetric part"
            )
        if self.unstable:
            count = len(self.unstable)
            sentences.append(
                f"the equilibrium is unstable: {count} mode{'s' if count > 1 else ''} with "
                "negative stiffness, beyond a buckling load or a limit point; the frequency given "
                "is minus the rate of growth over 2 pi"
            )
        return sentences


def refuse_softening(model: Model) -> None:
    """Raise ModesError if a material softens: it is stiffer on unloading than on loading."""
    for region in model.regions:
        if region.material.mullins is not None:
            raise ModesError(
                f"material '{region.material.name}' softens: small vibrations and instabilities "
                "have no single stiffness",
                hint="compute them without `mullins`",
            )


class SmallVibrations:
    """Stiffness and inertia of a model about the accepted equilibrium of the forces.

    Vectors (u,) are free coordinates without the pressures of chambers. inertia_root: L with
    L^T L = M (u, u) [kg^(1/2)]. error: relative error of the assembled stiffness against the forces
    along an arbitrary displacement [-]. loose (u, r): L times the rigid motions without stiffness,
    orthonormal.

    Raises ModesError if the stiffness would have too many entries, if its error is too large, or if
    a material softens.
    """

    def __init__(self, forces: StaticForces, friction: Friction = "stick") -> None:
        self.forces, self.model, self.tangent = forces, forces.model, Tangent(forces)
        self.friction, self.at = friction, forces.start
        refuse_softening(self.model)
        body = joined(self.model.bodies)
        refuse_too_large(body, self.tangent.pairs.nnz * self.model.dimension**2)
        self.body = at_equilibrium(body, self.at.x)
        self.size = self.forces.size - self.forces.counts[3]
        self.forces.residual(self.at)
        self.contact = contact_state(self.forces, friction)
        with self.vibrating():
            self.stiffness = self.tangent.at(self.at)
            self.error = self._error()
        if not self.error <= ALLOWED_ERROR:
            raise ModesError(
                f"the assembled stiffness differs from the forces by {self.error:.2g} of them, "
                f"allowed is {ALLOWED_ERROR:g}",
                hint="contact that is about to open or close, or a wall with an edge: compute the "
                "modes at another load",
            )
        matrix, u = self.stiffness.matrix, self.size
        inner = matrix[:u, :u]
        self.asymmetry = float(norm(inner - inner.T) / norm(inner + inner.T))
        self.bordered = self._bordered()
        self.inertia_root = self._inertia_root()
        loose, _ = np.linalg.qr(self.inertia_root @ self.stiffness.loose[:, :u].T)
        self.loose = loose

    # --- stiffness and inertia -------------------------------------------------------------------

    @contextmanager
    def vibrating(self) -> Iterator[None]:
        """Let what touches stick or slide, as for small vibrations, within the block."""
        limits = friction_limits(self.forces)
        before = [fields.read(limit) for limit in limits]
        for limit, values in zip(limits, before, strict=True):
            fields.write(limit, FRICTION_FACTORS[self.friction] * values)
        try:
            yield
        finally:
            for limit, values in zip(limits, before, strict=True):
                fields.write(limit, values)
            self.forces.residual(self.at)

    def product(self, v: np.ndarray) -> np.ndarray:
        """Return K v (size,) [N] of a displacement (size,) [m], by a central difference."""
        step = float(self.tangent.steps.min()) / float(np.abs(v).max())
        resisted: np.ndarray = self.forces.resisting(self.at, step * v) / step
        return resisted

    def _error(self) -> float:
        arbitrary = np.random.default_rng(0).uniform(-1.0, 1.0, self.forces.size)
        exact = self.product(arbitrary)
        missed = np.linalg.norm(self.stiffness.times(arbitrary) - exact)
        return float(missed / np.linalg.norm(exact))

    def _bordered(self) -> sp.csc_matrix:
        """Return the symmetric stiffness, bordered by pressures and elongations of cables."""
        matrix, u = self.stiffness.matrix, self.size
        # A row of the pressures times -1 is the transposed column.
        side = 0.5 * (matrix[:u, u:] - matrix[u:, :u].T)
        below = 0.5 * (matrix[u:, u:] + matrix[u:, u:].T)
        c = self.stiffness.stiffnesses
        taut = c > 1e-9 * self.stiffness.hold
        vectors = sp.csr_matrix(self.stiffness.vectors[taut, :u])
        inner = 0.5 * (matrix[:u, :u] + matrix[:u, :u].T)
        blocks = [
            [inner, side, vectors.T],
            [side.T, -below, None],
            [vectors, None, sp.diags(-1.0 / c[taut]) if taut.any() else None],
        ]
        present = [True, side.shape[1] > 0, bool(taut.any())]
        kept = [[b for b, is_there in zip(row, present, strict=True) if is_there]
                for row, is_there in zip(blocks, present, strict=True) if is_there]  # fmt: skip
        return sp.bmat(kept).tocsc()

    @property
    def border(self) -> int:
        """Number of pressures and elongations that border the stiffness."""
        return int(self.bordered.shape[0]) - self.size

    def _inertia_root(self) -> sp.csr_matrix:
        model, forces = self.model, self.forces
        free = forces.is_free.ravel()
        root = sp.diags(np.sqrt(np.repeat(model.mass, model.dimension)[free]))
        if model.mass_scaling is not None:
            scaled = model.mass_scaling.scaled(model.mass, model.dimension, 0.5)
            root = scaled[free][:, free] @ root
        parts = [root]
        if forces.bodies.count:
            mass = fields.read(forces.bodies.mass)[: forces.bodies.count]
            moves = np.repeat(np.sqrt(mass), model.dimension)[forces.free_moves.ravel()]
            parts.append(sp.diags(moves))
            inverse = fields.read(forces.bodies.inverse_inertia).reshape(-1, 3, 3)
            for number, turns in enumerate(forces.free_turns):
                R = Rotation.from_quat(self.at.turns[number]).as_matrix()
                inertia = R @ np.linalg.inv(inverse[number]) @ R.T
                own = inertia[np.ix_(turns, turns)] / forces.gyration[number] ** 2
                if own.size:
                    parts.append(sp.csr_matrix(cholesky(own)))
        return sp.block_diag(parts).tocsr()

    @cached_property
    def inertia(self) -> sp.csc_matrix:
        """Inertia M [kg], bordered by zeros as `bordered`."""
        L = self.inertia_root
        return sp.block_diag([L.T @ L, sp.csr_matrix((self.border, self.border))]).tocsc()

    def factors(self, sigma: float) -> SuperLU:
        """Return the factors of the bordered stiffness minus sigma times the inertia."""
        return splu(
            (self.bordered - sigma * self.inertia).tocsc(), permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0, options={"SymmetricMode": True},
        )  # fmt: skip

    # --- Maxwell branches ------------------------------------------------------------------------

    @cached_property
    def viscous(self) -> list[Any]:
        """Terms of elements whose material has Maxwell branches."""
        elements: list[Any] = list(self.forces.solver.terms.elements)
        return [term for term in elements if term.points.branch_count]

    @contextmanager
    def frozen(self, elements: Any) -> Iterator[None]:
        """Keep the viscous strain that elements have at the equilibrium within the block."""
        self.forces.residual(self.at)
        elements.set_time_increment(0, FROZEN * float(min(elements.points.relaxation.times)))
        try:
            yield
        finally:
            elements.set_time_increment(0, np.inf)

    def branch_stiffnesses(self) -> list[sp.csc_matrix]:
        """Return K_b [N/m] of the branches of each term, symmetric and bordered as `bordered`."""
        stiffnesses = []
        for elements in self.viscous:
            with self.vibrating(), self.frozen(elements):
                stiffer = self.tangent.at(self.at).matrix - self.stiffness.matrix
            inner = stiffer[: self.size, : self.size]
            border = sp.csc_matrix((self.border, self.border))
            stiffnesses.append(sp.block_diag([0.5 * (inner + inner.T), border]).tocsc())
        return stiffnesses

    def branch_energies(self, motions: np.ndarray) -> np.ndarray:
        """Return phi K_b phi (modes, terms) [1/s^2] of the branches of each term.

        motions (modes, u): phi, of unit modal mass.
        """
        padded = np.pad(motions, ((0, 0), (0, self.forces.counts[3])))
        energies = np.zeros((len(motions), len(self.viscous)))
        with self.vibrating():
            relaxed = [self.product(phi) for phi in padded] if self.viscous else []
            for column, elements in enumerate(self.viscous):
                with self.frozen(elements):
                    for row, phi in enumerate(padded):
                        energies[row, column] = phi @ (self.product(phi) - relaxed[row])
        return energies

    def growth(self, frequency: float) -> np.ndarray:
        """Return g_b (terms,) [-]: the modulus of the branches of each term over the sudden one."""
        growth = []
        for elements in self.viscous:
            moduli = fields.read(elements.points.branch_modulus)
            times = np.asarray(elements.points.relaxation.times)
            growth.append(branch_moduli(np.array([frequency]), times)[0] @ moduli / moduli.sum())
        return np.array(growth, dtype=complex)

    # --- modes -----------------------------------------------------------------------------------

    def modes(self, count: int) -> LoadedModes:
        """Return the `count` modes with the smallest omega^2, unstable ones first.

        Raises ModesError if the model has too few degrees of freedom.
        """
        refuse_too_many(self.body, count, self.size - self.loose.shape[1])
        squares, motions, phi = self._lowest(count)
        energies = self.branch_energies(phi)
        modes = [
            self._mode(float(square), motion, vector, energy)
            for square, motion, vector, energy in zip(squares, motions, phi, energies, strict=True)
        ]
        is_free = self.forces.is_free[self.body.nodes]
        held = int((~is_free.all(axis=1)).sum())
        return LoadedModes(
            self.body, list(modes), held, self.loose.shape[1], self.error, self.asymmetry,
            self.contact,
        )  # fmt: skip

    def _lowest(self, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return omega^2 (count,), L phi (count, u) of length 1, and phi (count, u)."""
        L, Z, u = self.inertia_root, self.loose, self.size
        sigma = -SHIFT * wave_frequency(self.body) ** 2
        for _ in range(MOST_SHIFTS):
            factors = self.factors(sigma)
            if int((factors.U.diagonal() < 0.0).sum()) <= self.border:
                break
            sigma *= 4.0

        def solved(y: np.ndarray) -> np.ndarray:
            force = np.pad(L.T @ y, (0, self.border))
            displacement: np.ndarray = factors.solve(force)[:u]
            return displacement

        def kept(y: np.ndarray) -> np.ndarray:
            return y - Z @ (Z.T @ y)

        inverse = LinearOperator((u, u), lambda y: kept(L @ solved(kept(y))), dtype=float)
        start = kept(np.random.default_rng(0).standard_normal(u))
        values, vectors = eigsh(inverse, count, which="LA", v0=start)
        order = np.argsort(-values)
        motions = vectors[:, order].T
        # (K - sigma M) phi = (omega^2 - sigma) L^T y gives phi = L^-1 y.
        phi = np.array([solved(y) / value for y, value in zip(motions, values[order], strict=True)])
        return sigma + 1.0 / values[order], motions, phi

    def _mode(
        self, square: float, motion: np.ndarray, phi: np.ndarray, energies: np.ndarray
    ) -> LoadedMode:
        frequency = float(np.sign(square) * np.sqrt(abs(square)) / (2.0 * np.pi))
        dynamic, damping = frequency, 0.0
        if square > 0.0 and energies.any():
            dynamic = self._dynamic(square, energies)
            damping = float(energies @ self.growth(dynamic).imag) / (
                2.0 * (2.0 * np.pi * dynamic) ** 2
            )
        shape = self.displacements(phi)[self.body.nodes]
        return LoadedMode(
            frequency, dynamic, shape / np.linalg.norm(shape, axis=1).max(),
            self._mass_shares(motion), square, damping, motion,
        )  # fmt: skip

    def _dynamic(self, square: float, energies: np.ndarray) -> float:
        """Return the frequency [Hz] with the branches of these energies (terms,) [1/s^2]."""

        def excess(tried: float) -> float:
            stiffened = square + float(energies @ self.growth(tried).real)
            return float(np.sqrt(max(stiffened, 0.0))) / (2.0 * np.pi) - tried

        lower = np.sqrt(square) / (2.0 * np.pi)
        upper = np.sqrt(square + float(energies.sum())) / (2.0 * np.pi)
        return float(brentq(excess, 0.5 * lower, 2.0 * upper))

    def displacements(self, phi: np.ndarray) -> np.ndarray:
        """Return the displacements (n, d) of all nodes by a motion (u,) of the free coordinates."""
        return self.displaced(phi)[0]

    def displaced(self, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the displacements (n, d) of all nodes and (b, d) of the centres by a motion (u,).

        A motion may be complex, as may be the displacements.
        """
        if np.iscomplexobj(phi):
            (x, centres), (x_2, centres_2) = self.displaced(phi.real), self.displaced(phi.imag)
            return x + 1j * x_2, centres + 1j * centres_2
        largest = max(float(np.abs(phi).max()), 1e-300)
        step = 1e-6 * float(np.ptp(self.at.x, axis=0).max()) / largest
        padded = np.pad(phi, (0, self.forces.counts[3]))
        before, after = (self.forces.moved(self.at, s * step * padded) for s in (-1.0, 1.0))
        of_nodes = self.model.ties.followed((after.x - before.x) / (2.0 * step))
        return of_nodes, (after.centres - before.centres) / (2.0 * step)

    def translation(self, axis: int) -> np.ndarray:
        """Return the motion (u,) in which everything that is free moves by 1 along an axis."""
        forces, along = self.forces, np.eye(self.model.dimension)[axis]
        return np.concatenate(
            [
                np.broadcast_to(along, forces.is_free.shape)[forces.is_free],
                np.broadcast_to(along, forces.free_moves.shape)[forces.free_moves],
                np.zeros(forces.counts[2]),
            ]
        )

    def _mass_shares(self, motion: np.ndarray) -> np.ndarray:
        """Return the effective mass (d,) of a mode over the mass of the model [-]."""
        whole = self.model.mass.sum() + sum(body.mass for body in self.model.rigid_bodies)
        L = self.inertia_root
        momenta = [motion @ (L @ self.translation(a)) for a in range(self.model.dimension)]
        return np.square(momenta) / whole


def lines_of(equilibria: Sequence[LoadedModes]) -> list[np.ndarray]:
    """Return for each of several equilibria the number of the line (modes,) that a mode belongs to.

    Lines join the modes of neighbouring equilibria whose motions overlap most. A mode that overlaps
    with none by LEAST_OVERLAP begins a new line.
    """
    lines: list[np.ndarray] = []
    last: dict[int, np.ndarray] = {}
    count = 0
    for modes in equilibria:
        motions = [mode.motion for mode in modes.loaded]
        names = list(last)
        overlap = np.abs(np.array([[m @ last[line] for line in names] for m in motions]))
        numbers = np.full(len(motions), -1)
        if names:
            for row, column in zip(*linear_sum_assignment(-overlap), strict=True):
                if overlap[row, column] >= LEAST_OVERLAP:
                    numbers[row] = names[column]
        new = numbers < 0
        numbers[new] = count + np.arange(new.sum())
        count += int(new.sum())
        last = dict(zip(numbers.tolist(), motions, strict=True))
        lines.append(numbers)
    return lines


def zero_crossings(
    values: Sequence[float], equilibria: Sequence[LoadedModes], lines: Sequence[np.ndarray]
) -> list[float]:
    """Return the load values at which a frequency goes through zero, where the model buckles.

    omega^2 is interpolated linearly between two equilibria.
    """
    squares: dict[int, list[tuple[float, float]]] = {}
    for value, modes, numbers in zip(values, equilibria, lines, strict=True):
        for mode, line in zip(modes.loaded, numbers.tolist(), strict=True):
            squares.setdefault(line, []).append((value, mode.square))
    return sorted(
        a + (b - a) * s / (s - t)
        for points in squares.values()
        for (a, s), (b, t) in pairwise(points)
        if s * t < 0.0
    )


def at_equilibrium(body: Body, x: np.ndarray) -> Body:
    """Return a body with its nodes at x (n, d) [m] of the model, as if it were at rest there."""
    points = x[body.nodes]
    regions = tuple(replace(region, points=points) for region in body.regions)
    return replace(body, points=points, regions=regions)


# -------------------------------------------------------------------------------------------------
# Contact at an equilibrium.


def friction_limits(forces: StaticForces) -> list[Any]:
    """Return the fields in which the limits of friction are linear: all zero, nothing sticks."""
    terms = forces.solver.terms
    contacts = [*terms.contacts, *terms.self_contacts]
    sliding = [load for load in terms.loads if isinstance(load, TetherTerm | EndDragTerm)]
    adhering = [adhesion for contact in contacts for adhesion in contact.adhesion]
    return [
        *(c.friction_coefficient for c in contacts),
        *(strength for adhesion in adhering for strength in adhesion.strengths()),
        *(load.longest for load in sliding),
    ]


def contact_state(forces: StaticForces, friction: Friction) -> ContactState:
    """Return the contact at the last trial state."""
    touches, at_limit = contact_points(forces)
    rough = any(fields.read(field).any() for field in friction_limits(forces))
    touching, open_points = int(touches.sum()), int((~touches).sum())
    return ContactState(touching, int(at_limit.sum()), open_points, friction if rough else "slip")


def contact_points(forces: StaticForces) -> tuple[np.ndarray, np.ndarray]:
    """Return which points (p,) touch, and which are at their friction limit, at the last state."""
    states = [(np.zeros(0, dtype=bool), np.zeros(0, dtype=bool))]
    for contact in [*forces.solver.terms.contacts, *forces.solver.terms.self_contacts]:
        rubbing = np.linalg.norm(fields.read(contact.friction)[0], axis=-1)
        if isinstance(contact, SurfaceContact):
            touches = fields.read(contact.touching)[0] > 0
            most = fields.read(contact.friction_limit)[0]
        elif isinstance(contact, CornerContact):
            touches = fields.read(contact.facet)[0] >= 0
            most = fields.read(contact.limit)[0]
        else:
            facet = fields.read(contact.facet)[0]
            touches = (facet >= 0) & (fields.read(contact.gap)[0] < 0.0)
            most = self_friction(forces, contact, facet)
        at_limit = touches & (most > 0.0) & (rubbing >= AT_LIMIT * most)
        if touches.ndim == 2:  # surfaces of a wall
            touches, at_limit = touches.any(axis=1), at_limit.any(axis=1)
        states.append((touches, at_limit))
    touching, limited = zip(*states, strict=True)
    return np.concatenate(touching), np.concatenate(limited)


def self_friction(forces: StaticForces, contact: Any, facet: np.ndarray) -> np.ndarray:
    """Return the friction limits (points,) [N] of contact between surfaces; facet (points,)."""
    data = forces.model.self_contact
    assert data is not None
    groups = data.point_group[len(data.nodes) :][np.maximum(facet, 0)]
    coefficients = fields.read(contact.friction_coefficient)[0]
    mu, N = coefficients[data.point_group, groups], fields.read(contact.pressing)[0]
    limits: np.ndarray = mu * N
    for adhesion in contact.adhesion:
        shear, sheared = (fields.read(f)[0, :, 0] for f in (adhesion.shear, adhesion.sheared))
        limits = np.where(N > 0.0, mu * np.maximum(N - sheared, 0.0) + shear, 0.0)
    return limits


# -------------------------------------------------------------------------------------------------
# Harmonic response about an equilibrium: small motions under a force of one frequency.
#
# A force Re(f exp(i omega t)) moves the free coordinates by Re(u exp(i omega t)), and Im(f exp(i
# omega t)), a sine, by Im(u exp(i omega t)). Both amplitudes follow from
#
#     [K + sum_b g_b(omega) K_b - omega^2 M] u = f,
#
# with stiffness, branches and inertia as for the modes. It is solved at each frequency:
# no mode is left out, and any damping by the Maxwell branches is exact.

PHASES = 8
"""Number of states of a cycle in which contact is looked at."""


class HarmonicResponse:
    """Amplitudes of a model that vibrates about an equilibrium. Vectors (u,) are complex."""

    def __init__(self, vibrations: SmallVibrations) -> None:
        self.vibrations, self.forces = vibrations, vibrations.forces

    @cached_property
    def branches(self) -> list[sp.csc_matrix]:
        """Stiffness of the Maxwell branches of each term of elements."""
        return self.vibrations.branch_stiffnesses()

    def motion(self, frequency: float, force: np.ndarray) -> np.ndarray:
        """Return u (u,) [m] under a force (u,) [N] of a frequency [Hz]."""
        vibrations, omega = self.vibrations, 2.0 * np.pi * frequency
        dynamic = vibrations.bordered - omega**2 * vibrations.inertia
        for growth, branch in zip(vibrations.growth(frequency), self.branches, strict=True):
            dynamic = dynamic + growth * branch
        lu = splu(dynamic.astype(complex).tocsc(), permc_spec="MMD_AT_PLUS_A")
        bordered = lu.solve(np.pad(force.astype(complex), (0, vibrations.border)))
        motion: np.ndarray = bordered[: vibrations.size]
        return motion

    def force_of(self, motor: Rotor, rotor: RotorForce) -> np.ndarray:
        """Return the force (u,) [N] of a motor; rotor: as `at_full_speed` returns it.

        omega t is the angle of an eccentric mass, or the phase of a sinusoidal force.
        """
        force, turn, d = rotor.sine.astype(complex), np.eye(3), len(rotor.sine)
        if isinstance(motor, CarriedRotor):  # an eccentric mass, which turns with the body
            force = rotor.cosine - 1j * rotor.sine
            turn = Rotation.from_quat(self.vibrations.at.turns[motor.body]).as_matrix()
        on_bodies = np.zeros(self.forces.free_moves.shape, dtype=complex)
        on_bodies[motor.body] = turn[:d, :d] @ force
        nodes, _, turns, _ = self.forces.counts
        moved = on_bodies[self.forces.free_moves]
        return np.concatenate([np.zeros(nodes), moved, np.zeros(turns)])

    def contact_changes(self, motion: np.ndarray) -> int:
        """Return how many points begin or cease to touch, or begin to slip, at most, in a cycle.

        Above zero the amplitude is not small. Points that slide freely do not begin to slip.
        """
        vibrations, forces, most = self.vibrations, self.forces, 0
        padded = np.pad(motion, (0, forces.counts[3]))
        with vibrations.vibrating() if vibrations.friction == "slip" else nullcontext():
            forces.residual(vibrations.at)
            touching, slipping = contact_points(forces)
            for angle in 2.0 * np.pi * np.arange(PHASES) / PHASES:
                moved = forces.moved(vibrations.at, (padded * np.exp(1j * angle)).real)
                forces.residual(moved)
                touches, slips = contact_points(forces)
                changed = (touches != touching) | (touches & slips & ~slipping)
                most = max(most, int(changed.sum()))
        forces.residual(vibrations.at)
        return most


def at_full_speed(motor: Rotor, frequency: float) -> RotorForce:
    """Return the force of a motor that runs at a frequency [Hz]."""
    return motor.at_frequency(motor.rotor, frequency, motor.rotor.start + motor.rotor.spin_up)
