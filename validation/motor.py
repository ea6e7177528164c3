"""Table 4.1 of the thesis: do its data make a motor, whose speed follows from its voltage?

They are: 210, 240, 260 Hz at 3, 4, 5 V on a piezoelectric disc (Table 4.1), 67 and 110 mA at 3 and
5 V (5.1; on which body is not said), slower on soft robots. A direct current motor at a steady
speed w [rad/s], with one constant k [V s/rad = N m/A], one resistance R and no losses but friction,
has

    V = k w + R I,   k I = c_0 + c_1 w + c_2 w^2

c_0 is Coulomb friction, c_1 viscous drag, c_2 the drag of air, and of a bearing that the eccentric
mass presses with m_e e w^2. All constants are positive, or the model is no motor. Two consequences
need no fit. V is a sum of w and I with positive weights: from 3 to 5 V it grows more than the speed
and less than the current. And where friction grows as w^n, k > 0 asks for n > log(V ratio) /
log(w ratio), while currents that were measured on the disc say n = log(I ratio) / log(w ratio).

Nothing is simulated.
"""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from softsim.report.style import BLUE, GREEN, INK, ORANGE, QUIET, drawing
from validation.cases import Outcomes
from validation.command import command
from validation.digitised import Points
from validation.script import Listing, Script
from validation.statements import MOTOR
from validation.verdicts import AGREES, EQUATIONS, UNKNOWN, Finding, Row, row

NAME = "motor"
VOLTAGE = np.array([3.0, 4.0, 5.0])  # V
ON_DISC = np.array([210.0, 240.0, 260.0])  # Hz
CURRENT = np.array([67e-3, 110e-3])  # A, at the first and the last voltage
ON_ROBOTS = {
    "Leafbot3": np.array([132.0, 186.0, 191.0]),
    "Leafbot5": np.array([132.0, 142.0, 186.0]),
    "Leafbot9": np.array([120.0, 166.0, 170.0]),
}  # Hz
ENDS = [0, -1]  # 3 and 5 V
ROUNDED = 5.0  # Hz: frequencies are given in tens
READ = 1e-3  # A, by which a current may be off
COPPER = 3.9e-3  # 1/K, growth of a winding's resistance
WARMER = (0.0, 10.0, 20.0, 40.0)  # K, of the winding at 5 V over 3 V
ALIKE = 0.05  # share by which what should be the same may differ
POSITIVE = "all constants positive"


def turning(frequency: np.ndarray) -> np.ndarray:
    """Angular velocity [rad/s]."""
    return 2.0 * np.pi * frequency


def constants(
    frequency: np.ndarray, current: np.ndarray, warmer: float = 0.0
) -> tuple[float, float]:
    """k [V s/rad] and R [Ohm] of V = k w + R I at 3 and 5 V, where the winding is `warmer` [K] at
    5 V than at 3 V.
    """
    growth = np.array([1.0, 1.0 + COPPER * warmer])
    unknown = np.column_stack([turning(frequency[ENDS]), growth * current])
    k, resistance = np.linalg.solve(unknown, VOLTAGE[ENDS])
    return float(k), float(resistance)


def friction_fit(powers: tuple[int, ...]) -> np.ndarray:
    """Factors of w^power in V that fit the three voltages of the disc best."""
    w = turning(ON_DISC)
    return np.asarray(np.linalg.lstsq(w[:, None] ** powers, VOLTAGE, rcond=None)[0])


def largest_constant(off: float, read: float) -> float:
    """k [V s/rad], the largest of all frequencies that are off by `off` [Hz], currents by `read`
    [A] at most.
    """
    signs = np.array(np.meshgrid(*4 * [[-1.0, 0.0, 1.0]])).reshape(4, -1).T
    found = [
        constants(
            np.array([ON_DISC[0] + a * off, 0.0, ON_DISC[-1] + b * off]),
            CURRENT + read * np.array([c, d]),
        )
        for a, b, c, d in signs
    ]
    return max(k for k, _ in found)


