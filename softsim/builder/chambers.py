"""Chambers: facets that close one, its pressure and its sources, controls by events."""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import Any

import numpy as np

from softsim.elements.geometry import Geometry
from softsim.loads.air_line import AirLine, SetPoint, Tube
from softsim.loads.load import LoadTargets, joined_facets
from softsim.loads.pressure import (
    AddedGas,
    AddedVolume,
    FollowerPressure,
    GaugeScale,
    PrescribedPressure,
    PressureSource,
)
from softsim.loads.pressure_control import ControlledPressure, EventCycles
from softsim.loads.profile import over_the_run
from softsim.mesh.mesh import open_rim, with_corners
from softsim.model import Model
from softsim.scene import loads as scene_loads
from softsim.scene.names import Names, in_mm
from softsim.scene.pneumatics import NetworkChamberSpec
from softsim.scene.profiles import EventCyclesProfile, PressureProfile
from softsim.scene.text import Keys
from softsim.solver.stable_step import chamber_compliance, element_frequencies

# -------------------------------------------------------------------------------------------------
# Closed chambers: a check that facets close one, and lids that complete their surface.


def refuse_open_chamber(
    names: Names,
    facets: np.ndarray,
    points: np.ndarray,
    held: np.ndarray,
    remedy: str,
    keys: Keys,
) -> None:
    """Raise SceneError unless the surface of the facets is closed.

    It is closed by itself, by a rim that does not move (all components of `held` (n, d)), or by
    planes of symmetry through the origin that its rim slides on. In a half section the axis closes
    it too, or a plane normal to the axis that its rim slides on; likewise in a ring section.

    remedy: how to hold a rim, for the error message.
    """
    rim = np.unique(open_rim(facets))
    closed = held[rim].all(axis=1)
    mirrored = on_mirror(points, held, rim)
    if names.is_axisymmetric:
        # On the axis, or in a plane across it: a flat lid encloses the same wherever its rim is.
        closed |= (points[rim, 0] < 1e-12) | held[rim, 1]
    if names.is_ring_section:
        closed |= held[rim, 0]
    loose = rim[~(closed | mirrored)]
    if len(loose):
        raise names.loaded.error(
            (*keys, "facets"),
            f"the chamber is open: its facets end at {in_mm(points[loose[0]])}, on a node that "
            "can move independently",
            f"{remedy}, or choose facets that extend from one held end to the other",
        )
    if mirrored.any() and not mirrored.all() and not reaches_axis(names):
        fixed = rim[~mirrored]
        raise names.loaded.error(
            (*keys, "facets"),
            "the rim of the chamber lies only partly on a plane of symmetry, for example not at "
            f"{in_mm(points[fixed[0]])}: its volume cannot be computed",
            "close the chamber with facets of the body, or model the whole body",
        )


def reaches_axis(names: Names) -> bool:
    """Return True if a facet encloses the space between itself and an axis."""
    return names.is_axisymmetric or names.is_ring_section


