"""One factor on the sleeve's three Yeoh constants: which one fits the statements at rest?

A sleeve with the thesis's constants (36, 0.25, 0.023 kPa) balloons at 8 to 9 kPa, and the thesis
works at 20 to 26 kPa. Hypothesis, with FACTOR as its only constant: the sleeve is FACTOR times as
stiff as its constants say, and the pressures of the thesis are those on the skin. Nobody knows why
it should be: seam, thread, thickness, another silicone (Dragon Skin 30 has 2.7 times the constant).

FACTOR and its BAND follow from the thesis's statements on radii, rows in contact, pull and
pressures, none on motion: what the simulation says of motion with it is a prediction. Each
statement admits a range of factors. Radii, rows and the size of the pull at 23 kPa have 2.18 to
2.26 in common, with friction 0.5 and 0.8 and with a finer mesh 2.18 to 2.22, 2.30, 2.32. The upper
end is firm: above 2.30 and 2.38 the robot does not fill the 41 and the 36 mm pipe at 20 kPa. The
lower end is soft: at 2.0 the radius in the 36 mm pipe and the pull in the 30 mm pipe are 8 and 16 %
off what is allowed. Outside lie, below: P_M3^S (1.1 to 2.1), a pull that hardly grows from 23 to
26 kPa (below 2.2), one of 2 N at 20 kPa in the 41 mm pipe (below 2.0); above: one of no more than
3.4 N at 26 kPa in the 30 mm pipe (2.7). All runs are quasi-static, so that damping does not matter.

The compressibility goes with the factor: with a bulk modulus of 200 times the shear modulus in
place of 20 all ranges are 4 to 6 % lower, with 2.08 to 2.16 in common (friction 0.8; with 0.7 the
pull in the 41 mm pipe has a gap there, 2.02 to 2.24). So 2.2 with 20 stands for 2.1 of a nearly
incompressible sleeve, which takes two and a half times the increments.

- In each pipe the section, held by a tendon, is inflated and emptied again, driven by volume
  (`held`): rows, pull, force on the upper wall over the pressure, at any factor from one run.
- In free air the smooth skin, as in `inflation_radius`.
- What else the ranges hang on: friction, root of the spikes, mesh, compressibility; and a run with
  the stated constants, which shows how well the runs scale.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from softsim.report.style import BLUE, INK, ORANGE, QUIET, SKY, WALL, drawing
from validation.admitted import Condition, admitted, told, told_of
from validation.cases import Case, Outcome, Outcomes
from validation.command import command
from validation.contact_rows import EXPECTED, expected
from validation.digitised import Points
from validation.held import Held, held
from validation.inflation_radius import (
    SPIKE_HEIGHT,
    SPIKED_DIAMETER,
    TOLERANCE,
    WORKING,
    inflated,
)
from validation.motion import NAN
from validation.pipes import LOOKS
from validation.propulsion_force import ALIKE, CLEARANCE, TENDON, WEIGHTS, WIDTH
from validation.script import Listing, Script
from validation.statements import CONTACT_ROWS, PULL, PULL_PIPE, PULL_PRESSURE, SIZE, TOUCH
from validation.thesis import (
    HIGHEST,
    HIGHESTS,
    LOWEST,
    LOWEST_SPREAD,
    PIPES,
    RING,
    STATED,
    WEIGHT,
)
from validation.verdicts import AGREES, Finding, Row, row

NAME = "sleeve_stiffness"
FACTOR = 2.2
BAND = (2.0, 2.4)

SHOWN = (1.8, 2.0, 2.2, 2.4, 2.6, 2.8, 3.0, 3.2)  # factors in the table
TRIED = np.round(np.arange(1.0, 4.001, 0.02), 2)  # factors among which ranges are sought

VOLUME = {30: 4.5, 36: 8.6, 41: 16.5}
"""Pipe [mm] -> air pumped in [ml]: further, elements of the spikes that touch are crushed."""

LEFT = {30: 0.8, 36: 2.8, 41: 3.0}
"""Pipe [mm] -> what is left of it in the end [ml]: the spikes have left the upper wall."""

SECTION = 0.12
"""Share by which the section may press harder or less hard than the robot in space at the same
pressure (robot:pfr/section).
"""

RISE, FALL = 0.4, 0.3  # s
SKIN = "skin in free air"
GIVEN_BULK, HIGH_BULK = 20.0, 200.0
"""Bulk over shear modulus: what a material has by itself, and one from which on pressures are
within 0.1 kPa of an incompressible sleeve's.
"""


@dataclass(frozen=True)
class Variant:
    """A series of runs, one a pipe. stiffness: of the sleeve, times the stated one. bulk: its bulk
    modulus over its shear modulus. mesh: settings of the mesh other than those of the scenes.
    """

    name: str
    stiffness: float = FACTOR
    friction: float = 0.7
    root: float = 2.5  # mm
    bulk: float = GIVEN_BULK
    mesh: tuple[str, ...] = ()

    def label(self, pipe: int) -> str:
        """The name of a case."""
        return f"{pipe} mm, {self.name}"

    def case(self, pipe: int) -> Case:
        """A robot held by a tendon in a pipe [mm], which lies on the bottom."""
        height = 0.5 * (pipe - WIDTH) - CLEARANCE
        profile = (
            f"{{kind: table, points: [[0 s, 0 ml], [{RISE} s, {VOLUME[pipe]} ml], "
            f"[{RISE + FALL} s, {LEFT[pipe]} ml]]}}"
        )
        overrides = (
            *(f"bodies.skin.mesh.{finer}" for finer in self.mesh),
            f"bodies.skin.mesh.root_thickness={self.root} mm",
            f"contact.friction_coefficient={self.friction}",
            *(f"materials.sleeve.{key}={value:.6g} kPa" for key, value in self._constants()),
            *(f"materials.sleeve.{key}" for key in compressibility(self.stiffness, self.bulk)),
            f"environment.walls={{pipe: {{kind: pipe, diameter: {pipe} mm, "
            f"axis_height: {height:.6g} mm}}}}",
            "environment.gravity=9.81 m/s^2",
            f"loads.gauge={{kind: tendon, acts_on: frame, stiffness: {TENDON} N/mm}}",
            f"loads.air.profile={profile}",
            f"time.end={RISE + FALL:.6g} s",
            "time.method=relaxation",  # nothing holds the robot before it has fallen to the wall
            "output.history_interval=1 ms",
            "output.frame_interval=1000 s",
        )
        return Case(self.label(pipe), "pfr_free_inflation.yaml", overrides)

    def runs(self, outcomes: Outcomes) -> dict[int, Held | None]:
        """What they say, pipe [mm] by pipe."""
        return {pipe: held(outcomes[self.label(pipe)], self.stiffness) for pipe in PIPES}

    def _constants(self) -> list[tuple[str, float]]:
        scaled = (self.stiffness * constant for constant in STATED)
        return list(zip(("C10", "C20", "C30"), scaled, strict=True))


MAIN = Variant("as the scenes")
OTHERS = (
    Variant("stated constants, scaled", stiffness=1.0),
    Variant("friction 0.5", friction=0.5),
    Variant("friction 0.8", friction=0.8),
    Variant("root 2 mm", root=2.0),
    Variant("root 3 mm", root=3.0),
    Variant("finer mesh", mesh=("spike_columns=2", "element_size=0.7 mm")),
    Variant("bulk modulus 200", bulk=HIGH_BULK),
    Variant("bulk modulus 200, friction 0.8", friction=0.8, bulk=HIGH_BULK),
)


def compressibility(stiffness: float, bulk: float) -> tuple[str, ...]:
    """The override of a sleeve's bulk modulus, if it is not what a material has by itself.

    stiffness: of the sleeve, times the stated one; its shear modulus at rest is 2 C10.
    """
    modulus = bulk * 2.0 * stiffness * STATED[0]
    return () if bulk == GIVEN_BULK else (f"bulk_modulus={modulus:.6g} kPa",)


def skin_name(bulk: float) -> str:
    """The name of the run of the smooth skin with this bulk over shear modulus."""
    return SKIN if bulk == GIVEN_BULK else f"{SKIN}, bulk modulus {bulk:g}"


def skin_case(bulk: float) -> Case:
    """The smooth skin with the stated constants, to 1.6 OD_S."""
    c10, c20, c30 = STATED
    overrides = (
        f"materials={{stated: {{law: yeoh, C10: {c10} kPa, C20: {c20} kPa, C30: {c30} kPa, "
        "density: 1070 kg/m^3}}",
        "bodies.skin.material=stated",
        *(f"materials.stated.{key}" for key in compressibility(1.0, bulk)),
        "loads.air.profile={kind: smooth_step, value: 23 ml, duration: 0.16 s}",
        "time.end=0.16 s",
        "output.history_interval=1 ms",
        "output.frame_interval=1000 s",
    )
    return Case(skin_name(bulk), "skin_inflation.yaml", overrides)


def cases() -> list[Case]:
    """One a pipe, and the skin; the others tell what else the ranges hang on."""
    variants = (MAIN, *OTHERS)
    skins = [skin_case(bulk) for bulk in sorted({variant.bulk for variant in variants})]
    return [*skins, *(variant.case(pipe) for variant in variants for pipe in PIPES)]


def conditions(outcomes: Outcomes, variant: Variant) -> list[Condition]:
    """Return the conditions of the thesis on a series of runs."""
    runs = variant.runs(outcomes)
    skin = outcomes[skin_name(variant.bulk)]
    found = [radius_condition(skin, pipe) for pipe in PIPES[1:]]
    for of_pipe in (rows_condition, same_rows, pull_at_best, pulls, pulls_alike, lets_go):
        found += [of_pipe(runs[pipe], pipe) for pipe in PIPES]
    return [*found, most_in_the_narrowest(runs)]


def radius_condition(skin: Outcome, pipe: int) -> Condition:
    """The pressures were chosen so that the robot, which adapts to 1 to 1.5 times its diameter,
    grows to the pipe's (4.2.3, 4.2.4): the highest pressure on the way to that radius.
    """
    curve = inflated(skin)
    on_the_way = np.maximum.accumulate(curve.pressure)
    radius = 0.5 * pipe - SPIKE_HEIGHT
    needed = float(np.interp(radius, curve.outer_radius, on_the_way, left=NAN, right=NAN))
    low, high = WORKING
    return Condition(
        SIZE,
        f"{pipe} mm: radius in free air",
        f"free air: grows to {pipe / SPIKED_DIAMETER:.2f} OD_S, a {pipe} mm pipe",
        f"at {low:g} to {high:g} kPa, within {100.0 * TOLERANCE:g} %",
        lambda factor: [factor * needed],
        (1.0 - TOLERANCE) * low,
        (1.0 + TOLERANCE) * high,
        "kPa",
    )


def rows_condition(run: Held | None, pipe: int) -> Condition:
    """Four rows touch in the 30 mm pipe, two to three in the others (4.2.4)."""
    low, high = EXPECTED[pipe]
    return Condition(
        CONTACT_ROWS,
        f"{pipe} mm: rows",
        f"rows that touch at 20, 23, 26 kPa; {pipe} mm pipe",
        expected(pipe),
        lambda factor: [NAN if run is None else run.rows_at(p, factor) for p in HIGHESTS],
        low,
        high,
    )


def same_rows(run: Held | None, pipe: int) -> Condition:
    """As many rows at 23 as at 26 kPa (4.2.4), of a robot that fills the pipe at 23 kPa."""

    def more(factor: float) -> list[float]:
        if run is None or run.rows_at(HIGHESTS[1], factor) == 0.0:
            return [NAN]
        return [run.rows_at(HIGHESTS[2], factor) - run.rows_at(HIGHESTS[1], factor)]

    claim = f"rows that touch at 26 kPa beyond those at 23 kPa; {pipe} mm pipe"
    return Condition(CONTACT_ROWS, f"{pipe} mm: rows, 26 less 23 kPa", claim, "0", more, 0.0, 0.0)


def pull_at_best(run: Held | None, pipe: int) -> Condition:
    """The largest pulls are 20 to 35 times the weight (4.2.4): at the best pressure of the three,
    which is the middle one.
    """
    return pull_condition(run, pipe, (HIGHEST,))


def pulls(run: Held | None, pipe: int) -> Condition:
    """The same at all three, to the letter."""
    return pull_condition(run, pipe, HIGHESTS)


def pull_condition(run: Held | None, pipe: int, pressures: tuple[float, ...]) -> Condition:
    """The robot's pull at some pressures [kPa], as far as the section can tell it."""
    low, high = (times * WEIGHT for times in WEIGHTS)
    at = ", ".join(f"{pressure:g}" for pressure in pressures)
    return Condition(
        PULL,
        f"{pipe} mm: pull at {at} kPa",
        f"largest pull at {at} kPa; {pipe} mm pipe",
        f"{low:.2f} to {high:.2f} N, within {100.0 * SECTION:g} %",
        lambda factor: [NAN if run is None else RING * run.pull_at(p, factor) for p in pressures],
        (1.0 - SECTION) * low,
        (1.0 + SECTION) * high,
        "N",
    )