def exponents() -> tuple[float, float]:
    """Growth of friction with the speed, as w^n: n above which k > 0, and n of the currents."""
    log_speed = math.log(ON_DISC[-1] / ON_DISC[0])
    return math.log(VOLTAGE[-1] / VOLTAGE[0]) / log_speed, math.log(
        CURRENT[1] / CURRENT[0]
    ) / log_speed


def positive(text: str, *values: float) -> Finding:
    """Constants of a motor: where one is not positive there is no such motor to tell of."""
    return Finding(text, AGREES if min(values) > 0.0 else UNKNOWN)


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Currents and speeds; frictions; how far rounding goes; what warmth would make of it."""
    k, resistance = constants(ON_DISC, CURRENT)
    text = f"k = {1e3 * k:.3g} mV s, R = {resistance:.3g} Ohm"
    claim = "V = k w + R I at 3 and 5 V on the disc"
    yield row(MOTOR, claim, POSITIVE, positive(text, k, resistance))
    speed, voltage, current = (float(one[-1] / one[0]) for one in (ON_DISC, VOLTAGE, CURRENT))
    text = f"{speed:.3f}, {voltage:.3f}, {current:.3f}"
    claim = "from 3 to 5 V speed, voltage, current grow by"
    reference = "the voltage lies between speed and current"
    yield row(MOTOR, claim, reference, positive(text, voltage - speed, current - voltage))
    least, found = exponents()
    text = f"n = {found:.3g} by the currents, more than {least:.3g} needed"
    claim = "friction grows as w^n, fast enough for k > 0"
    yield row(MOTOR, claim, "n by the currents above the least", positive(text, found - least))
    yield from friction_rows()
    k = largest_constant(0.0, 0.5 * READ)
    claim = "k > 0 within the rounding of the currents to mA"
    yield row(MOTOR, claim, POSITIVE, positive(f"k = {1e3 * k:.3g} mV s at most", k))
    k = largest_constant(ROUNDED, READ)
    induced = k * turning(ON_DISC[:1])[0]
    claim = f"k of use, frequencies off by {ROUNDED:g} Hz, currents by {1e3 * READ:g} mA"
    text = f"k = {1e3 * k:.3g} mV s at most, {induced:.2g} V of 3 V"
    reference = "induces 0.3 V at 3 V, a tenth, or more"
    yield row(MOTOR, claim, reference, positive(text, induced - 0.1 * VOLTAGE[0]))
    for name, frequency in ON_ROBOTS.items():
        k, resistance = constants(frequency, CURRENT)
        text = f"k = {1e3 * k:.3g} mV s, R = {resistance:.3g} Ohm"
        claim = f"V = k w + R I at 3 and 5 V, if the currents are those on {name}"
        yield row(MOTOR, claim, POSITIVE, positive(text, k, resistance))
    claim = "turns slower on a robot than on the disc, as a motor with these constants"
    yield row(MOTOR, claim, "120 to 191 Hz", Finding("no constants to foretell it with", UNKNOWN))


def friction_rows() -> Iterator[Row]:
    """Constants that each friction asks for, of V = w^power ... on the disc."""
    ratio = VOLTAGE / turning(ON_DISC)
    text = ", ".join(f"{1e3 * one:.3g}" for one in ratio) + " mV s"
    alike = Finding(text, AGREES if np.ptp(ratio) < ALIKE * ratio.mean() else UNKNOWN)
    yield row(MOTOR, "viscous drag: V / w is constant", f"within {100 * ALIKE:g} %", alike)
    for friction, powers, units in (
        ("Coulomb and viscous", (1, 0), ("V s", "V")),
        ("air or loaded bearing", (1, 2), ("V s", "V s^2")),
        ("Coulomb, viscous, and air or loaded bearing", (1, 0, 2), ("V s", "V", "V s^2")),
    ):
        found = friction_fit(powers)
        names = {0: "R c_0 / k", 1: "k + R c_1 / k", 2: "R c_2 / k"}
        text = ", ".join(
            f"{names[power]} = {value:.3g} {unit}"
            for power, value, unit in zip(powers, found, units, strict=True)
        )
        yield row(MOTOR, f"{friction}: best fit of V(w)", POSITIVE, positive(text, *found))

    powers = (1, 3)
    k, cubic = friction_fit(powers)
    grown = float((ON_DISC[-1] / ON_DISC[0]) ** 3)
    text = f"k = {1e3 * k:.3g} mV s, but the current grows by {grown:.3g}"
    claim = "friction as w^3: best fit of V(w), and the currents' growth with it"
    reference = f"all constants positive, {CURRENT[1] / CURRENT[0]:.3g} within {100 * ALIKE:g} %"
    off = ALIKE - abs(grown / (CURRENT[1] / CURRENT[0]) - 1.0)
    yield row(MOTOR, claim, reference, positive(text, k, cubic, off))


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """k and R by what the winding warms up."""
    found = [(warmer, *constants(ON_DISC, CURRENT, warmer)) for warmer in WARMER]
    yield Listing(
        "V = k w + R I on the disc, where the winding is warmer at 5 V than at 3 V",
        ("warmer by", "k", "R at 3 V", "induced at 3 V"),
        tuple(
            (f"{warmer:g} K", f"{1e3 * k:.3g} mV s", f"{resistance:.3g} Ohm",
             f"{k * turning(ON_DISC[:1])[0]:.2g} V")
            for warmer, k, resistance in found
        ),
    )  # fmt: skip


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Voltage over frequency with the best fits, and k over what the winding warms up."""
    with drawing(path, 3.0) as figure:
        left, right = figure.subplots(1, 2)
        frequency = np.linspace(0.0, 270.0)
        w = turning(frequency)
        for powers, colour, name in (
            ((1,), GREEN, "viscous"),
            ((1, 0), BLUE, "Coulomb and viscous"),
            ((1, 2), ORANGE, "air or loaded bearing"),
        ):
            left.plot(frequency, w[:, None] ** powers @ friction_fit(powers), color=colour,
                      label=name)  # fmt: skip
        left.errorbar(ON_DISC, VOLTAGE, xerr=ROUNDED, color=INK, marker="s", markersize=4,
                      linestyle="none", label="thesis, on the disc")  # fmt: skip
        left.axhline(0.0, color=QUIET, linewidth=0.7)
        left.set(xlabel="frequency [Hz]", ylabel="voltage [V]", ylim=(-6.0, 6.0))
        left.legend()
        warmer = np.linspace(0.0, WARMER[-1])
        found = [1e3 * constants(ON_DISC, CURRENT, one)[0] for one in warmer]
        right.axhline(0.0, color=QUIET, linewidth=0.7)
        right.plot(warmer, found, color=INK)
        right.set(xlabel="winding warmer at 5 V than at 3 V by [K]", ylabel="k [mV s]")


SCRIPT = Script(
    name=NAME,
    model=EQUATIONS,
    figure="Table 4.1",
    about=(
        "Whether voltages, frequencies on the disc and currents make a direct current motor with "
        "one constant and one resistance, whatever its friction: then the frequency on a robot "
        "could be foretold. A row agrees where the constants are positive; where one is not there "
        "is no such motor, and nothing can be told. None is: over resistance and current the "
        "voltage leaves nothing for the speed. A drop in brushes or in a driver makes it worse; a "
        "winding that is warmer at 5 V makes it possible, with any k, for no temperature is told "
        "(table). So frequency stays an input. Nothing is simulated."
    ),
    quick=(),
    rows=rows,
    draw=draw,
    listings=listings,
)

if __name__ == "__main__":
    command([SCRIPT])
