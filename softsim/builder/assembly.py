"""Assembly of the model of a scene in stages, each of which adds to a draft."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from softsim.applications import entry
from softsim.builder import contact, network, passage, rigid, walls
from softsim.builder.bodies import (
    built_bodies,
    held_components,
    initial_velocity,
    lumped_mass,
    mass_scaling,
    material_keys,
    meshed_bodies,
    probes,
)
from softsim.builder.chambers import Targets, refuse_what_cannot_be_felt
from softsim.builder.passage import chamber as chamber_of
from softsim.builder.passage import crossing, end_time, refuse_steady_probe, steady_probe
from softsim.builder.passage import robot as robot_of
from softsim.contact.surface_contact import ContactData, PenaltyStiffness
from softsim.contact.wall import Wall
from softsim.loads.load import Load
from softsim.loads.nodal import RisingGravity
from softsim.loads.prescribed import (
    MovingWall,
    PrescribedMotion,
    RigidMotion,
    prescribed,
    rigid_motions,
)
from softsim.loads.pressure import FollowerPressure
from softsim.loads.profile import Profile, over_the_run
from softsim.loads.tether import end_drags
from softsim.model import Body, Model, Relaxation
from softsim.rigid import RigidBodyData
from softsim.scene.bodies import STRUCTURES
from softsim.scene.loading import LoadedScene
from softsim.scene.names import Names
from softsim.scene.steps import AT_THE_START, Beginning
from softsim.scene.walls import Environment
from softsim.solver.stable_step import estimator
from softsim.structures.cable import cable_points, placed_cables, touching
from softsim.structures.structure import Structure
from softsim.structures.ties import Ties, placed_ties, refuse_held_nodes

RELAXING_VISCOSITY = 0.06
LONGEST_RELAXATION = 10.0
"""Default time [s] that a static run may take after the time of its loads."""
ALONG_ITS_AXIS = "in an axisymmetric model, gravity acts along the axis only"


@dataclass
class Draft:
    """Model under construction: what a stage passes on to those after it.

    names and ties are those of the placed bodies. points (n, d) [m], mass (n,) [kg] and is_free
    (n, d): of all nodes; own_mass (n,) [kg]: before ties handed it over; moves (n, d): True for
    components that are not held, also of tied nodes. soft_count: number of nodes of bodies and
    structures; carrier: rigid body of each node behind them. tied, outline_nodes: nodes of each
    rigid body. closed_walls: walls before an interference fit, `walls` after it. contact: of the
    bodies with walls. loads: all loads by name. gravity, starting_gravity (d,) [m/s^2].
    """

    loaded: LoadedScene
    beginning: Beginning
    names: Names = field(init=False)
    ties: Ties = field(init=False)
    bodies: tuple[Body, ...] = field(init=False)
    points: np.ndarray = field(init=False)
    soft_count: int = field(init=False)
    carrier: np.ndarray = field(init=False)
    motions: dict[str, PrescribedMotion] = field(init=False)
    tied: list[np.ndarray] = field(init=False)
    moves: np.ndarray = field(init=False)
    is_free: np.ndarray = field(init=False)
    structures: tuple[Structure, ...] = field(init=False)
    own_mass: np.ndarray = field(init=False)
    mass: np.ndarray = field(init=False)
    velocity: np.ndarray = field(init=False)
    outline_nodes: list[np.ndarray] = field(init=False)
    rigid_bodies: tuple[RigidBodyData, ...] = field(init=False)
    stiffness: PenaltyStiffness = field(init=False)
    closed_walls: tuple[Wall, ...] = field(init=False)
    walls: tuple[Wall, ...] = field(init=False)
    contact: ContactData = field(init=False)
    loads: dict[str, Load] = field(init=False)
    chamber: FollowerPressure | None = field(init=False)
    gravity: np.ndarray = field(init=False)
    starting_gravity: np.ndarray = field(init=False)


def build_model(loaded: LoadedScene, beginning: Beginning = AT_THE_START) -> Model:
    """Return the frozen model of a scene; beginning: start of a step that follows others.

    Raises
    ------
    SceneError: a name that does not exist, a mesh that cannot be computed with, an open chamber, a
    body that starts inside a wall, a law unstable within its strain range, a time step above the
    stable one.
    """
    draft = Draft(loaded, beginning)
    for stage in STAGES:
        stage(draft)
    model = finished(draft)
    for refuse in REFUSALS:
        refuse(draft.names, model)
    return model


def place_bodies(draft: Draft) -> None:
    """Mesh the bodies and place them, cables, tied nodes and rigid surfaces."""
    meshed = meshed_bodies(draft.loaded)
    cables = placed_cables(draft.loaded, meshed)
    names = Names(draft.loaded, meshed, cables, draft.beginning)
    names, draft.ties = placed_ties(names)
    draft.names = replace(names, surfaces=rigid.placed_surfaces(names))
    draft.bodies = built_bodies(draft.names)


def number_nodes(draft: Draft) -> None:
    """Number the nodes of bodies, structures, rigid surfaces and rigid outlines, in this order."""
    names = draft.names
    vertices, vertex_owner = rigid.surface_points(names)
    corners, corner_owner = rigid.outline_points(names)
    soft_points = [*(b.points for b in draft.bodies), cable_points(names)]
    draft.soft_count = sum(map(len, soft_points))
    draft.points = np.concatenate([*soft_points, vertices, corners])
    draft.carrier = np.concatenate([vertex_owner, corner_owner])


def hold_nodes(draft: Draft) -> None:
    """Find the components that are fixed, prescribed, or tied to a rigid body or a facet."""
    names = draft.names
    held = held_components(names, draft.bodies, draft.points)
    held[draft.soft_count :] = True
    fixed = held.copy()
    draft.motions = prescribed(names, held)
    for motion in draft.motions.values():
        held[motion.nodes, motion.axis] = True
    draft.tied = rigid.tied_nodes(names, ~held)
    for nodes in draft.tied:
        held[nodes] = True
    refuse_held_nodes(names, draft.ties, draft.points, fixed, held)
    draft.moves, draft.is_free = ~held, ~held
    draft.is_free[draft.ties.nodes] = False


def add_structures(draft: Draft) -> None:
    """Build cables, layers and fibres, still without contact."""
    draft.structures = tuple(
        structure
        for point in STRUCTURES.values()
        for structure in entry(point)(draft.names, draft.points, draft.is_free)
    )


def lump_masses(draft: Draft) -> None:
    """Lump the masses to the nodes, and give these their initial velocities."""
    names, bodies, points = draft.names, draft.bodies, draft.points
    draft.own_mass = lumped_mass(names, bodies, draft.structures, len(points))
    draft.mass = draft.ties.handed_over(draft.own_mass)
    starting = initial_velocity(names, bodies, points, draft.own_mass)
    draft.velocity = draft.ties.followed(np.where(draft.moves, starting, 0.0))


def add_rigid_bodies(draft: Draft) -> None:
    """Build the rigid bodies with the nodes that they carry."""
    names = draft.names
    draft.outline_nodes = [
        draft.soft_count + np.flatnonzero(draft.carrier == r)
        for r in range(len(names.scene.rigid_bodies))
    ]
    draft.rigid_bodies = tuple(
        rigid.rigid_body(
            names,
            name,
            rigid.own_mass(names, name, draft.bodies, draft.own_mass),
            np.concatenate([draft.tied[r], draft.outline_nodes[r]]),
        )
        for r, name in enumerate(names.scene.rigid_bodies)
    )


def add_walls(draft: Draft) -> None:
    """Build the walls, and the contact of bodies with them."""
    names, points = draft.names, draft.points
    settings = names.scene.contact
    draft.stiffness = PenaltyStiffness(
        settings,
        contact.penalty_stiffness(names, draft.bodies, len(points)),
        draft.ties.moved_mass(
            contact.contact_mass(points, draft.mass, draft.moves, draft.rigid_bodies)
        ),
    )
    surfaces = [b.node_sets["surface"] for b in draft.bodies]
    touching = np.concatenate([*surfaces, np.arange(draft.soft_count, len(points))])
    draft.closed_walls = walls.walls(names)
    draft.walls = walls.fitted(names, draft.closed_walls, points[touching])
    walls.refuse_penetration(names, draft.walls, points[touching])
    draft.contact = draft.stiffness.contact(touching, settings.friction_coefficient)


def add_loads(draft: Draft) -> None:
    """Build the loads and prescribed motions.

    Loads of a kind are in the order of the scene, and kinds in one order, so that scenes with the
    same loads share compiled kernels, whichever comes first in the file.
    """
    names = draft.names
    total_mass = draft.mass.sum() + sum(body.mass for body in draft.rigid_bodies)
    regions = {body.name: body.regions for body in draft.bodies}
    targets = Targets(
        names, regions, draft.points, draft.own_mass, draft.moves, draft.tied, total_mass
    )
    acting: dict[str, Load] = {
        name: entry(load.built_by)(targets, load, ("loads", name))
        for name, load in names.scene.loads.items()
    }
    acting |= network.built_network(targets, acting)
    pressures = [load for load in acting.values() if isinstance(load, FollowerPressure)]
    draft.chamber = chamber_of(names, pressures)
    draft.gravity, rise = gravity(names), gravity_share(names)
    draft.starting_gravity = draft.gravity
    if rise is not None:
        draft.starting_gravity = rise.at(draft.beginning.time) * draft.gravity
        acting |= {"environment.gravity_profile": RisingGravity(draft.gravity, rise)}
    acting |= {**end_drags(names), **draft.motions, **rigid_motions(names)}
    draft.loads = dict(sorted(acting.items(), key=lambda named: type(named[1]).__name__))


STAGES: tuple[Callable[[Draft], None], ...] = (
    place_bodies, number_nodes, hold_nodes, add_structures, lump_masses, add_rigid_bodies,
    add_walls, add_loads,
)  # fmt: skip
"""Stages of the assembly, in order; each needs those before it."""


def finished(draft: Draft) -> Model:
    """Return the model of a draft after all stages."""
    names, bodies, points, mass = draft.names, draft.bodies, draft.points, draft.mass
    scene = names.scene
    return Model(
        bodies=bodies,
        structures=touching(
            names, draft.structures, draft.is_free, draft.stiffness, draft.closed_walls
        ),
        points=points,
        velocity=draft.velocity,
        mass=mass,
        is_free=draft.is_free,
        ties=draft.ties,
        rigid_bodies=draft.rigid_bodies,
        outlines=rigid.outlines(names, points, draft.stiffness, draft.tied),
        walls=draft.walls,
        contact=draft.contact,
        adhesions=contact.adhesions(names, bodies, points, draft.walls, draft.contact),
        friction_memory=scene.contact.friction_memory,
        friction_slip_length=scene.contact.friction_slip_length,
        self_contact=contact.self_contact(
            names,
            bodies,
            points,
            draft.ties,
            [b.tied for b in draft.rigid_bodies if len(b.facets)],
            draft.ties.moved_mass(mass),
        ),
        corners=walls.corner_data(bodies, points, draft.walls, draft.contact),
        loads=tuple(draft.loads.values()),
        load_names=tuple(draft.loads),
        probes=probes(names, points, draft.moves, draft.ties),
        gravity=draft.gravity,
        starting_gravity=draft.starting_gravity,
        robot=robot_of(names, bodies, draft.chamber, points),
        start_time=draft.beginning.time,
        end_time=end_time(names, draft.chamber),
        cycles=scene.time.cycles,
        time_increment=None if scene.time.increment == "auto" else scene.time.increment,
        safety_factor=scene.solver.safety_factor,
        least_step=scene.solver.least_step,
        bulk_viscosity=bulk_viscosity(names),
        mass_scaling=mass_scaling(names, bodies, points, draft.is_free),
        energy_error_limit=scene.solver.energy_error_limit,
        relaxation=relaxation(names),
        settling=settling(names),
        passage=passage.passage(names, draft.closed_walls, draft.outline_nodes, draft.chamber),
        crossing=crossing(names, bodies),
    )


def gravity(names: Names) -> np.ndarray:
    """Return the acceleration of gravity (d,) [m/s^2].

    It is the vector that the scene gives, or points down in y, along -x as +x is inclined upwards,
    and towards +z as +y is rolled away from the vertical plane through x.
    """
    environment = names.scene.environment
    if isinstance(environment.gravity, tuple):
        return gravity_vector(names, environment.gravity)
    for key, angle in (("inclination", environment.inclination), ("roll", environment.roll)):
        if names.is_axisymmetric and angle != 0.0 and environment.gravity > 0.0:
            raise names.loaded.error(
                ("environment", key), ALONG_ITS_AXIS,
                f"leave the {key} out: gravity points down the axis y",
            )  # fmt: skip
    return gravity_in_space(environment)[: names.dimension]


def gravity_in_space(environment: Environment) -> np.ndarray:
    """Return gravity (3,) [m/s^2] in space, with its component out of a section's plane."""
    if isinstance(environment.gravity, tuple):
        return np.pad(environment.gravity, (0, 3 - len(environment.gravity)))
    slope, roll = environment.inclination, environment.roll
    across = np.cos(slope)
    down = np.array([-np.sin(slope), -across * np.cos(roll), across * np.sin(roll)])
    return np.asarray(environment.gravity * down)


