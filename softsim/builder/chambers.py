"""Chambers: pressures on facets and their sources: a time history, a liquid, a gas, an air line."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from softsim.builder.closure import (
    joined_facets,
    lids,
    refuse_open_chamber,
    smallest_volume,
)
from softsim.builder.loaded import Loaded
from softsim.builder.names import Names
from softsim.builder.profiles import over_the_run
from softsim.builder.regions import common_geometry
from softsim.loads.air_line import AirLine, Tube
from softsim.loads.drive import (
    AddedGas,
    AddedVolume,
    ControlledPressure,
    GivenPressure,
    Scheduled,
)
from softsim.loads.pressure import Drive, FollowerPressure
from softsim.loads.pressure_control import EventCycles
from softsim.loads.profile import Profile
from softsim.scene import chambers as scene_chambers
from softsim.scene.profiles import EventCyclesProfile, PressureProfile
from softsim.scene.tree import Keys
from softsim.stability.time_step import chamber_compliance

# A liquid is stiff, but adds no more than this to omega^2 of the stiffest element at rest, so that
# it costs a twentieth of the time step at most.
LIQUID_SHARE = 0.1

Chamber = (
    scene_chambers.FollowerPressure
    | scene_chambers.AddedVolume
    | scene_chambers.AddedGas
    | scene_chambers.Pneumatic
)


def pressure(loaded: Loaded, load: Chamber, keys: Keys) -> FollowerPressure:
    """Return the follower pressure on the facets of a chamber."""
    names, points, is_free = loaded.names, loaded.points, loaded.is_free
    facets = joined_facets(names, load.facets, keys)
    geometry = common_geometry(names, facets, keys)
    body, remedy = None, "hold both ends (bodies.NAME.fixed)"
    held = ~is_free
    if load.reacts_on is not None:
        body = names.rigid_number(load.reacts_on, (*keys, "reacts_on"))
        held = np.zeros_like(is_free)
        remedy = f"tie both ends to '{load.reacts_on}' (rigid_bodies.{load.reacts_on}.tied)"
        held[loaded.tied[body]] = True
    asks_volume = not isinstance(load, scene_chambers.FollowerPressure)
    if asks_volume or body is not None:
        refuse_open_chamber(names, facets, points, held, remedy, keys)
    edges = lids(names, facets, points, held) if asks_volume else facets[:0]
    first_node = names.bodies[load.facets[0].partition(".")[0]].first_node
    first = min(names.bodies[one.partition(".")[0]].first_node for one in load.facets)
    area = float(geometry.corner_areas(points[first:], facets - first).sum())
    facets, closing = (geometry.pressed(f, first_node) for f in (facets, edges))
    volume = geometry.enclosed_volume(points, np.concatenate([facets, closing]))
    nothing = smallest_volume(geometry, facets, points)
    if abs(volume) <= nothing:
        volume = 0.0
    compliance = chamber_compliance(geometry, facets, points, loaded.mass, is_free)
    drive = built_drive(names, load, volume, nothing, loaded.stiffest, compliance, keys)
    return FollowerPressure(str(keys[-1]), facets, closing, geometry, drive, body, area)


def built_drive(
    names: Names,
    load: Chamber,
    volume: float,
    nothing: float,
    stiffest: float,
    compliance: float,
    keys: Keys,
) -> Drive:
    """Return the pressure source of a chamber of this volume [m^3] at rest.

    A volume up to `nothing` [m^3] counts as none. A liquid adds at most the fraction LIQUID_SHARE
    to `stiffest`, the largest omega^2 [1/s^2] at rest, in a chamber of this `compliance` [m^4/kg].
    """
    if isinstance(load, scene_chambers.FollowerPressure):
        return followed(names, load.profile, lambda given: pressure_on_facets(load, given), keys)
    # A gas may start in a flat chamber, if its line has room; a liquid needs a volume to refer to.
    least = nothing if isinstance(load, scene_chambers.AddedVolume) else -nothing
    if volume < least:
        raise names.loaded.error(
            (*keys, "facets"),
            f"the facets enclose {volume * 1e6:.4g} ml: they face away from the chamber, or are "
            "flat",
            "name the facets of the body that touch the liquid or gas",
        )
    if isinstance(load, scene_chambers.Pneumatic):
        return air_line(names, load, volume, nothing, keys)
    profile = over_the_run(names, load.profile, keys)
    if isinstance(load, scene_chambers.AddedGas):
        side = room_beside(names, load, volume, load.dead_volume, nothing, keys)
        specific_energy = load.gas_constant * load.temperature
        gas = AddedGas(profile, volume, side, specific_energy, load.ambient_pressure)
        refuse_emptied(names, gas, f"{gas.initial_mass * 1e6:.4g} mg of gas", keys)
        return gas
    if compliance == 0.0:
        raise names.loaded.error(
            (*keys, "facets"),
            "no node of the chamber can move, so the volume of the liquid cannot change",
            "name facets of a body that can deform",
        )
    liquid = AddedVolume(profile, volume, LIQUID_SHARE * stiffest * volume / compliance)
    refuse_emptied(names, liquid, f"{volume * 1e6:.4g} ml", keys)
    return liquid


def refuse_emptied(names: Names, drive: AddedVolume | AddedGas, held: str, keys: Keys) -> None:
    """Raise SceneError if more is to be taken out of a chamber than it holds at the start."""
    least = float(drive.profile.values.min())
    if least <= -drive.content:
        raise names.loaded.error(
            (*keys, "profile"),
            f"{-least / drive.content:.3g} times the content of the chamber would be removed; it "
            f"holds {held} at the start",
            "remove less than it holds; positive values add to it",
        )


def commanded(load: Chamber, drive: Scheduled | AirLine, profile: Profile) -> Scheduled | AirLine:
    """Return the pressure source of a chamber with another time history.

    profile: over time [s], the pressure of the gauge [Pa], the volume pumped in [m^3] or the mass
    let in [kg].
    """
    if isinstance(load, scene_chambers.FollowerPressure):
        return GivenPressure(profile, pressure_on_facets(load, profile))
    if isinstance(drive, AirLine):
        return replace(drive, course=GivenPressure(profile, profile))
    return replace(drive, profile=profile)


def followed(
    names: Names, profile: PressureProfile, on_facets: Callable[[Profile], Profile], keys: Keys
) -> GivenPressure | ControlledPressure:
    """Return the pressure source of a profile at the gauge, or of a control by events."""
    if isinstance(profile, EventCyclesProfile):
        settings = EventCycles(**profile.model_dump(exclude={"kind"}))
        start = names.beginning.of(keys)
        return ControlledPressure(replace(settings, start=start + settings.start))
    given = over_the_run(names, profile, keys)
    return GivenPressure(given, on_facets(given))


def room_beside(
    names: Names,
    load: scene_chambers.AddedGas | scene_chambers.Pneumatic,
    volume: float,
    dead: float,
    nothing: float,
    keys: Keys,
) -> float:
    """Return the gas volume [m^3] beside a chamber of `volume` [m^3].

    It is `dead` minus the excluded volume. Raises SceneError if the total volume is not larger than
    `nothing` [m^3].
    """
    side = dead - load.excluded_volume
    if volume + side <= nothing:
        raise names.loaded.error(
            keys,
            f"the chamber holds {volume * 1e6:.4g} ml, of which {load.excluded_volume * 1e6:.4g} "
            f"ml are excluded, and the dead volume is {dead * 1e6:.4g} ml: no volume is left "
            "for the gas",
            "give the dead volume of the line, or a smaller excluded_volume",
        )
    return side


def air_line(
    names: Names, load: scene_chambers.Pneumatic, volume: float, nothing: float, keys: Keys
) -> AirLine:
    """Return the pump, valve and tube of a chamber of this volume [m^3] at rest.

    A volume of gas up to `nothing` [m^3] counts as none.
    """
    if names.scene.time.procedure == "static":
        raise names.loaded.error(
            keys,
            f"the air flow through '{keys[-1]}' depends on time, which a static procedure does "
            "not have",
            "write time.procedure: dynamic, or load the chamber by follower_pressure or added_gas",
        )
    tube = Tube(load.tube.length, load.tube.bore, load.tube.viscosity)
    dead = load.dead_volume + 0.5 * tube.volume
    side = room_beside(names, load, load.volume_ratio * volume, dead, nothing, keys)
    course = followed(names, load.profile, lambda given: given, keys)
    highest = highest_of(course) + load.band
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
        course=course, initial_volume=volume, volume_ratio=load.volume_ratio,
        side_volume=side, line_volume=load.line_volume + 0.5 * tube.volume,
        specific_energy=energy, ambient_pressure=ambient, tube=tube,
        valve=density * load.valve.flow / squares, pump_flow=density * load.pump.flow,
        stall=load.pump.stall, band=load.band,
    )  # fmt: skip


def highest_of(course: GivenPressure | ControlledPressure) -> float:
    """Return the highest pressure [Pa] that a gauge should ever show."""
    if isinstance(course, ControlledPressure):
        return course.settings.highest
    return float(course.profile.values.max())


def pressure_on_facets(load: scene_chambers.FollowerPressure, profile: Profile) -> Profile:
    """Return the pressure on the facets [Pa over s] while a gauge shows `profile`."""
    if load.acts_as_given:
        return profile
    on_skin = profile.translated(np.array(load.on_skin)) if load.on_skin else profile
    return on_skin.reduced(load.factor, load.offset)
