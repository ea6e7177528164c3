"""A beam of Dragon Skin 10 that drops and swings, predicted from two sets of constants.

Protocol. Data: a beam, 30 x 30 x 100 mm, clamped at one end and released from the horizontal, alone
and with 52 g (0.510 N) at its tip. Motion capture of three markers near the tip at 100 Hz, two runs
each (Dubied et al., arXiv 2201.12560). Measured: the mean drop of the markers in the last half
second, and frequency and damping ratio from eight swings after the first one.

Constants, two sets. Of the source: E = 263.8 kPa, from its COMSOL model of the beam at rest, so
that only frequencies and damping are predicted and the drops check the mechanics. Of another
laboratory: the library's dragon_skin_10 (C10 = 36 kPa, C20 = 0.25 kPa, C30 = 0.023 kPa), tension.
Both with the spectrum of Ecoflex 00-30 that the library has for all silicones, 1070 kg/m^3 and
nu = 0.49.

Model: hexahedra in space, 4 through the height; the load is a point mass on the face of the tip.
At rest: static procedure, with the long-term constants. Swings: dynamics from the horizontal.

Band. Constants of the source: 5 % for a drop, 6 % for a frequency, 15 % for a damping ratio. The
two runs differ by up to 3 % in the drops and by 6 % in the damping. Constants of another
laboratory: 30 % for drops, the difference of sources above which softsim calls a material
uncertain, and 15 % for frequencies, which go with the root of the modulus.

Not blind: these measurements have been compared with softsim before, with E = 247 kPa as a
compromise between drops and frequencies, and about the same errors were known.
"""

from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from softsim.report.style import BLUE, GREEN, ORANGE, drawing
from validation.cases import Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points
from validation.published import REFERENCE
from validation.script import PUBLISHED, Script
from validation.verdicts import Row, percent, row, shown, signed, within

NAME = "ds10_beam"
DATA = REFERENCE / NAME
SCENE = str(Path(__file__).with_name("ds10_beam.yaml"))
LENGTH, HEIGHT = 100.0, 30.0  # mm
ALONE, LOADED = "own weight", "with 52 g"
FILES = {ALONE: "gravity", LOADED: "load52"}
DURATION = {ALONE: "0.8 s", LOADED: "1.4 s"}
HALF_OF_LOAD = "conditions.load={kind: point_mass, nodes: beam.right, mass: 26 g}"
LIBRARY = ("law=yeoh", "C10=36 kPa", "C20=0.25 kPa", "C30=0.023 kPa")
CONSTANTS = {
    "of the source": (),
    "dragon_skin_10": tuple(f"materials.rubber.{constant}" for constant in LIBRARY),
}
BANDS = {"of the source": (0.05, 0.06, 0.15), "dragon_skin_10": (0.3, 0.15, 0.15)}
"""Bands of drop, frequency and damping ratio."""

SWINGS = 8


class Swing(NamedTuple):
    """Frequency [Hz] and damping ratio of a free decay."""

    frequency: float
    damping_ratio: float


def swing(time: np.ndarray, height: np.ndarray) -> Swing:
    """Return the swing of a height at equally spaced times; NaN with fewer than SWINGS + 2 turns.

    Extremes follow from parabolas through three samples. The first one depends on the release, so
    the next SWINGS half periods count. Their ratios exp(-pi zeta / sqrt(1 - zeta^2)) give the
    damping ratio zeta.
    """
    turns = np.sign(np.diff(height))
    k = np.flatnonzero(turns[:-1] * turns[1:] < 0.0) + 1
    if len(k) < SWINGS + 2:
        return Swing(np.nan, np.nan)
    slope = 0.5 * (height[k + 1] - height[k - 1])
    bend = height[k + 1] - 2.0 * height[k] + height[k - 1]
    times = (time[k] - slope / bend * (time[1] - time[0]))[1 : SWINGS + 2]
    extremes = (height[k] - 0.5 * slope**2 / bend)[1 : SWINGS + 2]
    decay = -np.polyfit(np.arange(SWINGS), np.log(np.abs(np.diff(extremes))), 1)[0]
    return Swing(0.5 * SWINGS / (times[-1] - times[0]), decay / np.hypot(np.pi, decay))


class Measured(NamedTuple):
    """Markers (3, 2) at the start along the beam and upwards [mm]; per run: time [s] and mean
    height [mm] of the markers.
    """

    markers: np.ndarray
    runs: list[tuple[np.ndarray, np.ndarray]]

    @property
    def drop(self) -> float:
        """Mean of the runs [mm], in the last half second."""
        return float(np.mean([-height[-50:].mean() for _, height in self.runs]))

    @property
    def swing(self) -> Swing:
        """Mean of the runs."""
        return Swing(*np.mean([swing(t[t > 0.0], z[t > 0.0]) for t, z in self.runs], axis=0))


