"""Leafbot before ramps, semicircles and fields of steps (5.3): how often it gets over, by pattern.

Each cell, a terrain and a pattern, is met by several robots that differ in what nobody sets by
hand: the motor's phase, friction, frequency and the distance to the foot, drawn evenly with a
stated seed, the same draws in each cell. The motor runs as at 5 V. Passed is as the scene's
`crossing` has it: the rear end past a ramp's upper edge, a semicircle's far foot, the end of a
field. The thesis gives neither voltage nor time limit. The cells are those between which its map
of success changes, not the whole map: that is `scenes/studies/leafbot_terrain_ramps.yaml`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import uniform_filter1d

from softsim.report.study.plots import wilson_band
from softsim.report.style import BLUE, GREEN, ORANGE, QUIET, drawing
from softsim.scene.quantities import ROW_FORCE
from validation.cases import Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points
from validation.motion import MILLI, NAN
from validation.script import Listing, Script
from validation.statements import FIELDS_OF_STEPS, OBSTACLES
from validation.verdicts import Finding, Row, between, judged, more_than, row, shown

NAME = "leafbot_terrain"
FREQUENCIES = {3: 191, 5: 186, 9: 170}  # Hz at 5 V, by rows of limbs (Table 4.1)
TRIALS, SEED = 5, 22
FRICTION, START = 0.7, 42.5  # mean coefficient; mean x of the foot [mm], 10.5 mm before the robot
PHASE, FRICTION_SPREAD, START_SPREAD, FREQUENCY_SPREAD = 180.0, 0.1, 2.5, 0.05
"""Half widths: degrees, shares, and millimetres of the distance to the foot."""
TIME, FIELD_TIME = 10.0, 60.0  # s; not in the thesis
PATIENCE = 3.0  # s without progress, after which a robot counts as stuck
MESH = (
    "bodies.body.mesh.limb_columns=2", "bodies.body.mesh.element_size=0.7 mm",
    "output.history_interval=0.5 ms", "output.frame_interval=1000 s",
)  # fmt: skip
CLOSE = 0.3  # by which a share of successes may be off
MASSES = {3: (2.1, 0.23, 0.23), 5: (2.6, *3 * (0.5,)), 9: (3.0, *6 * (0.3,))}
"""Of the head's node and the rows behind it [g] (Table B.2), by rows of limbs."""
G = 9.81
COLOURS = {3: GREEN, 5: BLUE, 9: ORANGE}


@dataclass(frozen=True)
class Terrain:
    """wall: as a scene has it, without its foot. slope: at its foot [rad], rise: from there to its
    upper edge [mm] along x, both of a ramp. time: the limit [s]. trials: numbers of the draws that
    meet it. claims: rows of limbs -> share of successes that the thesis reports, where it does.
    """

    name: str
    wall: str
    time: float
    claims: dict[int, float]
    trials: tuple[int, ...] = tuple(range(TRIALS))
    slope: float = NAN
    rise: float = NAN


def ramp(slope: int, height: int, claims: dict[int, float]) -> Terrain:
    """A ramp of `slope` [deg] and `height` [mm]."""
    wall = f"kind: ramp, slope: {slope} deg, height: {height} mm"
    angle = float(np.radians(slope))
    rise = height / float(np.tan(angle)) if slope < 90 else 0.0
    name = f"ramp {slope} deg, {height} mm"
    return Terrain(name, wall, TIME, claims, slope=angle, rise=rise)


def semicircle(radius: int, claims: dict[int, float]) -> Terrain:
    """A half round of `radius` [mm]."""
    wall = f"kind: semicircle, radius: {radius} mm"
    return Terrain(f"semicircle {radius} mm", wall, TIME, claims)


def field(rugosity: float, mean: float, seed: int, claims: dict[int, float]) -> Terrain:
    """A field of steps, its blocks shuffled by `seed`, from 1; each has a draw of its own."""
    wall = f"kind: step_field, rugosity: {rugosity}, mean_height: {mean} mm, seed: {seed}"
    return Terrain(f"field {rugosity}, shuffle {seed}", wall, FIELD_TIME, claims, (seed - 1,))


