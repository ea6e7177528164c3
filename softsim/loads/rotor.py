"""Forces of a vibration motor: an eccentric mass, or a sinusoid of given amplitude.

An eccentric mass m_e at radius r_e exerts the centrifugal force m_e r_e omega^2 in its direction. A
motor that turns about the section's normal z exerts its whole rotating vector in the section; one
that turns about the pipe's axis x (in the plane across the section) exerts only its y component; in
space all components act. The weight m_e g belongs to the mass of the body.

The force m_e r_e omega^2 (a cos(angle) + b sin(angle)), with a and b normal to the axis, turns from
a to b. For positive rotation about x, y and z, a is y, z and x, and b is z, x and y. These are axes
of the body that carries the motor and turn with it where it pitches or follows a bend. A sinusoidal
force keeps its direction in space.

The speed rises smoothly: omega(t) = 2 pi f (3 u^2 - 2 u^3) with u = t / spin_up, whose integral
gives the angle in closed form; the force rises with omega^2.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import real_field, vector_field, write_row
from softsim.compute.nodes import Nodes
from softsim.compute.term import PerScenario, Term
from softsim.loads.load import Load, LoadTargets
from softsim.rigid import RigidBodies
from softsim.scene import loads as scene_loads
from softsim.scene.text import Keys


@dataclass(frozen=True)
class RotorForce:
    """Force cos(angle) `cosine` + sin(angle) `sine`, both (d,) [N] at full speed.

    frequency [Hz], spin_up [s]; phase: the angle [rad] at `start` [s], where the rotation begins.
    """

    cosine: PerScenario[np.ndarray]
    sine: PerScenario[np.ndarray]
    frequency: PerScenario[float]
    spin_up: PerScenario[float]
    phase: PerScenario[float]
    start: PerScenario[float] = 0.0

    def turned(self, t: float) -> float:
        """Return the time [s] at full speed that gives the rotation reached at t [s]."""
        since = t - self.start
        if since >= self.spin_up:
            return since - 0.5 * self.spin_up
        u = since / self.spin_up
        return self.spin_up * u**3 * (1.0 - 0.5 * u)

    def at_phase(self, phase: float) -> "RotorForce":
        """Return the rotor with another initial angle [rad]."""
        return replace(self, phase=phase)

    def at_frequency(self, frequency: float, t: float) -> "RotorForce":
        """Return the rotor at another frequency [Hz] from t [s] on, with the same force.

        The angle is continuous at t.
        """
        skipped = 2.0 * np.pi * (self.frequency - frequency) * self.turned(t)
        return replace(self, frequency=frequency, phase=self.phase + skipped)


def eccentric_mass(
    mass: float,
    radius: float,
    frequency: float,
    axis: np.ndarray,
    sense: int,
    spin_up: float,
    phase: float,
    dimension: int,
) -> RotorForce:
    """Return the rotor of an eccentric mass [kg] at a radius [m] that turns about `axis` (3,).

    sense: 1 for positive rotation, -1 for negative. A model of two dimensions has the x and y
    components of its force.
    """
    amplitude = mass * radius * (2.0 * np.pi * frequency) ** 2
    cosine, sine = amplitude * across(axis)[:, :dimension]
    return RotorForce(cosine, sense * sine, frequency, spin_up, phase)


def across(axis: np.ndarray) -> np.ndarray:
    """Return two unit vectors (2, 3) a, b normal to an axis (3,) and right-handed with it.

    a is the projection of the coordinate axis that follows, in the order x, y, z, x, the one
    nearest to the given axis.
    """
    unit = axis / np.linalg.norm(axis)
    following = np.roll(np.eye(3), -1, axis=0)[np.abs(unit).argmax()]
    a = following - following.dot(unit) * unit
    a /= np.linalg.norm(a)
    return np.stack([a, np.cross(unit, a)])


def sinusoidal_force(
    amplitude: float, direction: np.ndarray, frequency: float, spin_up: float, phase: float
) -> RotorForce:
    """Return the force `amplitude` [N] along `direction` times the sine of the angle."""
    unit = np.asarray(direction) / np.linalg.norm(direction)
    return RotorForce(np.zeros_like(unit), amplitude * unit, frequency, spin_up, phase)


@dataclass(frozen=True, eq=False)
class Rotor(Load):
    """Vibration force on rigid body number `body`, along directions fixed in space."""

    body: int
    rotor: RotorForce

    def term(
        self, scenarios: Sequence["Rotor"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "RotorTerm":
        return RotorTerm(rigid_bodies, self.body, [load.rotor for load in scenarios])

    def at_frequency(self, now: RotorForce, frequency: float, t: float) -> RotorForce:
        """Return `now` at another frequency [Hz] from t [s] on; a sinusoid keeps its amplitude."""
        return now.at_frequency(frequency, t)


@dataclass(frozen=True, eq=False)
class CarriedRotor(Rotor):
    """Motor on rigid body number `body`, with force directions that turn with the body."""

    def term(
        self, scenarios: Sequence["Rotor"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "CarriedRotorTerm":
        return CarriedRotorTerm(rigid_bodies, self.body, [load.rotor for load in scenarios])

    def at_frequency(self, now: RotorForce, frequency: float, t: float) -> RotorForce:
        """Return `now` at another frequency f [Hz] from t [s] on, its force rising as f^2."""
        share = (frequency / self.rotor.frequency) ** 2
        cosine, sine = share * self.rotor.cosine, share * self.rotor.sine
        return replace(now.at_frequency(frequency, t), cosine=cosine, sine=sine)


class RotorTerm(Term):
    """Kernel class of vibration on rigid body number `body`, with one RotorForce per scenario."""

    def __init__(self, rigid_bodies: RigidBodies, body: int, rotors: list[RotorForce]) -> None:
        self.rigid_bodies, self.body = rigid_bodies, body
        self.cosine = vector_field(np.array([r.cosine for r in rotors]))
        self.sine = vector_field(np.array([r.sine for r in rotors]))
        self.speed = real_field(np.array([2.0 * np.pi * r.frequency for r in rotors]))
        self.spin_up = real_field(np.array([r.spin_up for r in rotors]))
        self.phase = real_field(np.array([r.phase for r in rotors]))
        self.start = real_field(np.array([r.start for r in rotors]))
        self.rotors = rotors

    def follow(self, scenario: int, rotor: RotorForce) -> None:
        """Replace the rotor of a scenario."""
        self.rotors[scenario] = rotor
        write_row(self.cosine, scenario, rotor.cosine)
        write_row(self.sine, scenario, rotor.sine)
        write_row(self.speed, scenario, 2.0 * np.pi * rotor.frequency)
        write_row(self.spin_up, scenario, rotor.spin_up)
        write_row(self.phase, scenario, rotor.phase)
        write_row(self.start, scenario, rotor.start)

    def pulls(self) -> list[Callable[..., None]]:
        return [self.pull]

    @ti.func
    def pull(self, s, i, t, dt):
        """Apply the force of time t; before its start the motor stands still."""
        spin_up, since = self.spin_up[s], t - self.start[s]
        share = ti.cast(1.0, backend.real)
        turned = since - 0.5 * spin_up
        if since < spin_up:
            u = since / spin_up
            share = u * u * (3.0 - 2.0 * u)
            turned = spin_up * u * u * u * (1.0 - 0.5 * u)
        if since < 0.0:
            share = 0.0
        angle = self.phase[s] + self.speed[s] * turned
        force = ti.cos(angle) * self.cosine[s] + ti.sin(angle) * self.sine[s]
        self.rigid_bodies.apply(s, self.body, share * share * self.in_space(s, force))

    @ti.func
    def in_space(self, s, force):
        """Return the force (d) [N] in space."""
        return force


class CarriedRotorTerm(RotorTerm):
    """Kernel class of a motor whose force directions turn with rigid body number `body`."""

    @ti.func
    def in_space(self, s, force):
        """Return the force (d) [N] in space of a force in the body's axes."""
        return self.rigid_bodies.to_space(s, self.body, force)


