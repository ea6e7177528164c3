"""What the gauge at the pump tells of the pipe, and what tubes cost (thesis 4.2.4, 6.3.1, 7.2.2).

The plane section at the end of its air line, motor off. Slowly inflated to 23 kPa, held there, then
the valve stays open: natural deflation. From the gauge's curve alone:

    slope ratio   of its rise in the last fifth of the pressure over that in the middle fifth
    pump time     for which the pump runs until the valve opens: the air that went in
    fall time     of natural deflation, from 23 down to 9 kPa on the gauge

A detector names the pipe whose stored value is nearest, by their ratio, and none where that is off
by more than a quarter. Stored is the run of friction 0.7; it is asked about runs of friction 0.5,
0.7 and 0.8, with noise on the gauge, and pumps and valves that let more or less through; and about
a pipe that it was never shown, and free air.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from softsim.report.style import BLUE, INK, QUIET, drawing
from validation.cases import THINNED, Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points
from validation.motion import NAN
from validation.script import Listing, Script
from validation.statements import FALL_TIME, RECOGNITION, SLOPE
from validation.thesis import HIGHEST, PIPES
from validation.verdicts import Row, above, below, more_than, row, shown

NAME = "sensing"
SCENE = "pfr_36mm_air_line.yaml"
FREE = 100  # mm, of a pipe that nothing touches
FRICTION, FRICTIONS = 0.7, (0.5, 0.7, 0.8)
OPENS, END = 12.0, 16.0  # s, of the valve and of a run
LOWEST = 9.0  # kPa
LENGTHS = (1, 2, 3)  # m, of the tube
SENSOR_NOISE = 0.1  # kPa, standard deviation of a row: 2 ms
FLOW_SPREAD = 0.05  # standard deviation of the flow of pump and of valve, from one to the next
DRAWS, SEED = 1000, 2026
LEAST_RIGHT = 0.9  # share of draws
UNSHOWN = 33  # mm, of a pipe that the detector does not know
LIMIT = 0.25  # of the logarithm of a feature over the stored one: five of FLOW_SPREAD
NONE = len(PIPES)  # what the detector answers beyond it, beside the numbers of PIPES
SENSED = (
    f"loads.air.profile={{kind: table, points: [[0 s, {HIGHEST} kPa], [{OPENS} s, {HIGHEST} kPa], "
    f"[{OPENS + 1e-3} s, 1 kPa]]}}",
    "loads.air.pump.flow=5 ml/s",
    f"time.end={END} s",
    *THINNED,
)
FEATURES = ("slope ratio", "pump time", "fall time")


def label(pipe: int, friction: float) -> str:
    """The name of a case."""
    where = "free air" if pipe == FREE else f"{pipe} mm pipe"
    return f"{where}, friction {friction:g}"


def of_length(length: int) -> str:
    """The name of a case of the thesis's rates."""
    return f"{length} m of tube"


def sensed(pipe: int, friction: float) -> Case:
    """One inflation, and natural deflation."""
    pipe_and_friction = (
        f"environment.walls.pipe.diameter={pipe} mm", f"contact.friction_coefficient={friction}"
    )  # fmt: skip
    return Case(label(pipe, friction), SCENE, (*pipe_and_friction, *SENSED))


def cases() -> list[Case]:
    """Each pipe at each friction, free air; the thesis's rates through tubes of three lengths."""
    nominal = [sensed(pipe, FRICTION) for pipe in (*PIPES, UNSHOWN, FREE)]
    spread = [sensed(pipe, f) for f in FRICTIONS if f != FRICTION for pipe in PIPES]
    lengths = [
        Case(
            of_length(length), SCENE,
            (f"loads.air.tube.length={length} m", "time.end=8 s", *THINNED),
        )
        for length in LENGTHS
    ]  # fmt: skip
    return [*nominal, *spread, *lengths]


