"""3.2.2.2 and 7.2.1 of the thesis: which silicone, and spikes of another one than the skin.

The thesis tried silicones from 00-10 to 30A, took Dragon Skin 10, and proposes spikes of Dragon
Skin 30 on that skin: faster, and as easy to inflate. Here the section with such spikes, beside
sleeves of one silicone, each as many times as stiff as stated as the sleeve of the scenes is:

- In free air, driven by volume: the pressures at which the tips, the mean of them, reach a pipe.
- In the 36 mm pipe, one cycle at 23 kPa, 192 Hz and 1.3 kPa/s.
- One spike on a plate, of the stated constants.

Ecoflex 00-30 balloons at 23 kPa, so it is only inflated, by volume. Shore 00-10 is not in the
library.
"""

from collections.abc import Callable, Iterator
from functools import partial
from json import dumps
from pathlib import Path

import numpy as np

from softsim.materials.library import library_material
from softsim.report.style import BLUE, GREEN, INK, ORANGE, QUIET, drawing
from softsim.scene.materials import Material, YeohMaterial
from softsim.scene.text import plain
from validation.air import deflation
from validation.cases import THINNED, Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points
from validation.motion import MILLI, NAN, displacement_while_falling, falls
from validation.script import Listing, Script
from validation.spike_patches import at
from validation.statements import HARDER_SPIKES, SLEEVE
from validation.thesis import BEST_RATE, HIGHEST, LOWEST
from validation.verdicts import Row, above, below, more_than, row, shown, within

NAME = "materials"
PIPE = 36  # mm
INFLATED = (30, 36)  # mm, pipes to whose wall the tips come, on the mean
TIP = 13.5  # mm, radius at which the tips are at first
ALIKE = 0.1  # share by which pressures may differ
PLAIN, HARD = "Dragon Skin 10", "spikes of Dragon Skin 30 on 10"
SLEEVES = {
    "Dragon Skin 20": "dragon_skin_20",
    "Dragon Skin 30": "dragon_skin_30",
    "Ecoflex 00-30": "ecoflex_00_30",
}
"""A whole sleeve of one silicone -> its name in the library."""
WALKING = (PLAIN, HARD, "Dragon Skin 20", "Dragon Skin 30")
COLOURS = dict(zip((PLAIN, HARD, *SLEEVES), (INK, ORANGE, BLUE, GREEN, QUIET), strict=True))
HARD_SPIKES = "pfr_36mm_hard_spikes.yaml"
ALONE = ("bodies.patch.mesh.columns=1", "bodies.patch.mesh.rows=1")
DEPTH = 0.1e-3  # m, of the plate


def inflated(name: str) -> str:
    """The name of a case."""
    return f"{name}, inflated"


def walking(name: str) -> str:
    """The name of a case."""
    return f"{name}, {PIPE} mm pipe"


def pressed(name: str) -> str:
    """The name of a case."""
    return f"{name}, a spike on a plate"


def yeoh(material: Material | None) -> YeohMaterial:
    """A material, which must be a Yeoh solid."""
    if not isinstance(material, YeohMaterial):
        raise ValueError(f"{material} is no Yeoh solid")
    return material


def spikes() -> tuple[str, ...]:
    """Overrides that give a section the spikes of HARD_SPIKES."""
    given = plain(Case("", HARD_SPIKES).loaded.tree)
    material, regions = given["materials"]["spikes"], given["bodies"]["skin"]["regions"]
    return f"materials.spikes={dumps(material)}", f"bodies.skin.regions={dumps(regions)}"


def sleeve(silicone: str) -> tuple[str, ...]:
    """Overrides that make the sleeve of a silicone, stiffer than stated as the scenes' is."""
    shipped = yeoh(Case("", "pfr_36mm.yaml").loaded.scene.materials["sleeve"])
    stated, other = (yeoh(library_material(name)) for name in ("dragon_skin_10", silicone))
    factor = shipped.C10 / stated.C10
    constants = zip(("C10", "C20", "C30"), other.constants, strict=True)
    return tuple(f"materials.sleeve.{key}={factor * value:.6g} Pa" for key, value in constants)


VARIANTS: dict[str, Callable[[], tuple[str, ...]]] = {
    PLAIN: tuple, HARD: spikes, **{name: partial(sleeve, own) for name, own in SLEEVES.items()},
}  # fmt: skip
"""Variant -> overrides of the section."""

ON_A_PLATE = {
    PLAIN: (),
    HARD: ("bodies.patch.regions={spikes: {material: dragon_skin_30}}",),
    **{name: (f"bodies.patch.material={own}",) for name, own in SLEEVES.items()},
}


def cycle(name: str) -> Case:
    """A variant in the pipe."""
    overrides = (*VARIANTS[name](), *deflation(BEST_RATE, LOWEST[PIPE]), *THINNED)
    return Case(walking(name), f"pfr_{PIPE}mm.yaml", overrides)


def cases() -> list[Case]:
    """Free air, one cycle in the pipe, one spike on a plate."""
    return [
        *(Case(inflated(name), "pfr_free_inflation.yaml", VARIANTS[name]()) for name in VARIANTS),
        *(cycle(name) for name in WALKING),
        *(Case(pressed(name), "spike_patch.yaml", (*ALONE, *changed))
          for name, changed in ON_A_PLATE.items()),
    ]  # fmt: skip


