"""Rigid bodies, the nodes tied to them, their outlines and surfaces."""

import numpy as np
from scipy.spatial.transform import Rotation

from softsim.contact.simple_walls import Cylinder, Sphere
from softsim.contact.surface_contact import ALLOWED_PENETRATION, PenaltyStiffness
from softsim.contact.terrain import checked_polyline
from softsim.errors import MeshError
from softsim.mesh.mesh import SURFACE, signed_volumes, simplex_facets
from softsim.mesh.reading import read_mesh
from softsim.mesh.surface import divided, in_order, read_surface, refuse_flat
from softsim.model import Body, OutlineData
from softsim.rigid import DIRECTIONS, RigidBodyData, freedom
from softsim.scene.bodies import BallOutline, RigidBody, RigidMotionSpec, RigidSurface
from softsim.scene.names import Names, PlacedSurface, in_mm
from softsim.scene.text import Keys
from softsim.scene.walls import PipeWall, PlaneWall
from softsim.units import format_quantity

# Points that stand for a round outline where it meets a wall.
POINTS_AROUND = 24
# Lengths into which the sides of a cylinder are divided where walls may bulge and so touch between
# its corners: in the plane, and in space. Of a bend's inner side, of radius r, they miss length^2 /
# 8 r: with a frame of 33 mm and r = 40 mm that is 3 um, and 24 um in space.
LENGTHS_ALONG = {2: 32, 3: 12}


def free_to_move(names: Names, name: str) -> tuple[bool, ...]:
    """Return True for the degrees of freedom of a rigid body that are free and not prescribed."""
    moved = {
        condition.direction
        for _, condition in names.conditions(RigidMotionSpec)
        if condition.body == name
    }
    free = zip(DIRECTIONS, freedom(names, name), strict=True)
    return tuple(yes and d not in moved for d, yes in free)


def tied_nodes(names: Names, is_free: np.ndarray) -> list[np.ndarray]:
    """Return the soft nodes tied to each rigid body.

    Raises SceneError if a node belongs to two bodies or is fixed.
    """
    taken = np.logical_not(is_free.all(axis=1))
    if names.is_axisymmetric:
        taken = np.logical_not(is_free[:, 1])  # nodes on the axis are held across it
    result = []
    for name, data in names.scene.rigid_bodies.items():
        nodes = np.zeros(0, dtype=int)
        for k, reference in enumerate(data.tied):
            keys = ("rigid_bodies", name, "tied", k)
            chosen = names.node_set(reference, keys)
            if taken[chosen].any():
                raise names.loaded.error(
                    keys,
                    f"a node of '{reference}' is already fixed or tied to another rigid body",
                    "a node can be tied to one body only",
                )
            nodes = np.union1d(nodes, chosen)
        taken[nodes] = True
        result.append(nodes)
    return result


def own_mass(names: Names, name: str, bodies: tuple[Body, ...], lumped: np.ndarray) -> float:
    """Return the mass [kg] of a rigid body without the deformable bodies tied to it.

    lumped (n,) [kg]: mass of all nodes, with layers, fibres and point masses. Raises SceneError if
    its total mass leaves nothing for itself, or if one of its deformable bodies is tied to another
    rigid body too.
    """
    data, keys = names.scene.rigid_bodies[name], ("rigid_bodies", name, "total_mass")
    if data.mass is not None:
        return data.mass
    assert data.total_mass is not None
    held = {other: tied_bodies(names, other) for other in names.scene.rigid_bodies}
    for body in held[name]:
        holders = [other for other, of_other in held.items() if body in of_other]
        if len(holders) > 1:
            raise names.loaded.error(
                keys,
                f"'{body}' is tied to {' and '.join(holders)}: its mass cannot be assigned to one "
                "of them",
                f"give rigid_bodies.{name}.mass, without the nodes tied to it",
            )
    carried = sum(float(lumped[b.nodes].sum()) for b in bodies if b.name in held[name])
    if data.total_mass <= carried:
        raise names.loaded.error(
            keys,
            f"total_mass is {format_quantity(data.total_mass, 'kg')}, but the deformable bodies "
            f"tied to '{name}' have {format_quantity(carried, 'kg')}",
            "give more than that, or give mass, which does not include them",
        )
    return data.total_mass - carried


