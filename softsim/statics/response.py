"""Harmonic response about an equilibrium: small motions under a force of one frequency.

A force Re(f exp(i omega t)) moves the free coordinates by Re(u exp(i omega t)), and Im(f exp(i
omega t)), a sine, by Im(u exp(i omega t)). Both amplitudes follow from

    [K + sum_b g_b(omega) K_b - omega^2 M] u = f,

with stiffness, branches and inertia as for the modes (modes.py). It is solved at each frequency:
no mode is left out, and any damping by the Maxwell branches is exact.
"""

from contextlib import nullcontext
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu
from scipy.spatial.transform import Rotation

from softsim.loads.rotor import CarriedRotor, Rotor, RotorForce
from softsim.statics.modes import SmallVibrations, contact_points

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
