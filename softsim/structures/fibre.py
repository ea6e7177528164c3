"""A fibre embedded in a body: a thread or wire whose points follow the elements around them.

The fibre is cut into bars between places a along it. With the shape functions N_aj of the element
around it, fixed where it lies at rest, a place and its mass are those of the element's corners j,
    x_a = sum_j N_aj x_j,   m_j += N_aj m_a
(ABAQUS's *EMBEDDED ELEMENT, SOFA's BarycentricMapping). A bar between the places a and b has
    l = |x_b - x_a|,   E = EA / (2 l_0) (l - l_0)^2,   f_j = -EA (l / l_0 - 1) (N_bj - N_aj) t,
t its direction: the exact derivatives, with the engineering strain l / l_0 - 1, which may be large.
As sum_j N_aj = 1 and sum_j N_aj x_j = x_a, neither force nor moment is lost: a bar's add up to
nothing, and the mass and its centre are the fibre's.

Thread goes slack: a bar that is shorter than at rest stores no energy, unless the fibre bears
compression, as a wire does in a matrix that keeps it from buckling. A fibre has no bending
stiffness and displaces no material: that of the body at the same place remains (as in ABAQUS).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np
import scipy.sparse as sp
import taichi as ti
from scipy.spatial import cKDTree

from softsim.compute import backend
from softsim.compute.fields import Number, index_field, real_field
from softsim.compute.nodes import Nodes
from softsim.compute.term import Pass, Samples, Stage, Term
from softsim.elements.geometry import cube_functions, nodal_sums, simplex_gradients
from softsim.mesh.mesh import SURFACE
from softsim.mesh.surface import at, closest_on_facets, side_lengths
from softsim.rigid import RigidBodies
from softsim.scene.bodies import Helix
from softsim.scene.names import MeshedBody, Names, close_names, in_mm
from softsim.scene.text import Keys
from softsim.structures.structure import NodalStiffness, Structure

BAR_LENGTHS = 0.1, 2.0
"""Plausible lengths of bars over the size of the elements around them."""


@dataclass(frozen=True)
class Fibre:
    """Data of a fibre.

    corners (k, c): nodes of the element around each place, numbered in the model; weights (k, c):
    its shape functions there. lengths (k - 1,): of the bars at rest [m]. stretching_stiffness EA
    [N], mass_per_length [kg/m].
    """

    name: str
    corners: np.ndarray
    weights: np.ndarray
    lengths: np.ndarray
    stretching_stiffness: float
    mass_per_length: float
    bears_compression: bool

    @property
    def title(self) -> str:
        """Text for messages."""
        return f"fibre '{self.name}'"

    @property
    def column(self) -> str:
        """Column of its tension in the history [N]."""
        return f"{self.name}_tension"

    @property
    def mass(self) -> float:
        """Mass of the fibre [kg]."""
        return self.mass_per_length * float(self.lengths.sum())

    @property
    def bar_nodes(self) -> np.ndarray:
        """Nodes (k - 1, 2 c) that each bar follows: those of its start, then of its end.

        A node may occur twice.
        """
        return np.concatenate([self.corners[:-1], self.corners[1:]], axis=1)

    @property
    def bar_weights(self) -> np.ndarray:
        """B (k - 1, 2 c): x_b - x_a = sum_j B_j x_j of these nodes."""
        return np.concatenate([-self.weights[:-1], self.weights[1:]], axis=1)

    @property
    def spring_stiffness(self) -> np.ndarray:
        """EA / l_0 (k - 1,) [N/m]."""
        return self.stretching_stiffness / self.lengths

    def places(self, x: np.ndarray) -> np.ndarray:
        """Return the places (k, d) [m] of the bar ends, with the model's nodes at x (n, d) [m]."""
        return np.einsum("kc,kcd->kd", self.weights, x[self.corners])

    def nodal_mass(self, node_count: int) -> np.ndarray:
        """Return the mass (n,) [kg] that each node gets: half of a bar's at each of its ends."""
        halves = 0.5 * self.mass_per_length * self.lengths
        of_places = np.append(halves, 0.0) + np.append(0.0, halves)
        return nodal_sums(self.corners, of_places[:, None] * self.weights, node_count)

    def rest_stiffness(self, points: np.ndarray) -> sp.csr_matrix:
        """Return K (n d, n d) [N/m] of taut bars at rest, with the nodes at points (n, d) [m]:
        EA / l_0 (B t) (B t)^T.
        """
        (n, d), nodes = points.shape, self.bar_nodes
        ways = np.diff(self.places(points), axis=0)
        tangents = ways / np.linalg.norm(ways, axis=1)[:, None]
        stretch = self.bar_weights[:, :, None] * tangents[:, None]  # dl / dx_j
        rows = np.repeat(np.arange(len(nodes)), nodes.shape[1] * d)
        columns = (nodes[:, :, None] * d + np.arange(d)).ravel()
        G = sp.csr_matrix((stretch.ravel(), (rows, columns)), shape=(len(nodes), n * d))
        return (G.T @ sp.diags(self.spring_stiffness) @ G).tocsr()

    def bound(self) -> NodalStiffness:
        """Return an upper bound EA / l_0 B B^T of the stiffness of the bars in any configuration.

        A bar has the stiffness EA / l_0 along itself and T / l across, which is less, and negative
        in compression. A slack bar, which has no stiffness, counts as taut.
        """
        B = self.bar_weights.T
        return NodalStiffness(self.title, self.bar_nodes.T, self.spring_stiffness * B[:, None] * B)

    def warnings(self, points: np.ndarray) -> dict[str, str]:
        """Return a warning of bars much longer or shorter than the elements around them."""
        around = points[self.corners]
        size = float(np.ptp(around, axis=1).max(axis=1).mean())
        bar = float(self.lengths.mean())
        if BAR_LENGTHS[0] * size <= bar <= BAR_LENGTHS[1] * size:
            return {}
        which = "span several elements" if bar > size else "add run time without more accuracy"
        return {
            f"bars of {self.name}": f"{self.title} has bars of {1e3 * bar:.3g} mm in elements of "
            f"{1e3 * size:.3g} mm, which {which}: set its spacing to about {500.0 * size:.2g} mm"
        }