def tied_bodies(names: Names, name: str) -> set[str]:
    """Return the names of the deformable bodies tied to a rigid body; cables do not count."""
    tied = names.scene.rigid_bodies[name].tied
    keys = ("rigid_bodies", name, "tied")
    return {
        names.body(reference, (*keys, k))[0]
        for k, reference in enumerate(tied)
        if reference.partition(".")[0] not in names.cables
    }


def rigid_body(names: Names, name: str, mass: float, tied: np.ndarray) -> RigidBodyData:
    """Return one rigid body of this mass [kg].

    tied: its soft nodes and its nodes without mass, the corners of its outline or surface.
    """
    data = names.scene.rigid_bodies[name]
    keys = ("rigid_bodies", name)
    free = free_to_move(names, name)
    surface, none = names.surfaces.get(name), np.zeros((0, names.dimension), dtype=int)
    velocity = names.vector(data.initial_velocity, (*keys, "initial_velocity"))
    started = dict(zip(DIRECTIONS, velocity, strict=False))
    started["rotation_z"] = data.initial_angular_velocity
    for direction, speed in started.items():
        if speed != 0.0 and not free[DIRECTIONS.index(direction)]:
            turning = direction.startswith("rotation")
            raise names.loaded.error(
                (*keys, "initial_angular_velocity" if turning else "initial_velocity"),
                f"'{name}' has an initial velocity in {direction}, which is not one of its free "
                "directions",
                f"add {direction} to rigid_bodies.{name}.free, or start it at rest",
            )
    return RigidBodyData(
        name=name,
        mass=mass,
        inertia=np.diag(np.broadcast_to(np.asarray(data.inertia, dtype=float), 3)),
        centre=names.vector(data.center, (*keys, "center")),
        tied=tied,
        velocity=velocity,
        angular_velocity=np.array([0.0, 0.0, data.initial_angular_velocity]),
        free=free,
        facets=surface.facets if surface else none,
        faces=surface.faces if surface else none,
    )


def placed_surfaces(names: Names) -> dict[str, PlacedSurface]:
    """Return the surfaces of all rigid bodies that have one, numbered after bodies and cables."""
    result: dict[str, PlacedSurface] = {}
    first_node = sum(len(body.mesh.points) for body in names.bodies.values())
    first_node += sum(len(cable.points) for cable in names.cables.values())
    for name, data in names.scene.rigid_bodies.items():
        if data.surface is not None:
            result[name] = placed_surface(names, name, data.surface, first_node)
            first_node += len(result[name].points)
    return result


def placed_surface(names: Names, name: str, data: RigidSurface, first_node: int) -> PlacedSurface:
    """Return the surface of the rigid body `name`.

    Its facets are as small as those of deformable bodies. Raises SceneError for a file that holds
    no closed surface of this kind of model, for one that is smaller than a facet of the deformable
    bodies or has too many facets, and for a body whose centre lies beside its surface.
    """
    keys = ("rigid_bodies", name, "surface")
    source = (*keys, "file" if data.points is None else "points")
    if name in names.bodies:
        raise names.loaded.error(
            keys,
            f"a deformable body is also called '{name}'",
            "contact needs unique names: rename one of them",
        )
    usual = names.median_side
    try:
        points, faces = read_rigid_surface(names, data, keys)
        size = np.ptp(points, axis=0).max()
        if size < usual:
            raise MeshError(
                f"the size of the surface is {size * 1e3:.3g} mm, less than that of a facet of "
                f"the deformable bodies, {usual * 1e3:.3g} mm",
                hint=f"check length_unit, which is {format_quantity(data.length_unit, 'm')} here",
            )
        longest = data.element_size if isinstance(data.element_size, float) else usual
        vertices, facets = divided(points, faces, longest)
        if names.is_axisymmetric:  # what lies on the axis has no area
            facets = facets[vertices[facets, 0].max(axis=1) > 1e-9 * size]
    except MeshError as error:
        raise names.loaded.error(source, error.message, error.hint) from None
    centre = names.vector(names.scene.rigid_bodies[name].center, ("rigid_bodies", name, "center"))
    low, high = points.min(axis=0), points.max(axis=0)
    if ((centre < low - 1e-9) | (centre > high + 1e-9)).any():
        raise names.loaded.error(
            ("rigid_bodies", name, "center"),
            f"the centre of mass, {in_mm(centre)}, is outside the surface of '{name}', which "
            f"extends from {in_mm(low)} to {in_mm(high)}",
            "give the centre in the coordinates of the placed surface, or move the surface "
            "(surface.position)",
        )
    return PlacedSurface(vertices, first_node, first_node + facets, first_node + faces)


