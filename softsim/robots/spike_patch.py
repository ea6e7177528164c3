"""A patch of the PufferFace Robot's sleeve, laid flat: rows and columns of spikes on a skin."""

import math

import numpy as np

from softsim.mesh.band import CellKind
from softsim.mesh.mesh import Mesh, renumbered
from softsim.mesh.quality import check
from softsim.robots.limits import (
    check_at_least_one,
    check_counts,
    check_lean,
    check_pitch,
    check_positive,
    check_thickness,
    least_thickness,
)
from softsim.robots.spike import spike
from softsim.robots.swept import layers_across, section, swept


def spike_patch(
    rows: int,
    columns: int,
    spike_pitch: float,
    column_pitch: float,
    skin_thickness: float,
    spike_height: float,
    front_radius: float,
    rear_radius: float,
    root_thickness: float,
    tip_thickness: float,
    lean: float,
    spike_width: float,
    element_size: float,
    cells: CellKind = "quad",
    skin_rows: int | None = None,
    spike_columns: int | None = None,
    spike_layers: int | None = None,
) -> Mesh:
    """Return a flat skin on y = 0 with `rows` spikes along x in each of `columns` columns along z.

    Spikes point up, +y, and lean backward: their tips lie `lean` behind their roots (-x). Each has
    its own piece of skin, spike_pitch long and column_pitch wide; the patch's middle is x = z = 0.
    Their section is that of `pfr_solid`, and so are element_size and the numbers of cells. All
    lengths in m.

    Node sets: underside (y = 0), outer (the skin's upper side, the roots included), front, rear
    (ends across x), j1, j2 ... (spikes above the skin, row by row from the front), tips. Facet
    sets: underside, outer (the skin's upper side between the spikes), spikes (their free sides).
    Cell sets: skin, spikes.

    Raises MeshError, naming the parameter and its limit, for dimensions that make no such body.
    """
    check_positive(
        spike_pitch=spike_pitch,
        column_pitch=column_pitch,
        skin_thickness=skin_thickness,
        spike_height=spike_height,
        front_radius=front_radius,
        rear_radius=rear_radius,
        root_thickness=root_thickness,
        tip_thickness=tip_thickness,
        spike_width=spike_width,
        element_size=element_size,
    )
    check_at_least_one(rows=rows, columns=columns)
    check_counts(cells, skin_rows=skin_rows, spike_columns=spike_columns, spike_layers=spike_layers)
    check_lean(lean)
    check_pitch("spike", spike_pitch, root_thickness, element_size)
    check_pitch("column", column_pitch, spike_width, element_size)
    shape = spike(spike_height, root_thickness, tip_thickness, lean, front_radius, rear_radius)
    check_thickness(
        "spike", shape, spike_height, least_thickness(cells, element_size, tip_thickness)
    )

    centers = (np.arange(rows) - (rows - 1) / 2) * spike_pitch
    strip = section(
        rows * spike_pitch, skin_thickness, centers, root_thickness, tip_thickness, shape,
        element_size, cells, skin_rows, spike_columns,
    )  # fmt: skip
    layers = spike_layers or layers_across(spike_width, element_size)
    # Of the layers between two spikes half belong to the column of each.
    beside = math.ceil(layers_across(column_pitch - spike_width, element_size) / 2)
    edges = np.array([-column_pitch, -spike_width, spike_width, column_pitch]) / 2
    counts = np.array([beside, layers, beside])
    column = np.interp(np.arange(counts.sum()), np.cumsum([0, *counts]), edges)
    middles = (np.arange(columns) - (columns - 1) / 2) * column_pitch
    z = np.append(middles[:, None] + column, columns * column_pitch / 2)
    places = np.dstack([*np.broadcast_arrays(*strip.points.T[:, None], z[:, None])])
    stations = np.arange(places.size // 3).reshape(places.shape[:2])
    spiked = np.tile(np.repeat([False, True, False], counts), columns)
    body = renumbered(swept(strip, places, stations, spiked.tolist(), cells, inside="underside"))
    check(body)
    return body
