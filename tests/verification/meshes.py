"""Small meshes with named sets for verification, written as ABAQUS input files in metres.

Mapped grids: the unit square or a piece of a sphere cut into equal cells, all diagonals leaning one
way, the pattern that locks most readily.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

ELEMENT_TYPES = {
    "plane_strain": "CPE",
    "ring_section": "CPE",
    "axisymmetric": "CAX",
    "solid": "C3D",
}
# Faces S1, S2 ... of a cell as ABAQUS numbers them, by dimension and the number of its corners.
FACES = {
    (2, 3): [(0, 1), (1, 2), (2, 0)],
    (2, 4): [(0, 1), (1, 2), (2, 3), (3, 0)],
    (3, 4): [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)],
    (3, 8): [
        (0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)
    ],
}  # fmt: skip


@dataclass(frozen=True)
class SmallMesh:
    """points (n, d) [m], cells (m, corners), positive; node sets by name.

    surfaces: names of node sets whose boundary facets, those with every corner in the set, also
    become a facet set of that name. Every cell is in the cell set "cells".
    """

    points: np.ndarray
    cells: np.ndarray
    node_sets: dict[str, np.ndarray] = field(default_factory=dict)
    surfaces: tuple[str, ...] = ()

    @property
    def volumes(self) -> np.ndarray:
        """Signed areas or volumes (m,) of the cells."""
        return signed_volumes(self.points, self.cells)

    @property
    def faces(self) -> list[tuple[int, ...]]:
        """Corners of a cell's faces."""
        return FACES[self.points.shape[1], self.cells.shape[1]]

    def boundary(self) -> np.ndarray:
        """Facets (k, corners) that only one cell has, in that cell's order of faces."""
        facets = np.concatenate([self.cells[:, face] for face in self.faces])
        _, number, count = np.unique(
            np.sort(facets, axis=1), axis=0, return_inverse=True, return_counts=True
        )
        return facets[count[number] == 1]

    def tilt_squared(self, name: str) -> float:
        """Mean square angle [rad^2], by area, between facets of this name and the sphere or circle
        about the origin on which their corners lie.
        """
        facets = self.boundary()
        corners = self.points[facets[np.isin(facets, self.node_sets[name]).all(axis=1)]]
        radius = np.linalg.norm(corners[0, 0])
        # The plane of a facet is nearest to the origin at the foot of its normal, at `height`.
        edges = corners[:, 1:] - corners[:, :1]
        if edges.shape[1] == 1:
            normals = edges[:, 0] @ np.array([[0.0, -1.0], [1.0, 0.0]])
        else:
            normals = np.cross(edges[:, 0], edges[:, 1])
        area = np.linalg.norm(normals, axis=1)
        height = np.abs(np.einsum("ki,ki->k", normals, corners[:, 0])) / area
        tilt = np.arccos(np.minimum(height / radius, 1.0))
        return float(np.average(tilt**2, weights=area))

    def write(self, path: Path, formulation: str) -> Path:
        """As an ABAQUS input file for this formulation."""
        rows = ["*NODE"]
        rows += [f"{a + 1}, " + ", ".join(map(repr, p)) for a, p in enumerate(self.points.tolist())]
        kind = f"{ELEMENT_TYPES[formulation]}{self.cells.shape[1]}"
        rows.append(f"*ELEMENT, TYPE={kind}, ELSET=cells")
        rows += [
            ", ".join(map(str, [e + 1, *cell])) for e, cell in enumerate((self.cells + 1).tolist())
        ]
        for name, nodes in self.node_sets.items():
            rows += [f"*NSET, NSET={name}", *map(str, np.asarray(nodes) + 1)]
        for name in self.surfaces:
            rows.append(f"*SURFACE, NAME={name}")
            inside = np.isin(self.cells, self.node_sets[name])
            for number, face in enumerate(self.faces):
                cells = np.flatnonzero(inside[:, list(face)].all(axis=1))
                rows += [f"{e + 1}, S{number + 1}" for e in cells]
        path.write_text("\n".join(rows) + "\n", encoding="utf-8")
        return path


def signed_volumes(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Signed areas or volumes (m,) of triangles or tetrahedra."""
    corners = points[cells]
    return np.linalg.det(corners[:, 1:] - corners[:, :1]) / (2.0 if cells.shape[1] == 3 else 6.0)


def corner_volumes(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Of simplexes their volumes (m,), of other cells those between the edges at their corners."""
    d, corners = points.shape[1], cells.shape[1]
    if corners == d + 1:
        return signed_volumes(points, cells)
    of = {
        4: [(0, 1, 3), (1, 2, 0), (2, 3, 1), (3, 0, 2)],
        8: [(0, 1, 3, 4), (1, 2, 0, 5), (2, 3, 1, 6), (3, 0, 2, 7),
            (4, 7, 5, 0), (5, 4, 6, 1), (6, 5, 7, 2), (7, 6, 4, 3)],
    }  # fmt: skip
    at = [cells[:, list(corner)] for corner in of[corners]]
    return np.concatenate([signed_volumes(points, corner) for corner in at])


def made_positive(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """The cells with two corners swapped where they are inside out."""
    turned = cells.copy()
    inverted = signed_volumes(points, cells) < 0.0
    turned[inverted, :2] = cells[inverted, 1::-1]
    return turned


def grid(
    columns: int,
    rows: int,
    place: Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]],
) -> SmallMesh:
    """Triangles of the unit square (s, t), its nodes at `place(s, t)` [m].

    Node and facet sets left, right (s = 0, 1), bottom, top (t = 0, 1).
    """
    s, t = np.meshgrid(np.linspace(0.0, 1.0, columns + 1), np.linspace(0.0, 1.0, rows + 1))
    points = np.stack(place(s.ravel(), t.ravel()), axis=1)
    node = np.arange(s.size).reshape(s.shape)
    a, b, c, d = node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]
    cells = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    sets = {"left": node[:, 0], "right": node[:, -1], "bottom": node[0], "top": node[-1]}
    return SmallMesh(points, made_positive(points, cells), sets, tuple(sets))


