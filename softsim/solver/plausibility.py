"""Warnings before a run about implausible inputs, mostly a unit that is wrong by a factor of 1000.

All these inputs are allowed. Bounds are wide on purpose: needless warnings would soon be ignored.
"""

from collections.abc import Iterator
from itertools import combinations, product

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from softsim.elements.geometry import Region
from softsim.elements.plane_elements import PlaneStrain
from softsim.loads.nodal import RisingGravity, Rotor
from softsim.loads.prescribed import PrescribedMotion, RigidMotion
from softsim.loads.pressure import ATMOSPHERE, FollowerPressure
from softsim.loads.profile import Profile
from softsim.materials.fitting import instability_stretch
from softsim.materials.material import Material
from softsim.mesh.mesh import SURFACE
from softsim.mesh.surface import at, closest_on_facets
from softsim.model import Body, Model
from softsim.scene.outputs import Output
from softsim.solver.guards import element_sizes
from softsim.solver.natural_modes import linked_groups, tied_pairs
from softsim.solver.stable_step import first_time_increment
from softsim.structures.fibre import holding_cells

# -------------------------------------------------------------------------------------------------
# Warnings of nearly incompressible bodies that long elements at a clamp make too stiff.
#
# An element with one point keeps its volume there. At a clamp the nodes of one face are held, so an
# element that is pulled off the clamp can narrow at its far face only, by twice as much as it
# should, and the next column would have to swell again, which its hourglass modes resist. The
# pressure of the first column is too large by half, and the body too stiff: a strip of 8 heights,
# clamped at one end, bends less by 6 % with 8 x 2 elements, 3 % with 16 x 4, 1 % with 32 x 4
# (Poisson's ratio 0.475, linear). With a column of length h and a body that reaches L from the
# clamp, h / (2 L) of its deflection is missing, whatever its height. With one element through the
# height there is no such error, as its point is not strained in bending, nor with a clamp that lets
# the body narrow.

LARGEST_ERROR = 0.03
"""Estimated missing fraction of the deflection above which a warning is given."""
SLENDER = 2.0
"""Least reach of a body from a clamp, over the clamp's height: shorter bodies hardly bend."""
LEAST_POISSON_RATIO = 0.4
"""Lowest Poisson's ratio at small strain for which a warning is given: with less the effect is
below 2 % where it is 3 % at 0.475."""


def clamp_warnings(model: Model) -> dict[str, str]:
    """Return warnings, kind -> text, of clamped elements that are too long."""
    held = ~np.any(model.is_free, axis=1)
    found: dict[str, str] = {}
    for region in model.regions:
        law, kappa = region.material.law, region.material.bulk_modulus
        mu = law.initial_shear_modulus
        poisson_ratio = (3.0 * kappa - 2.0 * mu) / (6.0 * kappa + 2.0 * mu)
        if not region.has_hourglass_modes or poisson_ratio < LEAST_POISSON_RATIO:
            continue
        missing = missing_deflection(region, held[region.nodes])
        if missing > LARGEST_ERROR:
            found[f"clamp of {region.body}"] = (
                f"body '{region.body}': at a clamp, the elements are long and there are several "
                "through the height. A nearly incompressible body then bends too little, "
                f"here by about {100.0 * missing:.0f} %. Use shorter elements at the clamp, "
                "or one element through the height"
            )
    return found


def missing_deflection(region: Region, held: np.ndarray) -> float:
    """Return the largest estimate h / (2 L) of the missing fraction of a body's deflection.

    Parameters
    ----------
    region : Region
        Quadrilaterals or hexahedra.
    held : np.ndarray
        True for nodes of the body that are held in every direction, (n,).

    Returns
    -------
    float
        Largest over the clamps that have two elements or more through their height; 0 without one.
        A clamp is a connected face of elements; its height is its smaller extent.
    """
    dimension = region.points.shape[1]
    clamped = region.cells[held[region.cells].sum(axis=1) == 2 ** (dimension - 1)]
    if len(clamped) == 0:
        return 0.0
    on_clamp = held[clamped]
    count = len(clamped)
    rows = np.repeat(np.arange(count), on_clamp.sum(axis=1))
    meets = coo_matrix((np.ones(len(rows)), (rows, clamped[on_clamp])), (count, len(held)))
    pieces, piece_of = connected_components(meets @ meets.T, directed=False)
    return max(_missing(region.points, clamped[piece_of == k], held) for k in range(pieces))


