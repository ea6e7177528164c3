"""Element types of ABAQUS: the supported ones, and replacements for the others."""

import re

CORNERS = {
    "CPE3": 3, "CPE4": 4, "CPE4R": 4, "CPE4I": 4,
    "CPS3": 3, "CPS4": 4, "CPS4R": 4, "CPS4I": 4,
    "CAX3": 3, "CAX4": 4, "CAX4R": 4, "CAX4I": 4,
    "C3D4": 4, "C3D5": 5, "C3D6": 6, "C3D8": 8, "C3D8R": 8, "C3D8I": 8,
}  # fmt: skip
"""Nodes of an element type; each may have an H (hybrid) behind it."""

FACES = {
    (2, 3): [[0, 1], [1, 2], [2, 0]],
    (2, 4): [[0, 1], [1, 2], [2, 3], [3, 0]],
    (3, 4): [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]],
    (3, 5): [[0, 1, 2, 3], [0, 4, 1], [1, 4, 2], [2, 4, 3], [3, 4, 0]],
    (3, 6): [[0, 1, 2], [3, 5, 4], [0, 3, 4, 1], [1, 4, 5, 2], [2, 5, 3, 0]],
    (3, 8): [
        *([0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1]),
        *([1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]),
    ],
}
"""Faces S1, S2 ... in the order of ABAQUS, by the numbers of dimensions and of corners."""

_LINEAR = {
    family: [name for name in CORNERS if name.startswith(family)]
    for family in ("CPE", "CPS", "CAX", "C3D")
}
_PLANE_SHAPES = {6: "second-order triangles", 8: "second-order quadrilaterals"}
_SOLID_SHAPES = {
    10: "second-order tetrahedra",
    15: "second-order wedges",
    20: "second-order hexahedra",
}
_CORNERS_OF_SECOND_ORDER = {"plane": {6: 3, 8: 4}, "C3D": {10: 4, 15: 6, 20: 8}}


def supported(written: str) -> str:
    """Return the type without its H, or "" if it is not supported.

    A hybrid element is computed as the type without H.
    """
    name = written.upper().removesuffix("H")
    return name if name in CORNERS else ""


def reduced(written: str) -> tuple[str, int]:
    """Return the linear type with the corners of a second-order type, C3D4 for C3D10M.

    Also return the number of nodes of the latter; ("", 0) for any other type.
    """
    kind, count = _parts(written)
    corners = _CORNERS_OF_SECOND_ORDER["C3D" if kind == "C3D" else "plane"].get(count)
    return (f"{kind}{corners}", count) if kind and corners else ("", 0)


def family(element_type: str) -> str:
    """Return the family of a type: CPE, CPS, CAX or C3D."""
    return element_type[:3]


def dimension(element_type: str) -> int:
    """Return the number of dimensions, 2 or 3, of a supported type's elements."""
    return 3 if family(element_type) == "C3D" else 2


def refusal(written: str) -> tuple[str, str]:
    """Return message and hint for an unsupported element type."""
    kind, count = _parts(written)
    shapes = _SOLID_SHAPES if kind == "C3D" else _PLANE_SHAPES
    shape = f", {shapes[count]}," if kind and count in shapes else ""
    message = f"elements of type {written.upper()}{shape} are not supported"
    if reduced(written)[0]:
        return message, (
            "write reduce_order: true next to the file name to drop their mid-side nodes, or "
            "mesh the part with linear elements: " + ", ".join(_LINEAR[kind])
        )
    if kind:
        return message, "mesh the part with linear elements: " + ", ".join(_LINEAR[kind])
    known = ", ".join(CORNERS)
    return message, f"a body consists of {known} (each also hybrid, H); remove all others"


def plane_stress_advice(element_type: str, formulation: str) -> str:
    """Return the advice which elements replace plane-stress ones in a body of this formulation."""
    rest = element_type.removeprefix("CPS")
    return {
        "plane_strain": f"for a thin section without strain in the depth direction use CPE{rest}",
        "ring_section": f"for the section of a ring_section use CPE{rest}; its sector is a key of "
        "the body",
        "axisymmetric": f"for the half section of a body of revolution use CAX{rest}",
        "solid": f"use a 3D mesh of C3D4 or C3D8R, or a section of CPE{rest} with formulation: "
        "plane_strain",
    }[formulation]


def _parts(written: str) -> tuple[str, int]:
    """Return family and number of nodes of a name such as C3D10M; ("", 0) for another name."""
    found = re.match(r"(CPE|CPS|CAX|C3D)(\d+)", written.upper())
    return (found[1], int(found[2])) if found else ("", 0)
