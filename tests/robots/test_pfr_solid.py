import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from softsim.errors import MeshError
from softsim.mesh.mesh import signed_volumes
from softsim.mesh.quality import check, quality
from softsim.robots.pfr import pfr_section, pfr_solid

DEFAULT = pfr_solid()
TUBE = pfr_solid(rows=0)


def radii(mesh, nodes) -> np.ndarray:
    return np.hypot(*mesh.points[nodes, 1:].T)


def areas(mesh, name) -> np.ndarray:
    """Outward normals (k, 3) [m^2] of a facet set, as long as the facets are large."""
    corners = mesh.points[mesh.facet_sets[name]]
    return np.cross(corners[:, -2] - corners[:, 0], corners[:, -1] - corners[:, 1]) / 2


def directions(mesh) -> np.ndarray:
    """Angles [rad] of the columns of nodes around the chamber."""
    y, z = mesh.points[mesh.node_sets["chamber"], 1:].T
    return np.unique(np.round(np.arctan2(z, y) % (2 * np.pi), 9) % round(2 * np.pi, 9))


def polygon(mesh) -> tuple[float, float]:
    """Area and perimeter over radius squared and radius of the polygon of those columns."""
    around = directions(mesh)
    steps = np.diff([*around, around[0] + 2 * np.pi])
    return float(np.sin(steps).sum() / 2), float(2 * np.sin(steps / 2).sum())


def test_the_tube_is_an_exact_prism_of_its_polygon():
    factor, _ = polygon(TUBE)
    assert factor == pytest.approx(np.pi, rel=4e-3)
    exact = factor * (8.5e-3**2 - 7.5e-3**2) * 30e-3
    assert quality(TUBE).volume == pytest.approx(exact, rel=1e-8)


@pytest.mark.physics
def test_the_tube_tends_to_the_round_one_with_second_order():
    exact = np.pi * (8.5e-3**2 - 7.5e-3**2) * 30e-3
    errors = [
        abs(quality(pfr_solid(rows=0, element_size=size)).volume / exact - 1)
        for size in (0.7e-3, 0.35e-3)
    ]
    assert errors[0] < 4e-3
    assert errors[1] < errors[0] / 3


@pytest.mark.parametrize(("name", "radius"), [("chamber", 7.5e-3), ("outer", 8.5e-3)])
def test_sides_of_the_tube(name, radius):
    _, perimeter = polygon(TUBE)
    total = np.linalg.norm(areas(TUBE, name), axis=1).sum()
    assert total == pytest.approx(perimeter * radius * 30e-3, rel=1e-8)
    np.testing.assert_allclose(radii(TUBE, TUBE.node_sets[name]), radius)


def test_the_tube_has_no_boundary_but_its_sides_and_ends():
    factor, perimeter = polygon(TUBE)
    total = np.linalg.norm(areas(TUBE, "surface"), axis=1).sum()
    ends = 2 * factor * (8.5e-3**2 - 7.5e-3**2)
    assert total == pytest.approx(perimeter * 16e-3 * 30e-3 + ends, rel=1e-8)


@pytest.mark.parametrize("mesh", [DEFAULT, TUBE], ids=["spiked", "tube"])
def test_the_surface_is_closed(mesh):
    facets = mesh.facet_sets["surface"]
    edges = np.concatenate([facets[:, [i, (i + 1) % 3]] for i in range(3)])
    forward, count = np.unique(edges, axis=0, return_counts=True)
    assert (count == 1).all()
    np.testing.assert_array_equal(forward, np.unique(edges[:, ::-1], axis=0))
    np.testing.assert_allclose(areas(mesh, "surface").sum(axis=0), 0, atol=1e-15)


def test_size_and_shape_of_the_default():
    measured = quality(DEFAULT)
    assert 30_000 < measured.cell_count < 60_000
    assert measured.smallest_altitude > 0.3e-3
    assert measured.worst_aspect_ratio < 4


def test_outer_dimensions():
    assert (DEFAULT.points[:, 0].min(), DEFAULT.points[:, 0].max()) == pytest.approx(
        (-15e-3, 15e-3)
    )
    everything = np.arange(len(DEFAULT.points))
    assert radii(DEFAULT, everything).min() == pytest.approx(7.5e-3)
    assert radii(DEFAULT, everything).max() == pytest.approx(13.5e-3)