def joined(mesh: SmallMesh) -> SmallMesh:
    """The quadrilaterals that `grid` cut into pairs of triangles."""
    first, second = mesh.cells[::2], mesh.cells[1::2]
    is_shared = (first[:, :, None] == second[:, None]).any(axis=2)
    # From the corner that only the first triangle has; the second one's own lies opposite.
    turn = np.argmin(is_shared, axis=1)[:, None] + np.arange(3)
    a, b, d = np.take_along_axis(first, turn % 3, axis=1).T
    return replace(mesh, cells=np.column_stack([a, b, second[:, 2], d]))


def two_strips(length: float, inner: float, outer: float, columns: int, rows: int) -> SmallMesh:
    """A section of a tube along x, |x| < length / 2: two strips, mirror images about y = 0.

    Node and facet sets of both: left, right, inner, outer; upper_inner of the upper one.
    """

    def place(s, t):
        return length * (s - 0.5), inner + t * (outer - inner)

    upper, count = grid(columns, rows, place), (columns + 1) * (rows + 1)
    points = np.concatenate([upper.points, upper.points * [1.0, -1.0]])
    cells = made_positive(points, np.concatenate([upper.cells, upper.cells + count]))
    both = {name: np.concatenate([s, s + count]) for name, s in upper.node_sets.items()}
    sets = {"left": both["left"], "right": both["right"], "inner": both["bottom"]}
    sets |= {"outer": both["top"], "upper_inner": upper.node_sets["bottom"]}
    return SmallMesh(points, cells, sets, tuple(sets))


def irregular_block(
    side: float, count: int, dimension: int, shift: float, seed: int, whole: bool
) -> SmallMesh:
    """A square or cube [0, side]^d, `count` cells a side, its inner nodes moved by `shift` times a
    cell's side in random directions; sets left, right, bottom, top, in space back, front. Cells are
    `whole`, or cut into simplexes.
    """
    ticks = np.linspace(0.0, side, count + 1)
    square = grid(count, count, lambda s, t: (side * s, side * t))
    points, cells = square.points, square.cells
    if whole:
        nodes = np.arange((count + 1) ** dimension).reshape([count + 1] * dimension)  # [z,] y, x
        at_low = [slice(0, count), slice(1, count + 1)]
        around = [(0, 0), (0, 1), (1, 1), (1, 0)]
        corners = around if dimension == 2 else [(k, *ij) for k in (0, 1) for ij in around]
        cells = np.stack(
            [nodes[tuple(at_low[i] for i in corner)].ravel() for corner in corners], axis=1
        )
    elif dimension == 3:
        low = len(points) * np.arange(count)[:, None]
        cells = swept(cells, low, low + len(points))
    if dimension == 3:
        points = np.column_stack([np.tile(points, (count + 1, 1)), np.repeat(ticks, len(points))])
    if not whole:
        cells = made_positive(points, cells)
    names = (("left", "right"), ("bottom", "top"), ("back", "front"))[:dimension]
    sets = {
        name: np.flatnonzero(points[:, axis] == end)
        for axis, pair in enumerate(names)
        for name, end in zip(pair, (0.0, side), strict=True)
    }
    inside = np.setdiff1d(np.arange(len(points)), np.concatenate([*sets.values()]))
    moved = distorted(points, cells, inside, shift * side / count, seed)
    return SmallMesh(moved, cells, sets, tuple(sets))


def quarter_ring(inner: float, outer: float, around: int, across: int) -> SmallMesh:
    """A quarter of a ring, x, y > 0.

    Node and facet set inner; node sets x0, y0: the nodes on x = 0, on y = 0.
    """

    def place(s, t):
        radius, angle = inner + t * (outer - inner), 0.5 * np.pi * s
        return radius * np.cos(angle), radius * np.sin(angle)

    mesh = grid(around, across, place)
    return walled(mesh.points, mesh.cells, mesh.node_sets["bottom"])


