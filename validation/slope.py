"""Overrides of a robot that climbs: an inclined pipe, and how it gets into it.

Nothing holds the robot before its spikes touch: it cannot settle, and in a steep pipe it would be
metres away by the end of an inflation. So it starts as it is meshed and is inflated within 50 ms,
in which it falls by 1 cm. A safety line catches it 20 cm further down once it has lost the wall.

Along the axis all 14 spikes of a ring hold and push, of which the section has 7 (vertically a ring
is as stiff as 7, see softsim/scene/library/pfr/section.yaml): it stands for half of the robot
there, and carries half of its weight (softsim/loads/nodal.py). Its inertia along the axis
stays whole.
"""

from validation.air import deflation
from validation.thesis import EFFECTIVE_RATE, RING

AT_ONCE = 460.0  # kPa/s: 23 kPa in 50 ms
SLACK = 200.0  # mm, of the safety line
LINE = (
    f"{{kind: tendon, acts_on: frame, direction: [1, 0], stiffness: 0.1 N/mm, slack: {SLACK} mm}}"
)


def upwards(pipe: int, angle: int, lowest: float) -> tuple[str, ...]:
    """One cycle at the pipe's most effective rate down to `lowest` [kPa].

    pipe: diameter [mm]. angle: inclination [deg].
    """
    air = deflation(EFFECTIVE_RATE[pipe], lowest, inflation_rate=AT_ONCE)
    return (*standing(angle), "time.settle=null", *air)


def standing(angle: int) -> tuple[str, ...]:
    """Return the overrides of an inclined pipe [deg]: safety line, half of the weight along it."""
    return (
        f"environment.inclination={angle} deg",
        f"loads.line={LINE}",
        f"loads.relief={{kind: axial_relief, acts_on: frame, share: {1.0 - 1.0 / RING:g}}}",
    )
