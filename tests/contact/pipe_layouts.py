"""Pipes that the tests of paths share, in the plane and in space."""

import numpy as np

from softsim.contact.pipe_layout import Bend, DiameterStep, Item, Straight, Taper, path_of_items
from softsim.contact.pipe_path import PipePath

RIGHT_ANGLE = 0.5 * np.pi

ALL_KINDS: list[Item] = [
    Straight(30e-3),
    Bend(RIGHT_ANGLE, 25e-3, 0.0),
    DiameterStep(24e-3),
    Straight(20e-3),
    Taper(15e-3, 40e-3),
    Bend(RIGHT_ANGLE, 30e-3, np.pi),
    Taper(6e-3, 30e-3),
    Taper(12e-3, 26e-3),
    Straight(4e-3),
    DiameterStep(36e-3),
    Straight(20e-3),
]
TURNED = [
    Bend(i.angle, i.radius, 0.4 * number) if isinstance(i, Bend) else i
    for number, i in enumerate(ALL_KINDS)
]


def layout(dimension: int, closed: tuple[bool, bool] = (False, True)) -> PipePath:
    """Every kind of segment and joint; it starts 30 mm wide at (2, 1[, -3]) mm."""
    items = ALL_KINDS if dimension == 2 else TURNED
    return path_of_items("pipe", items, 30e-3, np.array([2e-3, 1e-3, -3e-3])[:dimension], closed)


def places_around(path: PipePath, count: int, depth: float, seed: int) -> np.ndarray:
    """Places (count, d) [m] everywhere inside, up to `depth` [m] in the wall, and before the ends,
    none of them nearer to a joint's plane than a nanometre.
    """
    generator = np.random.default_rng(seed)
    s = generator.uniform(-5e-3, path.length + 5e-3, count)
    point, tangent = path.axis_place(s)
    across = generator.standard_normal(point.shape)
    across -= np.einsum("ij,ij->i", across, tangent)[:, None] * tangent
    across /= np.linalg.norm(across, axis=1)[:, None]
    widest = np.array([path.segment_at(one).radii for one in s]).max(axis=1)
    return point + (generator.uniform(0.0, 1.0, count) * (widest + depth))[:, None] * across
