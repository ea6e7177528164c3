"""Springs and drags of rigid bodies and cables: tendon to a force gauge, tether, dragged end."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.fields import Number, once, real_field, vector_field
from softsim.compute.nodes import Nodes
from softsim.compute.term import Pass, PerScenario, Samples, Stage, Term
from softsim.loads.load import Load, LoadTargets, RigidSpring
from softsim.rigid import RigidBodies, freedom
from softsim.scene.loads import TendonSpec, TetherSpec
from softsim.scene.names import Names
from softsim.scene.text import Keys

# -------------------------------------------------------------------------------------------------
# Tendon from a rigid body to a force gauge far away: a spring that pulls and never pushes.
#
# With u the displacement of the body's centre of mass, d the unit vector towards the gauge and s
# the slack, the elongation is e = -u.d - s (the gauge is so far away that d does not turn). If e >
# 0, the tendon pulls the body with T = k e along d, otherwise it is slack. Its energy k e^2/2 is
# stored, as that of springs in ABAQUS: in the internal energy (ALLSE), not in the external work.


@dataclass(frozen=True, eq=False)
class Tendon(Load):
    """Tendon on rigid body number `body` towards the unit vector `direction` (d,).

    It pulls with `stiffness` [N/m] once `slack` [m] is used up. The history records its tension as
    `pull`, averaged over the interval, as a gauge would show it.
    """

    body: int
    stiffness: PerScenario[float]
    direction: PerScenario[np.ndarray]
    slack: PerScenario[float]

    @property
    def columns(self) -> dict[str, str]:
        return {"pull": "N"}

    def term(
        self, scenarios: Sequence["Tendon"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "TendonTerm":
        return TendonTerm(
            rigid_bodies, self.body, np.array([tendon.stiffness for tendon in scenarios]),
            np.stack([tendon.direction for tendon in scenarios]),
            np.array([tendon.slack for tendon in scenarios]),
        )  # fmt: skip

    def springs(self, centres: np.ndarray, gravity: float) -> list[RigidSpring]:
        """Return the stiffness of the taut tendon along a line; it adds none against rotation."""
        return [RigidSpring("tendon", self.body, self.stiffness, goes_taut=True)]


class TendonTerm(Term):
    """Kernel class of a tendon on rigid body number `body`.

    stiffness: k (scenarios,) [N/m]. directions: d (scenarios, dimension). slack: s (scenarios,)
    [m]. Its `impulse` (scenarios,) [N s] is the integral of T since it was last cleared.
    """

    def __init__(
        self,
        rigid_bodies: RigidBodies,
        body: int,
        stiffness: np.ndarray,
        directions: np.ndarray,
        slack: np.ndarray,
    ) -> None:
        self.rigid_bodies, self.body = rigid_bodies, body
        self.stiffness, self.slack = real_field(stiffness), real_field(slack)
        self.direction = vector_field(directions)
        self.impulse = real_field(np.zeros(len(stiffness)))

    def pulls(self) -> list[Callable[..., None]]:
        return [self.pull]

    def state_fields(self) -> dict[str, ti.Field]:
        return {"impulse": self.impulse}

    def impulses(self) -> list[ti.Field]:
        return [self.impulse]

    def readings(self, samples: Samples) -> dict[str, np.ndarray]:
        """Return the mean tension [N]."""
        return {"pull": samples.mean(samples.read(self.impulse))}

    @ti.func
    def elongation(self, s):
        """Return e [m] of a taut tendon, else zero."""
        u = self.rigid_bodies.displacement(s, self.body)
        return ti.max(-u.dot(self.direction[s]) - self.slack[s], ti.cast(0.0, backend.real))

    @ti.func
    def pull(self, s, i, t, dt):
        """Pull the body towards the gauge with k e."""
        tension = self.stiffness[s] * self.elongation(s)
        self.rigid_bodies.hold(s, self.body, tension * self.direction[s])
        self.impulse[s] = self.impulse[s] + tension * dt

    @ti.func
    def stored_energy(self, s, part):
        """Return k e^2 / 2 [J]."""
        e = self.elongation(s)
        return once(part) * 0.5 * self.stiffness[s] * e * e


def tendon(loaded: LoadTargets, load: TendonSpec, keys: Keys) -> Tendon:
    """Return a tendon that holds a rigid body."""
    names = loaded.names
    body = names.rigid_number(load.acts_on, (*keys, "acts_on"))
    direction = names.vector(load.direction, (*keys, "direction"))
    free = np.array(freedom(names, load.acts_on)[: names.dimension])
    if not direction[free].any():
        raise names.loaded.error(
            (*keys, "direction"),
            f"'{load.acts_on}' cannot move along {list(load.direction)}, so the tendon could "
            "never become taut",
            f"free this direction (rigid_bodies.{load.acts_on}.free), or change the direction of "
            "the tendon",
        )
    return Tendon(body, load.stiffness, direction / np.linalg.norm(direction), load.slack)


# -------------------------------------------------------------------------------------------------
# Coulomb friction with memory along a line that turns: the drag of a tether or a cable's end.
#
# A spring k between a point and the object that it drags stretches by ds = e.dx as the point moves
# by dx, with the unit vector e along the line. Its stretch is limited to F / k; beyond that the
# object slides. The force is -k s e. The work of the point, by the trapezoidal rule like that of
# the integrator, minus the energy stored in the spring is dissipated: k (s_0 + s_1)/2 (e.dx - (s_1
# - s_0)) for a line of constant direction.


def longest_stretch(stiffness: np.ndarray, friction: np.ndarray) -> np.ndarray:
    """Return F / k [m]; 0 where the stiffness is zero."""
    slides = stiffness > 0.0
    return np.where(slides, friction / np.where(slides, stiffness, 1.0), 0.0)


@ti.func
def stretched(before, axis_before, axis, way, longest):
    """Return the stretch [m] after a displacement (d) [m] of the point while the line turned."""
    after = before + 0.5 * (axis_before + axis).dot(way)
    return ti.max(-longest, ti.min(longest, after))


@ti.func
def dissipated(stiffness, before, after, axis_before, axis, way):
    """Return the energy [J] dissipated by sliding during the displacement."""
    taken = 0.5 * stiffness * (before * axis_before + after * axis).dot(way)
    return taken - 0.5 * stiffness * (after * after - before * before)


# -------------------------------------------------------------------------------------------------
# Tether that a rigid body trails behind it along its own axis x: drag, weight, stiffness.
#
# Drag: Coulomb friction with memory along the body's axis e (below). Across e the tether
# has no stiffness, so it does not damp transverse vibration of the body.
#
# Weight: the weight m g of the part that hangs on the attachment point, with the present gravity.
#
# Stiffness against turning: the energy 2 sum K_i q_i^2 of the vector part q of the body's
# orientation, a unit quaternion (w, q), with the torque -2 (w K q + q x K q) that follows from it.
# About one axis that is -K sin(angle): K for small angles. With K_y = K_z it measures how far the
# body's axis has turned from rest, regardless of how often the body has rolled about it.
#
# Spring and turning energies are stored (ALLSE), sliding is dissipated by friction (ALLFD), the
# work of the weight is external (ALLWK). The tether does not depend on time: it acts before t = 0
# as well.


@dataclass(frozen=True, eq=False)
class Tether(Load):
    """Tether on rigid body number `body`, attached at `point` (d,) [m], in space at rest.

    Along the body's own x a spring of `stiffness` [N/m] slides at `drag` [N]; `carried_mass` [kg]
    hangs on the point; turning_stiffness (3,) [N m/rad] resists turning about x, y and z. The
    history records the drag against the forward direction as `tether_drag`, averaged over the
    interval.
    """

    body: int
    point: PerScenario[np.ndarray]
    stiffness: PerScenario[float]
    drag: PerScenario[float]
    carried_mass: PerScenario[float]
    turning_stiffness: PerScenario[np.ndarray]

    @property
    def columns(self) -> dict[str, str]:
        return {"tether_drag": "N"}

    @property
    def largest_force(self) -> float:
        return self.drag

    def term(
        self, scenarios: Sequence["Tether"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "TetherTerm":
        return TetherTerm(
            rigid_bodies, self.body,
            np.stack([tether.point for tether in scenarios]) - rigid_bodies.rest_centre[self.body],
            np.array([tether.stiffness for tether in scenarios]),
            np.array([tether.drag for tether in scenarios]),
            np.array([tether.carried_mass for tether in scenarios]),
            np.stack([tether.turning_stiffness for tether in scenarios]),
        )  # fmt: skip

    def springs(self, centres: np.ndarray, gravity: float) -> list[RigidSpring]:
        """Return the stiffness of a sticking tether along a line and against turning.

        It holds a point at the arm r and resists turning about its stiffest axis with K; with the
        weight W that hangs on it, the stiffness against turning is k r^2 + K + W r.
        """
        arm = float(np.linalg.norm(self.point - centres[self.body]))
        turning = self.stiffness * arm**2 + float(self.turning_stiffness.max())
        turning += self.carried_mass * gravity * arm
        return [RigidSpring("tether", self.body, self.stiffness, turning)]


class TetherTerm(Term):
    """Kernel class of a tether on rigid body number `body`.

    arms: attachment point relative to the centre of mass, in the body's axes (scenarios, d) [m].
    stiffness: k (scenarios,) [N/m]. drag: (scenarios,) [N]. carried_mass: m (scenarios,) [kg].
    turning_stiffness: K about x, y, z (scenarios, 3) [N m/rad].

    Fields (scenarios,) at the end of the last increment: place (d) [m] of the point, axis (d),
    stretch [m], weight (d) [N]; since the start: work of the weight and dissipation [J]; `impulse`
    [N s] is the integral of k s since it was last cleared.
    """

    def __init__(
        self,
        rigid_bodies: RigidBodies,
        body: int,
        arms: np.ndarray,
        stiffness: np.ndarray,
        drag: np.ndarray,
        carried_mass: np.ndarray,
        turning_stiffness: np.ndarray,
    ) -> None:
        self.rigid_bodies, self.body = rigid_bodies, body
        self.arm = vector_field(arms)
        self.stiffness = real_field(stiffness)
        self.longest = real_field(longest_stretch(stiffness, drag))
        self.carried_mass = real_field(carried_mass)
        self.turning_stiffness = vector_field(turning_stiffness)
        along_x = np.zeros_like(arms)
        along_x[:, 0] = 1.0
        self.place = vector_field(rigid_bodies.rest_centre[body] + arms)
        self.axis = vector_field(along_x)
        self.weight = vector_field(np.zeros_like(arms))
        self.stretch, self.work, self.dissipation, self.impulse = (
            real_field(np.zeros(len(arms))) for _ in range(4)
        )

    def pulls(self) -> list[Callable[..., None]]:
        return [self.pull]

    def state_fields(self) -> dict[str, ti.Field]:
        names = ("place", "axis", "weight", "stretch", "work", "dissipation", "impulse")
        return {name: getattr(self, name) for name in names}

    def impulses(self) -> list[ti.Field]:
        return [self.impulse]

    def readings(self, samples: Samples) -> dict[str, np.ndarray]:
        """Return the mean drag against the forward direction [N]."""
        return {"tether_drag": samples.mean(samples.read(self.impulse))}

    def forget_work(self) -> None:
        fields.write(self.work, 0.0)

    def forget_dissipation(self, scenario: int) -> None:
        fields.write_row(self.dissipation, scenario, 0.0)

    @ti.func
    def pull(self, s, i, t, dt):
        """Update the tether for the motion of the body and apply its forces to it."""
        arm = self.rigid_bodies.to_space(s, self.body, self.arm[s])
        way = self.rigid_bodies.centre[s, self.body] + arm - self.place[s]
        self.place[s] = self.place[s] + way
        drag = self.slide(s, way)
        weight = self.carried_mass[s] * self.rigid_bodies.nodes.gravity[s]
        self.work[s] = self.work[s] + 0.5 * (self.weight[s] + weight).dot(way)
        self.weight[s] = weight
        self.rigid_bodies.hold_at(s, self.body, drag + weight, arm)
        self.rigid_bodies.twist(s, self.body, self.righting_torque(s))
        self.impulse[s] = self.impulse[s] + self.stiffness[s] * self.stretch[s] * dt

    @ti.func
    def slide(self, s, way):
        """Update the stretch for the displacement (d) [m] of the point and return the drag (d) [N].

        Beyond the limit of the stretch the tether slides.
        """
        k, before, axis_before = self.stiffness[s], self.stretch[s], self.axis[s]
        along_x = ti.Vector.zero(backend.real, self.rigid_bodies.dimension)
        along_x[0] = 1.0
        axis = self.rigid_bodies.to_space(s, self.body, along_x)
        after = stretched(before, axis_before, axis, way, self.longest[s])
        self.dissipation[s] = self.dissipation[s] + dissipated(
            k, before, after, axis_before, axis, way
        )
        self.stretch[s], self.axis[s] = after, axis
        return -k * after * axis

    @ti.func
    def turn(self, s):
        """Return the vector part q (3) of the body's orientation."""
        orientation = self.rigid_bodies.orientation[s, self.body]
        return ti.Vector([orientation[1], orientation[2], orientation[3]])

    @ti.func
    def righting_torque(self, s):
        """Return -2 (w K q + q x K q) (3) [N m]."""
        w, q = self.rigid_bodies.orientation[s, self.body][0], self.turn(s)
        resisting = self.turning_stiffness[s] * q
        return -2.0 * (w * resisting + q.cross(resisting))

    @ti.func
    def stored_energy(self, s, part):
        """Return k s^2 / 2 + 2 sum K_i q_i^2 [J]."""
        stretch, q = self.stretch[s], self.turn(s)
        turned = 2.0 * (self.turning_stiffness[s] * q).dot(q)
        return once(part) * (0.5 * self.stiffness[s] * stretch * stretch + turned)

    @ti.func
    def dissipated_energy(self, s, part):
        """Return the energy [J] dissipated so far by friction, and 0 for viscosity and damping."""
        return once(part) * ti.Vector([self.dissipation[s], 0.0])

    @ti.func
    def work_done(self, s, dt, part):
        """Return the work of the weight so far [J]."""
        return once(part) * self.work[s]