def _missing(points: np.ndarray, cells: np.ndarray, held: np.ndarray) -> float:
    """Return the estimate for one clamp; 0 with one element through its height."""
    on_clamp = held[cells]
    corners = points[cells]
    near = np.where(on_clamp[..., None], corners, 0.0).sum(axis=1) / on_clamp.sum(axis=1)[:, None]
    far = np.where(on_clamp[..., None], 0.0, corners).sum(axis=1)
    far /= (~on_clamp).sum(axis=1)[:, None]
    length = float(np.linalg.norm(far - near, axis=1).mean())
    face = points[np.unique(cells[on_clamp])]
    # Principal directions of the face, the largest first; the last one of all is across it.
    directions = np.linalg.svd(face - face.mean(axis=0), full_matrices=True)[2]
    upright = directions[points.shape[1] - 2]
    height = float(np.ptp(face @ upright))
    along = np.where(on_clamp, corners @ upright, np.nan)
    side = float(np.mean(np.nanmax(along, axis=1) - np.nanmin(along, axis=1)))
    reach = float(np.linalg.norm(points - face.mean(axis=0), axis=1).max())
    bends = height > 1.5 * side and reach > SLENDER * height
    return 0.5 * length / reach if bends else 0.0


# Of soft robots and what they are made of, with much room: from a gel to hard plastic.
SIZES = 0.2e-3, 5.0  # m
SHEAR_MODULI = 50.0, 2e9  # Pa
DENSITIES = 20.0, 2e4  # kg/m^3
# A pressure over the shear modulus of what it acts on: thin skins balloon far below 1.
LARGEST_PRESSURE_RATIO = 100.0
# Where nothing says how far a law was fitted, it is to stay a material within these stretches.
STRETCHES = 0.6, 2.0
# Central differences show a sine of so many increments a period with an error of 1 %.
LEAST_INCREMENTS = 20
# Two bodies may meet if the boxes around them are nearer than this share of the smaller one's size.
MEETING_DISTANCE = 0.5
# Share of the smaller body's size by which bodies that just touch may overlap through round-off.
TOUCHING = 1e-6
# Elements in a cohesive zone. With 2.9 to 4.6 the pull-off force of a ball is right within 3 %.
LEAST_RESOLUTION = 2.0
# Beyond these ratios to the model's own scale a quantity is probably off by a unit: the gap of a
# wall over the model's size; a force over the softest shear modulus times the size squared; what is
# pumped into a chamber, or its line holds, over what the chamber holds; the mass of a rigid body
# over that of the deformable ones; a time over the run's length.
FARTHEST_WALL = 1e3
LARGEST_FORCE = 1e2
LARGEST_FILLING, LARGEST_LINE = 1e3, 1e4
LARGEST_MASS = 1e5
LONGEST_TIME = 1e6
# Bodies that come to rest do so within this time [s], or this many times the run's length.
LONGEST_SETTLING = 60.0, 1e2
# Loads that carry no weight.
HOLDING_NOTHING = (FollowerPressure, Rotor, RisingGravity)
# A run of fewer increments shows nothing.
FEWEST_INCREMENTS = 10
# A run that nobody waits for [days], at so many element updates a second: of a fast processor.
MOST_DAYS, FAST = 30.0, 50e6


def plausibility_warnings(model: Model) -> dict[str, str]:
    """Return warnings, kind -> text, of implausible values in a model.

    Sizes, materials and pressures are compared with those of soft robots; walls, forces, fillings,
    masses and times with the model's own scale; contact, ties, fibres and air lines are checked.
    """
    return {
        **{f"size of {b.name}": text for b in model.bodies for text in size_warnings(b)},
        **{f"depth of {b.name}": text for b in model.bodies for text in depth_warnings(b)},
        **{
            f"{kind} of {material.name}": text
            for material in {id(r.material): r.material for r in model.regions}.values()
            for kind, text in material_warnings(material).items()
        },
        **pressure_warnings(model),
        **air_line_warnings(model),
        **pace_warnings(model),
        **length_warnings(model),
        **meeting_warnings(model),
        **surface_warnings(model),
        **adhesion_warnings(model),
        **clamp_warnings(model),
        **wall_warnings(model),
        **support_warnings(model),
        **force_warnings(model),
        **filling_warnings(model),
        **mass_warnings(model),
        **time_warnings(model),
        **{k: t for s in model.all_structures for k, t in s.warnings(model.points).items()},
    }