def gravity_vector(names: Names, components: tuple[float, ...]) -> np.ndarray:
    """Return the gravity (d,) [m/s^2] that the scene gives by its components."""
    environment, keys = names.scene.environment, ("environment", "gravity")
    for key, angle in (("inclination", environment.inclination), ("roll", environment.roll)):
        if angle != 0.0:
            raise names.loaded.error(
                ("environment", key),
                "gravity is given as a vector, which already has a direction",
                f"leave the {key} out, or give gravity as one acceleration",
            )
    vector = names.vector(components, keys)
    if names.is_axisymmetric and vector[0] != 0.0:
        raise names.loaded.error(keys, ALONG_ITS_AXIS, "write 0 m/s^2 for x, the radial direction")
    return vector


def gravity_share(names: Names) -> Profile | None:
    """Return the factor of gravity over time; None if all of it acts from the start."""
    keys = ("environment", "gravity_profile")
    given, time = names.scene.environment.gravity_profile, names.scene.time
    if given is not None and time.procedure == "dynamic" and time.settle is not None:
        raise names.loaded.error(
            keys,
            "during time.settle the body carries its whole weight, which cannot be raised "
            "afterwards",
            "leave gravity_profile or time.settle out",
        )
    return None if given is None else over_the_run(names, given, keys)


