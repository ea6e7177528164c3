"""Leafbot: a backbone on rows of limbs, as the section along its length and in space."""

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.mesh import Mesh, mirrored, renumbered, transformed
from softsim.mesh.quality import check
from softsim.mesh.surface import CellKind
from softsim.robots.limits import (
    check_at_least_one,
    check_counts,
    check_lean,
    check_positive,
    check_rows,
    least_thickness,
)
from softsim.robots.spikes import (
    check_thickness,
    even,
    fineness_of,
    layers_across,
    section,
    spike,
    spiked_strip,
    swept,
    whole,
)

# -------------------------------------------------------------------------------------------------
# Section along its length.


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

    The limbs are the PufferFace Robot's spikes (`spikes.spike`), tips `lean` behind their roots:
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


# -------------------------------------------------------------------------------------------------
# Leafbot in space, widened for two motors side by side: its section swept across its width.

LAYER_STRETCH = 3.5
"""Length of the cells between the limbs along z over that in the section.

Only the backbone is there, which bends little across.
"""

SIDES = {"left": -1.0, "right": 1.0}
"""Sign of z of each side; the robot moves along +x, and +y is up."""


def leafbot_solid(
    length: float,
    width: float,
    thickness: float,
    rows: int,
    limb_pitch: float,
    limb_height: float,
    limb_width: float,
    limb_distance: float,
    side_distance: float,
    front_radius: float,
    rear_radius: float,
    root_thickness: float,
    tip_thickness: float,
    lean: float,
    head_row: int,
    rows_under_head: int,
    element_size: float,
    cells: CellKind = "quad",
    backbone_rows: int | None = None,
    limb_columns: int | None = None,
    limb_layers: int | None = None,
) -> Mesh:
    """Return a backbone on rows of limbs whose tips stand on y = 0, with a head on each side.

    x is forward, z points to the right, and the middle of both is x = z = 0. The body has a left
    and a right side.

    Along x it has the section of `leafbot_section`. The middles of the sides are
    side_distance apart; each row has two limbs a side, limb_width wide, whose middles are
    limb_distance apart. The heads stand on top, over rows_under_head rows of the limbs of their
    side from row head_row on, counted from the front, from the first root to the last and from limb
    to limb. All lengths in m; element_size as for `pfr.pfr_solid`.

    backbone_rows: number of hexahedra through the backbone. limb_columns: number across a limb
    along x. limb_layers: number across its width.

    Node sets: top, head_left, head_right, heads, limb1_left, limb1_right, limb2_left ... (limbs
    below the backbone, from the front), tips. Facet sets: top, limbs. Cell sets: backbone, limbs.

    Raises MeshError, naming the parameter and its limit, for dimensions that make no such body.
    """
    check_positive(
        length=length,
        width=width,
        thickness=thickness,
        limb_pitch=limb_pitch,
        limb_height=limb_height,
        limb_width=limb_width,
        limb_distance=limb_distance,
        side_distance=side_distance,
        front_radius=front_radius,
        rear_radius=rear_radius,
        root_thickness=root_thickness,
        tip_thickness=tip_thickness,
        element_size=element_size,
    )
    check_at_least_one(rows=rows, head_row=head_row, rows_under_head=rows_under_head)
    check_counts(
        cells, backbone_rows=backbone_rows, limb_columns=limb_columns, limb_layers=limb_layers
    )
    check_lean(lean)
    last_row = head_row + rows_under_head - 1
    if last_row > rows:
        raise MeshError(
            f"the heads stand on rows {head_row} to {last_row}; there are {rows}",
            hint="reduce head_row or rows_under_head, or increase rows",
        )
    check_rows("limb", rows, limb_pitch, root_thickness, element_size, length=length)
    _check_across(width, limb_width, limb_distance, side_distance)
    shape = spike(limb_height, root_thickness, tip_thickness, lean, front_radius, rear_radius)
    check_thickness("limb", shape, limb_height, least_thickness(cells, element_size, tip_thickness))

    centers = (np.arange(rows) - (rows - 1) / 2) * limb_pitch
    strip = section(
        length, thickness, centers, root_thickness, tip_thickness, shape, element_size, cells,
        backbone_rows, limb_columns,
    )  # fmt: skip
    middles = np.array([-limb_distance, limb_distance]) / 2
    limbs = np.concatenate([middles - side_distance / 2, middles + side_distance / 2])
    layers = limb_layers or layers_across(limb_width, element_size)
    z, limbed = _across(limbs, limb_width, width, layers, element_size * LAYER_STRETCH)
    places = np.dstack([*np.broadcast_arrays(*strip.points.T[:, None], z[:, None])])
    stations = np.arange(places.size // 3).reshape(places.shape[:2])
    upside_down = swept(strip, places, stations, limbed, cells, inside="top")
    shift = np.array([0.0, thickness + limb_height, 0.0])
    standing = transformed(mirrored(upside_down, 1), 0.0, shift)

    under_head = centers[::-1][head_row - 1 : last_row]
    reach = np.array([
        [under_head.min() - root_thickness / 2, (side_distance - limb_distance - limb_width) / 2],
        [under_head.max() + root_thickness / 2, (side_distance + limb_distance + limb_width) / 2],
    ])  # fmt: skip
    body = renumbered(_with_sides(standing, reach))
    check(body)
    return body


def _check_across(
    width: float, limb_width: float, limb_distance: float, side_distance: float
) -> None:
    """Raise MeshError unless the limbs of a row fit beside each other below the backbone."""
    if limb_distance <= limb_width:
        raise MeshError(
            f"limb_distance is {1e3 * limb_distance:.4g} mm and the limbs of a side overlap; "
            f"more than limb_width, {1e3 * limb_width:.4g} mm, is needed"
        )
    pair = limb_distance + limb_width
    if side_distance <= pair:
        raise MeshError(
            f"side_distance is {1e3 * side_distance:.4g} mm and the limbs of both sides overlap; "
            f"more than {1e3 * pair:.4g} mm is needed",
            hint="a pair of limbs is as wide as limb_distance plus limb_width",
        )
    needed = side_distance + pair
    if width < needed * (1 - 1e-9):
        raise MeshError(
            f"width is {1e3 * width:.4g} mm; side_distance, limb_distance and limb_width "
            f"need at least {1e3 * needed:.4g} mm"
        )


def _across(
    limbs: np.ndarray, limb_width: float, width: float, layers: int, longest: float
) -> tuple[np.ndarray, list[bool]]:
    """Return the ends of the layers along z [m], and a flag for each that is True if limbs fill it.

    limbs: middles of the limbs along z, ascending. layers: number across each. longest: approximate
    length of the other layers; their number is even between two limbs, so that there are nodes in
    the middle.
    """
    flanks = (limbs[:, None] + np.array([-limb_width, limb_width]) / 2).ravel()
    edges = np.concatenate([[-width / 2], flanks, [width / 2]])
    pieces = np.diff(edges)
    counts = np.array([even(piece / longest) for piece in pieces])
    counts[1::2] = layers
    # The outermost limbs may stand at the edges of the backbone.
    counts[[0, -1]] = np.where(pieces[[0, -1]] > 1e-9 * width, counts[[0, -1]], 0)
    limbed = np.repeat(np.arange(len(pieces)) % 2 == 1, counts)
    ends = np.cumsum([0, *counts])
    inner = slice(1 if counts[0] == 0 else 0, len(ends) - (1 if counts[-1] == 0 else 0))
    z = np.interp(np.arange(ends[-1] + 1), ends[inner], edges[inner])
    return z, limbed.tolist()


def _with_sides(body: Mesh, reach: np.ndarray) -> Mesh:
    """Return a swept strip, standing on its limbs, with the sets of Leafbot.

    reach: interval in which the head of the right side stands on top, (2,) along x, along z [m].
    """
    x, _, z = body.points.T
    sets = body.node_sets
    top = sets["top"]
    slack = 1e-9 * np.ptp(x)
    low, high = reach[0] - slack, reach[1] + slack
    on_head = (x[top] > low[0]) & (x[top] < high[0])
    heads = {
        f"head_{side}": top[on_head & (sign * z[top] > low[1]) & (sign * z[top] < high[1])]
        for side, sign in SIDES.items()
    }
    rows = [name for name in sets if name.startswith("j")]
    limbs = {
        f"limb{name[1:]}_{side}": sets[name][sign * z[sets[name]] > 0.0]
        for name in rows
        for side, sign in SIDES.items()
    }
    return Mesh(
        points=body.points,
        cells=body.cells,
        node_sets={
            "top": top,
            **heads,
            "heads": np.concatenate(list(heads.values())),
            **limbs,
            "tips": sets["tips"],
        },
        facet_sets={"top": body.facet_sets["top"], "limbs": body.facet_sets["spikes"]},
        cell_sets={"backbone": body.cell_sets["skin"], "limbs": body.cell_sets["spikes"]},
    )