def size_warnings(body: Body) -> Iterator[str]:
    """Return a warning of a body that is very small or very large."""
    extent = np.ptp(body.points, axis=0)
    if not SIZES[0] <= extent.max() <= SIZES[1]:
        sides = " x ".join(f"{1e3 * side:.4g}" for side in extent)
        yield (
            f"body '{body.name}' measures {sides} mm; if that is wrong by a factor of 1000, "
            "change the length_unit of its file, or the unit of its dimensions"
        )


def depth_warnings(body: Body) -> Iterator[str]:
    """Return warnings of plane sections that are very thin or thick."""
    depths = {r.geometry.thickness for r in body.regions if isinstance(r.geometry, PlaneStrain)}
    for depth in sorted(depths):
        if not SIZES[0] <= depth <= SIZES[1]:
            yield (
                f"the section of body '{body.name}' is {1e3 * depth:.4g} mm thick; if that is "
                "wrong by a factor of 1000, change the unit of its thickness"
            )


def material_warnings(material: Material) -> dict[str, str]:
    """Return warnings of a material with an unusual stiffness or density, or an unstable law.

    Unusual: softer than a gel or harder than plastic, too light or too heavy. Unstable: the law
    loses its stiffness within the strains that it is used for.
    """
    found = {}
    modulus = material.law.initial_shear_modulus
    if not SHEAR_MODULI[0] <= modulus <= SHEAR_MODULI[1]:
        found["stiffness"] = (
            f"material '{material.name}' has a shear modulus of {modulus:.3g} Pa; the usual range "
            f"is {SHEAR_MODULI[0]:g} Pa (gels) to {SHEAR_MODULI[1]:.0g} Pa (hard plastics): "
            "check the units of its constants"
        )
    if not DENSITIES[0] <= material.density <= DENSITIES[1]:
        found["density"] = (
            f"material '{material.name}' has a density of {material.density:.3g} kg/m^3; silicone "
            "has about 1080 kg/m^3 (1.08 g/cm^3): check its unit"
        )
    fitted = material.strain_range
    longest = STRETCHES[1] if fitted is None else 1.0 + fitted
    unstable = {
        mode: stretch
        for mode, stretch in instability_stretch(material.law, longest, STRETCHES[0]).items()
        if stretch is not None
    }
    if unstable:
        told = ", ".join(f"{mode} at a stretch of {s:.3g}" for mode, s in unstable.items())
        found["stability"] = (
            f"the stress of material '{material.name}' stops rising (Drucker) in {told}: fit its "
            "law over a wider strain range, or with fewer terms"
        )
    return found


def pressure_warnings(model: Model) -> dict[str, str]:
    """Return warnings of pressures far above the softest shear modulus, or below vacuum."""
    softest = min(r.material.law.initial_shear_modulus for r in model.regions)
    found = {}
    for load in model.pressures:
        values = load.source.pressure_values
        if values is None:
            continue  # the pressure due to a pump or a control depends on the body
        lowest, highest = float(values.min()), float(np.abs(values).max())
        if highest > LARGEST_PRESSURE_RATIO * softest:
            found[f"pressure of {load.name}"] = (
                f"load '{load.name}' reaches {1e-3 * highest:.4g} kPa, {highest / softest:.3g} "
                f"times the shear modulus of the softest material ({1e-3 * softest:.3g} kPa): "
                "check the units of both"
            )
        elif lowest < -ATMOSPHERE:
            found[f"pressure of {load.name}"] = (
                f"load '{load.name}' falls to {1e-3 * lowest:.4g} kPa, below vacuum "
                f"({-1e-3 * ATMOSPHERE:.4g} kPa): check its unit"
            )
    return found


def air_line_warnings(model: Model) -> dict[str, str]:
    """Return warnings of air lines with turbulent flow, or too little flow for pump or profile."""
    return {
        f"{kind} of {load.name}": f"load '{load.name}': {text}"
        for load in model.pressures
        for kind, text in load.source.warnings().items()
    }