def bulk_viscosity(names: Names) -> float:
    """Return the linear bulk viscosity coefficient b1.

    Under a static procedure it is at least RELAXING_VISCOSITY: without it the fastest modes outlive
    local damping and slow down the convergence of the slow ones.
    """
    given = names.scene.solver.bulk_viscosity
    return given if names.scene.time.procedure == "dynamic" else max(given, RELAXING_VISCOSITY)


def relaxation(names: Names) -> Relaxation | None:
    """Return the settings of a static procedure; None for a dynamic one."""
    scene = names.scene
    time = scene.time
    if time.procedure == "dynamic":
        refuse_steady_probe(names)
        refuse_method(names)
        refuse_derivatives(names)
        return None
    longest = LONGEST_RELAXATION if time.settle is None else time.settle
    by_default = "newton" if time.settle is None and time.until is None else "relaxation"
    by_newton = (time.method or by_default) == "newton"
    tolerance = scene.solver.equilibrium_tolerance
    follows_path = time.control == "arc_length"
    if follows_path and not by_newton:
        raise names.loaded.error(
            ("time", "control"),
            "relaxation does not follow a path of equilibria",
            "write method: newton, or leave `control` out",
        )
    if follows_path or not by_newton:
        refuse_derivatives(names)
    refuse_derivatives_between_rows(names)
    return Relaxation(
        longest, tolerance, steady_probe(names), by_newton=by_newton, follows_path=follows_path
    )


