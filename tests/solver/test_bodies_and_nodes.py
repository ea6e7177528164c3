"""Rigid bodies on springs, alone and with the nodes that press them, against the full matrix."""

import numpy as np
import pytest
from scipy.linalg import block_diag, eigh

from softsim.rigid import RigidBodyData
from softsim.solver.contact_bound import TiedSprings, with_bodies

NODES = 12


def body_of(d: int, free: tuple[bool, ...], rng: np.random.Generator) -> RigidBodyData:
    """One to which every other of NODES is tied."""
    root = rng.standard_normal((3, 3))
    return RigidBodyData(
        "b", 2e-3, 1e-7 * (root @ root.T + np.eye(3)), np.full(d, 1e-3), np.arange(0, NODES, 2),
        np.zeros(d), np.zeros(3), free, np.zeros((0, d), dtype=int), np.zeros((0, d), dtype=int),
    )  # fmt: skip


def motion_at(places: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """u = v + omega x r of places (n, d), as a matrix (n d, 6)."""
    d, rows = places.shape[1], []
    for place in places:
        r = np.zeros(3)
        r[:d] = place - centre
        turning = np.array([np.cross(axis, r) for axis in np.eye(3)]).T
        rows.append(np.hstack([np.eye(3), turning])[:d])
    return np.vstack(rows)


@pytest.mark.parametrize(
    "d, free",
    [
        (3, (True,) * 6),
        (3, (True, False, True, True, False, False)),
        (2, (True, True, False, False, False, True)),
        (2, (True, True, False, False, False, False)),
        (3, (False,) * 6),
    ],
)
def test_a_body_on_springs_at_its_tied_nodes(d, free):
    rng = np.random.default_rng(0)
    body = body_of(d, free, rng)
    points = 1e-2 * rng.standard_normal((NODES, d))
    nodes, k = np.arange(NODES), rng.uniform(10.0, 1000.0, NODES)
    found = TiedSprings(body, points, nodes).largest_frequency(k)
    moves = np.flatnonzero(free)
    J = motion_at(points[body.tied], body.centre)[:, moves]
    stiffness = J.T @ np.diag(np.repeat(k[body.tied], d)) @ J
    inertia = block_diag(body.mass * np.eye(3), body.inertia)[np.ix_(moves, moves)]
    expected = eigh(stiffness, inertia, eigvals_only=True)[-1] if len(moves) else 0.0
    assert found == pytest.approx(expected, rel=1e-9)
    none_of_them_tied = TiedSprings(body, points, nodes[1::2])
    assert none_of_them_tied.largest_frequency(k[1::2]) == 0.0


@pytest.mark.parametrize("between", [0.01, 1.0, 100.0])
def test_nodes_and_bodies_that_press_each_other(between):
    """The bound holds, and is no more than the sum that either alone would give."""
    rng = np.random.default_rng(1)
    for _ in range(50):
        root = rng.standard_normal((NODES, NODES))
        own, body = root @ root.T, np.diag(rng.uniform(0.0, 20.0, 3))
        u = np.sqrt(between) * rng.standard_normal((5, NODES))  # springs (u x - v y)^2
        v = np.sqrt(between) * rng.standard_normal((5, 3))
        p, b, d, s = (
            np.linalg.eigvalsh(matrix)[-1]
            for matrix in (own + u.T @ u, body + v.T @ v, u.T @ u, v.T @ v)
        )
        both = np.block([[own + u.T @ u, -u.T @ v], [-v.T @ u, body + v.T @ v]])
        exact = np.linalg.eigvalsh(both)[-1]
        assert exact <= with_bodies(p, b, d, s) * (1.0 + 1e-12)
        assert with_bodies(p, b, d, s) <= (p + b) * (1.0 + 1e-12)
