"""The pattern of a model's stiffness, and what it must not depend on."""

import numpy as np
import pytest

from softsim.solver.stiffness_bound import ModelStiffness, pairs

RINGS = """
bodies:
  b: {mesh: {generator: pfr_section, inner_diameter: 4 mm, outer_diameter: 8 mm,
             free_length: 4 mm, spikes_per_strip: 1, spike_height: 2 mm, root_thickness: 2 mm,
             tip_thickness: 1 mm, element_size: 1 mm},
      formulation: ring_section, thickness: 5 mm, sector: 90 deg, rings: skin,
      material: dragon_skin_10}
rigid_bodies: {ends: {mass: 1 g, inertia: 1 g*mm^2, tied: [b.knots]}}
loads:
  gas: {kind: added_gas, facets: [b.chamber], reacts_on: ends,
        profile: {kind: ramp, value: 1 mg, duration: 1 s}}
time: {end: 1 s}
"""


def test_pairs_of_many_nodes():
    """The square of the number of nodes is beyond 32 bits."""
    cells = np.array([[0, 99_999], [70_000, 70_000], [99_998, 3]], dtype=np.int32)
    pattern, of_corners = pairs([cells], [cells], (100_000, 100_000))
    first = np.repeat(np.arange(100_000), np.diff(pattern.indptr))
    second = pattern.indices
    of_corners = of_corners.reshape(3, 3, 2)
    for a in range(3):
        for b in range(3):
            np.testing.assert_array_equal(first[of_corners[a, b]], cells[a])
            np.testing.assert_array_equal(second[of_corners[a, b]], cells[b])
    assert len(first) == len({(p, q) for p, q in zip(first, second, strict=True)}) == 17


@pytest.mark.parametrize("angle", [0.8, np.pi / 2])
def test_what_turns_takes_its_stiffness_along(build, angle):
    """A ring section with gas in it, off its rest: the matrix of the turned one is the turned
    matrix, to round-off, so the stable step is the same.
    """
    model = build(RINGS)
    stiffness = ModelStiffness(model)
    noise = np.random.default_rng(1).standard_normal(model.points.shape)
    x = model.points * [1.0, 1.2] + 0.05e-3 * noise
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s], [-s, c]])
    found, turned = (dense(stiffness, at) for at in (x, x @ turn))
    whole = np.kron(np.eye(len(x)), turn.T)
    expected = whole @ found @ whole.T
    np.testing.assert_allclose(turned, expected, atol=1e-12 * np.abs(expected).max())
    assert np.linalg.eigvalsh(turned)[-1] == pytest.approx(np.linalg.eigvalsh(found)[-1], rel=1e-12)


def dense(stiffness, x):
    """M^-1/2 K M^-1/2 with the nodes at x, column by column."""
    matrix = stiffness.at(stiffness.elements(x), x)
    assert matrix.chamber_frequency() > 0.0
    return np.stack([matrix.product(e) for e in np.eye(x.size)], axis=1)