RAMPS = (
    ramp(30, 10, {3: 1.0, 5: 1.0, 9: 1.0}),
    ramp(40, 25, {3: 0.0, 5: 1.0, 9: 0.0}),
    ramp(50, 20, {3: 0.0, 5: 1.0, 9: 0.0}),
    ramp(90, 10, {}),
)
SEMICIRCLES = (
    semicircle(10, {3: 1.0, 5: 1.0, 9: 1.0}),
    semicircle(20, {3: 0.0, 5: 1.0, 9: 1.0}),
    semicircle(25, {3: 0.0, 5: 0.1, 9: 1.0}),
)
ROUGH = {0.185: 4.66, 0.284: 5.17}  # rugosity -> mean height [mm] (5.3.3)
SHUFFLES = (1, 2, 3)
FIELDS = {
    rugosity: tuple(field(rugosity, mean, n, {3: 0.0, 5: 1.0, 9: 1.0}) for n in SHUFFLES)
    for rugosity, mean in ROUGH.items()
}
SINGLE = (*RAMPS, *SEMICIRCLES)
ALL = (*SINGLE, *(terrain for group in FIELDS.values() for terrain in group))


def draws() -> np.ndarray:
    """Phase, friction, start and frequency (trials, 4), between -1 and 1; more trials leave the
    earlier ones as they are.
    """
    return np.random.default_rng(SEED).uniform(-1.0, 1.0, (TRIALS, 4))


def friction_of(trial: int) -> float:
    """Coefficient of friction of a trial, from 0."""
    return FRICTION * (1.0 + FRICTION_SPREAD * float(draws()[trial, 1]))


def foot_of(trial: int) -> float:
    """Where the terrain begins [mm]."""
    return START + START_SPREAD * float(draws()[trial, 2])


def label(terrain: Terrain, rows: int, trial: int) -> str:
    """The name of a case."""
    return f"Leafbot{rows}, {terrain.name}, trial {trial + 1}"


def case(terrain: Terrain, rows: int, trial: int) -> Case:
    """A robot before a terrain."""
    phase, _, _, faster = draws()[trial]
    frequency = FREQUENCIES[rows] * (1.0 + FREQUENCY_SPREAD * faster)
    wall = f"{{{terrain.wall}, foot: [{foot_of(trial):.3f} mm, 0 mm]}}"
    overrides = (
        f"environment.walls={{ground: {wall}}}", f"crossing.patience={PATIENCE} s",
        f"time.end={terrain.time} s", f"loads.motor.phase={PHASE * phase:.2f} deg",
        f"loads.motor.frequency={frequency:.3f} Hz",
        f"contact.friction_coefficient={friction_of(trial):.4f}", *MESH,
    )  # fmt: skip
    return Case(label(terrain, rows, trial), f"leafbot{rows}.yaml", overrides)


def cases() -> list[Case]:
    """A robot a terrain, pattern and trial.

    The shorter first, and of them a trial of every cell before the next one.
    """
    each = [(t, rows, n) for t in ALL for rows in FREQUENCIES for n in t.trials]
    return [case(*one) for one in sorted(each, key=lambda one: (one[0].time, one[2]))]


def trials(outcomes: Outcomes, terrain: Terrain, rows: int) -> list[Outcome]:
    """Those of a cell."""
    return [outcomes[label(terrain, rows, n)] for n in terrain.trials]


def successes(found: list[Outcome]) -> tuple[int, int]:
    """How many robots passed, of how many that ran."""
    verdicts = [outcome.summary["crossing"]["passed"] for outcome in found if outcome.summary]
    return int(sum(verdicts)), len(verdicts)


def interval(passed: int, ran: int) -> tuple[float, float]:
    """Wilson's interval, 95 %, of a share of successes; NaN where none ran."""
    if not ran:
        return NAN, NAN
    low, high = wilson_band(np.array([passed / ran]), np.array([ran]))[:, 0]
    return float(low), float(high)


def share_in_words(passed: int, ran: int) -> str:
    """A share of successes and its interval, as people read them."""
    low, high = interval(passed, ran)
    return f"{passed} of {ran}, {low:.2f} to {high:.2f}" if ran else shown(NAN)


def rate(found: list[Outcome]) -> float:
    """The share of successes; NaN until all robots ran."""
    passed, ran = successes(found)
    return passed / ran if ran == len(found) else NAN


