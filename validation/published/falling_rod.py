"""A soft rod that falls under its own weight: the solid in space against the theory of rods.

Protocol. Case: a rod of 0.6 m and radius 30 mm, E = 1 MPa, nu = 0.5, 1000 kg/m^3, clamped at one
end and straight, is released under gravity across it. Three rod codes were reported to differ by
5 % of its length in the first swing; their curves are not at hand. There is no measurement: the
reference is an inextensible rod without shear and damping (Euler's elastica with the inertia of its
mass), solved here as a chain of 40 links, whose error is 0.2 % of the length.

Constants: those of the case. Nothing is fitted.

Prediction: hexahedra in space, neo-Hookean, nu = 0.49 and the exact E, explicit dynamics without
material damping. The round section is replaced by a square one of the same bending stiffness per
mass and length. Two meshes: 4 and 8 elements through the height.

Band: 5 % of the length, 30 mm, for the largest distance between the tip of the solid (finer mesh)
and that of the rod during the first swing, which ends when the tip of the rod is highest again; the
same for the largest drop; 5 % for the time of the largest drop. The two meshes agree if their tips
are within 1 % of the length during that time.
"""

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from softsim.report.style import BLUE, GREEN, INK, drawing
from validation.cases import Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points
from validation.script import PUBLISHED, Script
from validation.verdicts import Row, below, percent, row, shown, signed, within

NAME = "falling_rod"
SCENE = str(Path(__file__).with_name("falling_rod.yaml"))
LENGTH, RADIUS, MODULUS, DENSITY, GRAVITY = 0.6, 0.03, 1e6, 1000.0, 9.81
END = 1.5  # s
LINKS = 40
BAND, BAND_OF_MESHES = 0.05, 0.01
COARSE, FINE = "4 elements high", "8 elements high"
COLOURS = {COARSE: GREEN, FINE: BLUE}
CASES = [Case(COARSE, SCENE), Case(FINE, SCENE, ("bodies.rod.mesh.element_size=6.5 mm",))]


class Tip(NamedTuple):
    """Time (rows,) [s] and position of the tip (rows, 2) [m]: along the straight rod, upwards."""

    time: np.ndarray
    position: np.ndarray

    def at(self, time: np.ndarray) -> np.ndarray:
        """Return the position at times (...,), NaN outside the curve."""
        columns = [
            np.interp(time, self.time, column, left=np.nan, right=np.nan)
            for column in self.position.T
        ]
        return np.stack(columns, axis=-1)

    @property
    def lowest(self) -> tuple[float, float]:
        """Largest drop [m] in the first swing and its time [s]; NaN without points."""
        if len(self.time) == 0:
            return np.nan, np.nan
        height = self.position[:, 1]
        first = int(np.argmin(np.where(self.time <= swing_end(), height, np.inf)))
        return float(-height[first]), float(self.time[first])


@cache
def rod() -> Tip:
    """Return the tip of the rod by theory.

    The unknowns are the angles of the links, whose masses sit at their far ends (half of one at the
    tip); springs of bending stiffness / link length join them.
    """
    step = LENGTH / LINKS
    stiffness = MODULUS * RADIUS**2 / (4.0 * DENSITY)  # EI over mass per length
    mass = np.full(LINKS, step)
    mass[-1] = 0.5 * step
    outboard = np.cumsum(mass[::-1])[::-1]
    joint = np.full(LINKS, stiffness / step)
    joint[0] *= 2.0  # from the clamp to the middle of the first link
    index = np.arange(LINKS)
    coupling = step**2 * outboard[np.maximum.outer(index, index)]

    def rate(time: float, state: np.ndarray) -> np.ndarray:
        angle, spin = state[:LINKS], state[LINKS:]
        difference = angle[:, None] - angle
        moment = joint * np.diff(angle, prepend=0.0)
        force = np.append(moment[1:], 0.0) - moment - GRAVITY * step * outboard * np.cos(angle)
        force -= (coupling * np.sin(difference)) @ spin**2
        return np.concatenate([spin, np.linalg.solve(coupling * np.cos(difference), force)])

    time = np.linspace(0.0, END, 751)
    state = np.zeros(2 * LINKS)
    angle = solve_ivp(rate, (0.0, END), state, "RK45", time, rtol=1e-6, atol=1e-9).y[:LINKS]
    return Tip(time, step * np.stack([np.cos(angle).sum(axis=0), np.sin(angle).sum(axis=0)], 1))


