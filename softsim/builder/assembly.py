"""Assembly of the whole model of a scene, part by part."""

from dataclasses import replace

import numpy as np

from softsim.builder import conditions, contact, loads, network, passage, rigid, structural, walls
from softsim.builder import contact as self_contact
from softsim.builder import walls as wall_corners
from softsim.builder.bodies import built_bodies, material_keys, meshed_bodies
from softsim.builder.chambers import refuse_what_cannot_be_felt
from softsim.builder.conditions import over_the_run
from softsim.builder.loads import LoadTargets
from softsim.builder.names import Names
from softsim.builder.names import chamber as chamber_of
from softsim.builder.names import robot as robot_of
from softsim.builder.passage import crossing, end_time, refuse_steady_probe, steady_probe
from softsim.elements.axisymmetric import Axisymmetric
from softsim.loads.nodal import RisingGravity
from softsim.loads.prescribed import MovingWall, PrescribedMotion, RigidMotion
from softsim.loads.pressure import FollowerPressure
from softsim.loads.profile import Profile
from softsim.model import Model, Relaxation
from softsim.scene.loading import LoadedScene
from softsim.scene.steps import AT_THE_START, Beginning
from softsim.scene.walls import Environment
from softsim.solver.stable_step import estimator

RELAXING_VISCOSITY = 0.06
LONGEST_RELAXATION = 10.0
"""Default time [s] that a static run may take after the time of its loads."""
ALONG_ITS_AXIS = "in an axisymmetric model, gravity acts along the axis only"