def near(found: list[Outcome], claimed: float) -> Finding:
    """Whether a share of successes is what is claimed, within CLOSE."""
    share = rate(found)
    holds = abs(share - claimed) <= CLOSE + 1e-9
    return judged(holds, share_in_words(*successes(found)), share)


def speed(outcome: Outcome) -> float:
    """Of the robot's rear from its start to the farthest place, over the time that the run lasted
    [mm/s]; NaN of one that failed.
    """
    if not outcome.history:
        return NAN
    t, rear = outcome.history["time"], outcome.history["rear_x"]
    return MILLI * float((rear.max() - rear[0]) / (t[-1] - t[0]))


def speeds(outcomes: Outcomes, rugosity: float, rows: int) -> np.ndarray:
    """Over all shuffles and trials of a field [mm/s] (n,)."""
    found = [trials(outcomes, terrain, rows) for terrain in FIELDS[rugosity]]
    return np.array([speed(outcome) for cell in found for outcome in cell])


def kept_grip(outcome: Outcome, terrain: Terrain, rows: int, trial: int, span: float) -> float:
    """Share of the time in state 2, the front on the ramp and the head not over its edge, in which
    the condition for no slip holds (Eq 5.26, 5.28): sum of m_i g mu over what touches behind the
    head >= (m_1 g sin beta - F_1 mu) cos beta + m_1 |dv_1/dt| (1 - cos beta), v_1 being the mean
    over `span` [s]. NaN where it never was there. A diagnostic: at 90 degrees its weight term
    vanishes, and F_1 = m_1 g presses on the slope as if that were level.
    """
    history = outcome.history
    foot = foot_of(trial)
    if not history:
        return NAN
    there = (MILLI * history["front_x"] > foot) & (MILLI * history["frame_x"] < foot + terrain.rise)
    if not there.any():
        return NAN
    mass = 1e-3 * np.array(MASSES[rows])
    merged = rows - len(mass) + 1  # rows under the head
    touch = np.array([history[f"{ROW_FORCE}body.limb{k + 1}"] > 0.0 for k in range(rows)])
    contact = np.vstack([touch[:merged].any(axis=0), touch[merged:]])
    t = history["time"]
    rows_in_span = max(1, round(span / float(np.diff(t).mean())))
    velocity = (np.gradient(history[name], t) for name in ("frame_x", "frame_y"))
    means = (uniform_filter1d(v, rows_in_span, mode="nearest") for v in velocity)
    acceleration = np.hypot(*(np.gradient(mean, t) for mean in means))
    mu, beta = friction_of(trial), terrain.slope
    grip = mu * G * mass[1:] @ contact[1:]
    weight = mass[0] * G * (np.sin(beta) - mu * contact[0]) * np.cos(beta)
    return float((grip >= weight + mass[0] * acceleration * (1.0 - np.cos(beta)))[there].mean())


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """The map's edges, cell by cell, and the orders that the thesis states."""
    for terrain in SINGLE:
        for limbs, claimed in terrain.claims.items():
            found = trials(outcomes, terrain, limbs)
            reference = f"{claimed:g} within {CLOSE:g}"
            claim = f"share of Leafbot{limbs} that passes; {terrain.name}"
            yield row(OBSTACLES, claim, reference, near(found, claimed), found)
    step = RAMPS[-1]
    both = [outcome for limbs in (5, 9) for outcome in trials(outcomes, step, limbs)]
    share = rate(both)
    struggle = judged(0.0 < share < 1.0, share_in_words(*successes(both)), share)
    yield row(
        OBSTACLES, f"Leafbot5 and 9 struggle; {step.name}", "above 0, below 1", struggle, both
    )
    yield from field_rows(outcomes)


