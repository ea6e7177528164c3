"""Element types of ABAQUS: which ones make a body here, and what to take for the others."""

import re

import numpy as np

CORNERS = {"CPE3": 3, "CPS3": 3, "CAX3": 3, "C3D4": 4}
"""Nodes of an element type; each may have an H (hybrid) behind it."""

FACES = {
    3: np.array([[0, 1], [1, 2], [2, 0]]),
    4: np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]),
}
"""Faces S1, S2 ... as ABAQUS counts them, by the number of corners."""

_LINEAR = {"CPE": "CPE3", "CPS": "CPS3", "CAX": "CAX3", "C3D": "C3D4"}
_PLANE_SHAPES = {
    4: "linear quadrilaterals",
    6: "second-order triangles",
    8: "second-order quadrilaterals",
}
_SOLID_SHAPES = {
    5: "linear pyramids",
    6: "linear wedges",
    8: "linear hexahedra",
    10: "second-order tetrahedra",
    15: "second-order wedges",
    20: "second-order hexahedra",
}


def formulation(written: str) -> str:
    """The type without its H: what a hybrid element computes is the same. "" if not known."""
    name = written.upper().removesuffix("H")
    return name if name in CORNERS else ""


def refusal(written: str) -> tuple[str, str]:
    """Message and hint for an element type that makes no body here."""
    family, count = _parts(written)
    shapes = _SOLID_SHAPES if family == "C3D" else _PLANE_SHAPES
    shape = f", {shapes[count]}," if family and count in shapes else ""
    message = f"elements of type {written.upper()}{shape} are not supported"
    if family:
        right = _LINEAR[family]
        kind = "tetrahedra" if family == "C3D" else "triangles"
        return message, f"mesh the part with linear {kind}: {right} or {right}H"
    known = ", ".join(CORNERS)
    return message, f"a body is made of {known} (each also hybrid, H); leave all others out"


def _parts(written: str) -> tuple[str, int]:
    """Family and number of nodes in a name such as C3D10M; ("", 0) for another name."""
    found = re.match(r"(CPE|CPS|CAX|C3D)(\d+)", written.upper())
    return (found[1], int(found[2])) if found else ("", 0)