def test_the_first_spikes_keep_their_width_and_the_section_of_the_plane_model():
    spikes = DEFAULT.cells[DEFAULT.cell_sets["spikes"]]
    x, y, z = DEFAULT.points[spikes].mean(axis=1).T
    upper = spikes[(y > 8e-3) & (np.abs(z) < 1e-3) & (np.abs(x) < 3e-3)]
    np.testing.assert_allclose(np.abs(DEFAULT.points[upper, 2]).max(), 1e-3)
    section = pfr_section(element_size=0.1e-3)
    both = signed_volumes(section.points, section.cells[section.cell_sets["spikes"]]).sum()
    volume = signed_volumes(DEFAULT.points, upper).sum()
    assert volume == pytest.approx(both / 10 * 2e-3, rel=0.02)
    flank = np.unique(upper)[np.isclose(DEFAULT.points[np.unique(upper), 2], 1e-3)]
    assert len(flank) > 20


@pytest.mark.parametrize(("rows", "columns", "layers"), [(1, 2, 2), (1, 2, 3), (2, 4, 1)])
def test_hexahedra_through_the_skin_and_across_a_spike_are_given(rows, columns, layers):
    mesh = pfr_solid(
        cells="quad",
        element_size=1.25e-3,
        skin_rows=rows,
        spike_columns=columns,
        spike_layers=layers,
    )
    assert mesh.cells.shape[1] == 8
    for sets in ("node_sets", "facet_sets", "cell_sets"):
        assert getattr(mesh, sets).keys() == getattr(DEFAULT, sets).keys()
    around = len(mesh.node_sets["equator_inner"])
    assert len(mesh.node_sets["knot_front"]) == around * (rows + 1)
    assert around % 14 == 0
    assert len(mesh.node_sets["tips"]) == 70 * (columns + 1) * (layers + 1)
    spikes = mesh.cells[mesh.cell_sets["spikes"]]
    wedges = (spikes[:, 2] == spikes[:, 3]) & (spikes[:, 6] == spikes[:, 7])
    assert wedges.sum() == 70 * columns * layers
    cap = 70 * layers * columns * (columns + 1) // 2
    assert (len(spikes) - cap) % (70 * columns * layers) == 0
    volume = signed_volumes(mesh.points, spikes).sum()
    fine = pfr_section(element_size=0.1e-3)
    both = signed_volumes(fine.points, fine.cells[fine.cell_sets["spikes"]]).sum()
    # A spike's root lies on the polygon of the skin, whose chords run below the circle.
    assert volume == pytest.approx(7 * both * 2e-3, rel=0.05)
    names = ("chamber", "outer", "spikes", "surface")
    counts = {name: len(mesh.facet_sets[name]) for name in names}
    ends = 2 * around * rows
    assert counts["chamber"] + counts["outer"] + counts["spikes"] + ends == counts["surface"]
    np.testing.assert_allclose(areas(mesh, "surface").sum(axis=0), 0, atol=1e-15)
    factor, _ = polygon(mesh)
    # The chamber with flat ends encloses the prism of its polygon.
    centres = mesh.points[mesh.facet_sets["chamber"]].mean(axis=1)
    flux = -(areas(mesh, "chamber") * centres)[:, 1:].sum() / 2
    assert flux == pytest.approx(factor * 7.5e-3**2 * 30e-3, rel=1e-6)


def test_without_nodes_in_the_middle_there_is_no_equator():
    mesh = pfr_solid(cells="quad", element_size=1.25e-3, spike_columns=1, spike_layers=1)
    assert {name for name in DEFAULT.node_sets if name not in mesh.node_sets} == {
        "equator_inner", "equator_outer",
    }  # fmt: skip
    spikes = mesh.cells[mesh.cell_sets["spikes"]]
    assert (spikes[:, 2] == spikes[:, 3]).sum() == 70