def refuse_derivatives(names: Names) -> None:
    """Raise SceneError if a run without load steps of Newton's method asks for derivatives."""
    if names.scene.output.derivatives is not None:
        raise names.loaded.error(
            ("output", "derivatives"),
            "derivatives need a static run by Newton's method",
            "write time.procedure: static, without settle, until, and control: arc_length",
        )


def refuse_derivatives_between_rows(names: Names) -> None:
    """Raise SceneError if derivatives are asked at a time at which the history has no row."""
    output, end = names.scene.output, names.scene.time.end
    asked = () if output.derivatives is None else output.derivatives.at
    for number, time in enumerate(asked):
        rows = time / output.history_interval
        if time < end * (1.0 - 1e-9) and (rows < 0.5 or abs(rows - round(rows)) > 1e-6):
            raise names.loaded.error(
                ("output", "derivatives", "at", number),
                f"the history has no row at {time:g} s",
                "give a multiple of output.history_interval, or the end",
            )


def refuse_method(names: Names) -> None:
    """Raise SceneError if a dynamic run names a method of finding equilibrium."""
    time = names.scene.time
    for key, is_given in (("method", time.method is not None), ("control", time.control != "load")):
        if is_given:
            raise names.loaded.error(
                ("time", key),
                "only a static run goes from equilibrium to equilibrium",
                f"write procedure: static, or leave `{key}` out",
            )


