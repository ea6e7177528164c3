"""Loads: pressure in chambers, motors, forces, tendons, tethers, pulled cables."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from softsim.builder.chambers import joined_facets, lids, refuse_open_chamber, smallest_volume
from softsim.builder.conditions import over_the_run
from softsim.builder.rigid import freedom
from softsim.builder.structural import in_bodies, refuse_all_around
from softsim.elements.geometry import nodal_sums
from softsim.loads.air_line import AirLine, SetPoint, Tube
from softsim.loads.load import Load
from softsim.loads.nodal import AxialRelief, NodalForce, RigidForce
from softsim.loads.pressure import (
    AddedGas,
    AddedVolume,
    FollowerPressure,
    GaugeScale,
    PrescribedPressure,
    PressureSource,
)
from softsim.loads.pressure_control import ControlledPressure, EventCycles
from softsim.loads.profile import Profile, smooth_rise
from softsim.loads.rotor import CarriedRotor, Rotor, eccentric_mass, sinusoidal_force
from softsim.loads.tendon import Tendon
from softsim.loads.tether import EndDrag, Tether
from softsim.model import Body
from softsim.scene import loads as scene_loads
from softsim.scene.names import Names, in_mm
from softsim.scene.pneumatics import NetworkChamberSpec
from softsim.scene.profiles import EventCyclesProfile, PressureProfile
from softsim.scene.text import Keys
from softsim.solver.stable_step import chamber_compliance, element_frequencies
from softsim.structures.pulled_cable import PulledCable

# Way [m] on which a tether's drag builds up, where no stiffness is given: what some 0.25 m of soft
# tube stretch by (E A / L, 240 N/m) under a drag of 0.02 to 0.03 N, and far less than a gait.
ELASTIC_SLIP = 0.1e-3

# Of a cable's length: eyelets that are no farther from each other are at one place.
SAME_PLACE = 1e-6


@dataclass(frozen=True)
class LoadTargets:
    """Bodies and nodes on which loads act.

    points (n, d) [m], mass (n,) [kg] and is_free (n, d): of all nodes. tied: nodes tied to each
    rigid body. total_mass [kg]: of everything in the model.
    """

    names: Names
    bodies: tuple[Body, ...]
    points: np.ndarray
    mass: np.ndarray
    is_free: np.ndarray
    tied: list[np.ndarray]
    total_mass: float

    @cached_property
    def stiffest(self) -> float:
        """Largest omega^2 [1/s^2] of an element at rest."""
        regions = (region for body in self.bodies for region in body.regions)
        return max(float(element_frequencies(region).max()) for region in regions)


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
    for body, region, chosen in names.bounded(facets):
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


# -------------------------------------------------------------------------------------------------
# Pressure of chambers and its sources: a time history, a liquid, a gas, an air line.

# A liquid is stiff, but adds no more than this to omega^2 of the stiffest element at rest, so that
# it costs a twentieth of the time step at most.
LIQUID_SHARE = 0.1

PressureSourceSpec = (
    scene_loads.FollowerPressureSpec
    | scene_loads.AddedVolumeSpec
    | scene_loads.AddedGasSpec
    | scene_loads.Pneumatic
)


@dataclass(frozen=True)
class RestingChamber:
    """Chamber in the shape at rest.

    volume [m^3]: enclosed by its facets. nothing [m^3]: volume up to which it counts as flat.
    compliance [m^4/kg]: of its surface. stiffest [1/s^2]: largest omega^2 of the model.
    """

    names: Names
    keys: Keys
    volume: float
    nothing: float
    compliance: float
    stiffest: float

    def refuse_inverted(self, least: float) -> None:
        """Raise SceneError if the facets enclose a volume below `least` [m^3]."""
        if self.volume < least:
            raise self.names.loaded.error(
                (*self.keys, "facets"),
                f"the facets enclose {self.volume * 1e6:.4g} ml: they face away from the chamber, "
                "or are flat",
                "name the facets of the body that touch the liquid or gas",
            )

    def liquid_modulus(self) -> float:
        """Return the bulk modulus [Pa] of a liquid, as large as the time step allows.

        It adds at most the fraction LIQUID_SHARE to `stiffest`.
        """
        if self.compliance == 0.0:
            raise self.names.loaded.error(
                (*self.keys, "facets"),
                "no node of the chamber can move, so the volume of the liquid cannot change",
                "name facets of a body that can deform",
            )
        return LIQUID_SHARE * self.stiffest * self.volume / self.compliance

    def room_beside(self, filled: float, dead: float, excluded: float) -> float:
        """Return the gas volume [m^3] beside a chamber that is filled by `filled`: dead - excluded.

        Raises SceneError if the total volume is not larger than `nothing`.
        """
        side = dead - excluded
        if filled + side <= self.nothing:
            raise self.names.loaded.error(
                self.keys,
                f"the chamber holds {filled * 1e6:.4g} ml, of which {excluded * 1e6:.4g} ml are "
                f"excluded, and the dead volume is {dead * 1e6:.4g} ml: no volume is left for the "
                "gas",
                "give the dead volume of the line, or a smaller excluded_volume",
            )
        return side


def pressure(loaded: LoadTargets, load: PressureSourceSpec, keys: Keys) -> FollowerPressure:
    """Return the follower pressure on the facets of a chamber."""
    return chamber_pressure(loaded, load, partial(SOURCES[type(load)], load), keys)


def chamber_pressure(
    loaded: LoadTargets,
    load: PressureSourceSpec | NetworkChamberSpec,
    source: Callable[[RestingChamber], PressureSource],
    keys: Keys,
) -> FollowerPressure:
    """Return the follower pressure on the facets of a chamber; source: returns its source."""
    names, points, is_free = loaded.names, loaded.points, loaded.is_free
    facets = joined_facets(names, load.facets, keys)
    geometry = names.common_geometry(facets, keys)
    body, remedy = None, "hold both ends (bodies.NAME.fixed)"
    held = ~is_free
    if load.reacts_on is not None:
        body = names.rigid_number(load.reacts_on, (*keys, "reacts_on"))
        held = np.zeros_like(is_free)
        remedy = f"tie both ends to '{load.reacts_on}' (rigid_bodies.{load.reacts_on}.tied)"
        held[loaded.tied[body]] = True
    needs_volume = not isinstance(load, scene_loads.FollowerPressureSpec)
    if needs_volume or body is not None:
        refuse_open_chamber(names, facets, points, held, remedy, keys)
    edges = lids(names, facets, points, held) if needs_volume else facets[:0]
    first_node = names.bodies[load.facets[0].partition(".")[0]].first_node
    first = min(names.bodies[one.partition(".")[0]].first_node for one in load.facets)
    area = float(geometry.corner_areas(points[first:], facets - first).sum())
    facets, closing = (geometry.pressed(f, first_node) for f in (facets, edges))
    volume = geometry.enclosed_volume(points, np.concatenate([facets, closing]))
    nothing = smallest_volume(geometry, facets, points)
    if abs(volume) <= nothing:
        volume = 0.0
    compliance = chamber_compliance(geometry, facets, points, loaded.mass, is_free)
    fed = source(RestingChamber(names, keys, volume, nothing, compliance, loaded.stiffest))
    return FollowerPressure(str(keys[-1]), facets, closing, geometry, fed, body, area)


def follower_source(
    load: scene_loads.FollowerPressureSpec, chamber: RestingChamber
) -> PressureSource:
    """Return the pressure of a profile, or of a control by events."""
    scale = GaugeScale(load.on_skin, load.factor, load.offset)
    return set_point(chamber.names, load.profile, scale, chamber.keys)


def added_volume(load: scene_loads.AddedVolumeSpec, chamber: RestingChamber) -> AddedVolume:
    """Return the liquid of a chamber, which must have a volume at rest."""
    chamber.refuse_inverted(chamber.nothing)
    names, keys, volume = chamber.names, chamber.keys, chamber.volume
    profile = over_the_run(names, load.profile, keys)
    liquid = AddedVolume(profile, volume, chamber.liquid_modulus())
    refuse_emptied(names, liquid, f"{volume * 1e6:.4g} ml", keys)
    return liquid


def added_gas(load: scene_loads.AddedGasSpec, chamber: RestingChamber) -> AddedGas:
    """Return the gas of a chamber, which may be flat at rest if there is a dead volume."""
    chamber.refuse_inverted(-chamber.nothing)
    names, keys, volume = chamber.names, chamber.keys, chamber.volume
    profile = over_the_run(names, load.profile, keys)
    side = chamber.room_beside(volume, load.dead_volume, load.excluded_volume)
    gas = AddedGas(
        profile, volume, side, load.gas_constant * load.temperature, load.ambient_pressure
    )
    refuse_emptied(names, gas, f"{gas.initial_mass * 1e6:.4g} mg of gas", keys)
    return gas


def refuse_emptied(names: Names, filling: AddedVolume | AddedGas, held: str, keys: Keys) -> None:
    """Raise SceneError if more is to be taken out of a chamber than it holds at the start."""
    least = float(filling.profile.values.min())
    if least <= -filling.content:
        raise names.loaded.error(
            (*keys, "profile"),
            f"{-least / filling.content:.3g} times the content of the chamber would be removed; it "
            f"holds {held} at the start",
            "remove less than it holds; positive values add to it",
        )


def set_point(names: Names, profile: PressureProfile, scale: GaugeScale, keys: Keys) -> SetPoint:
    """Return the pressure source of a profile at the gauge, or of a control by events."""
    if isinstance(profile, EventCyclesProfile):
        settings = EventCycles(**profile.model_dump(exclude={"kind"}))
        start = names.beginning.of(keys)
        return ControlledPressure(replace(settings, start=start + settings.start))
    return PrescribedPressure.at_gauge(over_the_run(names, profile, keys), scale)


def air_line(load: scene_loads.Pneumatic, chamber: RestingChamber) -> AirLine:
    """Return the pump, valve and tube of a chamber, which may be flat at rest."""
    chamber.refuse_inverted(-chamber.nothing)
    names, keys = chamber.names, chamber.keys
    if names.scene.time.procedure == "static":
        raise names.loaded.error(
            keys,
            f"the air flow through '{keys[-1]}' depends on time, which a static procedure does "
            "not have",
            "write time.procedure: dynamic, or load the chamber by follower_pressure or added_gas",
        )
    tube = Tube(load.tube.length, load.tube.bore, load.tube.viscosity)
    dead = load.dead_volume + 0.5 * tube.volume
    filled = load.volume_ratio * chamber.volume
    side = chamber.room_beside(filled, dead, load.excluded_volume)
    shown = set_point(names, load.profile, GaugeScale(), keys)
    highest = shown.highest + load.band
    if load.pump.stall <= highest:
        raise names.loaded.error(
            (*keys, "pump", "stall"),
            f"the pump stalls at {load.pump.stall / 1e3:.4g} kPa, so it never reaches "
            f"{highest / 1e3:.4g} kPa, the highest pressure of the profile including the band",
            "use a stronger pump, or lower the profile",
        )
    energy = load.gas_constant * load.temperature
    ambient = load.ambient_pressure
    density = ambient / energy
    squares = (ambient + load.valve.pressure) ** 2 - ambient**2
    return AirLine(
        set_point=shown, initial_volume=chamber.volume, volume_ratio=load.volume_ratio,
        side_volume=side, line_volume=load.line_volume + 0.5 * tube.volume,
        specific_energy=energy, ambient_pressure=ambient, tube=tube,
        valve=density * load.valve.flow / squares, pump_flow=density * load.pump.flow,
        stall=load.pump.stall, band=load.band,
    )  # fmt: skip


SOURCES: dict[type, Callable[[Any, RestingChamber], PressureSource]] = {
    scene_loads.FollowerPressureSpec: follower_source,
    scene_loads.AddedVolumeSpec: added_volume,
    scene_loads.AddedGasSpec: added_gas,
    scene_loads.Pneumatic: air_line,
}

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