def pulls_alike(run: Held | None, pipe: int) -> Condition:
    """No significant differences between 23 and 26 kPa (4.2.4), of one that fills the pipe."""

    def ratio(factor: float) -> list[float]:
        if run is None or run.rows_at(HIGHESTS[1], factor) == 0.0:
            return [NAN]
        return [run.pull_at(HIGHESTS[2], factor) / run.pull_at(HIGHESTS[1], factor)]

    return Condition(
        PULL_PRESSURE,
        f"{pipe} mm: pull at 26 over 23 kPa",
        f"pull at 26 kPa over that at 23 kPa; {pipe} mm pipe",
        f"1 within {100.0 * ALIKE:g} %",
        ratio,
        1.0 - ALIKE,
        1.0 + ALIKE,
    )


def lets_go(run: Held | None, pipe: int) -> Condition:
    """At P_M3^S the spikes barely touch the wall (6.4)."""
    low, high = ((1.0 + share) * LOWEST[pipe] for share in (-LOWEST_SPREAD, LOWEST_SPREAD))
    return Condition(
        TOUCH,
        f"{pipe} mm: P_M3^S",
        f"P_M3^S, less than the weight is left on the upper wall; {pipe} mm pipe",
        f"{LOWEST[pipe]:g} kPa within {100.0 * LOWEST_SPREAD:g} %",
        lambda factor: [NAN if run is None else run.release(WEIGHT, factor)],
        low,
        high,
        "kPa",
    )