@cache
def swing_end() -> float:
    """Return the time at which the tip of the rod is highest again [s]."""
    height = rod().position[:, 1]
    lowest = int(np.argmin(np.where(rod().time < 0.7 * END, height, np.inf)))
    return float(rod().time[lowest + int(np.argmax(height[lowest:]))])


def solid(outcome: Outcome) -> Tip:
    """Return the tip of the solid; without rows if its run failed."""
    history = outcome.history
    if not history:
        return Tip(np.empty(0), np.empty((0, 2)))
    return Tip(history["time"], np.stack([LENGTH + history["tip_x"], history["tip_y"]], axis=1))


def distance(tip: Tip, other: Tip) -> float:
    """Return the largest distance during the first swing [m], NaN where a curve is missing."""
    if 0 in (len(tip.time), len(other.time)):
        return np.nan
    time = np.linspace(0.0, swing_end(), 500)
    return float(np.max(np.linalg.norm(tip.at(time) - other.at(time), axis=1)))


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Yield the distance of the tips, drop and time of the largest drop, and the two meshes."""
    coarse, fine = (solid(outcomes[name]) for name in (COARSE, FINE))
    behind = [outcomes[FINE]]
    away = distance(fine, rod())
    band = f"{percent(BAND)} of the length"
    error = shown(100 * away / LENGTH, "% of the length")
    found = below(1e3 * away, 1e3 * BAND * LENGTH, "mm")
    claim = "tip during the first swing, largest distance from the rod of theory"
    yield row(None, claim, f"0, until {swing_end():.3g} s", found, behind, error, band)
    (drop, time), (wanted, wanted_time) = fine.lowest, rod().lowest
    found = within(1e3 * drop, 1e3 * wanted, BAND * LENGTH / wanted, "mm")
    error = shown(100 * (drop - wanted) / LENGTH, "% of the length")
    yield row(
        None, "largest drop of the tip", shown(1e3 * wanted, "mm"), found, behind, error, band
    )
    found = within(time, wanted_time, BAND, "s")
    error, band = signed(time / wanted_time - 1.0), percent(BAND)
    yield row(None, "time of the largest drop", shown(wanted_time, "s"), found, behind, error, band)
    away = distance(coarse, fine)
    found = below(1e3 * away, 1e3 * BAND_OF_MESHES * LENGTH, "mm")
    error = shown(100 * away / LENGTH, "% of the length")
    band = f"{percent(BAND_OF_MESHES)} of the length"
    claim = "tips of the two meshes, largest distance"
    yield row(None, claim, "0", found, list(outcomes.values()), error, band)


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Draw height of the tip over time, and its path."""
    with drawing(path, 2.8) as figure:
        left, right = figure.subplots(1, 2)
        curves = {name: (solid(outcomes[name]), colour) for name, colour in COLOURS.items()}
        for name, (tip, colour) in {**curves, "rod of theory": (rod(), INK)}.items():
            style = "--" if colour == INK else "-"
            look = {"linewidth": 3.0, "alpha": 0.5} if name == COARSE else {"linewidth": 1.2}
            x, y = tip.position.T
            left.plot(tip.time, y, style, color=colour, label=name, **look)
            right.plot(x, y, style, color=colour, **look)
        left.fill_between(
            rod().time, *(rod().position[:, 1] + side * BAND * LENGTH for side in (-1.0, 1.0)),
            color=INK, alpha=0.1, linewidth=0, label="band",
        )  # fmt: skip
        left.axvline(swing_end(), color=INK, linewidth=0.7, linestyle=":")
        left.set(xlabel="time [s]", ylabel="height of the tip [m]")
        right.set(xlabel="tip along the straight rod [m]", ylabel="height [m]", aspect="equal")
        figure.legend(loc="outside upper center", ncols=4)


SCRIPT = Script(
    name=NAME,
    figure="theory of rods; no measurement",
    about=__doc__,
    cases=lambda: CASES,
    rows=rows,
    draw=draw,
    evidence=PUBLISHED,
)

if __name__ == "__main__":
    command([SCRIPT])