def build_model(loaded: LoadedScene, beginning: Beginning = AT_THE_START) -> Model:
    """Return the frozen model of a scene; beginning: start of a step that follows others.

    Raises
    ------
    SceneError: a name that does not exist, a mesh that cannot be computed with, an open chamber, a
    body that starts inside a wall, a law unstable within its strain range, a time step above the
    stable one.
    """
    meshed, scene = meshed_bodies(loaded), loaded.scene
    names = Names(loaded, meshed, structural.placed_cables(loaded, meshed), beginning)
    names, all_ties = structural.placed_ties(names)
    names = replace(names, surfaces=rigid.placed_surfaces(names))
    bodies = built_bodies(names)
    soft_points = np.concatenate([*(b.points for b in bodies), structural.cable_points(names)])
    soft_count = len(soft_points)
    vertices, vertex_owner = rigid.surface_points(names)
    corners, corner_owner = rigid.outline_points(names)
    points = np.concatenate([soft_points, vertices, corners])
    carrier = np.concatenate([vertex_owner, corner_owner])

    held = conditions.held_components(names, bodies, points)
    held[soft_count:] = True
    fixed = held.copy()
    motions = conditions.prescribed(names, held)
    for motion in motions.values():
        held[motion.nodes, motion.axis] = True
    tied = rigid.tied_nodes(names, ~held)
    for nodes in tied:
        held[nodes] = True
    structural.refuse_held_nodes(names, all_ties, points, fixed, held)
    moves, is_free = ~held, ~held
    is_free[all_ties.nodes] = False
    structures = structural.built_structures(names, points, is_free)
    own_mass = conditions.lumped_mass(names, bodies, structures, len(points))
    mass = all_ties.handed_over(own_mass)
    starting = conditions.initial_velocity(names, bodies, points, own_mass)
    velocity = all_ties.followed(np.where(moves, starting, 0.0))
    outline_nodes = [
        soft_count + np.flatnonzero(carrier == r) for r in range(len(scene.rigid_bodies))
    ]
    rigid_bodies = tuple(
        rigid.rigid_body(
            names,
            name,
            rigid.own_mass(names, name, bodies, own_mass),
            np.concatenate([tied[r], outline_nodes[r]]),
        )
        for r, name in enumerate(scene.rigid_bodies)
    )
    stiffness = contact.PenaltyStiffness(
        scene.contact,
        contact.penalty_stiffness(names, bodies, len(points)),
        all_ties.moved_mass(contact.contact_mass(points, mass, moves, rigid_bodies)),
    )
    surfaces = [b.node_sets["surface"] for b in bodies]
    touching = np.concatenate([*surfaces, np.arange(soft_count, len(points))])
    closed_walls = walls.walls(names)
    all_walls = walls.fitted(names, closed_walls, points[touching])
    walls.refuse_penetration(names, all_walls, points[touching])
    at_walls = stiffness.contact(touching, scene.contact.friction_coefficient)
    total_mass = mass.sum() + sum(rigid_body.mass for rigid_body in rigid_bodies)
    loaded_parts = LoadTargets(names, bodies, points, own_mass, moves, tied, total_mass)
    acting = loads.built_loads(loaded_parts)
    acting |= network.built_network(loaded_parts, acting)
    chamber = chamber_of(names, [a for a in acting.values() if isinstance(a, FollowerPressure)])
    full_gravity, rise = gravity(names), gravity_share(names)
    starting_gravity = full_gravity
    if rise is not None:
        starting_gravity = rise.at(beginning.time) * full_gravity
        acting |= {"environment.gravity_profile": RisingGravity(full_gravity, rise)}
    for further in (loads.end_drags(names), motions, rigid.rigid_motions(names)):
        acting |= further
    # Of a kind in the order of the scene; kinds in one order, so that scenes with the same loads
    # share compiled kernels, whichever comes first in the file.
    acting = dict(sorted(acting.items(), key=lambda named: type(named[1]).__name__))
    model = Model(
        bodies=bodies,
        structures=structural.touching_structures(
            names, structures, is_free, stiffness, closed_walls
        ),
        points=points,
        velocity=velocity,
        mass=mass,
        is_free=is_free,
        ties=all_ties,
        rigid_bodies=rigid_bodies,
        outlines=rigid.outlines(names, points, stiffness, tied),
        walls=all_walls,
        contact=at_walls,
        adhesions=contact.adhesions(names, bodies, points, all_walls, at_walls),
        friction_memory=scene.contact.friction_memory,
        friction_slip_length=scene.contact.friction_slip_length,
        self_contact=self_contact.self_contact(
            names,
            bodies,
            points,
            all_ties,
            [b.tied for b in rigid_bodies if len(b.facets)],
            all_ties.moved_mass(mass),
        ),
        corners=wall_corners.corner_data(bodies, points, all_walls, at_walls),
        loads=tuple(acting.values()),
        load_names=tuple(acting),
        probes=conditions.probes(names, points, moves, all_ties),
        gravity=full_gravity,
        starting_gravity=starting_gravity,
        robot=robot_of(names, bodies, chamber, points),
        start_time=beginning.time,
        end_time=end_time(names, chamber),
        cycles=scene.time.cycles,
        time_increment=None if scene.time.increment == "auto" else scene.time.increment,
        safety_factor=scene.solver.safety_factor,
        least_step=scene.solver.least_step,
        bulk_viscosity=bulk_viscosity(names),
        mass_scaling=conditions.mass_scaling(names, bodies, points, is_free),
        energy_error_limit=scene.solver.energy_error_limit,
        relaxation=relaxation(names),
        settling=settling(names),
        passage=passage.passage(names, closed_walls, outline_nodes, chamber),
        crossing=crossing(names, bodies),
    )
    refuse_instant_relaxation(names, model)
    refuse_path_of_motion(names, model)
    refuse_what_cannot_be_felt(names, model)
    refuse_unstable_step(names, model)
    return model


def gravity(names: Names) -> np.ndarray:
    """Return the acceleration of gravity (d,) [m/s^2].

    It is the vector that the scene gives, or points down in y, along -x as +x is inclined upwards,
    and towards +z as +y is rolled away from the vertical plane through x.
    """
    environment = names.scene.environment
    if isinstance(environment.gravity, tuple):
        return gravity_vector(names, environment.gravity)
    for key, angle in (("inclination", environment.inclination), ("roll", environment.roll)):
        if isinstance(names.geometry, Axisymmetric) and angle != 0.0 and environment.gravity > 0.0:
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
    if isinstance(names.geometry, Axisymmetric) and vector[0] != 0.0:
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
