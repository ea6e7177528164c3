"""The shape of a facet."""

import numpy as np
import pytest
import taichi as ti

from softsim.compute import fields
from softsim.contact.deformable_surface import EdgeShape, TriangleShape, is_farther


@pytest.mark.parametrize("shape", [EdgeShape(), TriangleShape()], ids=["edge", "triangle"])
def test_a_facet_that_is_told_to_be_farther_is(fresh_taichi, shape):
    """Of facets and places at random: told apart for most that are far, for none that is near."""
    d, count = shape.dimension, 4000
    rng = np.random.default_rng(3)
    places = rng.uniform(-3.0, 3.0, (count, d))
    corners = fields.vector_field(rng.uniform(-1.0, 1.0, (count, d, d)))
    place = fields.vector_field(places)
    limit = fields.real_field(rng.uniform(0.0, 2.0, count))
    distance = fields.real_field(np.zeros(count))
    told = fields.index_field(np.zeros(count))

    @ti.kernel
    def measure():
        for k in range(count):
            X = ti.Matrix.zero(ti.f64, d, d)
            for c in ti.static(range(d)):
                for i in ti.static(range(d)):
                    X[c, i] = corners[k, c][i]
            w = shape.closest_weights(X, place[k])
            distance[k] = (place[k] - X.transpose() @ w).norm_sqr()
            told[k] = is_farther(X, place[k], limit[k])

    measure()
    far = fields.read(distance) > fields.read(limit)
    said = fields.read(told) == 1
    assert not (said & ~far).any()
    assert said.sum() > 0.7 * far.sum()