def most_in_the_narrowest(runs: Mapping[int, Held | None]) -> Condition:
    """It pulls most in the 30 mm pipe (4.2.4): its pull over the largest of the others, each the
    mean of the three pressures.
    """

    def mean(pipe: int, factor: float) -> float:
        run = runs[pipe]
        return NAN if run is None else float(np.mean([run.pull_at(p, factor) for p in HIGHESTS]))

    def ratio(factor: float) -> list[float]:
        first, *others = (mean(pipe, factor) for pipe in PIPES)
        return [first / np.max(others)]

    claim = "pulls most in the 30 mm pipe: over the largest pull in another one"
    return Condition(PULL_PIPE, "pull: most in 30 mm", claim, "above 1", ratio, 1.0, np.inf)


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Yield the verdict on each condition at FACTOR, and the factors that it admits."""
    for condition in conditions(outcomes, MAIN):
        finding = condition.judge(FACTOR)
        computed = f"{finding.computed}; admits {told_of(condition, TRIED)}"
        judged = Finding(computed, finding.verdict)
        claim = f"{condition.claim}; sleeve {FACTOR:g} times as stiff"
        yield row(condition.statement, claim, condition.reference, judged, outcomes.values())


def fitting(found: list[Condition]) -> np.ndarray:
    """How many of the statements each of TRIED fits."""
    return np.sum([admitted(condition, TRIED) for condition in found], axis=0)


def best(found: list[Condition]) -> str:
    """Where most of the statements are fitted, and how many."""
    count = fitting(found)
    return f"{told(count == count.max(), TRIED)} ({count.max()} of {len(found)})"


def remarks(outcomes: Outcomes) -> Iterator[str]:
    """The hypothesis, and what speaks against it."""
    if any(run is None for run in MAIN.runs(outcomes).values()):
        return
    found = conditions(outcomes, MAIN)
    yield (
        f"Hypothesis: a sleeve {FACTOR:g} times ({BAND[0]:g} to {BAND[1]:g}) as stiff as its "
        "stated constants, and pressures as the thesis gives them. Most statements are fitted at "
        f"{best(found)}. Not fitted there: "
        + "; ".join(s.name for s in found if s.judge(FACTOR).verdict != AGREES)
        + ". Nobody knows why the sleeve should be stiffer."
    )


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """Yield two tables: condition over factor; condition over what else matters."""
    if any(run is None for run in MAIN.runs(outcomes).values()):
        return
    found = conditions(outcomes, MAIN)
    yield Listing(
        "Statements over the factor on the sleeve's constants (x: does not fit; ?: beyond "
        "what was run, or it does not fill the pipe)",
        ("statement", "thesis", *(f"{factor:g}" for factor in SHOWN), "admits"),
        tuple((s.name, s.reference, *map(s.shown, SHOWN), told_of(s, TRIED)) for s in found),
    )
    variants = [v for v in (MAIN, *OTHERS) if any(v.runs(outcomes).values())]
    if len(variants) > 1:
        columns = [conditions(outcomes, variant) for variant in variants]
        ranges = [[told_of(s, TRIED) for s in column] for column in columns]
        yield Listing(
            "Admitted factors, and what else they hang on",
            ("statement", *(variant.name for variant in variants)),
            tuple((s.name, *of) for s, of in zip(found, zip(*ranges, strict=True), strict=True)),
        )


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """The range that each statement admits; pull and force on the upper wall over the pressure."""
    with drawing(path, 5.4) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(3, 2))
        draw_ranges(left, conditions(outcomes, MAIN))
        low, high = (times * WEIGHT for times in WEIGHTS)
        right.axhspan(low, high, color=WALL, zorder=0, label="thesis: largest pull")
        for pipe, run in MAIN.runs(outcomes).items():
            if run is not None:
                pressure = run.pressure * FACTOR / run.stiffness
                pull = RING * run.pull * FACTOR / run.stiffness
                colour = LOOKS[pipe]["color"]
                right.plot(pressure, pull, color=colour, label=f"{pipe} mm pipe")
                right.axvline(LOWEST[pipe], color=colour, linewidth=0.8, linestyle=":")
        right.plot([], [], color=QUIET, linewidth=0.8, linestyle=":", label="thesis: P_M3^S")
        right.set(
            xlim=(0.0, 28.0), ylim=(0.0, 5.0), xlabel="pressure, rising [kPa]",
            ylabel="pull of the robot [N]", title=f"sleeve {FACTOR:g} times as stiff",
        )  # fmt: skip
        right.legend(loc="upper left", frameon=True, edgecolor="none", framealpha=1.0)


def draw_ranges(axes: Axes, found: list[Condition]) -> None:
    """A line a statement, thick where a factor fits."""
    axes.axvspan(*BAND, color=SKY, alpha=0.25, linewidth=0)
    axes.axvline(FACTOR, color=BLUE, linewidth=0.9)
    for number, condition in enumerate(found):
        fits = admitted(condition, TRIED)
        colour = INK if condition.judge(FACTOR).verdict == AGREES else ORANGE
        place = np.where(fits, float(number), NAN)
        axes.plot(TRIED, place, color=colour, linewidth=4.0, solid_capstyle="butt")
    axes.set(
        yticks=range(len(found)), yticklabels=[condition.name for condition in found],
        xlim=(TRIED[0], TRIED[-1]), ylim=(len(found) - 0.5, -0.5),
        xlabel="factor on the sleeve's constants", title="admitted by each statement",
    )  # fmt: skip
    axes.tick_params(axis="y", labelsize=7)


SCRIPT = Script(
    name=NAME,
    figure="Fig 4.9, 4.11, 4.12, Table 6.2",
    about=(
        "How stiff is the sleeve? One factor on its three Yeoh constants, the thesis's pressures "
        "taken literally, held against the statements on radii, rows in contact, pull and "
        "pressures: none on motion. Quasi-static runs, the robot held by a tendon and slowly "
        "inflated and emptied in each pipe; a skin that is as many times as stiff has the same "
        "shape at as many times the pressure, so a run a pipe tells of all factors. The verdicts "
        f"are those of a sleeve {FACTOR:g} times as stiff as stated, a hypothesis; each row says "
        "which factors it would admit."
    ),
    cases=cases,
    quick=(skin_name(MAIN.bulk), MAIN.label(36)),
    rows=rows,
    draw=draw,
    remarks=remarks,
    listings=listings,
)

if __name__ == "__main__":
    command([SCRIPT])