def read_rigid_surface(
    names: Names, data: RigidSurface, keys: Keys
) -> tuple[np.ndarray, np.ndarray]:
    """Return the points (n, d) [m] of a placed surface, and its facets (m, d) with outward normals.

    Raises MeshError.
    """
    if data.points is not None:
        if names.dimension == 3:
            raise MeshError("points describe a surface in 2D only", hint="give an STL file")
        corners = [names.vector(p, (*keys, "points", k)) for k, p in enumerate(data.points)]
        points = checked_polyline(np.array(corners), closed=True).points
        faces = np.stack([np.arange(len(points)), np.roll(np.arange(len(points)), -1)], axis=1)
        if signed_volumes(points - points[0], np.insert(faces, 0, 0, axis=1)).sum() < 0.0:
            faces = faces[:, ::-1]
    else:
        path = names.loaded.resolve_file((*keys, "file"))
        if path.suffix.lower() == ".stl":
            surface = read_surface(path, data.length_unit)
            points, faces = surface.points, surface.triangles
        else:
            mesh = read_mesh(path, data.length_unit, reduce_order=True).mesh
            points, faces = mesh.points, simplex_facets(mesh.facet_sets[SURFACE])[0]
    if points.shape[1] != names.dimension:
        needed = {2: "a section, such as a polygon by its points", 3: "a 3D surface"}
        raise MeshError(
            f"{data.file} has {points.shape[1]} dimensions, the model has {names.dimension}",
            hint=f"give {needed[names.dimension]}",
        )
    used, faces = np.unique(faces, return_inverse=True)
    faces = faces.reshape(-1, names.dimension)
    turn = Rotation.from_euler("z", data.rotation).as_matrix()
    turn = turn[: names.dimension, : names.dimension]
    points = points[used] @ turn.T + names.vector(data.position, (*keys, "position"))
    if names.dimension == 3:
        refuse_flat(points, faces)
        return points, faces
    lowest = points[:, 0].min() / np.ptp(points, axis=0).max()
    if names.is_axisymmetric and lowest < -1e-9:
        raise MeshError(
            "a point of the surface is at a negative radius x", hint="give its half at x >= 0"
        )
    return points, in_order(faces)


