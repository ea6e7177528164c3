"""Limits on dimensions that several bodies share; errors name the parameter."""

import math

from softsim.errors import MeshError
from softsim.mesh.surface import CellKind

LARGEST_GRID = 5_000_000
"""Largest number of cells that fits in a reasonable memory."""


def check_positive(**lengths: float) -> None:
    """Raise MeshError, naming the first of the lengths [m] that is not positive and finite."""
    for name, length in lengths.items():
        if not (math.isfinite(length) and length > 0):
            raise MeshError(f"{name} is {1e3 * length:g} mm; it must be positive")


def check_skin(inner_diameter: float, outer_diameter: float) -> None:
    """Raise MeshError unless the outer diameter [m] leaves a skin around the inner one."""
    if not outer_diameter > inner_diameter:
        raise MeshError(
            f"outer_diameter is {1e3 * outer_diameter:g} mm; "
            f"more than inner_diameter, {1e3 * inner_diameter:g} mm, is needed"
        )


def check_lean(lean: float) -> None:
    """Raise MeshError unless spikes lean [m] backward."""
    if not lean >= 0:
        raise MeshError(
            f"lean is {1e3 * lean:g} mm; it must be 0 mm or more (spikes lean backward)",
            hint="turn the body around for a robot that faces the other way",
        )


def check_counts(kind: CellKind, **counts: int | None) -> None:
    """Raise MeshError for a number of cells that is less than one or must not be given.

    Numbers of triangles and tetrahedra follow from element_size. The error names the first such
    number.
    """
    for name, count in counts.items():
        if count is None:
            continue
        if kind == "simplex":
            raise MeshError(
                f"{name} is {count}; for triangles and tetrahedra it follows from element_size",
                hint=f'leave {name} out, or write "cells: quad"',
            )
        check_at_least_one(**{name: count})


def check_at_least_one(**counts: int) -> None:
    """Raise MeshError, naming the first of the numbers that is less than one."""
    for name, count in counts.items():
        if count < 1:
            raise MeshError(f"{name} is {count}; it must be 1 or more")


def least_thickness(kind: CellKind, element_size: float, tip_thickness: float) -> float:
    """Return the least thickness [m] of a spike.

    Triangles keep their size, while quadrilaterals are as thin as the spike.
    """
    return {"simplex": element_size, "quad": min(element_size, tip_thickness / 2)}[kind]


def check_rows(
    what: str, count: int, pitch: float, root: float, element_size: float, **length: float
) -> None:
    """Raise MeshError unless rows of spikes, rings or limbs have an element between them.

    what: "spike", "ring" or "limb". root: length [m] of a row's root along the skin; pitch [m]:
    distance between the middles of the rows; length: of the skin, one, by the name of its
    parameter.
    """
    [(name, available)] = length.items()
    if count < 0:
        raise MeshError(f"the number of {what} rows is {count}; it must be 0 or more")
    if count > 1:
        check_pitch(what, pitch, root, element_size)
    needed = (count - 1) * pitch + root + 2 * element_size
    if count > 0 and available < needed:
        raise MeshError(
            f"{name} is {1e3 * available:.4g} mm; {count} rows of {what}s, "
            f"and an element at each end, need at least {1e3 * needed:.4g} mm",
            hint=f"increase {name}, or reduce {what}_pitch or the number of rows",
        )


def check_pitch(what: str, pitch: float, root: float, element_size: float) -> None:
    """Raise MeshError unless neighbours have an element between their roots.

    pitch: distance [m] of their middles.
    """
    if pitch < root + element_size:
        raise MeshError(
            f"{what}_pitch is {1e3 * pitch:.4g} mm and the {what}s overlap; a root and "
            f"an element between them need at least {1e3 * (root + element_size):.4g} mm"
        )


def check_cell_count(count: float, element_size: float) -> None:
    """Raise MeshError if the number of elements of this size [m] exceeds LARGEST_GRID."""
    if count > LARGEST_GRID:
        raise MeshError(
            f"element_size is {1e3 * element_size:g} mm and makes at least {count:.3g} elements; "
            f"at most {LARGEST_GRID:g} fit in a reasonable memory",
            hint="increase element_size",
        )