def field_rows(outcomes: Outcomes) -> Iterator[Row]:
    """Successes and speeds on both fields."""
    for rugosity, shuffles in FIELDS.items():
        for limbs, claimed in shuffles[0].claims.items():
            found = [
                outcome for terrain in shuffles for outcome in trials(outcomes, terrain, limbs)
            ]
            claim = f"share of Leafbot{limbs} that passes; field of rugosity {rugosity}"
            yield row(
                FIELDS_OF_STEPS, claim, f"{claimed:g} within {CLOSE:g}", near(found, claimed), found
            )
    low, high = (
        {limbs: speeds(outcomes, rugosity, limbs) for limbs in (5, 9)} for rugosity in ROUGH
    )
    ratio = between(float(low[9].mean() / low[5].mean()), 0.8, 1.25)
    yield row(
        FIELDS_OF_STEPS, "Leafbot9 over Leafbot5, speed on the smoother field", "0.8 to 1.25", ratio
    )
    faster = more_than(float(high[9].mean()), float(high[5].mean()), "mm/s")
    yield row(
        FIELDS_OF_STEPS, "Leafbot9 is faster than Leafbot5 on the rougher field", "faster", faster
    )
    steadier = more_than(float(high[5].std()), float(high[9].std()), "mm/s")
    yield row(
        FIELDS_OF_STEPS, "Leafbot5 varies more than Leafbot9 on the rougher field", "more", steadier
    )


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """Shares of successes; why those that did not pass are stuck; how often 5.26 holds."""
    headings = ("terrain", *(f"Leafbot{limbs}" for limbs in FREQUENCIES))
    shares = tuple(
        (t.name, *(share_in_words(*successes(trials(outcomes, t, n))) for n in FREQUENCIES))
        for t in ALL
    )
    yield Listing("Robots that pass, with Wilson's interval", headings, shares)
    told = tuple(
        (name, outcome.summary["crossing"]["sentence"])
        for name, outcome in outcomes.items()
        if outcome.summary
    )
    yield Listing("Verdicts", ("robot", "verdict"), told)
    spans = {limbs: (0.0, 1.0 / frequency) for limbs, frequency in FREQUENCIES.items()}
    grips = tuple(
        (
            outcome.name, outcome.summary["crossing"]["verdict"],
            *(in_percent(kept_grip(outcome, terrain, limbs, n, span)) for span in spans[limbs]),
        )
        for terrain in RAMPS
        for limbs in FREQUENCIES
        for n, outcome in zip(terrain.trials, trials(outcomes, terrain, limbs), strict=True)
        if outcome.summary
    )  # fmt: skip
    heads = "robot", "verdict", "holds, v as it is", "holds, v of a turn of the motor"
    yield Listing("Condition 5.26 while the front is on the ramp", heads, grips)


def in_percent(share: float) -> str:
    """A share as people read it."""
    return shown(100.0 * share, "%")


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Shares of successes with their intervals, beside those of the thesis."""
    with drawing(path, 3.4) as figure:
        axes = figure.subplots()
        for k, (limbs, colour) in enumerate(COLOURS.items()):
            at = np.arange(len(ALL)) + 0.22 * (k - 1)
            counts = [successes(trials(outcomes, terrain, limbs)) for terrain in ALL]
            share = np.array([passed / ran if ran else NAN for passed, ran in counts])
            bounds = np.array([interval(*count) for count in counts]).T
            axes.vlines(at, *bounds, color=colour, linewidth=1.2)
            axes.plot(at, share, "o", color=colour, markersize=4, label=f"Leafbot{limbs}")
            claimed = [terrain.claims.get(limbs, NAN) for terrain in ALL]
            axes.plot(at, claimed, "_", color=colour, markersize=8)
        axes.plot([], [], "_", color=QUIET, label="thesis")
        names = [terrain.name for terrain in ALL]
        axes.set_xticks(range(len(ALL)), names, rotation=35, ha="right", rotation_mode="anchor")
        axes.set(ylabel="share that passes", ylim=(-0.05, 1.05))
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(COLOURS) + 1)


SCRIPT = Script(
    name=NAME,
    figure="Fig 5.12, 5.13, 5.15",
    about=(
        "Leafbot with three, five and nine rows of limbs before ramps, semicircles and fields of "
        f"steps: {TRIALS} robots a cell, one a shuffle of a field, that differ in motor phase, "
        "friction (10 %), start (5 mm) and frequency (5 %). Over means that the rear is past the "
        f"upper edge, the far foot or the field within {TIME:g} s, on the fields {FIELD_TIME:g} s; "
        f"a robot that comes no farther for {PATIENCE:g} s counts as stuck; "
        "intervals are Wilson's, 95 %. The thesis names neither voltage (5 V here) nor time. Three "
        "core hours."
    ),
    cases=cases,
    rows=rows,
    draw=draw,
    listings=listings,
)

if __name__ == "__main__":
    command([SCRIPT])