def test_all_spikes_are_alike():
    volumes = signed_volumes(DEFAULT.points, DEFAULT.cells)
    spikes = DEFAULT.cell_sets["spikes"]
    assert len(spikes) % (5 * 14) == 0
    _, y, z = DEFAULT.points[DEFAULT.cells[spikes]].mean(axis=1).T
    which = np.round(np.arctan2(z, y) / (2 * np.pi / 14)).astype(int) % 14
    np.testing.assert_allclose(np.bincount(which, volumes[spikes]), volumes[spikes].sum() / 14)


def test_a_spike_mirrors_itself():
    # Two cells across, and diagonals to and fro: no direction around is favoured.
    middle = DEFAULT.points[DEFAULT.cells].mean(axis=1)
    near = middle[(middle[:, 1] > 0) & (np.abs(middle[:, 2]) < 1.5e-3)] * 1e3
    mirrored = near * [1, 1, -1]
    for a in (near, mirrored):
        a[:] = a[np.lexsort(np.round(a, 6).T)]
    np.testing.assert_allclose(near, mirrored, atol=1e-9)


def test_knots_are_the_end_faces():
    for name, x in (("knot_front", 15e-3), ("knot_rear", -15e-3)):
        ends = np.flatnonzero(np.isclose(DEFAULT.points[:, 0], x) & (_skin(DEFAULT)))
        np.testing.assert_array_equal(np.sort(DEFAULT.node_sets[name]), ends)
    both = {*DEFAULT.node_sets["knot_front"], *DEFAULT.node_sets["knot_rear"]}
    assert set(DEFAULT.node_sets["knots"]) == both


def _skin(mesh) -> np.ndarray:
    return np.isin(np.arange(len(mesh.points)), mesh.cells[mesh.cell_sets["skin"]])


def test_chamber_faces_the_axis():
    nodes = DEFAULT.node_sets["chamber"]
    np.testing.assert_allclose(radii(DEFAULT, nodes), 7.5e-3)
    np.testing.assert_array_equal(np.unique(DEFAULT.facet_sets["chamber"]), np.sort(nodes))
    centers = DEFAULT.points[DEFAULT.facet_sets["chamber"]].mean(axis=1)
    assert ((areas(DEFAULT, "chamber") * centers)[:, 1:].sum(axis=1) < 0).all()


def test_outer_and_spikes_and_chamber_and_ends_are_the_surface():
    names = ("chamber", "outer", "spikes")
    ends = np.isin(DEFAULT.facet_sets["surface"], DEFAULT.node_sets["knot_front"]).all(axis=1) | (
        np.isin(DEFAULT.facet_sets["surface"], DEFAULT.node_sets["knot_rear"]).all(axis=1)
    )
    parts = [DEFAULT.facet_sets[name] for name in names] + [DEFAULT.facet_sets["surface"][ends]]
    together = np.sort(np.concatenate(parts), axis=1)
    assert len(np.unique(together, axis=0)) == len(together)
    assert len(together) == len(DEFAULT.facet_sets["surface"])
    _, perimeter = polygon(DEFAULT)
    roots = 5 * 14 * 3e-3 * 2e-3
    outer = np.linalg.norm(areas(DEFAULT, "outer"), axis=1).sum()
    assert outer == pytest.approx(perimeter * 8.5e-3 * 30e-3 - roots, rel=2e-3)
    centers = DEFAULT.points[DEFAULT.facet_sets["outer"]].mean(axis=1)
    assert ((areas(DEFAULT, "outer") * centers)[:, 1:].sum(axis=1) > 0).all()


def test_rows_count_from_the_front_and_leave_out_their_roots():
    for row, center in enumerate((12e-3, 6e-3, 0, -6e-3, -12e-3), start=1):
        nodes = DEFAULT.node_sets[f"j{row}"]
        assert radii(DEFAULT, nodes).min() > 8.5e-3 + 0.1e-3
        x = DEFAULT.points[nodes, 0]
        assert x.min() == pytest.approx(center - 3e-3)
        assert center + 1.4e-3 < x.max() < center + 1.51e-3
        assert len(nodes) % 14 == 0
    assert "j6" not in DEFAULT.node_sets


def test_tips_are_the_outer_ends():
    tips = DEFAULT.node_sets["tips"]
    assert len(tips) == 5 * 14 * 3 * 2
    np.testing.assert_allclose(radii(DEFAULT, tips), 13.5e-3)


