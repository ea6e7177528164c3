"""Points of a line from text tables."""

import numpy as np
import pytest

from softsim.errors import MeshError
from softsim.mesh.reading import read_points


def written(tmp_path, text):
    path = tmp_path / "ground.csv"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "text",
    [
        "x, y\n0, 1\n\n10.5, -2e0\n",
        "# a ground\nx [mm];y [mm]\n0;1\n10.5;-2 # its end\n",
        "0\t1\n10.5\t-2",
        "0 1\r\n  10.5   -2\r\n",
        "\ufeff0,1\n10.5,-2\n",
    ],
)
def test_tables_that_people_write(tmp_path, text):
    points = read_points(written(tmp_path, text), 1e-3)
    np.testing.assert_allclose(points, [[0.0, 1e-3], [10.5e-3, -2e-3]], rtol=1e-15)


def test_an_empty_one_has_no_points(tmp_path):
    assert read_points(written(tmp_path, "x, y\n"), 1.0).shape == (0, 2)


@pytest.mark.parametrize(
    "text, line",
    [
        ("0, 1\n2\n", 2),
        ("0, 1\n2, 3, 4\n", 2),
        ("x, y\n0, 1\nx, y\n", 3),
        ("0, one\n", 1),
        ("0, 1\nnan, 2\n", 2),
        ("0,1; 2,3\n", 1),
    ],
)
def test_a_line_that_is_no_point_is_named(tmp_path, text, line):
    with pytest.raises(MeshError, match=rf"ground\.csv:{line}: '.*' is not a point"):
        read_points(written(tmp_path, text), 1.0)


def test_what_is_no_text(tmp_path):
    path = tmp_path / "ground.csv"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(MeshError, match="cannot be read as a table"):
        read_points(path, 1.0)