# -------------------------------------------------------------------------------------------------
# Drag of the part of a cable beyond its simulated end, along the direction of the cable.
#
# Friction is that of a trailed tether along the direction of the last segment; across it the end is
# free. The spring's energy is stored (ALLSE), sliding is dissipated by friction (ALLFD). The drag
# does not depend on time: it acts before t = 0 as well.


@dataclass(frozen=True, eq=False)
class EndDrag(Load):
    """Spring of `stiffness` [N/m] at node `end` that slides at the force `drag` [N].

    It acts along the line from node `before` to node `end`. place (d,) [m]: position of the end;
    axis (d,): unit vector along the line, both at rest.
    """

    before: int
    end: int
    place: np.ndarray
    axis: np.ndarray
    stiffness: PerScenario[float]
    drag: PerScenario[float]

    @property
    def largest_force(self) -> float:
        return self.drag

    def term(
        self, scenarios: Sequence["EndDrag"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "EndDragTerm":
        return EndDragTerm(nodes, scenarios)


class EndDragTerm(Term):
    """Kernel class of the drag on the end of a cable.

    Fields (scenarios,) at the end of the last increment: place (d) [m] of the node, axis (d),
    stretch [m]; dissipation [J] since the start.
    """

    def __init__(self, nodes: Nodes, drags: Sequence[EndDrag]) -> None:
        self.nodes = nodes
        self.before, self.end = Number(drags[0].before), Number(drags[0].end)
        self.slot = nodes.corner_forces.reserve(np.array([drags[0].end]))
        stiffness = np.array([drag.stiffness for drag in drags])
        self.stiffness = real_field(stiffness)
        self.longest = real_field(
            longest_stretch(stiffness, np.array([drag.drag for drag in drags]))
        )
        self.place = vector_field(np.stack([drag.place for drag in drags]))
        self.axis = vector_field(np.stack([drag.axis for drag in drags]))
        self.stretch, self.dissipation = (real_field(np.zeros(len(drags))) for _ in range(2))

    def passes(self) -> dict[Stage, list[Pass]]:
        return {Stage.MOVE: [Pass("cables", 1, (self.pull,))]}

    def state_fields(self) -> dict[str, ti.Field]:
        names = ("place", "axis", "stretch", "dissipation")
        return {name: getattr(self, name) for name in names}

    def forget_dissipation(self, scenario: int) -> None:
        fields.write_row(self.dissipation, scenario, 0.0)

    @ti.func
    def pull(self, s, i, t, dt):
        """Update the stretch for the motion of the end and apply the drag to it."""
        k, before, axis_before = self.stiffness[s], self.stretch[s], self.axis[s]
        now = self.nodes.position[s, self.end.read()]
        along = now - self.nodes.position[s, self.before.read()]
        axis, way = along / along.norm(), now - self.place[s]
        after = stretched(before, axis_before, axis, way, self.longest[s])
        self.dissipation[s] = self.dissipation[s] + dissipated(
            k, before, after, axis_before, axis, way
        )
        self.place[s], self.axis[s], self.stretch[s] = now, axis, after
        self.nodes.corner_forces.write(s, self.slot, -k * after * axis)

    @ti.func
    def stored_energy(self, s, part):
        """Return k s^2 / 2 [J]."""
        return once(part) * 0.5 * self.stiffness[s] * self.stretch[s] * self.stretch[s]

    @ti.func
    def dissipated_energy(self, s, part):
        """Return the energy [J] dissipated so far by friction, and 0 for viscosity and damping."""
        return once(part) * ti.Vector([self.dissipation[s], 0.0])


# -------------------------------------------------------------------------------------------------
# Tethers of a scene.


# Way [m] on which a tether's drag builds up, where no stiffness is given: what some 0.25 m of soft
# tube stretch by (E A / L, 240 N/m) under a drag of 0.02 to 0.03 N, and far less than a gait.
ELASTIC_SLIP = 0.1e-3


def tether(loaded: LoadTargets, load: TetherSpec, keys: Keys) -> Tether:
    """Return a tether that a rigid body trails."""
    names = loaded.names
    strength = float(np.linalg.norm(names.scene.environment.gravity))
    body = names.rigid_number(load.acts_on, (*keys, "acts_on"))
    if load.drag > 0.0 and not freedom(names, load.acts_on)[0]:
        raise names.loaded.error(
            (*keys, "drag"),
            f"'{load.acts_on}' cannot move along x, so the tether would exert no drag",
            f"free this direction (rigid_bodies.{load.acts_on}.free), or write 0 N",
        )
    centre = names.vector(names.scene.rigid_bodies[load.acts_on].center, keys)
    return Tether(
        body=body,
        point=centre + names.vector(load.at, (*keys, "at")),
        stiffness=load.drag / ELASTIC_SLIP if load.stiffness == "auto" else load.stiffness,
        drag=load.drag,
        carried_mass=load.weight / strength if strength > 0.0 else 0.0,
        turning_stiffness=turning_stiffness(names, load, keys),
    )


def turning_stiffness(names: Names, load: TetherSpec, keys: Keys) -> np.ndarray:
    """Return the stiffness (3,) [N m/rad] of a tether against roll, yaw and pitch.

    These are rotations about x, y and z.
    """
    if names.dimension == 2:
        for key, given in (("roll", load.roll_stiffness), ("yaw", load.yaw_stiffness)):
            if given > 0.0:
                raise names.loaded.error(
                    (*keys, f"{key}_stiffness"),
                    f"a plane section has no {key}: it rotates about z only (pitch)",
                    f"leave {key}_stiffness out",
                )
    return np.array([load.roll_stiffness, load.yaw_stiffness, load.pitch_stiffness])


def end_drags(names: Names) -> dict[str, EndDrag]:
    """Return the drags on the ends of cables, by name: friction of the part beyond the end."""
    result = {}
    for name, placed in names.cables.items():
        drag = names.scene.cables[name].end_drag
        place = placed.points[-1]
        along = place - placed.points[-2]
        axis = along / np.linalg.norm(along)
        if drag > 0.0:
            before, end = map(int, placed.nodes[-2:])
            held = EndDrag(before, end, place, axis, drag / ELASTIC_SLIP, drag)
            result[f"cables.{name}.end_drag"] = held
    return result