def curve(outcome: Outcome) -> tuple[np.ndarray, np.ndarray]:
    """Radius of the tips [mm] and pressure [kPa] (rows,) while a section is inflated."""
    history = outcome.history
    if not history:
        return np.full(2, NAN), np.full(2, NAN)
    return TIP + MILLI * history["tip_y"], history["pressure"] / MILLI


def reaching(outcome: Outcome, pipe: int) -> float:
    """Pressure at which the tips reach the wall of a pipe in free air [kPa]."""
    radius, pressure = curve(outcome)
    reached = np.flatnonzero(radius >= pipe / 2)
    return float(pressure[reached[0]]) if len(reached) else NAN


def displacement(outcomes: Outcomes, name: str) -> float:
    """While the pressure falls [mm]."""
    return MILLI * displacement_while_falling(outcomes[walking(name)].history)


def onset(outcomes: Outcomes, name: str) -> float:
    """Pressure at which it sets off [kPa]."""
    cycles = falls(outcomes[walking(name)].history)
    return cycles[0].onset_pressure / MILLI if cycles else NAN


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Harder spikes: inflates as before, faster; harder sleeves: they do not fill the pipe."""
    before, after = (outcomes[inflated(name)] for name in (PLAIN, HARD))
    for pipe in INFLATED:
        wanted = reaching(before, pipe)
        found = within(reaching(after, pipe), wanted, ALIKE, "kPa")
        claim = f"{HARD}: inflates as before to the wall of a {pipe} mm pipe"
        reference = f"{shown(wanted, 'kPa')} within {100 * ALIKE:g} %"
        yield row(HARDER_SPIKES, claim, reference, found, [before, after])
    found = more_than(displacement(outcomes, HARD), displacement(outcomes, PLAIN), "mm")
    behind = [outcomes[walking(name)] for name in (HARD, PLAIN)]
    yield row(
        HARDER_SPIKES, f"{HARD}: comes farther in a cycle, {PIPE} mm pipe", "farther", found, behind
    )
    limit = f"{HIGHEST:g} kPa"
    claim = f"{PLAIN} reaches the wall of the {PIPE} mm pipe"
    found = below(reaching(before, PIPE), HIGHEST, "kPa")
    yield row(SLEEVE, claim, f"below {limit}", found, [before])
    for name in ("Dragon Skin 20", "Dragon Skin 30"):
        harder = outcomes[inflated(name)]
        found = above(reaching(harder, PIPE), HIGHEST, "kPa")
        claim = f"{name} hinders the inflation to the {PIPE} mm pipe"
        yield row(SLEEVE, claim, f"above {limit}", found, [harder])


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """Every variant: pressures, motion, stiffness of a spike."""
    listed = tuple(
        (
            name,
            *(shown(reaching(outcomes[inflated(name)], pipe)) for pipe in INFLATED),
            shown(curve(outcomes[inflated(name)])[1].max()),
            shown(displacement(outcomes, name)) if name in WALKING else "-",
            shown(onset(outcomes, name)) if name in WALKING else "-",
            shown(at(outcomes[pressed(name)], DEPTH) / DEPTH),
        )
        for name in VARIANTS
    )
    yield Listing(
        "Silicones",
        (
            "what", *(f"kPa to reach {pipe} mm" for pipe in INFLATED), "highest kPa",
            f"mm a cycle, {PIPE} mm pipe", "sets off at kPa", "N/m of a spike, as stated",
        ),
        listed,
    )  # fmt: skip


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Pressure over the tips' radius; the way while the pressure falls."""
    with drawing(path, 3.0) as figure:
        left, right = figure.subplots(1, 2)
        for name, colour in COLOURS.items():
            radius, pressure = curve(outcomes[inflated(name)])
            left.plot(radius, pressure, color=colour, label=name)
            for fall in falls(outcomes[walking(name)].history) if name in WALKING else ():
                way = MILLI * (fall.x - fall.x[fall.began])[fall.began :]
                right.plot(fall.pressure[fall.began :] / MILLI, way, color=colour)
        for pipe in INFLATED:
            left.axvline(pipe / 2, color=QUIET, linewidth=0.7, linestyle="--")
        left.set(xlabel="radius of the tips [mm]", ylabel="pressure [kPa]", title="in free air")
        right.invert_xaxis()
        right.set(xlabel="pressure, falling [kPa]", ylabel="way [mm]", title=f"{PIPE} mm pipe")
        left.legend(fontsize="small")


SCRIPT = Script(
    name=NAME,
    figure="3.2.2.2, 7.2.1",
    about=(
        "Sleeves of Dragon Skin 10, 20, 30, of Ecoflex 00-30, and of Dragon Skin 10 with spikes of "
        "Dragon Skin 30, by the plane section: pressure over radius in free air, one cycle in the "
        "36 mm pipe, one spike on a plate. All are as many times stiffer than stated as the sleeve "
        "of the scenes. Claims: harder spikes are faster and inflate as before; sleeves "
        "harder than Dragon Skin 10 do not fill the pipe at 23 kPa."
    ),
    cases=cases,
    rows=rows,
    draw=draw,
    listings=listings,
)

if __name__ == "__main__":
    command([SCRIPT])