def surface_points(names: Names) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices (k, d) of all surfaces, and the number of the rigid body of each (k,)."""
    points, owners = [np.zeros((0, names.dimension))], [np.zeros(0, dtype=int)]
    for r, name in enumerate(names.scene.rigid_bodies):
        if name in names.surfaces:
            points.append(names.surfaces[name].points)
            owners.append(np.full(len(points[-1]), r))
    return np.concatenate(points), np.concatenate(owners)


def outline_shape(names: Names, name: str, data: RigidBody) -> Cylinder | Sphere:
    """Return the shape of the outline of the rigid body `name`."""
    outline = data.outline
    centre = names.vector(data.center, ("rigid_bodies", name, "center"))
    if isinstance(outline, BallOutline):
        return Sphere(name, centre, outline.radius)
    assert outline is not None
    axis = 1 if names.is_axisymmetric else 0
    return Cylinder(name, centre, axis, 0.5 * outline.length, 0.5 * outline.height)


def outline_points(names: Names) -> tuple[np.ndarray, np.ndarray]:
    """Return points (k, d) of outlines that may touch walls, and the number of the body of each."""
    points, owners = [np.zeros((0, names.dimension))], [np.zeros(0, dtype=int)]
    for r, (name, data) in enumerate(names.scene.rigid_bodies.items()):
        if data.outline is None:
            continue
        shape = outline_shape(names, name, data)
        arms = touching_points(names, shape)
        if names.is_axisymmetric:
            arms = arms[arms[:, 0] >= 0.0]
        points.append(shape.centre + arms)
        owners.append(np.full(len(arms), r))
    return np.concatenate(points), np.concatenate(owners)


def touching_points(names: Names, shape: Cylinder | Sphere) -> np.ndarray:
    """Return the points (k, d) of an outline, relative to its centre, that may touch the walls.

    Planes and straight pipes touch a cylinder at its corners or rims first; other walls may touch
    its sides anywhere.
    """
    if isinstance(shape, Sphere):
        return ball_points(shape, names.dimension)
    walls = names.scene.environment.walls.values()
    straight = all(isinstance(wall, PlaneWall | PipeWall) for wall in walls)
    lengths = 1 if straight else LENGTHS_ALONG[names.dimension]
    if names.dimension == 3:
        return cylinder_points(shape, lengths)
    return rectangle_points(shape, lengths)


def ball_points(shape: Sphere, dimension: int) -> np.ndarray:
    """Return points (k, d) on a ball or, in the plane, a disc."""
    circle = points_around()
    if dimension == 2:
        return shape.radius * circle
    turns = [[c, s * across, s * up] for c, s in circle for across, up in circle]
    return shape.radius * np.unique(np.round(turns, 12), axis=0)


def cylinder_points(shape: Cylinder, lengths: int) -> np.ndarray:
    """Return points (k, 3) on the rims of a cylinder along x, and on rings between them.

    The rings divide it into the given number of lengths.
    """
    along = shape.half_length * np.linspace(-1.0, 1.0, lengths + 1)
    return np.array([[a, *(shape.radius * c)] for a in along for c in points_around()])


def rectangle_points(shape: Cylinder, lengths: int) -> np.ndarray:
    """Return the corners of a rectangle (k, 2), and points between them.

    They divide its longer side into the given number of lengths and its shorter one into pieces
    that are not longer.
    """
    half = np.full(2, shape.radius)
    half[shape.axis] = shape.half_length
    counts = np.ceil(lengths * half / half.max() * (1.0 - 1e-9)).astype(int)
    x, y = (h * np.linspace(-1.0, 1.0, n + 1) for h, n in zip(half, counts, strict=True))
    below, right = ([[a, -half[1]] for a in x[:-1]], [[half[0], b] for b in y[:-1]])
    one_way = np.array([*below, *right])
    return np.concatenate([one_way, -one_way])


def points_around() -> np.ndarray:
    """Return points (POINTS_AROUND, 2), evenly spaced around the unit circle."""
    around = 2.0 * np.pi * np.arange(POINTS_AROUND) / POINTS_AROUND
    return np.stack([np.cos(around), np.sin(around)], axis=1)


def outlines(
    names: Names,
    points: np.ndarray,
    stiffness: PenaltyStiffness,
    tied: list[np.ndarray],
) -> tuple[OutlineData, ...]:
    """Return the outlines of all rigid bodies that have one, with the contact of their supports.

    Raises SceneError if a node of a support starts inside the outline.
    """
    result = []
    for r, (name, data) in enumerate(names.scene.rigid_bodies.items()):
        if data.outline is None:
            continue
        keys = ("rigid_bodies", name, "supports")
        sets = [names.node_set(s, (*keys, k)) for k, s in enumerate(data.supports)]
        # Tied nodes move with the body and cannot lie against it.
        nodes = np.setdiff1d(np.concatenate([np.zeros(0, dtype=int), *sets]), tied[r])
        shape = outline_shape(names, name, data)
        support = None
        if len(nodes):
            support = stiffness.contact(nodes, data.support_friction_coefficient)
            gaps = shape.least_gap(points[nodes])
            if gaps.min() < -ALLOWED_PENETRATION:
                raise names.loaded.error(
                    keys,
                    f"a node at {in_mm(points[nodes[gaps.argmin()]])} starts "
                    f"{-gaps.min() * 1e3:.3g} mm inside the outline of '{name}'",
                    "the outline must lie outside the supports: shrink it, or move the body",
                )
        result.append(OutlineData(r, shape, support))
    return tuple(result)