def octant(inner: float, outer: float, around: int, across: int) -> SmallMesh:
    """Tetrahedra of an eighth of a thick sphere, x, y, z > 0; `around` cells along its edges.

    Sets as of `quarter_ring`, and z0.
    """
    steps = [(i, j, around - i - j) for i in range(around + 1) for j in range(around + 1 - i)]
    number = {step: k for k, step in enumerate(steps)}
    triangles = []
    for i, j, k in steps:
        if k > 0:
            triangles.append([(i, j, k), (i + 1, j, k - 1), (i, j + 1, k - 1)])
        if k > 1:
            triangles.append([(i + 1, j, k - 1), (i + 1, j + 1, k - 2), (i, j + 1, k - 1)])
    section = np.array([[number[step] for step in three] for three in triangles])
    directions = np.array(steps) / np.linalg.norm(steps, axis=1, keepdims=True)
    radii = np.linspace(inner, outer, across + 1)
    points = (radii[:, None, None] * directions).reshape(-1, 3)
    low = len(steps) * np.arange(across)[:, None]
    return walled(points, swept(section, low, low + len(steps)), np.arange(len(steps)))


def octant_of_hexahedra(inner: float, outer: float, around: int, across: int) -> SmallMesh:
    """As `octant`: the three faces of a cube that meet at a corner, blown up."""
    angles = np.linspace(0.0, 0.25 * np.pi, around + 1)
    face = joined(grid(around, around, lambda s, t: (s, t)))
    u, v = np.tan(angles[np.round(around * face.points).astype(int)]).T
    faces = [np.roll(np.column_stack([np.ones_like(u), u, v]), k, axis=1) for k in range(3)]
    directions = np.concatenate(faces)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    _, kept, number = np.unique(
        directions.round(12), axis=0, return_index=True, return_inverse=True
    )
    section = number.ravel()[np.concatenate([face.cells + k * len(u) for k in range(3)])]
    radii = np.linspace(inner, outer, across + 1)
    points = (radii[:, None, None] * directions[kept]).reshape(-1, 3)
    low = len(kept) * np.arange(across)[:, None, None]
    cells = np.concatenate([low + section, low + len(kept) + section], axis=2).reshape(-1, 8)
    return walled(points, cells, np.arange(len(kept)))


def swept(triangles: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Tetrahedra between copies of a triangulated section, layer by layer.

    low, high (layers, 1): what to add to a section's node numbers at a layer's two faces. On every
    side of a prism the diagonal rises from the smaller number: neighbours agree.
    """
    a, b, c = np.sort(triangles, axis=1).T
    corners = [
        [low + a, low + b, low + c, high + c],
        [low + a, low + b, high + b, high + c],
        [low + a, high + a, high + b, high + c],
    ]
    return np.stack([np.stack(four, axis=-1) for four in corners]).reshape(-1, 4)


def tube_of_hexahedra(
    inner: float, outer: float, length: float, counts: tuple[int, int, int]
) -> SmallMesh:
    """A tube about x from x = 0 to its length [m], `counts` of cells across, around and along.

    Node and facet sets inner, left, right.
    """
    across, around, along = counts
    steps = np.arange((across + 1) * around * (along + 1))
    a, rest = np.divmod(steps, around * (along + 1))
    c, k = np.divmod(rest, along + 1)
    radius, angle = inner + (outer - inner) * a / across, 2.0 * np.pi * c / around
    points = np.stack([length * k / along, radius * np.cos(angle), radius * np.sin(angle)], axis=1)

    def number(da, dc, dk):
        i, j, h = np.meshgrid(np.arange(across), np.arange(around), np.arange(along), indexing="ij")
        nodes = ((i + da) * around + (j + dc) % around) * (along + 1) + h + dk
        return nodes.ravel()

    square = [(0, 0), (1, 0), (1, 1), (0, 1)]  # outwards, then around: x goes along
    cells = np.stack([number(*corner, dk) for dk in (0, 1) for corner in square], axis=1)
    sets = {
        "inner": np.flatnonzero(a == 0),
        "left": np.flatnonzero(k == 0),
        "right": np.flatnonzero(k == along),
    }
    return SmallMesh(points, cells, sets, tuple(sets))


def walled(points: np.ndarray, cells: np.ndarray, inner: np.ndarray) -> SmallMesh:
    """A thick wall with its sets; coordinates that rounding left off zero are zero."""
    points = np.where(np.abs(points) < 1e-15, 0.0, points)
    sets = {"inner": inner}
    for axis, letter in enumerate("xyz"[: points.shape[1]]):
        sets[f"{letter}0"] = np.flatnonzero(points[:, axis] == 0.0)
    if cells.shape[1] == points.shape[1] + 1:
        cells = made_positive(points, cells)
    return SmallMesh(points, cells, sets, ("inner",))


def distorted(
    points: np.ndarray, cells: np.ndarray, inside: np.ndarray, distance: float, seed: int
) -> np.ndarray:
    """The points with those `inside` moved by `distance` [m], each in a random direction.

    The first of the seeds from `seed` on whose cells are all positive.
    """
    while True:
        step = np.random.default_rng(seed).standard_normal(points[inside].shape)
        moved = points.copy()
        moved[inside] += distance * step / np.linalg.norm(step, axis=1, keepdims=True)
        if (corner_volumes(moved, cells) > 0.0).all():
            return moved
        seed += 1
