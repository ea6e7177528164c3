"""Closed surfaces from STL files."""

import logging

import meshio
import numpy as np
import pytest

from softsim.errors import MeshError
from softsim.mesh.surface import read_surface, signed_volume

CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) * [4.0, 2.0, 3.0]
FACES = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)
BOX = np.concatenate([FACES[:, [0, 1, 2]], FACES[:, [0, 2, 3]]])


@pytest.fixture
def stl(tmp_path):
    """Write triangles of the box's corners as an STL and return its path."""

    def write(triangles, binary=True, points=CORNERS):
        path = tmp_path / "box.stl"
        mesh = meshio.Mesh(points, [("triangle", np.asarray(triangles))])
        meshio.write(path, mesh, file_format="stl", binary=binary)
        return path

    return write


@pytest.mark.parametrize("binary", [True, False])
def test_a_closed_surface_in_its_unit(stl, binary):
    mesh = read_surface(stl(BOX, binary), 1e-3)
    assert mesh.points.shape == (8, 3) and mesh.triangles.shape == (12, 3)
    np.testing.assert_allclose(mesh.points.max(axis=0), [4e-3, 2e-3, 3e-3])
    assert signed_volume(mesh.points, mesh.triangles) == pytest.approx(24e-9)


def test_one_that_is_inside_out_is_turned(stl):
    mesh = read_surface(stl(BOX[:, ::-1]), 1.0)
    assert signed_volume(mesh.points, mesh.triangles) == pytest.approx(24.0)


def test_minus_zero_is_zero(stl):
    points = np.repeat(CORNERS[BOX].reshape(-1, 3), 1, axis=0)
    points[::2][points[::2] == 0.0] = -0.0
    mesh = read_surface(stl(np.arange(36).reshape(-1, 3), points=points), 1.0)
    assert mesh.points.shape == (8, 3)


def test_an_open_one_says_how_many_edges_and_where(stl):
    """Without one triangle three edges have one left, without two that meet four."""
    with pytest.raises(MeshError, match="open: 3 edges do not have") as refused:
        read_surface(stl(BOX[1:]), 1.0)
    lost = {tuple(c) for c in CORNERS[BOX[0]]}
    assert "box.stl" in str(refused.value)
    named = [f"({', '.join(f'{c:g}' for c in corner)})" for corner in lost]
    assert sum(place in refused.value.message for place in named) == 2
    with pytest.raises(MeshError, match=r"open: 4 edges .* has 1"):
        read_surface(stl(np.delete(BOX, [0, 6], axis=0)), 1.0)


def test_a_third_triangle_at_an_edge_is_no_closed_surface(stl):
    fin = [[0, 1, 7], [1, 0, 7]]
    with pytest.raises(MeshError, match=r"open: 2 edges .* has 4"):
        read_surface(stl(np.concatenate([BOX, fin])), 1.0)


def test_two_orientations_are_refused(stl):
    mixed = BOX.copy()
    mixed[5] = mixed[5, ::-1]
    with pytest.raises(MeshError, match="opposite orientation at 3 edges; the first one is from"):
        read_surface(stl(mixed), 1.0)


def test_collapsed_triangles_are_left_out_and_said(stl, caplog):
    with caplog.at_level(logging.WARNING):
        mesh = read_surface(stl(np.concatenate([BOX, [[0, 1, 1]]]), binary=False), 1.0)
    assert len(mesh.triangles) == 12
    assert "ignored 1 triangles without area" in caplog.text


def cut_off(path):
    path.write_bytes(path.read_bytes()[:300])


def empty(path):
    path.write_bytes(b"\0" * 84)


def lost_number(path):
    path.write_text(path.read_text().replace("vertex 4.0", "vertex nan", 1))


@pytest.mark.parametrize("spoil", [cut_off, empty, lost_number])
def test_what_is_no_stl(stl, spoil):
    path = stl(BOX, binary=spoil is not lost_number)
    spoil(path)
    with pytest.raises(MeshError, match=r"box\.stl"):
        read_surface(path, 1.0)
    other = path.with_suffix(".obj")
    path.rename(other)
    with pytest.raises(MeshError, match="not an STL file"):
        read_surface(other, 1.0)