def refuse_path_of_motion(names: Names, model: Model) -> None:
    """Raise SceneError if a path by arc length meets a prescribed motion: it follows loads."""
    if model.relaxation is None or not model.relaxation.follows_path:
        return
    motions = (PrescribedMotion, RigidMotion, MovingWall)
    if any(isinstance(x, motions) for x in (*model.loads, *model.walls)):
        raise names.loaded.error(
            ("time", "control"),
            "arc_length follows forces and pressures, and this scene prescribes a motion",
            "write control: load, which follows a motion through the limit points of its force",
        )


def settling(names: Names) -> Relaxation | None:
    """Return the settings of the time before t = 0; None if bodies start as they are meshed."""
    scene = names.scene
    if scene.time.procedure == "static" or scene.time.settle is None:
        return None
    shortest = walls.CLOSING * scene.time.settle if scene.contact.interference_fit else 0.0
    return Relaxation(scene.time.settle, scene.solver.equilibrium_tolerance, shortest=shortest)


def refuse_instant_relaxation(names: Names, model: Model) -> None:
    """Raise SceneError if a Maxwell branch relaxes within a hundredth of an increment.

    Such a branch carries no load: the viscosity that it represents would be lost.
    """
    if not any(region.material.branches for region in model.regions):
        return
    step = estimator(model).at_rest.value
    for region in model.regions:
        for branch in region.material.branches:
            if branch.relaxation_time < 0.01 * step:
                raise names.loaded.error(
                    material_keys(names, region.body, region.cell_set),
                    f"material '{region.material.name}' relaxes in "
                    f"{branch.relaxation_time * 1e6:.3g} us, much less than a time step of "
                    f"{step * 1e6:.3g} us",
                    "leave out prony terms shorter than the time step",
                )


def refuse_unstable_step(names: Names, model: Model) -> None:
    """Raise SceneError if a step given by the user is unstable at the start."""
    if model.time_increment is None:
        return
    stable = estimator(model).at_rest
    if model.time_increment > stable.stable:
        raise names.loaded.error(
            ("time", "increment"),
            f"the time step {model.time_increment * 1e6:.3g} us is above the stable step: "
            f"{stable.describe()}",
            f'write "auto", or at most {np.floor(model.safety_factor * stable.value * 1e9):g} ns',
        )


REFUSALS: tuple[Callable[[Names, Model], None], ...] = (
    refuse_instant_relaxation,
    refuse_path_of_motion,
    refuse_what_cannot_be_felt,
    refuse_unstable_step,
)
"""Checks of the whole model."""
