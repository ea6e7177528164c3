"""Loads: motors, forces, tendons, tethers, pulled cables; the pressure of chambers: chambers.py."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from softsim.builder.bodies import bounded
from softsim.builder.chambers import joined_facets, pressure
from softsim.builder.names import Names, in_mm
from softsim.builder.profiles import LoadTargets, over_the_run
from softsim.builder.rigid import freedom
from softsim.builder.structural import in_bodies, refuse_all_around
from softsim.elements.geometry import nodal_sums
from softsim.loads.load import Load
from softsim.loads.nodal import AxialRelief, NodalForce, RigidForce
from softsim.loads.profile import Profile, smooth_rise
from softsim.loads.rotor import CarriedRotor, Rotor, eccentric_mass, sinusoidal_force
from softsim.loads.tendon import Tendon
from softsim.loads.tether import EndDrag, Tether
from softsim.scene import loads as scene_loads
from softsim.scene.text import Keys
from softsim.structures.pulled_cable import PulledCable

# Way [m] on which a tether's drag builds up, where no stiffness is given: what some 0.25 m of soft
# tube stretch by (E A / L, 240 N/m) under a drag of 0.02 to 0.03 N, and far less than a gait.
ELASTIC_SLIP = 0.1e-3

# Of a cable's length: eyelets that are no farther from each other are at one place.
SAME_PLACE = 1e-6


def built_loads(loaded: LoadTargets) -> dict[str, Load]:
    """Return all loads of a scene by name, in its order."""
    return {
        name: BUILDERS[type(load)](loaded, load, ("loads", name))
        for name, load in loaded.names.scene.loads.items()
    }


def sized(
    loaded: LoadTargets,
    load: scene_loads.OverTime | scene_loads.Directed[Any],
    full: str,
    keys: Keys,
) -> tuple[np.ndarray, Profile]:
    """Return the vector of a load and the factor of it over time [s] of the whole run.

    The vector is the load's full value, at the key `full`, or the unit vector along its direction,
    and the profile has the value then.
    """
    names = loaded.names
    if isinstance(load, scene_loads.OverTime):
        return names.vector(getattr(load, full), (*keys, full)), over_time(loaded, load, keys)
    direction = names.vector(load.direction, (*keys, "direction"))
    return direction / np.linalg.norm(direction), over_the_run(names, load.profile, keys)


def over_time(loaded: LoadTargets, load: scene_loads.OverTime, keys: Keys) -> Profile:
    """Return the factor of a load over time [s] of the whole run."""
    if load.profile is None:
        return smooth_rise(load.ramp).delayed(loaded.names.beginning.of(keys))
    return over_the_run(loaded.names, load.profile, keys)


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


def nodal_force(
    loaded: LoadTargets,
    load: scene_loads.NodalForceSpec | scene_loads.DirectedNodalForce,
    keys: Keys,
) -> NodalForce:
    """Return a force on a node set."""
    names = loaded.names
    nodes = names.node_set(load.nodes, (*keys, "nodes"))
    if not loaded.is_free[nodes].any(axis=1).all():
        raise names.loaded.error(
            (*keys, "nodes"),
            f"a node of '{load.nodes}' is fixed or tied, so a force on it has no effect",
            "load free nodes, or apply the load to the rigid body",
        )
    share = loaded.mass[nodes] / loaded.mass[nodes].sum()
    force, factor = sized(loaded, load, "force", keys)
    return NodalForce(nodes, np.outer(share, force), factor)


def surface_traction(
    loaded: LoadTargets,
    load: scene_loads.SurfaceTraction | scene_loads.DirectedTraction,
    keys: Keys,
) -> NodalForce:
    """Return a force per area at rest on facets: on each corner int N_a t dA."""
    names = loaded.names
    facets = joined_facets(names, load.facets, keys)
    areas = np.zeros(facets.shape)
    for body, region, chosen in bounded(names, facets):
        of_body = facets[chosen] - body.first_node
        areas[chosen] = region.geometry.corner_areas(body.mesh.points, of_body)
    measure = nodal_sums(facets, areas, len(loaded.points))
    return distributed(measure, *sized(loaded, load, "traction", keys))


def body_force(
    loaded: LoadTargets, load: scene_loads.BodyForce | scene_loads.DirectedBodyForce, keys: Keys
) -> NodalForce:
    """Return a force per volume at rest on bodies, by their lumped volume."""
    names = loaded.names
    volumes = np.zeros(len(loaded.points))
    for k, name in enumerate(load.bodies):
        if name not in names.bodies:
            known = ", ".join(names.bodies)
            raise names.loaded.error(
                (*keys, "bodies", k), f"there is no body '{name}'", f"known: {known}"
            )
        body = next(b for b in loaded.bodies if b.name == name)
        for r in body.regions:
            shares = r.geometry.mass_shares(r.points, r.cells) * r.volumes[:, None]
            volumes[r.nodes] += nodal_sums(r.cells, shares, len(r.points))
    return distributed(volumes, *sized(loaded, load, "density", keys))


def distributed(measure: np.ndarray, per_measure: np.ndarray, factor: Profile) -> NodalForce:
    """Return a force per area or volume on the nodes with a nonzero measure.

    measure: (n,) [m^2, m^3], area or volume of each node.
    """
    nodes = np.flatnonzero(measure)
    return NodalForce(nodes, np.outer(measure[nodes], per_measure), factor)


def rigid_force(
    loaded: LoadTargets,
    load: scene_loads.RigidForceSpec | scene_loads.DirectedRigidForce,
    keys: Keys,
) -> RigidForce:
    """Return a force on a rigid body."""
    names = loaded.names
    body = names.rigid_number(load.acts_on, (*keys, "acts_on"))
    return RigidForce(body, *sized(loaded, load, "force", keys))


def axial_relief(loaded: LoadTargets, load: scene_loads.AxialReliefSpec, keys: Keys) -> AxialRelief:
    """Return the relief of a rigid body from a fraction of the total weight along its axis."""
    body = loaded.names.rigid_number(load.acts_on, (*keys, "acts_on"))
    return AxialRelief(body, load.share * loaded.total_mass)


def tendon(loaded: LoadTargets, load: scene_loads.TendonSpec, keys: Keys) -> Tendon:
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


def tether(loaded: LoadTargets, load: scene_loads.TetherSpec, keys: Keys) -> Tether:
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


def turning_stiffness(names: Names, load: scene_loads.TetherSpec, keys: Keys) -> np.ndarray:
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


def pulled_cable(loaded: LoadTargets, load: scene_loads.PulledCableSpec, keys: Keys) -> PulledCable:
    """Return a cable through eyelets."""
    names = loaded.names
    refuse_all_around(names, "a cable", keys)
    places = np.array(
        [names.vector(place, (*keys, "eyelets", k)) for k, place in enumerate(load.eyelets)]
    )
    corners, weights = in_bodies(names, places, load.tolerance, (*keys, "eyelets"))
    anchors = np.zeros_like(places)
    if load.pulled_from is not None:
        anchor = names.vector(load.pulled_from, (*keys, "pulled_from"))
        corners, weights = (np.pad(rows, ((1, 0), (0, 0))) for rows in (corners, weights))
        anchors = np.concatenate([anchor[None], anchors])
    pull, tension = driven(loaded, load, keys)
    cable = PulledCable(
        name=str(keys[-1]), corners=corners, weights=weights, anchors=anchors, rest_length=0.0,
        stiffness=load.stiffness or 0.0, pull=pull, tension=tension,
    )  # fmt: skip
    held = cable.places(loaded.points)
    pieces = np.linalg.norm(np.diff(held, axis=0), axis=1)
    shortest = int(np.argmin(pieces))
    if pieces[shortest] <= SAME_PLACE * pieces.sum():
        at_anchor = load.pulled_from is not None and shortest == 0
        raise names.loaded.error(
            (*keys, "pulled_from" if at_anchor else "eyelets"),
            f"two successive points of '{keys[-1]}' are at the same place, {in_mm(held[shortest])}",
            "leave one of them out",
        )
    return replace(cable, rest_length=float(pieces.sum()))


def driven(
    loaded: LoadTargets, load: scene_loads.PulledCableSpec, keys: Keys
) -> tuple[Profile, Profile]:
    """Return the drawn-in length [m] of a cable and its tension [N] over time [s] of the whole run.

    The one that the scene does not give is zero.
    """
    names = loaded.names
    key, given = "profile", None
    for name, values in (
        ("pull_profile", load.pull_profile), ("tension_profile", load.tension_profile)
    ):  # fmt: skip
        if values is not None:
            key, given = name, over_the_run(names, values, keys)
    course = over_time(loaded, load, keys) if given is None else given
    if (course.values < 0.0).any():
        raise names.loaded.error(
            (*keys, key),
            f"falls to {course.values.min():.4g}: a cable can only pull",
            "use values of at least 0",
        )
    pull = 1.0 if key == "pull_profile" else load.pull or 0.0
    tension = 1.0 if key == "tension_profile" else load.tension or 0.0
    return course.times_factor(pull), course.times_factor(tension)


BUILDERS: dict[type, Callable[[LoadTargets, Any, Keys], Load]] = {
    scene_loads.FollowerPressureSpec: pressure,
    scene_loads.AddedVolumeSpec: pressure,
    scene_loads.AddedGasSpec: pressure,
    scene_loads.Pneumatic: pressure,
    scene_loads.EccentricMass: eccentric_motor,
    scene_loads.SinusoidalForce: sinusoid,
    scene_loads.NodalForceSpec: nodal_force,
    scene_loads.DirectedNodalForce: nodal_force,
    scene_loads.SurfaceTraction: surface_traction,
    scene_loads.DirectedTraction: surface_traction,
    scene_loads.BodyForce: body_force,
    scene_loads.DirectedBodyForce: body_force,
    scene_loads.RigidForceSpec: rigid_force,
    scene_loads.DirectedRigidForce: rigid_force,
    scene_loads.AxialReliefSpec: axial_relief,
    scene_loads.TendonSpec: tendon,
    scene_loads.TetherSpec: tether,
    scene_loads.PulledCableSpec: pulled_cable,
}
