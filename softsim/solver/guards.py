"""Guards that stop a failed run with place, time, likely cause and remedy; warnings of contact."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from softsim.contact.wall import Wall
from softsim.elements.geometry import Region, measure_elements
from softsim.errors import StabilityError
from softsim.loads.nodal import Rotor
from softsim.loads.pressure import PressureSource
from softsim.mesh.surface import side_lengths
from softsim.model import Body, Model, Relaxation, SelfContactData
from softsim.solver.stable_step import StableStep

# Beyond these volume ratios the element's J^(-1/3) loses accuracy and the solid its meaning.
SMALLEST_J = 0.3
LARGEST_J = 2.0
# Hourglass modes may hold this share of the internal energy, ABAQUS's rule for its ALLAE.
HOURGLASS_SHARE = 0.05
HOURGLASS = "hourglass_energy"  # its column in the history
# A sensor that is off by more than this share of the highest pressure wanted does not follow.
SENSOR_SHARE = 0.1
# What mass scaling may add to a body's inertia against turning: the plane robot with the groups of
# validation/convergence.py and a factor of 4 has a third of it, and walks 6 % slower.
TURNING_SHARE = 0.01


def refuse_broken_elements(model: Model, x: np.ndarray, time: float) -> None:
    """Raise StabilityError if a position is not a number or an element has J < 0.3 or J > 2.

    x: (n, d) [m]. The error names the element, its place and the time, or the cable.
    """
    first = 0  # element of a body, among those of all
    for body in model.bodies:
        with np.errstate(invalid="ignore", over="ignore"):
            J = np.linalg.det(body.joined(r.deformation(x[r.nodes]) for r in body.regions))
        broken = np.flatnonzero(~np.isfinite(J))
        if len(broken):
            raise StabilityError(
                f"{_where(body, broken[0], time)} has a position that is not a number (NaN)",
                f"either the deformation grew without limit ({thinning_advice(model)}), or the "
                "time step was too large: lower solver.safety_factor or "
                "contact.penalty_stiffness",
                first + int(broken[0]),
            )
        crushed, blown = int(np.argmin(J)), int(np.argmax(J))
        if J[crushed] < SMALLEST_J:
            kind = "is turned over" if J[crushed] <= 0.0 else "is crushed"
            raise StabilityError(
                f"{_where(body, crushed, time)} {kind}: volume ratio J = {J[crushed]:.3g}",
                "the load rises too fast, the contact is too stiff, or the mesh is too coarse "
                "for the bending: slow the load, refine the mesh, or lower the pressure",
                first + crushed,
            )
        if J[blown] > LARGEST_J:
            raise StabilityError(
                f"{_where(body, blown, time)} is overstretched: volume ratio J = {J[blown]:.3g}",
                f"{thinning_advice(model)}; or check material.bulk_modulus",
                first + blown,
            )
        first += len(body.cells)
    for structure in model.structures:
        if not np.isfinite(x[structure.own_nodes]).all():
            raise StabilityError(
                f"{structure.title} has a position that is not a number (NaN) at t = {time:.6g} s",
                "either the body it is tied to became unstable, or the time step was too large: "
                "lower solver.safety_factor or contact.penalty_stiffness",
            )


def thinning_advice(model: Model) -> str:
    """Return the advice on elements that become too thin, by the pressure sources of the model."""
    advice = dict.fromkeys(load.source.thinning_advice for load in model.pressures)
    return "; ".join(advice) or "the load deforms elements too much: lower it"


def refuse_collapsed_chamber(
    name: str, source: PressureSource, volume: float, pressure: float, time: float
) -> None:
    """Raise StabilityError if a chamber is turned inside out or its pressure is below vacuum.

    Only a chamber that enclosed a volume at the start can be turned inside out. volume [m^3]: the
    enclosed volume at `time` [s]. pressure [Pa]: above the ambient one.
    """
    shown = f"{1e-3 * pressure:.4g} kPa"
    if volume <= 0.0 < source.initial_volume:
        raise StabilityError(
            f"chamber '{name}' is turned inside out at t = {time:.6g} s: it encloses "
            f"{1e6 * volume:.4g} ml, at a pressure of {shown}",
            f"remove less than the {1e6 * source.initial_volume:.4g} ml that it holds at the "
            "start; to let its walls touch before that, name its body in contact.self_contact",
        )
    if pressure < -source.ambient_pressure:
        raise StabilityError(
            f"the pressure in chamber '{name}' is below vacuum at t = {time:.6g} s: {shown}, and "
            f"vacuum is {-1e-3 * source.ambient_pressure:.4g} kPa; it encloses "
            f"{1e6 * volume:.4g} ml",
            "remove less from it, or remove it more slowly",
        )


def refuse_crowding(time: float) -> NoReturn:
    """Raise StabilityError because a neighbour list of self-contact is too short."""
    raise StabilityError(
        f"too many facets of contact.self_contact came close to one node before t = {time:.6g} s: "
        "the contact search could not store all of them",
        "the surface is crumpled, or its facets differ too much in length: lower the load, use a "
        "more uniform mesh, or leave the crumpled part out of contact.self_contact",
    )


def strain_warnings(model: Model, x: np.ndarray, time: float) -> dict[str, str]:
    """Return warnings, by region and kind, of strains beyond the valid range of a material law.

    A law is used beyond the strain that it was fitted on, or past the loss of its shear stiffness
    (`Law.shear_stiffness`).
    """
    warnings = {}
    for body in model.bodies:
        for region in body.regions:
            material, part = region.material, _part_name(region)
            measured = measure_elements(region, x[region.nodes])
            stiffness, fitted = measured.shear_stiffness, material.strain_range
            weakest, longest = int(np.argmin(stiffness)), int(np.argmax(measured.stretch))
            if stiffness[weakest] <= 0.0:
                warnings[f"{part} unstable"] = (
                    f"{_where(body, region.numbers[weakest], time)} is where material "
                    f"'{material.name}' has lost its stiffness: I1 = "
                    f"{measured.I1_bar[weakest]:.3g}; fit the law over a wider strain range, "
                    "or with fewer terms"
                )
            if fitted is not None and measured.stretch[longest] > 1.0 + fitted:
                warnings[f"{part} range"] = (
                    f"{_where(body, region.numbers[longest], time)} is stretched to "
                    f"{measured.stretch[longest]:.3g}; material '{material.name}' was fitted up "
                    f"to {1.0 + fitted:.3g}"
                )
    return warnings


def hourglass_warnings(history: Mapping[str, np.ndarray]) -> dict[str, str]:
    """Return a warning if hourglass energy at its maximum is a large part of the internal one."""
    if HOURGLASS not in history or not len(history[HOURGLASS]):
        return {}
    counted = np.isfinite(history[HOURGLASS]) & np.isfinite(history["internal_energy"])
    most = int(np.argmax(np.where(counted, history[HOURGLASS], -np.inf)))
    held, internal = history[HOURGLASS][most], history["internal_energy"][most]
    if not held > HOURGLASS_SHARE * internal:
        return {}
    return {
        "hourglass": f"at {history['time'][most]:.4g} s hourglass modes hold "
        f"{100.0 * held / internal:.2g} % of the internal energy, more than "
        f"{100.0 * HOURGLASS_SHARE:g} %: single elements bend or twist; compare with a mesh "
        "of twice as many elements across the bent part"
    }


def air_line_warnings(history: Mapping[str, np.ndarray]) -> dict[str, str]:
    """Return a warning if the sensor is far from the target pressure while pump or valve works."""
    if "air_supply" not in history or not len(history["air_supply"]):
        return {}
    ahead = history["air_supply"] * (history["wanted_pressure"] - history["pressure"])
    most = int(np.argmax(ahead))
    largest = max(float(history["wanted_pressure"].max()), 0.0)
    if not ahead[most] > SENSOR_SHARE * largest:
        return {}
    at_work = "the pump ran" if history["air_supply"][most] > 0.0 else "the valve was open"
    return {
        "air line": f"at {history['time'][most]:.4g} s {at_work}, and the sensor showed "
        f"{1e-3 * history['pressure'][most]:.4g} kPa instead of the prescribed "
        f"{1e-3 * history['wanted_pressure'][most]:.4g} kPa: the air line cannot follow the "
        "profile"
    }


def turning_warnings(added_turning: float) -> dict[str, str]:
    """Return a warning if mass scaling adds too large a fraction [-] to the moment of inertia."""
    if added_turning <= TURNING_SHARE:
        return {}
    return {
        "mass scaling": "mass scaling increases the moment of inertia of a body by "
        f"{100.0 * added_turning:.3g} %, more than {100.0 * TURNING_SHARE:g} %: its groups of "
        "nodes are not small compared with the body; reduce mass_scaling.within or factor, "
        "and compare with a run without mass scaling"
    }


def refuse_collapsed_step(
    model: Model, stable: StableStep, at_rest: StableStep, time: float
) -> None:
    """Raise StabilityError if the stable step is less than model.least_step of that at rest.

    The rest of the run would take too long. time [s]: the current time.
    """
    share = stable.value / at_rest.value
    if share < model.least_step:
        raise StabilityError(
            f"the stable step has fallen to {100.0 * share:.2g} % of its value at rest at t = "
            f"{time:.6g} s: {stable.describe()}",
            f"{thinning_advice(model)}; to allow such short steps, lower solver.least_step",
        )


def refuse_unstable_step(model: Model, stable: StableStep, time: float) -> None:
    """Raise StabilityError if the time step given by the user exceeds the stable one."""
    if model.time_increment is not None and model.time_increment > stable.stable:
        raise StabilityError(
            f"the time step {model.time_increment * 1e6:.3g} us is no longer stable at "
            f"t = {time:.6g} s: {stable.describe()}",
            'set time.increment to "auto", or to a smaller value',
        )


def step_warnings(model: Model, stable: StableStep) -> dict[str, str]:
    """Return a warning of a step given by the user that is longer than the recommended one."""
    if model.time_increment is None or model.time_increment <= stable.value:
        return {}
    step = f"the time step {model.time_increment * 1e6:.3g} us"
    return {"time step": f"{step} is longer than recommended: {stable.describe()}"}


def refuse_no_equilibrium(model: Model, share: float, relaxation: Relaxation) -> NoReturn:
    """Raise StabilityError because a static run found no equilibrium in the allowed time.

    share: unbalanced force over internal forces [-].
    """
    raise StabilityError(
        f"no equilibrium was found within {relaxation.longest:g} s after the end of the loads: "
        f"the unbalanced force is {share:.3g} of the internal forces, required is "
        f"{relaxation.tolerance:g}",
        "the body may be free to move away, balloon or slide: hold it, lower the load, or "
        f"increase time.settle; {thinning_advice(model)}",
    )


def refuse_unsettled(share: float, settling: Relaxation) -> NoReturn:
    """Raise StabilityError because the bodies did not come to rest before t = 0.

    share: unbalanced force over internal forces [-].
    """
    raise StabilityError(
        f"the bodies did not come to rest within the {settling.longest:g} s of time.settle: the "
        f"unbalanced force is {share:.3g} of the internal forces, required is "
        f"{settling.tolerance:g}",
        "the body may slide, roll or fall under its weight: start it closer to its support, "
        "increase time.settle, or leave time.settle out",
    )


def refuse_energy_error(model: Model, error: float, time: float, largest: str) -> NoReturn:
    """Raise StabilityError because the error of the energy balance exceeds its limit.

    error [-]: of the balance; largest: name of the largest energy.
    """
    raise StabilityError(
        f"the energy balance is off by {100.0 * error:.3g} % at t = {time:.6g} s, above the limit "
        f"of {100.0 * model.energy_error_limit:.3g} %; largest contribution: {largest}",
        "an energy gain means that the time step is above the stable one or that a contact is "
        "too stiff: lower solver.safety_factor or contact.penalty_stiffness",
    )


def _part_name(region: Region) -> str:
    """Return the name of a body, or of a region of it."""
    return region.body if region.cell_set is None else f"{region.body}.{region.cell_set}"


def _where(body: Body, element: int, time: float) -> str:
    place = ", ".join(f"{c * 1e3:.2f}" for c in body.points[body.cells[element]].mean(axis=0))
    sets = [
        name
        for name, nodes in body.node_sets.items()
        if name not in ("surface", "all")
        and np.isin(body.cells[element] + body.first_node, nodes).any()
    ]
    among = f" (sets: {', '.join(sets)})" if sets else ""
    return (
        f"element {element} of body '{body.name}'{among}, at rest at ({place}) mm, "
        f"at t = {time:.6g} s,"
    )


# -------------------------------------------------------------------------------------------------
# Contact chatter: nodes that lose and regain contact many times per oscillation of the body.
#
# Chatter belongs to the mesh, not to the body: each node bounces on its own penalty spring or with
# the fastest waves of its elements. Friction then acts for part of the time only, and the distance
# that a body slides depends on the mesh. A node that regains contact within RETURN_SHARE of the
# body's oscillation period has chattered; the measure is the number of such returns per oscillation
# period in contact.

RETURN_SHARE = 0.1
# More returns in an oscillation than this are no bouncing of the body as a whole.
MOST_RETURNS = 1.0
# A node with less contact in the whole run, in oscillations, is not named.
LEAST_CONTACT = 1.0


@dataclass(frozen=True)
class Chatter:
    """Chatter of all nodes on walls.

    returns: mean number of returns per oscillation period in contact [-], over all nodes. worst,
    worst_returns: the node that chatters most, and its returns per period; worst is None if there
    was hardly any contact.
    """

    returns: float
    worst: int | None
    worst_returns: float


def oscillation_period(model: Model) -> float:
    """Return the period [s] of the slow motion of a model.

    That of the first motor; without a motor, the shortest period 4 h / sqrt(mu0 / rho) of the first
    shear mode over all regions, with the smallest extent h of each.
    """
    for load in model.of_kind(Rotor):
        return 1.0 / load.rotor.frequency
    return min(
        4.0 * float(np.ptp(r.points, axis=0).min())
        * np.sqrt(r.material.density / r.material.law.initial_shear_modulus)
        for r in model.regions
    )  # fmt: skip


def return_time(model: Model) -> float:
    """Return the time [s] within which a node that regains contact has chattered."""
    return RETURN_SHARE * oscillation_period(model)


def chatter(model: Model, returns: np.ndarray, contact_time: np.ndarray) -> Chatter:
    """Return the chatter of the nodes that may touch walls.

    returns (k,): number of returns of each node; contact_time (k,): its time in contact [s].
    """
    oscillations = contact_time / oscillation_period(model)
    long = np.flatnonzero(oscillations > LEAST_CONTACT)
    if len(long) == 0:
        return Chatter(0.0, None, 0.0)
    each = returns[long] / oscillations[long]
    worst = int(np.argmax(each))
    mean = float(returns.sum() / oscillations.sum())
    return Chatter(mean, int(model.contact.nodes[long[worst]]), float(each[worst]))


def chatter_warnings(model: Model, found: Chatter) -> dict[str, str]:
    """Return a warning if contact with walls has chattered since t = 0, with place and remedy."""
    if found.worst is None or found.returns <= MOST_RETURNS:
        return {}
    place = ", ".join(f"{c * 1e3:.2f}" for c in model.points[found.worst])
    body = next(
        (f"'{b.name}'" for b in model.bodies if found.worst in range(len(model.points))[b.nodes]),
        "an outline",
    )
    return {
        "chatter": "contact chatters: nodes lose contact with the wall and return "
        f"{found.returns:.3g} times within one oscillation period of "
        f"{oscillation_period(model) * 1e3:.3g} ms, most often ({found.worst_returns:.3g} "
        f"times) the node of {body} at rest at ({place}) mm. Friction and sliding then depend "
        "on the mesh. Give the material its spectrum up to the kHz range "
        "(materials.NAME.spectrum), raise contact.damping_ratio, slow the response of the "
        "friction limit (contact.friction_memory, contact.friction_slip_length), or let the "
        "body settle first (time.settle)"
    }


# -------------------------------------------------------------------------------------------------
# Penetration of walls by nodes and of bodies by each other, which penalty contact allows.
#
# Depths are compared with the size of the elements and the thickness of walls. A node that is more
# than half through a wall is pushed out on the other side. If no increment moves it by more than a
# quarter of the wall's thickness, its depth has been between a quarter and a half before: a motion
# per increment and a largest depth that are both below a quarter therefore rule this out.


# Deeper than this share of its elements' size a node is held by a contact that is too soft.
DEEPEST = 0.1
# Share of a wall's thickness beyond which a node may come out on the other side.
THROUGH = 0.25


@dataclass(frozen=True)
class Penetration:
    """Largest penetration of walls so far.

    depths: (walls, k) [m], of each node of `model.contact` into each wall. relative: the largest
    ratio to the size of the elements at the node [-]; node: that node, None without contact.
    """

    depths: np.ndarray
    relative: float
    node: int | None


def penetration(model: Model, depths: np.ndarray) -> Penetration:
    """Return the penetration for depths (walls, k) [m] of the nodes that may touch."""
    if not depths.size:
        return Penetration(depths, 0.0, None)
    relative = depths.max(axis=0) / element_sizes(model)[model.contact.nodes]
    worst = int(np.argmax(relative))
    node = int(model.contact.nodes[worst]) if relative[worst] > 0.0 else None
    return Penetration(depths, float(relative[worst]), node)


@dataclass(frozen=True)
class BodyPenetration:
    """Largest penetration of bodies into each other, or of one into itself, so far.

    relative: over the size of the facets there [-]; depth [m]; place (d,) of that point at rest
    [m]. Zero without contact.
    """

    relative: float
    depth: float
    place: np.ndarray


def body_penetration(model: Model, data: SelfContactData, depths: np.ndarray) -> BodyPenetration:
    """Return the penetration for depths (k + f,) [m] of all contact points."""
    corners = model.points[data.facets]
    of_facets = side_lengths(model.points, data.facets).mean(axis=1)
    sizes = np.concatenate([element_sizes(model)[data.nodes], of_facets])
    # A finely meshed rigid surface makes no contact softer: deformable facets are the measure.
    rigid = np.concatenate([data.nodes, data.facets[:, 0]]) >= model.meshed_count
    sizes[rigid] = np.maximum(sizes[rigid], sizes[~rigid].mean())
    relative = depths / sizes
    worst = int(np.argmax(relative))
    places = np.concatenate([model.points[data.nodes], corners.mean(axis=1)])
    return BodyPenetration(float(relative[worst]), float(depths[worst]), places[worst])


def body_penetration_warnings(found: BodyPenetration | None) -> dict[str, str]:
    """Return a warning of bodies that penetrated each other deeply for the size of elements."""
    if found is None or found.relative <= DEEPEST:
        return {}
    place = ", ".join(f"{c * 1e3:.2f}" for c in found.place)
    return {
        "penetration of bodies": f"the surface at rest at ({place}) mm penetrated another surface "
        f"by {1e3 * found.depth:.3g} mm, {100.0 * found.relative:.3g} % of the size of its "
        f"elements, more than {100.0 * DEEPEST:g} %: the contact is too soft; lower "
        "contact.allowed_penetration, or leave out contact.penalty_stiffness"
    }


def element_sizes(model: Model) -> np.ndarray:
    """Return the mean side of the surface facets at each node (n,) [m].

    It is infinite for nodes that are on no surface, and the smallest diameter of all rigid outlines
    for their nodes.
    """
    sizes = np.full(len(model.points), np.inf)
    outlines = slice(model.first_outline_node, None)
    sizes[outlines] = min((2.0 * o.shape.radius for o in model.outlines), default=np.inf)
    surfaces = [body.facet_sets["surface"] for body in model.bodies]
    for facets in (*surfaces, *(body.facets for body in model.rigid_bodies)):
        sides = side_lengths(model.points, facets)
        corners = [facets, np.roll(facets, 1, axis=1)]
        sums, counts = (
            sum(np.bincount(c.ravel(), w.ravel(), len(sizes)) for c in corners)
            for w in (sides, sides > 0.0)
        )
        np.divide(sums, counts, out=sizes, where=counts > 0)
    return sizes


def penetration_warnings(model: Model, found: Penetration) -> dict[str, str]:
    """Return warnings of nodes that penetrated a wall deeply for their elements or the wall."""
    warnings = {}
    if found.node is not None and found.relative > DEEPEST:
        depth = found.depths[:, model.contact.nodes == found.node].max()
        place = ", ".join(f"{c * 1e3:.2f}" for c in model.points[found.node])
        warnings["penetration"] = (
            f"the node at rest at ({place}) mm penetrated a wall by {1e3 * depth:.3g} mm, "
            f"{100.0 * found.relative:.3g} % of the size of its elements, more than "
            f"{100.0 * DEEPEST:g} %: the contact is too soft; raise "
            "contact.penalty_stiffness, or leave it out"
        )
    for wall, depths in zip(model.walls, found.depths, strict=False):
        thickness, depth = wall.thickness(), float(depths.max())
        if depth > THROUGH * thickness:
            warnings[f"thickness of {wall.names[0]}"] = (
                f"a node penetrated the wall '{wall.names[0]}' by {1e3 * depth:.3g} mm, and the "
                f"wall is {1e3 * thickness:.3g} mm thick: the node may have passed through; "
                "make the wall thicker, raise contact.penalty_stiffness, or reduce the speed "
                "of impact"
            )
    return warnings


def thinnest_wall(walls: Sequence[Wall]) -> tuple[str, float]:
    """Return the name of the thinnest wall and its thickness [m]; infinite without thin walls."""
    return min(
        ((w.names[0], w.thickness()) for w in walls), key=lambda w: w[1], default=("", np.inf)
    )


def crossing_warnings(name: str, thickness: float, speed: float, dt: float) -> dict[str, str]:
    """Return a warning if the fastest node can pass through a thin wall in one increment.

    name, thickness [m]: of the wall. speed [m/s]: of the node. dt [s]: the time step.
    """
    if speed * dt <= THROUGH * thickness:
        return {}
    return {
        f"thickness of {name}": f"a node moves at {speed:.3g} m/s, which is "
        f"{1e3 * speed * dt:.3g} mm per increment, and the wall '{name}' is "
        f"{1e3 * thickness:.3g} mm thick: nodes may pass through it; make the wall thicker, "
        f"or set time.increment to at most {1e6 * THROUGH * thickness / speed:.3g} us"
    }