def test_equator_lies_between_the_spikes():
    inner, outer = (DEFAULT.node_sets[f"equator_{side}"] for side in ("inner", "outer"))
    np.testing.assert_allclose(DEFAULT.points[[*inner, *outer], 0], 0, atol=1e-15)
    np.testing.assert_allclose(radii(DEFAULT, inner), 7.5e-3)
    np.testing.assert_allclose(radii(DEFAULT, outer), 8.5e-3)
    assert len(inner) == len(directions(DEFAULT))
    y, z = DEFAULT.points[outer, 1:].T
    gaps = np.sort(np.arctan2(z, y) % (2 * np.pi)) / (2 * np.pi / 14)
    np.testing.assert_allclose(gaps, np.arange(14) + 0.5)
    assert len(TUBE.node_sets["equator_outer"]) == len(directions(TUBE))


def test_a_plain_tube_has_no_spike_sets():
    assert {"j1", "tips"}.isdisjoint(TUBE.node_sets)
    assert "spikes" not in TUBE.facet_sets
    assert "spikes" not in TUBE.cell_sets


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"inner_diameter": -1e-3}, "inner_diameter is -1 mm; it must be positive"),
        ({"spike_width": 0.0}, "spike_width is 0 mm; it must be positive"),
        ({"element_size": float("nan")}, "element_size is nan mm"),
        ({"outer_diameter": 15e-3}, "outer_diameter is 15 mm; more than inner_diameter, 15 mm"),
        ({"lean": -1e-3}, "lean is -1 mm"),
        ({"rows": -1}, "the number of spike rows is -1"),
        ({"spikes_around": 0}, "spikes_around is 0; it must be 1 or more"),
        (
            {"spikes_around": 20},
            "spike_width is 2 mm and the spikes overlap; 20 around.* leave 1.966 mm",
        ),
        ({"spikes_around": 100}, "spike_width is 2 mm and the spikes overlap; .* leave 0 mm"),
        ({"spike_width": 0.5e-3}, "spike_width is 0.5 mm; at least element_size, 0.7 mm"),
        ({"spike_pitch": 3.5e-3}, "spike_pitch is 3.5 mm and the spikes overlap; .* 3.7 mm"),
        ({"rows": 6}, "free_length is 30 mm; 6 rows of spikes, .* at least 34.4 mm"),
        ({"front_radius": 3e-3}, "front_radius is 3 mm; .* at least 3.725 mm"),
        ({"tip_thickness": 0.2e-3}, "the spike is 0.2 mm thick 5 mm from its root"),
    ],
)
def test_parameters_out_of_range_are_named_with_their_limit(change, said):
    with pytest.raises(MeshError, match=said):
        pfr_solid(**change)


@settings(deadline=None, max_examples=15)
@given(
    skin=st.floats(0.6e-3, 2e-3),
    rows=st.integers(0, 2),
    spikes_around=st.integers(1, 14),
    spike_height=st.floats(3e-3, 7e-3),
    root_thickness=st.floats(2e-3, 4e-3),
    tip_thickness=st.floats(0.9e-3, 2e-3),
    lean=st.floats(0, 3e-3),
    spike_width=st.floats(1e-3, 2.5e-3),
    element_size=st.floats(0.6e-3, 0.9e-3),
)
@pytest.mark.physics
def test_any_sensible_body_has_sound_cells(skin, rows, **dimensions):
    try:
        mesh = pfr_solid(
            outer_diameter=15e-3 + 2 * skin,
            rows=rows,
            free_length=(rows + 1) * 6e-3,
            **dimensions,
        )
    except MeshError as refused:
        assert "_radius is" in refused.message or "the spike" in refused.message
        assume(False)
    check(mesh)
    assert quality(mesh).worst_aspect_ratio < 10


@pytest.mark.parametrize("cells", ["simplex", "quad"])
@pytest.mark.parametrize("size", [1e-12, 1e-7, 1e-6])
def test_more_elements_than_memory_holds_are_refused_before_they_are_made(cells, size):
    with pytest.raises(MeshError, match="fit in a reasonable memory"):
        pfr_solid(element_size=size, cells=cells)
