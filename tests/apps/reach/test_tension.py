"""The tension of a tether against closed forms."""

import numpy as np
import pytest

from softsim.apps.reach.distance import CORNER, Tension, TetherProperties, tension_along, ways
from softsim.contact import pipe_layout
from softsim.contact.pipe_layout import Bend, Fork, Straight

WEIGHT, FRICTION, RADIUS = 0.03, 0.6, 0.3  # N/m, -, m
DOWN = np.array([0.0, -1.0, 0.0])
LEVEL = np.array([0.0, 0.0, 1.0])  # the layout lies level
QUARTER = 0.5 * np.pi


def tension(*items: pipe_layout.Item, down: np.ndarray = DOWN, weight: float = WEIGHT) -> Tension:
    network = pipe_layout.network_of_items("pipe", items, {}, 0.036, np.zeros(3), ())
    [way] = ways(network)
    return tension_along(way, TetherProperties(weight, FRICTION), down)


@pytest.mark.parametrize("slope", [0.0, 0.4, QUARTER, -0.2, -1.2])
def test_straight(slope: float) -> None:
    """w (sin + mu cos) per length, but never below zero on a way down on which it slides by itself;
    what hangs is w (sin - mu cos).
    """
    down = np.array([-np.sin(slope), -np.cos(slope), 0.0])
    found = tension(Straight(4.0), down=down)
    rub = FRICTION * np.cos(slope)
    drawn, held = (4.0 * WEIGHT * (np.sin(slope) + sign * rub) for sign in (1.0, -1.0))
    assert found.drawing[-1] == pytest.approx(max(drawn, 0.0), abs=1e-12)
    assert found.holding[-1] == pytest.approx(max(held, 0.0), abs=1e-12)


def test_level_bend() -> None:
    """Where weight and tension press at a right angle to each other, |p|^2 = (T/r)^2 + w^2:
    T = w r sinh(mu theta + arsinh(T_0 / (w r))).
    """
    found = tension(Straight(2.0), Bend(2.0, RADIUS, 0.0), down=LEVEL)
    first = FRICTION * WEIGHT * 2.0
    unit = WEIGHT * RADIUS
    expected = unit * np.sinh(FRICTION * 2.0 + np.arcsinh(first / unit))
    assert found.drawing[-1] == pytest.approx(expected, rel=1e-7)
    assert found.holding[-1] == 0.0


def test_bend_upwards() -> None:
    """From level to upright under so much tension that the tether lies on the inner side all along:
    dT/d theta = mu (T - w r cos) + w r sin has the solution
    T = C exp(mu theta) + A cos + B sin, A = w r (mu^2 - 1) / (1 + mu^2), B = mu (A - w r).
    """
    found = tension(Straight(40.0), Bend(QUARTER, RADIUS, 0.0))
    unit, square = WEIGHT * RADIUS, FRICTION**2
    a = unit * (square - 1.0) / (1.0 + square)
    b = FRICTION * (a - unit)
    first = FRICTION * WEIGHT * 40.0
    expected = (first - a) * np.exp(FRICTION * QUARTER) + b
    assert found.drawing[-1] == pytest.approx(expected, rel=1e-7)


def test_without_weight_as_euler_and_eytelwein() -> None:
    """Small against its tension, what a tether weighs in the bend does not count."""
    found = tension(Straight(1e4), Bend(1.2, 0.01, 0.0), Bend(0.7, 0.01, np.pi))
    first = FRICTION * WEIGHT * 1e4
    assert found.drawing[-1] == pytest.approx(first * np.exp(FRICTION * 1.9), rel=1e-5)


def test_hanging_over_a_bend() -> None:
    """A tether that hangs down a pipe is held by T exp(-mu theta), and drawn by T exp(mu theta)."""
    upright = np.array([-1.0, 0.0, 0.0])
    found = tension(Straight(1e3), Bend(QUARTER, 0.01, 0.0), down=upright)
    hanging = 1e3 * WEIGHT
    assert found.drawing[-1] == pytest.approx(hanging * np.exp(FRICTION * QUARTER), rel=1e-4)
    assert found.holding[-1] == pytest.approx(hanging * np.exp(-FRICTION * QUARTER), rel=1e-4)


def test_a_way_into_a_branch_turns_a_corner() -> None:
    """Of a tee two exits: straight on, and around a right angle."""
    tee = Fork(0.2, {"side": 0.0}, 0.036, True, 0.002)
    items = (Straight(3.0), tee, Straight(1.0))
    network = pipe_layout.network_of_items(
        "pipe", items, {"side": (Straight(1.0),)}, 0.036, np.zeros(3), ()
    )
    along = {
        way.exit: tension_along(way, TetherProperties(WEIGHT, FRICTION), LEVEL)
        for way in ways(network)
    }
    rub = FRICTION * WEIGHT
    assert along["end"].drawing[-1] == pytest.approx(4.2 * rub)
    expected = 3.1 * rub * np.exp(FRICTION * CORNER) + 1.1 * rub
    assert along["side"].drawing[-1] == pytest.approx(expected)
    assert along["side"].arc_length[-1] == pytest.approx(4.2)