@cache
def measured(beam: str) -> Measured:
    """Return what was measured on a beam."""
    runs, markers = [], []
    for file in sorted(DATA.glob(f"beam_{FILES[beam]}_V2_*_tip_mm.csv")):
        table = np.genfromtxt(file, delimiter=",")
        time, places = table[:, 0], table[:, 1:].reshape(-1, 3, 3)
        start = places[time <= 0.0].mean(axis=0)
        runs.append((time, places[:, :, 2].mean(axis=1) - start[:, 2].mean()))
        markers.append(start)
    x, _, up = np.mean(markers, axis=0).T  # x from -100 mm at the clamp, y across, z up
    return Measured(np.column_stack([x + LENGTH, up]), runs)


def name_of(beam: str, constants: str, is_swinging: bool) -> str:
    """Return the name of a case."""
    return f"{beam}, {constants}, {'swinging' if is_swinging else 'at rest'}"


def cases() -> list[Case]:
    """Return both beams with both constants, at rest and swinging."""
    found = []
    for beam in FILES:
        load = (HALF_OF_LOAD,) if beam == LOADED else ()
        dynamic = (
            "time.procedure=dynamic", f"time.end={DURATION[beam]}", "output.history_interval=1 ms"
        )  # fmt: skip
        for constants, overrides in CONSTANTS.items():
            for is_swinging in (False, True):
                name = name_of(beam, constants, is_swinging)
                changes = (*overrides, *load, *(dynamic if is_swinging else ()))
                found.append(Case(name, SCENE, changes))
    return found


def heights(outcome: Outcome, beam: str) -> np.ndarray:
    """Return the mean height of the markers (rows,) [mm], which move with the face of the tip."""
    h = outcome.history
    along, upwards = (1e3 * (h[f"upper_{axis}"] - h[f"lower_{axis}"]) for axis in "xy")
    angle = np.arctan2(-along, HEIGHT + upwards)
    arm = measured(beam).markers.mean(axis=0) - (LENGTH, 0.5 * HEIGHT)
    middle = 0.5 * 1e3 * (h["upper_y"] + h["lower_y"])
    return middle + np.sin(angle) * arm[0] + np.cos(angle) * arm[1] - arm[1]


def predicted(outcomes: Outcomes, beam: str, constants: str) -> tuple[float, Swing]:
    """Return the drop [mm] at rest and the swing; NaN of a run that failed."""
    rest, swinging = (outcomes[name_of(beam, constants, moves)] for moves in (False, True))
    drop = np.nan if rest.failure else -float(heights(rest, beam)[-1])
    if swinging.failure:
        return drop, Swing(np.nan, np.nan)
    time = np.arange(0.0, swinging.history["time"][-1], 2e-3)
    height = np.interp(time, swinging.history["time"], heights(swinging, beam))
    return drop, swing(time, height)


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Yield drop, frequency and damping ratio of each beam with each set of constants."""
    for constants, bands in BANDS.items():
        for beam in FILES:
            behind = [outcomes[name_of(beam, constants, moves)] for moves in (False, True)]
            drop, found = predicted(outcomes, beam, constants)
            of_beam = measured(beam)
            compared: Sequence[tuple[str, float, float, str]] = (
                ("drop at rest", drop, of_beam.drop, "mm"),
                ("frequency", found.frequency, of_beam.swing.frequency, "Hz"),
                ("damping ratio", found.damping_ratio, of_beam.swing.damping_ratio, ""),
            )
            for (claim, value, reference, unit), band in zip(compared, bands, strict=True):
                yield row(
                    None, f"{beam}, constants {constants}: {claim}", shown(reference, unit),
                    within(value, reference, band, unit), behind,
                    signed(value / reference - 1.0), percent(band),
                )  # fmt: skip


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Draw the height of the markers over time, measured and predicted."""
    with drawing(path, 2.8) as figure:
        for axes, beam in zip(figure.subplots(1, 2), FILES, strict=True):
            for number, (time, height) in enumerate(measured(beam).runs):
                axes.plot(time, height, color=ORANGE, label=None if number else "measured")
            for constants, colour in zip(CONSTANTS, (BLUE, GREEN), strict=True):
                outcome = outcomes[name_of(beam, constants, True)]
                if not outcome.failure:
                    axes.plot(
                        outcome.history["time"], heights(outcome, beam), color=colour,
                        label=f"constants {constants}",
                    )  # fmt: skip
            axes.set(
                xlabel="time [s]", ylabel="height of the markers [mm]", title=beam,
                xlim=(0.0, float(DURATION[beam].split()[0])),
            )  # fmt: skip
        figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=3)


SCRIPT = Script(
    name=NAME,
    figure="Dubied et al., arXiv 2201.12560, srl-ethz/diffPD_sim2real",
    about=__doc__,
    cases=cases,
    quick=(name_of(ALONE, "of the source", False), name_of(ALONE, "of the source", True)),
    rows=rows,
    draw=draw,
    evidence=PUBLISHED,
    data=DATA,
)

if __name__ == "__main__":
    command([SCRIPT])