def features(
    outcome: Outcome, noise: np.ndarray | float = 0.0, pump: float = 1.0, valve: float = 1.0
) -> np.ndarray:
    """FEATURES of a run, times in s; with `noise` [kPa] on the gauge where its slope is taken, and
    pump and valve that let through so many times as much, which take their time over that.
    """
    if not len(outcome.history):
        return np.full(len(FEATURES), NAN)
    t, true = outcome.history["time"], 1e-3 * outcome.history["pressure"]
    shown_ = true + noise
    rising, falling = t < OPENS, t > OPENS
    ratio = slope(t, true, shown_, 0.8, 0.99) / slope(t, true, shown_, 0.4, 0.6)
    pump_runs = (outcome.history["air_supply"] == 1.0).astype(float)
    pumping = np.trapezoid(pump_runs[rising], t[rising]) / pump
    fallen = (t[falling][np.argmax(true[falling] < LOWEST)] - OPENS) / valve
    return np.array([ratio, pumping, fallen])


def slope(t: np.ndarray, true: np.ndarray, read: np.ndarray, low: float, high: float) -> float:
    """Of the straight line through the readings [kPa/s] while the first rise passes from `low` to
    `high` times HIGHEST; NaN where it does not come so high.
    """
    if not (true >= high * HIGHEST).any():
        return NAN
    first, last = (int(np.argmax(true >= share * HIGHEST)) for share in (low, high))
    return float(np.polyfit(t[first:last], read[first:last], 1)[0])


def stored(outcomes: Outcomes) -> dict[int, np.ndarray]:
    """Pipe -> its features at the nominal friction."""
    return {pipe: features(outcomes[label(pipe, FRICTION)]) for pipe in PIPES}