def on_mirror(points: np.ndarray, held: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Return True (k,) for nodes that slide on a plane of symmetry x_i = 0.

    Their component i is held, but not all components are.
    """
    at_zero = np.abs(points[nodes]) < 1e-9 * np.ptp(points, axis=0).max()
    return (held[nodes] & at_zero).any(axis=1) & ~held[nodes].all(axis=1)


def lids(names: Names, facets: np.ndarray, points: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Return facets (k, corners) over the held rims of a surface, so that it encloses a volume.

    There are none where they would add nothing to the volume as seen from the origin: in half and
    ring sections they run straight to the axis, and planes of symmetry go through the origin. The
    open chains of a section are joined, the end of each to a start, so that the sum of distances is
    smallest: two strips of a robot enclose the space between them.
    """
    rim = open_rim(facets)
    nodes = np.unique(rim)
    nothing = np.zeros((0, facets.shape[1]), dtype=int)
    if reaches_axis(names) or on_mirror(points, held, nodes).any():
        return nothing
    if len(nodes) == 0:
        return nothing
    if facets.shape[1] == 2:
        starts = np.setdiff1d(facets[:, 0], facets[:, 1])
        ends = np.setdiff1d(facets[:, 1], facets[:, 0])
        ways = np.linalg.norm(points[ends][:, None] - points[starts], axis=2)
        from scipy.optimize import linear_sum_assignment  # slow to import, and seldom needed

        first, second = linear_sum_assignment(ways)
        return np.column_stack([ends[first], starts[second]])
    fans = []
    following = dict(rim.tolist())
    while following:
        loop = chain(following, next(iter(following)))
        for node in loop[:-1]:
            del following[node]
        fans += [[loop[0], a, b] for a, b in pairwise(loop[1:-1])]
    return with_corners(np.array(fans).reshape(-1, 3), 2, facets.shape[1])


def smallest_volume(geometry: Geometry, facets: np.ndarray, points: np.ndarray) -> float:
    """Return the volume [m^3] that counts as none: 1e-9 of the facets' area times their extent."""
    size = np.ptp(points[np.unique(facets)], axis=0).max()
    area = np.linalg.norm(geometry.volume_gradient(points, facets), axis=2).sum()
    return float(1e-9 * area * size)


def chain(following: dict[int, int], start: int) -> list[int]:
    """Return the nodes from `start` along `following`, to its end or back to the start."""
    nodes = [start]
    while nodes[-1] in following:
        nodes.append(following[nodes[-1]])
        if nodes[-1] == start:
            break
    return nodes


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


class Targets(LoadTargets):
    """Bodies and nodes on which loads and chambers act."""

    @cached_property
    def stiffest(self) -> float:
        """Largest omega^2 [1/s^2] of an element at rest."""
        regions = itertools.chain.from_iterable(self.regions.values())
        return max(float(element_frequencies(region).max()) for region in regions)


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


def pressure(loaded: Targets, load: PressureSourceSpec, keys: Keys) -> FollowerPressure:
    """Return the follower pressure on the facets of a chamber."""
    return chamber_pressure(loaded, load, partial(SOURCES[type(load)], load), keys)


def chamber_pressure(
    loaded: Targets,
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


# -------------------------------------------------------------------------------------------------
# Checks that a robot has what a pressure controlled by events needs.

# Rows of the history by which a speed is told at least.
ROWS_OF_A_SPEED = 4


def refuse_what_cannot_be_felt(names: Names, model: Model) -> None:
    """Raise SceneError if a controlled pressure needs events that the history does not record."""
    for keys, settings in controls(model):
        refuse_a_second_chamber(names, model, keys)
        refuse_no_motion(names, model, keys)
        refuse_missing_rows(names, model, settings, keys)
        refuse_a_short_window(names, settings, keys)


def controls(model: Model) -> Iterator[tuple[Keys, EventCycles]]:
    """Yield the keys and the settings of the profile of each controlled pressure."""
    for load in model.pressures:
        if load.source.control is not None:
            yield ("loads", load.name, "profile"), load.source.control


def refuse_a_second_chamber(names: Names, model: Model, keys: Keys) -> None:
    """Raise SceneError if the pressure is not that of the robot's chamber.

    The history records no other pressure.
    """
    chamber = model.chamber
    if chamber is not None and keys[1] != chamber.name:
        raise names.loaded.error(
            keys,
            f"event_cycles can only drive the chamber of the robot, which is '{chamber.name}'",
            f"write robot: {{chamber: {keys[1]}}}",
        )


def refuse_no_motion(names: Names, model: Model, keys: Keys) -> None:
    """Raise SceneError if the model is static or has no frame whose motion could be measured."""
    if model.relaxation is not None:
        raise names.loaded.error(
            keys,
            "event_cycles respond to the motion of the robot, and a static procedure has none",
            "write time.procedure: dynamic, or a profile of kind cycles",
        )
    if not model.rigid_bodies:
        raise names.loaded.error(
            keys,
            "event_cycles need the motion of the robot's frame, and there is no frame",
            "add rigid_bodies, or write a profile of kind cycles",
        )


def refuse_missing_rows(names: Names, model: Model, settings: EventCycles, keys: Keys) -> None:
    """Raise SceneError if a criterion needs more rows of spikes than the robot has."""
    for key in ("contact_rows", "least_rows"):
        wanted = getattr(settings, key)
        if wanted > len(model.robot.rows):
            raise names.loaded.error(
                (*keys, key),
                f"{key} needs {wanted}, but robot.rows names {len(model.robot.rows)}",
                "name more node sets there, such as ['skin.j*[0-9]']; 0 switches the criterion off",
            )


def refuse_a_short_window(names: Names, settings: EventCycles, keys: Keys) -> None:
    """Raise SceneError if the motion window has too few rows of the history to compute a speed."""
    least = ROWS_OF_A_SPEED * names.scene.output.history_interval
    if settings.motion_window < least:
        raise names.loaded.error(
            (*keys, "motion_window"),
            f"within {settings.motion_window * 1e3:.4g} ms the history has too few rows to "
            f"compute a speed: at least {ROWS_OF_A_SPEED} are needed",
            f"set at least {least * 1e3:.4g} ms, or a shorter output.history_interval",
        )
