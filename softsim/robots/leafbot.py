"""Leafbot: the section of its backbone with rows of limbs, along its length."""

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.mesh import Mesh, mirrored, renumbered, transformed
from softsim.mesh.quality import check
from softsim.mesh.surface import CellKind
from softsim.robots.limits import (
    check_counts,
    check_positive,
    check_rows,
    least_thickness,
)
from softsim.robots.spike import check_thickness, spike
from softsim.robots.spiked_strip import fineness_of, spiked_strip, whole


def leafbot_section(
    length: float = 64e-3,
    thickness: float = 2e-3,
    rows: int = 5,
    limb_pitch: float = 14e-3,
    limb_height: float = 5e-3,
    root_thickness: float = 4e-3,
    tip_thickness: float = 1e-3,
    lean: float = 2.5e-3,
    front_radius: float = 5e-3,
    rear_radius: float = 3.5e-3,
    rows_under_head: int = 2,
    element_size: float = 1e-3,
    cells: CellKind = "quad",
    backbone_rows: int | None = None,
    limb_columns: int | None = None,
) -> Mesh:
    """Return a backbone on rows of limbs whose tips stand on y = 0; x is forward, 0 its middle.

    The limbs are the PufferFace Robot's spikes (`spike.spike`), tips `lean` behind their roots:
    pressed down they push the robot forward. Of equal root and tip thickness, and large radii, they
    are straight bars. All lengths in m; element_size as for `pfr.pfr_section`. backbone_rows: of
    quadrilaterals through the backbone. limb_columns: across a limb.

    Node sets: top; head (of the top, over the first `rows_under_head` rows, from root to root);
    limb1, limb2 ... (below the backbone, from the front); tips. Facet set: top. Cell sets:
    backbone, limbs.

    The thesis gives no thickness of a limb's root. One of 4 mm, 4 mm deep (two limbs of 2 mm), of
    Dragon Skin 30, is as stiff as its limb against a plate, see scenes/leafbot_press.yaml.

    Raises MeshError, naming the parameter and its limit, for dimensions that make no such body.
    """
    check_positive(
        length=length,
        thickness=thickness,
        limb_pitch=limb_pitch,
        limb_height=limb_height,
        root_thickness=root_thickness,
        tip_thickness=tip_thickness,
        front_radius=front_radius,
        rear_radius=rear_radius,
        element_size=element_size,
    )
    check_counts(cells, backbone_rows=backbone_rows, limb_columns=limb_columns)
    if not 1 <= rows_under_head <= rows:
        raise MeshError(f"rows_under_head is {rows_under_head}; it may be 1 to {rows}, all rows")
    check_rows("limb", rows, limb_pitch, root_thickness, element_size, length=length)
    shape = spike(limb_height, root_thickness, tip_thickness, lean, front_radius, rear_radius)
    check_thickness("limb", shape, limb_height, least_thickness(cells, element_size, tip_thickness))

    centers = (np.arange(rows) - (rows - 1) / 2) * limb_pitch
    across = limb_columns or whole((root_thickness + tip_thickness) / 2 / element_size)
    fineness = fineness_of(cells, thickness, element_size, backbone_rows, across)
    strip = spiked_strip(length, thickness, centers, root_thickness, shape, fineness)
    under_head = centers[[-rows_under_head, -1]] + root_thickness / 2 * np.array([-1.0, 1.0])
    section = renumbered(_on_its_limbs(strip, thickness + limb_height, under_head))
    check(section)
    return section


def _on_its_limbs(strip: Mesh, height: float, under_head: np.ndarray) -> Mesh:
    """Return a strip with its spikes upwards turned over about its axis, standing on y = 0.

    under_head: interval along x in which the head stands on top (2,) [m].
    """
    section = transformed(mirrored(strip, 1), 0.0, np.array([0.0, height]))
    nodes, cells = section.node_sets, section.cell_sets
    top = nodes["chamber"]
    slack = 1e-9 * height * np.array([-1.0, 1.0])
    rear, front = np.searchsorted(section.points[top, 0], under_head + slack)
    limbs = {name: s for name, s in nodes.items() if name.startswith("j")}
    return Mesh(
        points=section.points,
        cells=section.cells,
        node_sets={
            "top": top,
            "head": top[rear:front],
            "tips": nodes["tips"],
            **{f"limb{name[1:]}": limb for name, limb in limbs.items()},
        },
        facet_sets={"top": section.facet_sets["chamber"]},
        cell_sets={"backbone": cells["skin"], "limbs": cells["spikes"]},
    )
