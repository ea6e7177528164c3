"""A capped cylinder as a wall: its gap, its normal, its picture."""

import numpy as np
import pytest

from softsim.compute.vectors import NUMPY
from softsim.contact.simple_walls import Cylinder

HALF, RADIUS = 30e-3, 20e-3


@pytest.mark.parametrize("dimension, axis", [(2, 0), (2, 1), (3, 0), (3, 2)])
def test_gap_and_picture(dimension, axis):
    """The gap is that of the nearer of side and caps, the normal its gradient; faces and lines lie
    on it and face out.
    """
    centre = np.array([1e-2, 2e-2, 3e-2])[:dimension]
    wall = Cylinder("post", centre, axis, HALF, RADIUS)
    x = np.random.default_rng(1).uniform(-0.1, 0.1, (50, dimension))
    arm = x - centre
    across = np.linalg.norm(np.delete(arm, axis, axis=1), axis=1)
    exact = np.maximum(across - RADIUS, np.abs(arm[:, axis]) - HALF)
    np.testing.assert_allclose(wall.gaps(x)["post"], exact, atol=1e-15)
    parameters = [np.moveaxis(parameter, 0, -1) for parameter in wall.parameters]
    _, normal = wall.gap_and_normal(x.T, *parameters, NUMPY)
    ways = 1e-7 * np.eye(dimension)
    slopes = [(wall.gaps(x + e)["post"] - wall.gaps(x - e)["post"]) / 2e-7 for e in ways]
    np.testing.assert_allclose(normal, slopes, atol=1e-7)
    (pieces,) = wall.drawn().values()
    np.testing.assert_allclose(wall.gaps(pieces.reshape(-1, dimension))["post"], 0.0, atol=1e-15)
    if dimension == 2:
        way = pieces[:, 1] - pieces[:, 0]
        normal = np.stack([-way[:, 1], way[:, 0]], axis=1)
    else:  # of the diagonals: at the middle of a cap two corners are one
        normal = np.cross(pieces[:, 2] - pieces[:, 0], pieces[:, 3] - pieces[:, 1])
    assert (((pieces.mean(axis=1) - centre) * normal).sum(axis=1) > 0.0).all()