def pace_warnings(model: Model) -> dict[str, str]:
    """Return warnings of motors and motions that are too fast for the time step."""
    dt = first_time_increment(model)
    shortest = LEAST_INCREMENTS * dt
    found = {}
    for number, load in enumerate(model.of_kind(Rotor)):
        frequency = load.rotor.frequency
        if frequency * shortest > 1.0:
            found[f"motor {number}"] = (
                f"a motor turns at {frequency:.4g} Hz, which is {1.0 / (frequency * dt):.3g} "
                f"increments per turn; at least {LEAST_INCREMENTS} are needed to resolve it: "
                f"set time.increment to at most {1e6 / (LEAST_INCREMENTS * frequency):.3g} us"
            )
    motions = [m.profile for m in model.of_kind(PrescribedMotion)]
    motions += [m.profile for m in model.of_kind(RigidMotion)]
    for number, profile in enumerate(motions):
        fastest = shortest_swing(profile)
        if 2.0 * fastest < shortest:
            found[f"motion {number}"] = (
                f"a prescribed motion reverses within {1e6 * fastest:.3g} us, which is "
                f"{fastest / dt:.3g} increments; at least {LEAST_INCREMENTS // 2} are needed "
                "to resolve it"
            )
    return found


def shortest_swing(profile: Profile) -> float:
    """Return the shortest time [s] between two reversals of a profile; infinite without two."""
    moving = np.flatnonzero(np.diff(profile.values) != 0.0)
    rising = np.diff(profile.values)[moving] > 0.0
    turns = profile.times[moving[1:][np.diff(rising.astype(int)) != 0]]
    return float(np.diff(turns).min()) if len(turns) > 1 else np.inf


def length_warnings(model: Model) -> dict[str, str]:
    """Return a warning of a run with an impractical computing time."""
    dt = first_time_increment(model)
    increments = (model.end_time - model.start_time) / dt
    days = increments * model.element_count / FAST / 86400.0
    if days <= MOST_DAYS:
        return {}
    return {
        "length": f"the run needs {increments:.3g} increments of {1e6 * dt:.3g} us, about "
        f"{days:.2g} days at {FAST / 1e6:g} million element updates per second: shorten "
        "time.end, coarsen the mesh where elements are smallest, or apply the loads faster"
    }


def wall_warnings(model: Model) -> dict[str, str]:
    """Return warnings of walls that are too far from all bodies for contact."""
    size = float(np.ptp(model.points, axis=0).max())
    touching = model.points[model.contact.nodes]
    return {
        f"distance of {name}": f"wall '{name}' is {gap.min():.3g} m away from the bodies, "
        f"{gap.min() / size:.3g} times their size: check the units of its position and size"
        for wall in model.walls
        if len(touching)
        for name, gap in wall.gaps(touching).items()
        if gap.min() > FARTHEST_WALL * size
    }


def support_warnings(model: Model) -> dict[str, str]:
    """Return a warning of bodies that fall freely by more than their size.

    There is no wall, no held node or rigid body, and no load that may carry them.
    """
    gravity = float(np.linalg.norm(model.gravity))
    fall = 0.5 * gravity * (model.end_time - model.start_time) ** 2
    if model.walls or fall < np.ptp(model.points, axis=0).max():
        return {}
    down = np.flatnonzero(model.gravity)
    loose = np.asarray(model.is_free[:, down].all(axis=1))
    loose[model.ties.nodes] = loose[model.first_outline_node :] = True
    for body in model.rigid_bodies:
        loose[body.tied] = True
    guided = any(not body.free[axis] for body in model.rigid_bodies for axis in down)
    held = guided or not loose.all()
    if held or not all(isinstance(load, HOLDING_NOTHING) for load in model.loads):
        return {}
    return {
        "support": f"nothing holds the bodies: they fall by {fall:.3g} m until the end of the "
        "run; add environment.walls, hold nodes (bodies.NAME.fixed), or switch gravity off "
        "(environment.gravity: 0 m/s^2)"
    }


def force_warnings(model: Model) -> dict[str, str]:
    """Return warnings of forces that are too large for the size and stiffness of the model."""
    softest = min(r.material.law.initial_shear_modulus for r in model.regions)
    scale = softest * float(np.ptp(model.points, axis=0).max()) ** 2
    return {
        f"force of {name}": f"load '{name}' exerts {load.largest_force:.3g} N, "
        f"{load.largest_force / scale:.3g} times the softest shear modulus multiplied by the "
        "square of the model size: check its unit"
        for name, load in model.named_loads.items()
        if load.largest_force > LARGEST_FORCE * scale
    }


