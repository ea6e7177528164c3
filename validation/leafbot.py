"""Leafbot on the flat and on slopes (5.2, 5.3): the plane section against the thesis's statements.

Nothing is fitted to a speed: the motor's force and the masses are the thesis's, the limb's root is
as thick as makes the limb as stiff as it says (`leafbot_press.yaml`). The speed is the mean over
the second half of two seconds, along the ground. Bands: friction 10 % less and more, finer meshes,
half the step; each of the robot with five rows at 142 Hz.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from softsim.report.style import BLUE, GREEN, INK, ORANGE, QUIET, drawing
from validation.cases import THINNED, Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points
from validation.motion import MILLI, NAN, speed_after
from validation.script import Listing, Script
from validation.statements import FLAT_SLOPE, LIMB, LIMB_ROWS, NODES, RADIUS, SPEED
from validation.verdicts import (
    Row,
    all_between,
    below,
    between,
    highest_at,
    judged,
    rises,
    row,
    shown,
    shown_list,
    within,
)

NAME = "leafbot"
FREQUENCIES = {3: (132, 186, 191), 5: (132, 142, 186), 9: (120, 166, 170)}
"""Rows -> Hz at 3, 4, 5 V (Table 4.1)."""
SPEEDS = (200.0, 220.0, 300.0)  # mm/s of the robot with five rows (5.2.2.2)
SPREAD = 0.2  # share by which they may be off
SETTLED = 0.5  # share of the run after which the speed is taken
WINDOW = 20  # turns of the motor
SETTLING = (0.4, 1.5)  # s in which 90 % of the speed is reached (Fig 5.6: about 1 s)
HIGHEST = 2.0  # mm, how far the head rises (App. A)
SLOPES = (0, 10, 20, 25, 30, 40)  # deg, at the frequency of 4 V
STEEP = 30  # deg and more are not climbed (5.3)
K_Z, K_SPREAD = 250.0, 0.1  # N/m of one limb (Table B.1)
PUSH = 0.5  # horizontal over vertical force of a limb (Eq 5.22)
DEPTH = 0.25e-3  # m, of the bounce
PRESS = "limbs on a plate"
BANDS = {
    "friction 0.63": ("contact.friction_coefficient=0.63",),
    "friction 0.77": ("contact.friction_coefficient=0.77",),
    "two elements across a limb": (
        "bodies.body.mesh.limb_columns=2", "bodies.body.mesh.element_size=0.7 mm",
    ),
    "two across limb and backbone": (
        "bodies.body.mesh.limb_columns=2", "bodies.body.mesh.backbone_rows=2",
        "bodies.body.mesh.element_size=0.5 mm",
    ),
    "half the step": ("solver.safety_factor=0.45",),
}  # fmt: skip
# Of a limb's front [mm]; the second is the robot's. Fig 3.7 has 3 mm for the first, an arc that
# does not span a limb 5 mm high with this root: 4.2 mm is as round as it gets.
RADII = (4.2, 5.0, 8.0)
SLOWER = (132, 142)  # Hz, at 3 and 4 V, where it is the fastest
COLOURS = {3: GREEN, 5: BLUE, 9: ORANGE}


def label(rows: int, frequency: int) -> str:
    """The name of a case."""
    return f"Leafbot{rows}, {frequency} Hz"


def walking(rows: int, frequency: int) -> Case:
    """On the flat."""
    overrides = (f"loads.motor.frequency={frequency} Hz", *THINNED)
    return Case(label(rows, frequency), f"leafbot{rows}.yaml", overrides)


def climbing(slope: int) -> Case:
    """The robot with five rows at 142 Hz up a slope [deg], on some of which it never rests."""
    overrides = (f"environment.inclination={slope} deg", "time.settle=null", *THINNED)
    return Case(f"slope {slope} deg", "leafbot5.yaml", overrides)


def rounded(radius: float, frequency: int) -> Case:
    """On the flat with five rows of limbs of this front radius [mm]."""
    flat = walking(5, frequency)
    if radius == RADII[1]:
        return flat
    front = f"bodies.body.mesh.front_radius={radius} mm"
    return Case(f"R1 {radius:g} mm, {frequency} Hz", flat.scene, (front, *flat.overrides))


def cases() -> list[Case]:
    """On the flat, on slopes, within the bands of what was assumed, and with other limbs."""
    found = [walking(rows, f) for rows in FREQUENCIES for f in FREQUENCIES[rows]]
    found.append(Case(PRESS, "leafbot_press.yaml"))
    bands = [Case(name, "leafbot5.yaml", (*changed, *THINNED)) for name, changed in BANDS.items()]
    radii = [rounded(radius, f) for f in SLOWER for radius in RADII if radius != RADII[1]]
    return [*found, *(climbing(slope) for slope in SLOPES[1:]), *bands, *radii]


def speed(outcome: Outcome) -> float:
    """Along the ground [mm/s]."""
    return MILLI * speed_after(outcome.history, SETTLED)


def speeds(outcomes: Outcomes, rows: int) -> list[float]:
    """At each frequency of a robot [mm/s]."""
    return [speed(outcomes[label(rows, f)]) for f in FREQUENCIES[rows]]


def settling(outcome: Outcome, frequency: float) -> float:
    """When 90 % of the speed is first reached [s], as the mean over WINDOW whole turns of the
    motor.
    """
    if not outcome.history:
        return NAN
    t, x = outcome.history["time"], outcome.history["frame_x"]
    window = WINDOW / frequency
    begins = np.arange(0.0, t[-1] - window, 1.0 / frequency)
    means = (np.interp(begins + window, t, x) - np.interp(begins, t, x)) / window
    fast = np.flatnonzero(MILLI * means >= 0.9 * speed(outcome))
    return float(begins[fast[0]]) if len(fast) else NAN


def rise(outcome: Outcome) -> float:
    """How far the head rises over where it stands at first [mm]."""
    if not outcome.history:
        return NAN
    y = outcome.history["frame_y"]
    return float(MILLI * (y - y[0]).max())


def pressed(outcome: Outcome) -> tuple[float, float]:
    """Secant stiffness of one of two limbs [N/m], and horizontal over vertical force, at DEPTH."""
    if not outcome.history:
        return NAN, NAN
    history = outcome.history
    way = DEPTH / 1e-3 * history["time"][-1]  # 1 mm over the whole run
    x, y = (np.interp(way, history["time"], history[f"wall_force_{axis}"]) for axis in "xy")
    return float(y / DEPTH / 2.0), float(x / y)


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """The limb; speeds, how they grow and settle; the head; three patterns; slopes."""
    press = outcomes[PRESS]
    stiffness, push = pressed(press)
    found = within(stiffness, K_Z, K_SPREAD, "N/m")
    yield row(LIMB, "stiffness of a limb", f"{K_Z:g} N/m within 10 %", found, [press])
    yield row(LIMB, "horizontal over vertical force of a limb", "0.4 to 0.6",
              between(push, PUSH - 0.1, PUSH + 0.1), [press])  # fmt: skip
    five = [outcomes[label(5, f)] for f in FREQUENCIES[5]]
    for f, wanted, outcome in zip(FREQUENCIES[5], SPEEDS, five, strict=True):
        found = within(speed(outcome), wanted, SPREAD, "mm/s")
        reference = f"{wanted:g} mm/s within {100 * SPREAD:g} %"
        yield row(SPEED, f"speed at {f} Hz", reference, found, [outcome])
    claim = "faster the faster the motor, five rows"
    yield row(SPEED, claim, "rises", rises(speeds(outcomes, 5), "mm/s"), five)
    times = [settling(outcome, f) for f, outcome in zip(FREQUENCIES[5], five, strict=True)]
    settled = all_between(times, *SETTLING, "s")
    yield row(SPEED, "speed is reached in about 1 s", "0.4 to 1.5 s", settled, five)
    head = max((rise(outcome) for outcome in five), default=NAN)
    yield row(
        NODES, "the head rises little", f"below {HIGHEST:g} mm", below(head, HIGHEST, "mm"), five
    )
    lowest = [outcomes[label(n, f[0])] for n, f in FREQUENCIES.items()]
    order = [speed(outcome) for outcome in lowest]
    found = judged(order[0] > order[1] > order[2], shown_list(order, "mm/s"), *order)
    yield row(
        LIMB_ROWS, "at 3 V three rows are faster than five, five than nine", "order", found, lowest
    )
    three = speeds(outcomes, 3)
    found = judged(max(three[1:]) < three[0], shown_list(three, "mm/s"), *three)
    behind = [outcomes[label(3, f)] for f in FREQUENCIES[3]]
    yield row(
        LIMB_ROWS, "three rows are slower at 186 and 191 than at 132 Hz", "slower", found, behind
    )
    for f in SLOWER:
        fronts = [outcomes[rounded(radius, f).name] for radius in RADII]
        names = [f"{radius:g} mm" for radius in RADII]
        best = highest_at(names, [speed(outcome) for outcome in fronts], [names[1]], "mm/s")
        claim = f"fastest with a front radius of {names[1]}, of {', '.join(names)}; {f} Hz"
        yield row(RADIUS, claim, names[1], best, fronts)
    steep = [outcomes[climbing(s).name] for s in SLOPES if s >= STEEP]
    up = max(speed(outcome) for outcome in steep)
    found = judged(up <= 0.0, shown(up, "mm/s"), up)
    yield row(FLAT_SLOPE, f"does not climb {STEEP} deg or more", "0 mm/s or less", found, steep)


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """Speeds of the bands and on slopes."""
    base = speed(outcomes[label(5, 142)])
    found = {name: speed(outcomes[name]) for name in BANDS}
    bands = tuple(
        (name, shown(value), shown(100.0 * (value / base - 1.0))) for name, value in found.items()
    )
    yield Listing("Bands: five rows, 142 Hz", ("what", "mm/s", "change [%]"), bands)
    climbed = tuple((f"{s}", shown(v)) for s, v in zip(SLOPES, uphill(outcomes), strict=True))
    yield Listing("Slopes: five rows, 142 Hz", ("deg", "mm/s"), climbed)


def uphill(outcomes: Outcomes) -> list[float]:
    """Speed at each of SLOPES [mm/s]."""
    names = [label(5, 142), *(climbing(slope).name for slope in SLOPES[1:])]
    return [speed(outcomes[name]) for name in names]


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Speed over frequency of the three robots; of the one with five rows over the slope."""
    with drawing(path, 3.0) as figure:
        left, right = figure.subplots(1, 2, sharey=True)
        for n, frequencies in FREQUENCIES.items():
            left.plot(frequencies, speeds(outcomes, n), color=COLOURS[n], marker="o",
                      label=f"{n} rows")  # fmt: skip
        left.plot(FREQUENCIES[5], SPEEDS, color=INK, marker="s", linestyle="none",
                  label="thesis, five rows")  # fmt: skip
        right.plot(SLOPES, uphill(outcomes), color=BLUE, marker="o")
        right.axvline(STEEP, color=QUIET, linewidth=0.8, linestyle="--")
        for axes in (left, right):
            axes.axhline(0.0, color=QUIET, linewidth=0.7)
        left.set(xlabel="frequency of the motor [Hz]", ylabel="speed [mm/s]")
        right.set(xlabel="slope [deg]", title="five rows, 142 Hz")
        left.legend()


SCRIPT = Script(
    name=NAME,
    figure="Leafbot: 5.2, 5.3",
    about=(
        "Leafbot's plane section by finite elements: its limb on a plate, three patterns of rows "
        "on the flat at the frequencies of 3, 4 and 5 V, slopes. Nothing is fitted to a speed. "
        "Claims: 200, 220, 300 mm/s with five rows; the head below 2 mm; at 3 V fewer rows are "
        "faster; three rows slower at 186 and 191 than at 132 Hz; no slope of 30 degrees or more."
    ),
    cases=cases,
    quick=(label(5, 142), PRESS),
    rows=rows,
    draw=draw,
    listings=listings,
)

if __name__ == "__main__":
    command([SCRIPT])