def named(known: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Which of PIPES each feature names (features,), or NONE, by the stored ones (pipes, features);
    none where the gauge's curve has no such feature.
    """
    off = np.abs(np.log(known / found))
    beyond = ~(off.min(axis=0) <= LIMIT)
    return np.where(beyond, NONE, off.argmin(axis=0))


def confusions(outcomes: Outcomes) -> np.ndarray:
    """For each of FEATURES the share of draws of each pipe, UNSHOWN and FREE (rows) that are named
    each pipe, or NONE (columns): (features, pipes + 2, pipes + 1). NaN where a run is missing.
    """
    known = np.array(list(stored(outcomes).values()))
    behind = {p: [outcomes[label(p, friction)] for friction in FRICTIONS] for p in PIPES}
    behind |= {p: [outcomes[label(p, FRICTION)]] for p in (UNSHOWN, FREE)}
    shares = np.zeros((len(FEATURES), len(behind), len(PIPES) + 1))
    if any(not len(outcome.history) for of_pipe in behind.values() for outcome in of_pipe):
        return np.full_like(shares, NAN)
    random = np.random.default_rng(SEED)
    for k, runs in enumerate(behind.values()):
        for _ in range(DRAWS):
            outcome = runs[random.integers(len(runs))]
            noise = random.normal(0.0, SENSOR_NOISE, len(outcome.history["time"]))
            found = features(outcome, noise, *random.normal(1.0, FLOW_SPREAD, 2))
            shares[np.arange(len(FEATURES)), k, named(known, found)] += 1.0 / DRAWS
    return shares


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """The curve bends in wide pipes, the air leaves a narrow one fastest; the pipe is named."""
    ratios, _, times = np.array(list(stored(outcomes).values())).T
    behind = [outcomes[label(pipe, FRICTION)] for pipe in PIPES]
    for pipe, ratio in list(zip(PIPES, ratios, strict=True))[1:]:
        claim = f"slope near the top over that in the middle; {pipe} mm pipe"
        yield row(SLOPE, claim, "below 1", below(float(ratio), 1.0), behind)
    yield row(
        SLOPE, "that ratio is smaller in the 41 than in the 36 mm pipe", "smaller",
        more_than(float(ratios[1]), float(ratios[2])), behind,
    )  # fmt: skip
    yield row(
        SLOPE, "it is the largest in the 30 mm pipe", "largest",
        more_than(float(ratios[0]), float(max(ratios[1:]))), behind,
    )  # fmt: skip
    yield row(
        FALL_TIME, "natural deflation is the shortest in the 30 mm pipe", "shortest",
        more_than(float(min(times[1:])), float(times[0]), "s"), behind,
    )  # fmt: skip
    spread = [outcomes[label(pipe, friction)] for pipe in PIPES for friction in FRICTIONS]
    beside = [outcomes[label(pipe, FRICTION)] for pipe in (UNSHOWN, FREE)]
    for feature, shares in zip(FEATURES, confusions(outcomes), strict=True):
        right = float(np.diag(shares)[: len(PIPES)].mean())
        claim = f"one inflation names the pipe by its {feature}"
        finding = above(right, LEAST_RIGHT)
        reference = f"right in {100 * LEAST_RIGHT:g} % of draws"
        yield row(RECOGNITION, claim, reference, finding, spread)
        finding = above(float(shares[len(PIPES) :, NONE].mean()), LEAST_RIGHT)
        claim = f"a pipe of {UNSHOWN} mm and free air are named none of them by the {feature}"
        yield row(RECOGNITION, claim, reference, finding, beside)


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """Features by pipe, confusion matrices, and what the tube costs."""
    yield Listing(
        f"features of the gauge's curve, friction {FRICTION:g}",
        ("", *FEATURES),
        tuple(
            (label(pipe, FRICTION), *(shown(v) for v in features(outcomes[label(pipe, FRICTION)])))
            for pipe in (*PIPES, UNSHOWN, FREE)
        ),
    )
    asked = [f"{pipe} mm" for pipe in (*PIPES, UNSHOWN)] + ["free air"]
    for feature, of_feature in zip(FEATURES, confusions(outcomes), strict=True):
        yield Listing(
            f"share of draws named each pipe by the {feature}",
            ("pipe", *(f"named {pipe} mm" for pipe in PIPES), "none"),
            tuple(
                (pipe, *(f"{share:.3f}" for share in shares))
                for pipe, shares in zip(asked, of_feature, strict=True)
            ),
        )
    yield Listing(
        "gauge and skin [kPa] at the thesis's rates, 36 mm pipe",
        ("", "inflated: gauge", "skin", "after 1 s: gauge", "skin", "falling: gauge", "skin"),
        tuple((of_length(n), *map(shown, losses(outcomes[of_length(n)]))) for n in LENGTHS),
    )


def losses(outcome: Outcome) -> list[float]:
    """Pressure [kPa] at gauge and skin when the gauge first shows 23 kPa less half a per cent, at
    2 s where the fall begins, and at 6 s while it falls.
    """
    if not len(outcome.history):
        return [NAN] * 6
    t = outcome.history["time"]
    both = [1e-3 * outcome.history[name] for name in ("pressure", "section_pressure")]
    moments = [int(np.argmax(both[0] >= 0.995 * HIGHEST)), *np.searchsorted(t, (1.99, 6.0))]
    return [float(p[k]) for k in moments for p in both]


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Gauge and skin over time, a panel a pipe."""
    with drawing(path, 2.6) as figure:
        panels = figure.subplots(1, len(PIPES) + 1, sharey=True)
        for axes, pipe in zip(panels, (*PIPES, FREE), strict=True):
            outcome = outcomes[label(pipe, FRICTION)]
            if len(outcome.history):
                t = outcome.history["time"]
                skin = 1e-3 * outcome.history["section_pressure"]
                axes.plot(t, 1e-3 * outcome.history["pressure"], color=QUIET, label="gauge")
                axes.plot(t, skin, color=BLUE, label="skin")
            axes.axvline(OPENS, color=INK, linewidth=0.6, linestyle="--")
            axes.set(xlabel="time [s]", xlim=(0.0, END))
            axes.set_title("free air" if pipe == FREE else f"{pipe} mm pipe", fontsize=8)
        panels[0].set_ylabel("pressure [kPa]")
        if panels[0].lines[:-1]:
            panels[0].legend(loc="best")


SCRIPT = Script(
    name=NAME,
    figure="sections 4.2.4, 6.3.1, 7.2.2",
    about=(
        "The section at the end of 2 m of tube: a pump of 5 ml/s inflates it to 23 kPa on the "
        f"gauge and holds that, then the valve stays open from {OPENS:g} s on. The gauge's curve "
        "bends where the skin gives way, and less where a pipe holds it; the air leaves a skin "
        "faster that a pipe presses. A detector takes the nearest stored value of the three pipes, "
        f"or none, under {SENSOR_NOISE:g} kPa of noise, {100 * FLOW_SPREAD:g} % of spread of pump "
        "and valve, and friction of 0.5, 0.7 or 0.8. Last table: the thesis's rates, inflation "
        "with 23 and deflation with 1.3 kPa/s, through 1 to 3 m of tube."
    ),
    cases=cases,
    rows=rows,
    draw=draw,
    listings=listings,
)

if __name__ == "__main__":
    command([SCRIPT])
