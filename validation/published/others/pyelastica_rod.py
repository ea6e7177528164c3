"""The falling soft rod of `falling_rod`, computed by PyElastica: tip of the first swing.

A Cosserat rod (extension, shear, bending, linear elasticity) of 50 elements without damping, by
PyElastica's position Verlet. Compared with the rod of theory and with the solid in space. Needs
`pip install -e '.[others]'`; takes about three minutes.
"""

import elastica
import numpy as np
from rich.console import Console
from rich.table import Table

from softsim.report.style import BLUE, GREEN, INK, drawing
from validation.cases import outcomes_by_name, run_cases
from validation.published.falling_rod import (
    CASES,
    DENSITY,
    END,
    FINE,
    GRAVITY,
    LENGTH,
    MODULUS,
    RADIUS,
    Tip,
    distance,
    rod,
    solid,
)
from validation.published.others import OUT

ELEMENTS = 50
TIME_STEP = 2e-5  # s, a tenth of the travel time of a wave of extension through an element
SAMPLED_EVERY = 100  # steps


class System(
    elastica.BaseSystemCollection, elastica.Constraints, elastica.Forcing, elastica.CallBacks
):
    """Rod with a clamp, gravity and a record of its tip."""


class TipRecord(elastica.CallBackBaseClass):
    """Record of time and position of the tip, every `SAMPLED_EVERY` steps."""

    def __init__(self, times: list[float], positions: list[np.ndarray]) -> None:
        super().__init__()
        self._times, self._positions = times, positions

    def make_callback(self, system: elastica.CosseratRod, time: float, current_step: int) -> None:
        """Record the tip in the plane of the fall."""
        if current_step % SAMPLED_EVERY == 0:
            self._times.append(time)
            self._positions.append(system.position_collection[:2, -1].copy())


def cosserat_rod() -> Tip:
    """Return the tip of PyElastica's rod."""
    along, upwards, _ = np.eye(3)
    system = System()
    body = elastica.CosseratRod.straight_rod(
        ELEMENTS, np.zeros(3), along, upwards, LENGTH, RADIUS, DENSITY, youngs_modulus=MODULUS
    )
    system.append(body)
    system.constrain(body).using(
        elastica.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,)
    )
    system.add_forcing_to(body).using(elastica.GravityForces, acc_gravity=-GRAVITY * upwards)
    times: list[float] = []
    positions: list[np.ndarray] = []
    system.collect_diagnostics(body).using(TipRecord, times=times, positions=positions)
    system.finalize()
    steps = round(END / TIME_STEP)
    elastica.integrate(elastica.PositionVerlet(), system, END, steps, progress_bar=False)
    return Tip(np.array(times), np.array(positions))


def main() -> None:
    """Compute the three tips, print how they differ, and draw them."""
    console = Console()
    found = outcomes_by_name(CASES, run_cases(CASES, OUT, 1, console))
    tips = {
        "rod of theory": rod(),
        "PyElastica": cosserat_rod(),
        "softsim, solid": solid(found[FINE]),
    }
    table = Table("", "largest drop [mm]", "its time [s]", "farthest from the rod of theory [mm]")
    for name, tip in tips.items():
        drop, time = tip.lowest
        away = distance(tip, rod())
        table.add_row(name, f"{1e3 * drop:.1f}", f"{time:.3f}", f"{1e3 * away:.1f}")
    console.print(table)
    path = OUT / "pyelastica_rod.png"
    with drawing(path, 2.8) as figure:
        axes = figure.subplots()
        for (name, tip), colour in zip(tips.items(), (INK, GREEN, BLUE), strict=True):
            axes.plot(tip.time, tip.position[:, 1], color=colour, linewidth=1.2, label=name)
        axes.set(xlabel="time [s]", ylabel="height of the tip [m]")
        axes.legend()
    console.print(f"figure {path}")


if __name__ == "__main__":
    main()
