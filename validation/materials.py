"""3.2.2.2 and 7.2.1 of the thesis: which silicone, and spikes of another one than the skin.

The thesis tried silicones from 00-10 to 30A, took Dragon Skin 10, and proposes spikes of Dragon
Skin 30 on that skin: faster, and as easy to inflate. Here the section with such spikes, beside
sleeves of one silicone, each as many times as stiff as stated as the sleeve of the scenes is:

- In free air, driven by volume: the pressures at which the tips reach each pipe.
- In the 36 mm pipe, one cycle at 23 kPa, 192 Hz and 1.3 kPa/s.
- One spike on a plate, of the stated constants.

Ecoflex 00-30 balloons at 23 kPa, so it is only inflated, by volume. Shore 00-10 is not in the
library.
"""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from softsim.builder.materials import library_material
from softsim.report.style import BLUE, GREEN, INK, ORANGE, QUIET, drawing
from softsim.scene.materials import Material, YeohMaterial
from validation.air import deflation
from validation.cases import THINNED, Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points
from validation.motion import MILLI, NAN, displacement_while_falling, falls
from validation.script import Listing, Script
from validation.spike_patches import at
from validation.thesis import BEST_RATE, LOWEST, PIPES
from validation.verdicts import Row, more_than, row, shown, within

NAME = "materials"
PIPE = 36  # mm
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
    """Overrides that give a section the spikes of `hard_spikes`, at rest."""
    hard = yeoh(Case("", HARD_SPIKES).loaded.scene.materials["spikes"])
    return (
        f"materials.spikes={{law: yeoh, C10: {hard.C10} Pa, C20: {hard.C20} Pa, "
        f"density: {hard.density} kg/m^3}}",
        "bodies.skin.regions={spikes: {material: spikes}}",
    )


def sleeve(silicone: str) -> tuple[str, ...]:
    """Overrides that make the sleeve of a silicone, stiffer than stated as the scenes' is."""
    shipped = yeoh(Case("", "pfr_36mm.yaml").loaded.scene.materials["sleeve"])
    stated, other = (yeoh(library_material(name)) for name in ("dragon_skin_10", silicone))
    factor = shipped.C10 / stated.C10
    constants = zip(("C10", "C20", "C30"), other.constants, strict=True)
    return tuple(f"materials.sleeve.{key}={factor * value:.6g} Pa" for key, value in constants)


AT_REST: dict[str, Callable[[], tuple[str, ...]]] = {
    PLAIN: tuple, HARD: spikes, **{name: partial(sleeve, own) for name, own in SLEEVES.items()},
}  # fmt: skip
"""Variant -> overrides of the section without motion."""

ON_A_PLATE = {
    PLAIN: (),
    HARD: ("bodies.patch.regions={spikes: {material: dragon_skin_30}}",),
    **{name: (f"bodies.patch.material={own}",) for name, own in SLEEVES.items()},
}


def cycle(name: str) -> Case:
    """A variant in the pipe."""
    overrides = (*deflation(BEST_RATE, LOWEST[PIPE]), *THINNED)
    if name == HARD:
        return Case(walking(name), HARD_SPIKES, overrides)
    return Case(walking(name), f"pfr_{PIPE}mm.yaml", (*AT_REST[name](), *overrides))


def cases(quick: bool) -> list[Case]:
    """The subset walks with the silicone of the scenes and with harder spikes."""
    if quick:
        return [cycle(PLAIN), cycle(HARD)]
    return [
        *(Case(inflated(name), "pfr_free_inflation.yaml", AT_REST[name]()) for name in AT_REST),
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
    """Harder spikes: inflates as before, faster; Dragon Skin 10 before harder sleeves."""
    plain, hard = (outcomes[inflated(name)] for name in (PLAIN, HARD))
    for pipe in PIPES:
        before = reaching(plain, pipe)
        found = within(reaching(hard, pipe), before, ALIKE, "kPa")
        claim = f"{HARD}: inflates as before to the wall of a {pipe} mm pipe"
        reference = f"{shown(before, 'kPa')} within {100 * ALIKE:g} %"
        yield row(NAME, claim, reference, found, [plain, hard])
    for faster, slower in ((HARD, PLAIN), *((PLAIN, name) for name in WALKING[2:])):
        found = more_than(displacement(outcomes, faster), displacement(outcomes, slower), "mm")
        behind = [outcomes[walking(name)] for name in (faster, slower)]
        claim = f"{faster} comes farther in a cycle than {slower}; {PIPE} mm pipe"
        yield row(NAME, claim, "farther", found, behind)


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """Every variant: pressures, motion, stiffness of a spike."""
    listed = tuple(
        (
            name,
            *(shown(reaching(outcomes[inflated(name)], pipe)) for pipe in PIPES),
            shown(curve(outcomes[inflated(name)])[1].max()),
            shown(displacement(outcomes, name)) if name in WALKING else "-",
            shown(onset(outcomes, name)) if name in WALKING else "-",
            shown(at(outcomes[pressed(name)], DEPTH) / DEPTH),
        )
        for name in AT_REST
    )
    yield Listing(
        "Silicones",
        (
            "what", *(f"kPa to reach {pipe} mm" for pipe in PIPES), "highest kPa",
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
        for pipe in PIPES:
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
        "of the scenes. Claims: harder spikes are faster and inflate as before; Dragon Skin 10 is "
        "better than 20 and 30."
    ),
    cases=cases,
    rows=rows,
    draw=draw,
    columns=(),
    listings=listings,
)

if __name__ == "__main__":
    command([SCRIPT])