@dataclass(frozen=True, eq=False)
class Fibres(Structure):
    """All fibres of a model: one structure, so that their kernels are compiled once."""

    fibres: tuple[Fibre, ...]
    kind: ClassVar[str] = "fibres"

    @property
    def columns(self) -> dict[str, str]:
        return {fibre.column: "N" for fibre in self.fibres}

    def term(
        self, scenarios: Sequence["Fibres"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "FibreTerm":
        return FibreTerm(nodes, self.fibres)

    def nodal_mass(self, node_count: int) -> np.ndarray:
        return sum((f.nodal_mass(node_count) for f in self.fibres), np.zeros(node_count))

    def stiffness_bound(self, x: np.ndarray) -> list[NodalStiffness]:
        return [fibre.bound() for fibre in self.fibres]

    def rest_stiffness(self, points: np.ndarray) -> sp.csr_matrix:
        nothing = sp.csr_matrix((points.size, points.size))
        return sum((fibre.rest_stiffness(points) for fibre in self.fibres), nothing)

    def lines(self, x: np.ndarray) -> dict[str, list[np.ndarray]]:
        return {"fibres": [fibre.places(x) for fibre in self.fibres]}

    def description(self) -> dict[str, str]:
        return {
            fibre.title: f"{len(fibre.lengths)} bars, {fibre.lengths.sum() * 1e3:.4g} mm, "
            f"{fibre.mass * 1e3:.4g} g"
            for fibre in self.fibres
        }

    def warnings(self, points: np.ndarray) -> dict[str, str]:
        return {k: text for f in self.fibres for k, text in f.warnings(points).items()}


class FibreTerm(Term):
    """Force term of all fibres of a model: one term, so that kernels are compiled once.

    least (bars,) [m]: lower limit of the elongation l - l_0 in the tension of a bar. impulse
    (scenarios, bars) [N s]: of each bar's tension, since last cleared.
    """

    def __init__(self, nodes: Nodes, fibres: Sequence[Fibre]) -> None:
        counts = [len(fibre.lengths) for fibre in fibres]
        self.nodes, self.bars = nodes, Number(sum(counts))
        self.columns = [fibre.column for fibre in fibres]
        self.starts = np.cumsum([0, *counts[:-1]])
        bar_nodes = np.concatenate([fibre.bar_nodes for fibre in fibres])
        self.node_count = bar_nodes.shape[1]
        self.node = index_field(bar_nodes)
        self.weight = real_field(np.concatenate([fibre.bar_weights for fibre in fibres]))
        lengths = [fibre.lengths for fibre in fibres]
        self.length = real_field(np.concatenate(lengths))
        self.least = real_field(
            np.concatenate([-f.lengths * f.bears_compression for f in fibres])  # never below -l_0
        )
        self.spring_stiffness = real_field(np.concatenate([f.spring_stiffness for f in fibres]))
        self.first_slot = nodes.corner_forces.reserve(bar_nodes)
        self.impulse = real_field(np.zeros((nodes.scenarios, len(bar_nodes))))

    def passes(self) -> dict[Stage, list[Pass]]:
        return {Stage.MOVE: [Pass("fibres", int(self.bars), (self.stretch,))]}

    def state_fields(self) -> dict[str, ti.Field]:
        return {"impulse": self.impulse}

    def impulses(self) -> list[ti.Field]:
        return [self.impulse]

    def readings(self, samples: Samples) -> dict[str, np.ndarray]:
        """Return the mean tension [N] of the bar of each fibre in which it is largest."""
        impulses = np.maximum.reduceat(samples.read(self.impulse), self.starts, axis=1)
        return dict(zip(self.columns, samples.mean(impulses).T, strict=True))

    @ti.func
    def way(self, s, i):
        """Return the vector from the start of bar i to its end [m]."""
        way = ti.Vector.zero(backend.real, self.nodes.dimension)
        for c in range(self.node_count):  # not unrolled: it may be 16
            way += self.weight[i, c] * self.nodes.position[s, self.node[i, c]]
        return way

    @ti.func
    def elongation(self, i, length):
        """Return the elongation l - l_0 [m] of bar i, zero where it is slack."""
        return ti.max(length - self.length[i], self.least[i])

    @ti.func
    def stretch(self, s, i, t, dt):
        """Write the forces of bar i on the nodes that it follows."""
        way = self.way(s, i)
        length = way.norm()
        tension = self.spring_stiffness[i] * self.elongation(i, length)
        pull = -tension / length * way
        for c in range(self.node_count):  # not unrolled: it may be 16
            slot = self.first_slot + self.node_count * i + c
            self.nodes.corner_forces.write(s, slot, self.weight[i, c] * pull)
        self.impulse[s, i] = self.impulse[s, i] + tension * dt

    @ti.func
    def stored_energy(self, s, part):
        """Return the energy of stretching [J]."""
        energy = ti.cast(0.0, backend.real)
        for i in range(self.bars.first(part), self.bars.first(part + 1)):
            elongation = self.elongation(i, self.way(s, i).norm())
            energy += 0.5 * self.spring_stiffness[i] * elongation * elongation
        return energy


# -------------------------------------------------------------------------------------------------
# Search for the elements that contain given points, and their shape functions there.

# A place that is outside an element by no more than this share of it lies in it.
ROUND_OFF = 1e-9
# Newton's steps to a place in a bilinear or trilinear element; four do where it is no wedge.
MOST_STEPS = 30


def embedded(
    places: np.ndarray, points: np.ndarray, cells: np.ndarray, surface: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the nodes that places in a body follow, their weights, and how far places are moved.

    Each place (k, d) [m] in a body follows nodes (k, c) with weights (k, c) and is moved by a
    distance (k,) [m].

    points (n, d) [m], cells (m, c) and surface (f, corners) of the body's mesh. A place in
    a cell follows the nodes of the cell with its shape functions as weights and is not moved; where
    several cells meet, the first is taken. A place outside is moved to the closest point of the
    surface, and follows the nodes of that facet.
    """
    cell, weights = holding_cells(places, points, cells)
    nodes, moved = cells[cell], np.zeros(len(places))
    outside = np.flatnonzero(cell < 0)
    if len(outside):
        facet, shares = closest_on_facets(places[outside], points, surface)
        corners = surface[facet]
        moved[outside] = np.linalg.norm(at(shares, points[corners]) - places[outside], axis=1)
        spare = ((0, 0), (0, cells.shape[1] - surface.shape[1]))  # corners without weight
        nodes[outside] = np.pad(corners, spare, mode="edge")
        weights[outside] = np.pad(shares, spare)
    return nodes, weights, moved


def holding_cells(
    places: np.ndarray, points: np.ndarray, cells: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the number of the cell that contains each place, and its shape functions there.

    The result is the number (k,) of the cell (m, c) for places (k, d) [m], -1 for none, and the
    shape functions (k, c). points (n, d) [m] of the mesh.
    """
    corners = points[cells]
    centres = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centres[:, None], axis=2).max() * (1.0 + ROUND_OFF)
    near = cKDTree(centres).query_ball_point(places, reach)
    place = np.repeat(np.arange(len(places)), [len(members) for members in near])
    candidate = np.concatenate([np.sort(members) for members in near]).astype(int)
    weights, beside = shape_functions(places[place], points, cells[candidate])
    inside = np.flatnonzero(beside <= ROUND_OFF)
    held, first = np.unique(place[inside], return_index=True)
    found, of_places = np.full(len(places), -1), np.zeros((len(places), cells.shape[1]))
    found[held], of_places[held] = candidate[inside[first]], weights[inside[first]]
    return found, of_places


def shape_functions(
    places: np.ndarray, points: np.ndarray, cells: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return shape functions of cells at one place each, and how far outside the place lies.

    N_a (k, c) of cells (k, c) at places (k, d) [m]; the distance outside (k,) is a fraction of the
    cell's size, zero or less inside.
    """
    if cells.shape[1] == points.shape[1] + 1:
        first = points[cells[:, 0]]
        weights = np.einsum("kci,ki->kc", simplex_gradients(points, cells), places - first)
        weights[:, 0] += 1.0
        return weights, -weights.min(axis=1)
    corners = points[cells]
    size = np.linalg.norm(corners - places[:, None], axis=2).max(axis=1)
    xi = np.zeros(places.shape)
    for _ in range(MOST_STEPS):
        weights, slopes = cube_functions(xi, cells.shape[1])
        apart = places - at(weights, corners)
        if np.linalg.norm(apart, axis=1).max(initial=0.0) < 1e-15 * size.max(initial=0.0):
            break
        # dx_j / dxi_i; a pseudo-inverse, as corners of a wedge fall together.
        inverse = np.linalg.pinv(slopes.swapaxes(1, 2) @ corners)
        step = np.einsum("ki,kij->kj", apart, inverse)
        # What is far outside need not go on: another cell holds it.
        xi = np.clip(xi + step, -2.0, 2.0)
    weights, _ = cube_functions(xi, cells.shape[1])
    missed = np.linalg.norm(places - at(weights, corners), axis=1) / size
    return weights, np.maximum(np.abs(xi).max(axis=1) - 1.0, missed)


# -------------------------------------------------------------------------------------------------
# Places in bodies, and fibres of a scene.


# Default distance from the surface that a place or a tied node may have, over the mean side of its
# facets.
SURFACE_TOLERANCE = 0.05


def refuse_all_around(names: Names, what: str, keys: Keys) -> None:
    """Raise SceneError in an axisymmetric or ring model, where `what` would be a closed sheet."""
    if names.is_axisymmetric or names.is_ring_section:
        raise names.loaded.error(
            keys,
            f"{what} in a model that is {names.geometry.name} would be a closed sheet around the "
            "axis",
            "write formulation solid or plane_strain, or use a layer instead",
        )


def usual_tolerance(body: MeshedBody) -> float:
    """Return the default tolerance [m]: how far outside of a body a place may lie."""
    facets, points = body.mesh.facet_sets[SURFACE], body.mesh.points
    sides = side_lengths(points, facets)
    return SURFACE_TOLERANCE * float(sides[sides > 0.0].mean())


def in_bodies(
    names: Names, places: np.ndarray, tolerance: float | None, keys: Keys
) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes (k, c) that each place (k, d) [m] follows, and their weights (k, c).

    They belong to the body in which the place lies, or to which it is closest. tolerance: how far
    it may lie outside [m], None: the usual one. Raises SceneError at `keys` with the number of a
    place that is farther away.
    """
    found = []
    for body in names.bodies.values():
        mesh = body.mesh
        nodes, weights, moved = embedded(places, mesh.points, mesh.cells, mesh.facet_sets[SURFACE])
        most = usual_tolerance(body) if tolerance is None else tolerance
        found.append((body.first_node + nodes, weights, moved, np.full(len(places), most)))
    nodes, weights, moved, allowed = (np.stack(parts) for parts in zip(*found, strict=True))
    closest, each = np.argmin(moved, axis=0), np.arange(len(places))
    outside = np.flatnonzero(moved[closest, each] > allowed[closest, each])
    if len(outside):
        k = int(outside[0])
        name = list(names.bodies)[closest[k]]
        raise names.loaded.error(
            (*keys, k),
            f"{in_mm(places[k])} is outside all bodies: {moved[closest[k], k] * 1e3:.3g} mm from "
            f"'{name}', more than the tolerance of {allowed[closest[k], k] * 1e3:.3g} mm",
            "place it inside a body",
        )
    return nodes[closest, each], weights[closest, each]


# A helix is a polygon with so many sides a turn, at least.
LEAST_SIDES = 8

MOST_BARS = 100_000
"""Number of bars above which a fibre is refused: its places would not fit in memory."""


def fibres(names: Names, points: np.ndarray, is_free: np.ndarray) -> list[Fibres]:
    """Return the fibres of a scene as one structure, or nothing without fibres."""
    found = tuple(fibre(names, name) for name in names.scene.fibres)
    return [Fibres(found)] if found else []


def fibre(names: Names, name: str) -> Fibre:
    """Return a fibre of a scene.

    Raises SceneError in an axisymmetric model or a ring section, for a fibre without a length, and
    for one that leaves its body.
    """
    data, keys = names.scene.fibres[name], ("fibres", name)
    refuse_all_around(names, "a fibre", keys)
    if data.body not in names.bodies:
        raise names.loaded.error(
            (*keys, "body"),
            f"there is no body '{data.body}'",
            close_names(data.body, list(names.bodies), "bodies"),
        )
    body = names.bodies[data.body]
    if data.helix is None:
        places = along_corners(names, name)
    else:
        places = along_helix(names, data.helix, data.spacing, (*keys, "helix"))
    points = body.mesh.points
    nodes, weights, moved = embedded(places, points, body.mesh.cells, body.mesh.facet_sets[SURFACE])
    refuse_outside(names, name, body, places, moved)
    held = at(weights, points[nodes])
    area = 0.25 * np.pi * data.diameter**2
    return Fibre(
        name=name,
        corners=body.first_node + nodes,
        weights=weights,
        lengths=np.linalg.norm(np.diff(held, axis=0), axis=1),
        stretching_stiffness=data.youngs_modulus * area,
        mass_per_length=data.density * area,
        bears_compression=data.bears_compression,
    )


def along_corners(names: Names, name: str) -> np.ndarray:
    """Return places (k, d) [m] along a fibre: its points, and places evenly between them."""
    data = names.scene.fibres[name]
    assert data.points is not None
    corners = [
        names.vector(point, ("fibres", name, "points", k)) for k, point in enumerate(data.points)
    ]
    places = [corners[0]]
    for k, (start, end) in enumerate(pairwise(corners)):
        length = float(np.linalg.norm(end - start))
        if length == 0.0:
            raise names.loaded.error(
                ("fibres", name, "points", k + 1),
                f"'{name}' has two successive points at {in_mm(start)}",
                "leave one of them out",
            )
        count = bar_count(names, length, data.spacing, ("fibres", name, "spacing"))
        places += [start + (end - start) * step / count for step in range(1, count)]
        places.append(end)
    return np.array(places)


def bar_count(names: Names, length: float, spacing: float, keys: Keys) -> int:
    """Return the number of bars of about `spacing` [m] on a length [m] of a fibre.

    Raises SceneError above MOST_BARS.
    """
    count = length / spacing
    if not count <= MOST_BARS:
        raise names.loaded.error(
            keys,
            f"a fibre of {length:.4g} m would have {count:.3g} bars; at most {MOST_BARS} are "
            "possible",
            "set spacing to about half of the element size; check pitch and turns of a helix",
        )
    return max(1, round(count))


def along_helix(names: Names, helix: Helix, spacing: float, keys: Keys) -> np.ndarray:
    """Return places (k, 3) [m], evenly spaced along a helix.

    Raises SceneError in a section, and if the spacing makes too coarse a polygon of it.
    """
    if names.dimension == 2:
        raise names.loaded.error(
            keys,
            "a helix is not possible in a plane section",
            "write points, or use formulation solid",
        )
    axis = names.axis(helix.direction, (*keys, "direction"))
    a_turn = float(np.hypot(2.0 * np.pi * helix.radius, helix.pitch))
    if spacing * LEAST_SIDES > a_turn:
        raise names.loaded.error(
            (*keys[:-1], "spacing"),
            f"a turn of the helix is {a_turn * 1e3:.4g} mm long, less than {LEAST_SIDES} bars of "
            f"{spacing * 1e3:.4g} mm",
            f"set spacing to at most {a_turn / LEAST_SIDES * 1e3:.3g} mm",
        )
    count = bar_count(names, helix.turns * a_turn, spacing, (*keys[:-1], "spacing"))
    turned = helix.turns * np.linspace(0.0, 1.0, count + 1)
    sense = 1.0 if helix.handedness == "right" else -1.0
    angle = helix.start_angle + sense * 2.0 * np.pi * turned
    across = [helix.radius * np.cos(angle), helix.radius * np.sin(angle)]
    # The first column is along the axis; those after it follow as y after x.
    places = np.roll(np.stack([helix.pitch * turned, *across], axis=1), axis, axis=1)
    return places + names.vector(helix.center, (*keys, "center"))


def refuse_outside(
    names: Names, name: str, body: MeshedBody, places: np.ndarray, moved: np.ndarray
) -> None:
    """Raise SceneError if a place (k, d) [m] of a fibre is too far outside its body.

    moved (k,) [m]: its distance from the body, which must not exceed the tolerance.
    """
    data = names.scene.fibres[name]
    tolerance = usual_tolerance(body) if data.tolerance is None else data.tolerance
    out = np.flatnonzero(moved > tolerance)
    if not len(out):
        return
    worst = int(np.argmax(moved))
    raise names.loaded.error(
        ("fibres", name, "helix" if data.points is None else "points"),
        f"'{name}' leaves body '{data.body}' at {in_mm(places[out[0]])}; at "
        f"{in_mm(places[worst])} it is {moved[worst] * 1e3:.3g} mm outside, more than the "
        f"tolerance of {tolerance * 1e3:.3g} mm",
        f"place it inside the body, or raise the tolerance (fibres.{name}.tolerance)",
    )