def filling_warnings(model: Model) -> dict[str, str]:
    """Return warnings of chambers whose added content or line is far larger than the chamber."""
    found = {}
    for load in model.pressures:
        source = load.source
        if source.filling_ratio > LARGEST_FILLING:
            found[f"filling of {load.name}"] = (
                f"load '{load.name}' adds {source.filling_ratio:.3g} times the initial "
                f"content of its chamber, {1e6 * source.initial_volume:.4g} ml: check its "
                "unit"
            )
        outside = source.gas_outside
        if outside > 0.0 and outside > LARGEST_LINE * source.initial_volume > 0.0:
            found[f"line of {load.name}"] = (
                f"load '{load.name}' has {1e6 * outside:.4g} ml of gas outside its chamber of "
                f"{1e6 * source.initial_volume:.4g} ml: check the unit of its dead volume "
                "or line"
            )
    return found


def mass_warnings(model: Model) -> dict[str, str]:
    """Return warnings of moving rigid bodies that are far heavier than all deformable ones."""
    soft = sum(body.mass for body in model.bodies)
    return {
        f"mass of {body.name}": f"rigid body '{body.name}' has a mass of {body.mass:.3g} kg, "
        f"{body.mass / soft:.3g} times the mass of the deformable bodies: check its unit"
        for body in model.rigid_bodies
        if any(body.free[:3]) and body.mass > LARGEST_MASS * soft
    }


def time_warnings(model: Model) -> dict[str, str]:
    """Return warnings of times that do not fit the run's length, and of a run of a few increments.

    A run in steps begins late: times of loads count from t = 0.
    """
    duration, dt = model.end_time - model.start_time, first_time_increment(model)
    found = {
        f"time of {name}": f"load '{name}' changes until {load.last_change:.3g} s, but the run "
        f"ends at {model.end_time:.3g} s: only a small part of the load history is simulated; "
        "check the units of its times and rates"
        for name, load in model.named_loads.items()
        if load.last_change > LONGEST_TIME * model.end_time
    }
    if duration < FEWEST_INCREMENTS * dt:
        found["end"] = (
            f"the run ends after {1e6 * duration:.3g} us, which is {duration / dt:.2g} "
            "increments: check the unit of time.end"
        )
    settling = model.settling
    longest = max(LONGEST_SETTLING[0], LONGEST_SETTLING[1] * duration)
    if settling is not None and settling.longest > longest:
        found["settle"] = (
            f"time.settle allows {settling.longest:.3g} s of settling before a run of "
            f"{duration:.3g} s: check its unit"
        )
    return found


def output_warnings(model: Model, output: Output) -> dict[str, str]:
    """Return warnings of intervals of the output that are far longer than the run."""
    duration = model.end_time - model.start_time
    return {
        key: f"output.{key} is {interval:.3g} s in a run of {duration:.3g} s, so only the start "
        "and the end are stored: check its unit"
        for key in ("history_interval", "frame_interval")
        if (interval := getattr(output, key)) > LONGEST_TIME * duration
    }


def meeting_warnings(model: Model) -> dict[str, str]:
    """Return warnings of bodies without contact with each other that overlap or are close."""
    group = linked_groups(tied_pairs(model), len(model.bodies))
    found = {}
    for (i, a), (j, b) in combinations(enumerate(model.bodies), 2):
        if group[i] == group[j] or are_in_contact(model, a.nodes, b.nodes):
            continue
        size = min(np.ptp(a.points, axis=0).max(), np.ptp(b.points, axis=0).max())
        if box_distance(a.points, b.points) > MEETING_DISTANCE * size:
            continue
        depth = overlap(a, b)
        overlaps = depth > TOUCHING * size
        found[f"contact of {a.name} and {b.name}"] = (
            f"bodies '{a.name}' and '{b.name}' have no contact with each other and "
            + (
                f"overlap at the start, by up to {1e3 * depth:.3g} mm: move one of them, and name "
                "both"
                if overlaps
                else "start so close that they may pass through each other: name both"
            )
            + " in contact.self_contact or contact.pairs, or join them by ties"
        )
    return found


