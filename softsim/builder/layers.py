"""Thin layers on facets of bodies: their material data and their mass."""

import numpy as np

from softsim.builder.names import Names, in_mm
from softsim.builder.regions import bounded
from softsim.elements.axisymmetric import Axisymmetric
from softsim.elements.geometry import nodal_sums
from softsim.elements.layer import Layer
from softsim.elements.ring_section import RingSection
from softsim.elements.solid import triangles_of
from softsim.scene.tree import Keys


def built_layers(names: Names, points: np.ndarray) -> tuple[Layer, ...]:
    """Return all layers of a scene, in its order, with the nodes at points (n, d) [m].

    Layers on the same facets add up. Raises SceneError in a ring section, and on the axis.
    """
    return tuple(layer(names, name, points) for name in names.scene.layers)


def layer(names: Names, name: str, points: np.ndarray) -> Layer:
    """Return a layer of a scene."""
    data, keys = names.scene.layers[name], ("layers", name)
    if isinstance(names.geometry, RingSection):
        raise names.loaded.error(
            keys,
            "a ring_section cannot have a layer: the hoop stretch at its surface is not defined",
            "write formulation plane_strain, axisymmetric or solid",
        )
    facets, areas = layer_facets(names, name)
    mass = float(areas.sum()) * data.thickness * data.density
    if names.dimension == 3:
        facets, share = triangles_of(facets)
        gradients, areas = on_triangles(points[facets])
        whole = areas > 0.0  # not what is left of a triangle among quadrilaterals
        facets, gradients, areas = facets[whole], gradients[whole], share * areas[whole]
    else:
        gradients, areas = on_edges(points[facets]), areas.sum(axis=1)
    around = np.zeros(len(facets))
    if isinstance(names.geometry, Axisymmetric):
        radius = points[facets][:, :, 0].mean(axis=1)
        refuse_axis(names, data.facets, points, facets, radius, (*keys, "facets"))
        around = 1.0 / radius
    return Layer(
        name=name,
        facets=facets,
        gradients=gradients,
        around=around,
        volumes=data.thickness * areas,
        youngs_modulus=data.youngs_modulus,
        poisson_ratio=data.poisson_ratio,
        mass=mass,
    )


def layer_facets(names: Names, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the facets (m, corners) of a layer, and their corners' areas (m, corners) [m^2]."""
    data = names.scene.layers[name]
    facets = names.facet_set(data.facets, ("layers", name, "facets"))
    areas = np.zeros(facets.shape)
    for body, region, chosen in bounded(names, facets):
        of_body = facets[chosen] - body.first_node
        areas[chosen] = region.geometry.corner_areas(body.mesh.points, of_body)
    return facets, areas


def layer_masses(names: Names, node_count: int) -> np.ndarray:
    """Return the mass (n,) [kg] of the layers at each node."""
    mass = np.zeros(node_count)
    for name, data in names.scene.layers.items():
        facets, areas = layer_facets(names, name)
        mass += nodal_sums(facets, data.density * data.thickness * areas, node_count)
    return mass


def on_edges(ends: np.ndarray) -> np.ndarray:
    """Return gradients (m, 2, 1) [1/m] along edges between these ends (m, 2, d) [m]."""
    inverse = 1.0 / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    return np.stack([-inverse, inverse], axis=1)[:, :, None]


def on_triangles(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return gradients (m, 3, 2) [1/m] in the plane of triangles, and their areas (m,) [m^2].

    The corners are (m, 3, 3) [m]; the directions are the first side and across it. The gradients of
    a flat triangle are zero.
    """
    e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    length = np.linalg.norm(e, axis=1)
    double = np.linalg.norm(np.cross(e, f), axis=1)
    whole = double > 1e-12 * (length**2 + (f**2).sum(axis=1))
    length, double = np.where(whole, length, 1.0), np.where(whole, double, 1.0)
    along, height = (e * f).sum(axis=1) / length, double / length
    zero = np.zeros(len(e))
    second = np.stack([1.0 / length, -along / double], axis=1)
    third = np.stack([zero, 1.0 / height], axis=1)
    gradients = np.stack([-second - third, second, third], axis=1)
    return gradients, np.where(whole, 0.5 * double, 0.0)


def refuse_axis(
    names: Names, reference: str, points: np.ndarray, facets: np.ndarray, radius: np.ndarray,
    keys: Keys,
) -> None:  # fmt: skip
    """Raise SceneError if a facet lies on the axis, where it would have no circumference."""
    on_axis = np.flatnonzero(radius < 1e-12)
    if len(on_axis):
        raise names.loaded.error(
            keys,
            f"the facet of '{reference}' at {in_mm(points[facets[on_axis[0]]].mean(axis=0))} lies "
            "on the axis",
            "leave it out of the set: a facet on the axis is not part of the surface of the body",
        )