# -------------------------------------------------------------------------------------------------
# Rotors of a scene.


def eccentric_motor(
    loaded: LoadTargets, load: scene_loads.EccentricMass, keys: Keys
) -> CarriedRotor:
    """Return a vibration motor on a rigid body."""
    rotor = eccentric_mass(
        load.factor * load.eccentric_mass, load.radius, load.frequency,
        np.array(load.rotation_axis), load.sense, load.spin_up, load.phase,
        loaded.names.dimension,
    )  # fmt: skip
    begun = replace(rotor, start=loaded.names.beginning.of(keys))
    return CarriedRotor(shaken_body(loaded, load.acts_on, keys), begun)


def sinusoid(loaded: LoadTargets, load: scene_loads.SinusoidalForce, keys: Keys) -> Rotor:
    """Return a sinusoidal force on a rigid body."""
    direction = loaded.names.vector(load.direction, (*keys, "direction"))
    rotor = sinusoidal_force(load.amplitude, direction, load.frequency, load.spin_up, load.phase)
    begun = replace(rotor, start=loaded.names.beginning.of(keys))
    return Rotor(shaken_body(loaded, load.acts_on, keys), begun)


def shaken_body(loaded: LoadTargets, acts_on: str, keys: Keys) -> int:
    """Return the number of the rigid body on which a vibration acts."""
    names = loaded.names
    if names.scene.time.procedure == "static":
        raise names.loaded.error(
            keys,
            f"'{keys[-1]}' vibrates, so a static procedure cannot find an equilibrium",
            "leave the motor out, or write time.procedure: dynamic",
        )
    return names.rigid_number(acts_on, (*keys, "acts_on"))
