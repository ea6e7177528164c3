"""Overrides of a pressure cycle, and how long a run of it lasts.

The thesis gives no inflation rate, and its claims are on the fall: rise and rest are kept short,
half a second from zero, and a hold in which the vibration settles.
"""

import math

from validation.thesis import HIGHEST

INFLATION_RATE = 46.0  # kPa/s
HOLD = 0.2  # s
FULL = 2.0  # s, rise and hold of robot:pfr/air_line


def deflation(
    rate: float, lowest: float, cycles: int = 1, inflation_rate: float = INFLATION_RATE
) -> tuple[str, ...]:
    """`cycles` times up to HIGHEST and down to `lowest` [kPa] at `rate`; rates in kPa/s."""
    profile = (
        f"{{kind: cycles, highest: {HIGHEST} kPa, inflation_rate: {inflation_rate} kPa/s, "
        f"hold: {HOLD} s, deflation_rate: {rate} kPa/s, lowest: {lowest} kPa, count: {cycles}}}"
    )
    rises = _rises(HIGHEST, lowest, cycles, inflation_rate)
    return _overrides(profile, rises + cycles * (HOLD + (HIGHEST - lowest) / rate))


def natural_deflation(
    time_constant: float, lowest: float, cycles: int, highest: float = HIGHEST
) -> tuple[str, ...]:
    """The same with the air let out: p = highest exp(-t / time_constant), `time_constant` in s."""
    profile = (
        f"{{kind: natural_deflation, highest: {highest} kPa, inflation_rate: {INFLATION_RATE} "
        f"kPa/s, hold: {HOLD} s, time_constant: {time_constant} s, lowest: {lowest} kPa, "
        f"count: {cycles}}}"
    )
    rises = _rises(highest, lowest, cycles, INFLATION_RATE)
    fall = time_constant * math.log(highest / lowest)
    return _overrides(profile, rises + cycles * (HOLD + fall))


def deflation_on_gauge(rate: float, lowest: float) -> tuple[str, ...]:
    """Return one cycle of robot:pfr/air_line, to `lowest` [kPa] on the gauge at `rate` [kPa/s]."""
    return (
        f"loads.air.profile.deflation_rate={rate} kPa/s",
        f"loads.air.profile.lowest={lowest} kPa",
        f"time.end={math.ceil(1e3 * (FULL + (HIGHEST - lowest) / rate))} ms",
    )


def _rises(highest: float, lowest: float, cycles: int, rate: float) -> float:
    """Time of all inflations [s]: the first starts at zero, the others at the lowest pressure."""
    return (highest + (cycles - 1) * (highest - lowest)) / rate


def _overrides(profile: str, duration: float) -> tuple[str, ...]:
    # In ms, rounded up: the last cycle must be whole.
    return f"loads.air.profile={profile}", f"time.end={math.ceil(1e3 * duration)} ms"