def surface_warnings(model: Model) -> dict[str, str]:
    """Return warnings of rigid mesh surfaces that are close to a body without contact with it."""
    found = {}
    for rigid, body in product(model.rigid_bodies, model.bodies):
        nodes = np.unique(rigid.facets)
        tied = np.isin(rigid.tied, np.arange(body.nodes.start, body.nodes.stop)).any()
        if tied or not len(nodes) or are_in_contact(model, nodes, body.nodes):
            continue
        places = model.points[nodes]
        size = min(np.ptp(places, axis=0).max(), np.ptp(body.points, axis=0).max())
        if box_distance(places, body.points) <= MEETING_DISTANCE * size:
            found[f"contact of {rigid.name} and {body.name}"] = (
                f"rigid body '{rigid.name}' and body '{body.name}' have no contact with each "
                "other and start so close that they may pass through each other: name both "
                "in contact.self_contact or contact.pairs"
            )
    return found


def adhesion_warnings(model: Model) -> dict[str, str]:
    """Return a warning of cohesive zones that the mesh does not resolve."""
    sizes = element_sizes(model)[model.contact.nodes]
    found = {}
    surfaces = model.self_contact
    if surfaces is not None and surfaces.adhesion is not None:
        zone, size = surfaces.adhesion.zone, surfaces.adhesion.size
        if zone < LEAST_RESOLUTION * size:
            found["adhesion between bodies"] = unresolved_zone(zone, size)
    for wall, adhesion in zip(model.walls, model.adhesions, strict=True):
        if adhesion is None:
            continue
        resolution = adhesion.zone / sizes[:, None]
        node, surface = np.unravel_index(np.argmin(resolution), resolution.shape)
        if resolution[node, surface] < LEAST_RESOLUTION:
            found[f"adhesion to {wall.names[surface]}"] = unresolved_zone(
                adhesion.zone[node, surface], sizes[node]
            )
    return found


def unresolved_zone(zone: float, size: float) -> str:
    """Return the warning of a cohesive zone [m] in elements of this size [m]."""
    factor = np.sqrt(zone / size / LEAST_RESOLUTION)
    return (
        f"the cohesive zone at the rim of a contact is {1e3 * zone:.3g} mm long, and the "
        f"elements are {1e3 * size:.3g} mm: the pull-off force depends on the mesh; "
        f"multiply the pull_off_stress in contact.adhesion by {factor:.2g} or less, or use "
        f"elements of at most {1e3 * zone / LEAST_RESOLUTION:.3g} mm"
    )


def are_in_contact(model: Model, one: slice | np.ndarray, other: slice | np.ndarray) -> bool:
    """Return True if nodes of both sets are in surfaces that may touch each other."""
    data = model.self_contact
    if data is None:
        return False
    group = np.full(len(model.points), -1)
    group[data.nodes] = data.point_group[: len(data.nodes)]
    sides = (np.unique(group[nodes][group[nodes] >= 0]) for nodes in (one, other))
    return bool(data.may_touch[np.ix_(*sides)].any())


def box_distance(a: np.ndarray, b: np.ndarray) -> float:
    """Return the distance [m] between the bounding boxes of points a (n, d) and b (m, d) [m].

    It is 0 if the boxes overlap.
    """
    apart = np.maximum(a.min(axis=0) - b.max(axis=0), b.min(axis=0) - a.max(axis=0))
    return float(np.linalg.norm(np.maximum(apart, 0.0)))


def overlap(a: Body, b: Body) -> float:
    """Return the depth [m] of the node of either body that is deepest inside the other, or 0."""
    return max(depth_in(a, b), depth_in(b, a))


def depth_in(body: Body, other: Body) -> float:
    """Return the largest depth [m] of the nodes of a body inside the other, or 0."""
    low, high = other.points.min(axis=0), other.points.max(axis=0)
    places = body.points[((body.points >= low) & (body.points <= high)).all(axis=1)]
    if not len(places):
        return 0.0
    inside = places[holding_cells(places, other.points, other.cells)[0] >= 0]
    if not len(inside):
        return 0.0
    surface = other.facet_sets[SURFACE] - other.first_node
    facet, weights = closest_on_facets(inside, other.points, surface)
    closest = at(weights, other.points[surface[facet]])
    return float(np.linalg.norm(inside - closest, axis=1).max())
