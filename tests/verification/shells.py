"""Small meshes around chambers, written as ABAQUS input files, and the scenes that use them."""

from typing import NamedTuple

import numpy as np

from softsim.robots.block import box

INNER, OUTER = 8e-3, 10e-3

SPHERE = """
bodies: {shell: {mesh: {file: shell.inp}, formulation: axisymmetric, material: rubber}}
materials: {rubber: {law: neo_hooke, C10: 36 kPa, density: 1070 kg/m^3}}
environment: {gravity: 0 m/s^2}
conditions: {middle: {kind: fixed, nodes: shell.equator_inner, directions: [y]}}
output:
  history_interval: 1 ms
  probes: {inner: {kind: displacement, nodes: shell.equator_inner},
           outer: {kind: displacement, nodes: shell.equator_outer}}
"""
GAS = """
loads: {gas: {kind: added_gas, facets: [shell.chamber],
              profile: {kind: ramp, value: 1 mg, duration: 20 ms}}}
time: {end: 30 ms, procedure: static}
"""
BOX = """
bodies: {shell: {mesh: {file: shell.inp}, formulation: solid, material: rubber, fixed: [floor]}}
materials: {rubber: {law: neo_hooke, C10: 36 kPa, density: 1070 kg/m^3}}
environment: {gravity: 0 m/s^2}
loads:
  first: {kind: added_volume, facets: [shell.open],
          profile: {kind: ramp, value: 0.15 ml, duration: 8 ms}}
  second: {kind: added_volume, facets: [shell.closed],
           profile: {kind: ramp, value: 0.1 ml, duration: 8 ms}}
time: {end: 12 ms}
output:
  probes: {open: {kind: volume, facets: [shell.open]},
           closed: {kind: volume, facets: [shell.closed]}}
"""


class Shell(NamedTuple):
    """A mesh and its free sides: (element, face) from 0 on; node sets."""

    kind: str
    points: np.ndarray
    cells: np.ndarray
    surfaces: dict[str, np.ndarray]
    node_sets: dict[str, list[int]]

    def write(self, path):
        """As an ABAQUS input file, in mm."""
        lines = ["*NODE"]
        for k, point in enumerate(1e3 * self.points, start=1):
            lines.append(", ".join([str(k), *(repr(float(c)) for c in point)]))
        lines.append(f"*ELEMENT, TYPE={self.kind}")
        for k, cell in enumerate(self.cells, start=1):
            lines.append(", ".join(str(n) for n in [k, *(cell + 1)]))
        for name, sides in self.surfaces.items():
            lines.append(f"*SURFACE, NAME={name}, TYPE=ELEMENT")
            lines += [f"{element + 1}, S{face + 1}" for element, face in sides]
        for name, nodes in self.node_sets.items():
            lines += [f"*NSET, NSET={name}", *(str(n + 1) for n in nodes)]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def round_shell(kind: str, rows: int, angles: np.ndarray, closed: bool) -> Shell:
    """Rows of triangles between the radii INNER and OUTER at the angles [rad].

    Surfaces: chamber (inside), outside. Node sets: equator_inner, equator_outer, at angle 0.
    """
    r = np.linspace(INNER, OUTER, rows + 1)
    points = np.stack([np.outer(r, np.cos(angles)), np.outer(r, np.sin(angles))], axis=-1)
    points[np.abs(points) < 1e-12 * OUTER] = 0.0
    node = np.arange(r.size * angles.size).reshape(r.size, -1)
    equator = int(np.argmin(np.abs(angles)))
    sets = {"equator_inner": [node[0, equator]], "equator_outer": [node[-1, equator]]}
    if closed:
        node = np.column_stack([node, node[:, :1]])
    a, b, c, d = node[:-1, 1:], node[:-1, :-1], node[1:, :-1], node[1:, 1:]
    rising = np.stack([a, b, c, a, c, d], axis=-1)  # inner edge: face 0 of the first triangle
    falling = np.stack([a, b, d, b, c, d], axis=-1)
    i, j = np.indices(a.shape)
    rises = (i + j) % 2 == 0
    cells = np.where(rises[..., None], rising, falling).reshape(-1, 3)
    first = 2 * np.arange(a.size).reshape(a.shape)
    inside = np.column_stack([first[0], np.zeros_like(first[0])])
    # Outer edge c-d: the second face of the second triangle, both ways.
    outside = np.column_stack([first[-1] + 1, np.ones_like(first[-1])])
    return Shell(kind, points.reshape(-1, 2), cells, {"chamber": inside, "outside": outside}, sets)


def half_section(rows: int) -> Shell:
    """The sphere; its cells are about square."""
    return round_shell("CAX3", rows, np.linspace(-np.pi / 2, np.pi / 2, 10 * rows + 1), False)


def ring(rows: int) -> Shell:
    """A ring of plane strain: a long tube."""
    return round_shell("CPE3", rows, np.linspace(-np.pi, np.pi, 20 * rows + 1)[:-1], True)


C3D4_FACES = np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])


def hollow_box() -> Shell:
    """A box of 18 x 10 x 10 mm with two holes: `closed`, 6 x 6 x 6 mm, and `open`, 6 x 8 x 6 mm,
    which ends on the box's underside, `floor`.
    """
    whole = box(18e-3, 10e-3, 10e-3, 2e-3)
    x, y, z = whole.points[whole.cells].mean(axis=1).T
    hole = (np.abs(np.abs(x - 9e-3) - 4e-3) < 3e-3) & (np.abs(z - 5e-3) < 3e-3) & (y < 8e-3)
    hole &= (x > 9e-3) | (y > 2e-3)
    used, cells = np.unique(whole.cells[~hole], return_inverse=True)
    points, cells = whole.points[used], cells.reshape(-1, 4)
    faces = cells[:, C3D4_FACES].reshape(-1, 3)
    _, number, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    middle = points[faces].mean(axis=1)
    inside = ((middle > 1e-9) & (middle < np.array([18e-3, 10e-3, 10e-3]) - 1e-9)).all(axis=1)
    sides = np.flatnonzero((count[number] == 1) & inside)
    is_open = middle[sides, 0] > 9e-3
    surfaces = {
        "closed": np.column_stack(np.divmod(sides[~is_open], 4)),
        "open": np.column_stack(np.divmod(sides[is_open], 4)),
    }
    floor = np.flatnonzero(points[:, 1] == 0.0)
    return Shell("C3D4", points, cells, surfaces, {"floor": floor})
