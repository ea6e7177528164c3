"""Overrides of a pressure cycle, and how long a run of it lasts.

The thesis gives no inflation rate. Little moves while the pressure rises or rests at its highest,
so both are kept short: half a second from zero, and a hold in which the vibration settles.
"""

import math

from validation.thesis import HIGHEST

INFLATION_RATE = 46.0  # kPa/s
HOLD = 0.2  # s


def deflation(rate: float, lowest: float, cycles: int = 1) -> tuple[str, ...]:
    """`cycles` times up to HIGHEST and down to `lowest` [kPa] at `rate` [kPa/s]."""
    profile = (
        f"{{kind: cycles, highest: {HIGHEST} kPa, inflation_rate: {INFLATION_RATE} kPa/s, "
        f"hold: {HOLD} s, deflation_rate: {rate} kPa/s, lowest: {lowest} kPa, count: {cycles}}}"
    )
    return _overrides(profile, (HIGHEST - lowest) / rate, lowest, cycles)


def natural_deflation(time_constant: float, lowest: float, cycles: int) -> tuple[str, ...]:
    """The same with the air let out: p = HIGHEST exp(-t / time_constant), `time_constant` in s."""
    profile = (
        f"{{kind: natural_deflation, highest: {HIGHEST} kPa, inflation_rate: {INFLATION_RATE} "
        f"kPa/s, hold: {HOLD} s, time_constant: {time_constant} s, lowest: {lowest} kPa, "
        f"count: {cycles}}}"
    )
    return _overrides(profile, time_constant * math.log(HIGHEST / lowest), lowest, cycles)


def _overrides(profile: str, fall: float, lowest: float, cycles: int) -> tuple[str, ...]:
    # The first inflation starts at zero, the others at the lowest pressure.
    rises = (HIGHEST + (cycles - 1) * (HIGHEST - lowest)) / INFLATION_RATE
    end = math.ceil(1e3 * (rises + cycles * (HOLD + fall)))  # ms; the last cycle must be whole
    return f"loads.air.profile={profile}", f"time.end={end} ms"
