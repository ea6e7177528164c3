"""Quantities with units: "36 mm" -> 0.036. The only user of pint; inside softsim all is SI."""

import math
import re
from functools import lru_cache
from typing import Any

# SI unit -> what it measures (for people) and how it is written.
KINDS = {
    "m": ("length", "36 mm"),
    "s": ("time", "24 s"),
    "kg": ("mass", "10 g"),
    "Pa": ("pressure", "23 kPa"),
    "Pa/s": ("pressure rate", "1.3 kPa/s"),
    "1/Pa": ("compressibility", "1.4 1/MPa"),
    "Hz": ("frequency", "192 Hz"),
    "rad": ("angle", "30 deg"),
    "rad/s": ("angular velocity", "10 rad/s"),
    "m/s": ("velocity", "5 mm/s"),
    "m/s^2": ("acceleration", "9.81 m/s^2"),
    "N": ("force", "0.5 N"),
    "N/m": ("stiffness", "250 N/m"),
    "kg/m^3": ("density", "1070 kg/m^3"),
    "kg*m^2": ("moment of inertia", "1 kg*mm^2"),
}


# A number and a product of units with small exponents; nothing that could be long to evaluate.
QUANTITY = re.compile(
    r"(?P<number>[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?)\s*"
    r"(?P<unit>(/\s*)?[A-Za-zµ°]+([*/ ]+[A-Za-zµ°]+|(\^|\*\*)-?\d)*)"
)


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint  # takes a third of a second: only when a quantity is read

    return pint.UnitRegistry(on_redefinition="ignore", cache_folder=None)


@lru_cache(maxsize=4096)
def parse(text: str, unit: str) -> float:
    """The value of `text` in the SI unit `unit`, a key of KINDS.

    >>> parse("36 mm", "m")
    0.036

    Raises
    ------
    ValueError: no unit, another kind of quantity, or no finite number.
    """
    kind, example = KINDS[unit]
    right = f'{kind} due, such as "{example}"'
    number = text.strip()
    try:
        bare = float(number)
    except ValueError:
        pass
    else:
        own_unit = example.split(" ", 1)[1]
        raise ValueError(f'{number} has no unit: write "{bare:g} {own_unit}"; {right}')
    written = QUANTITY.fullmatch(number)
    if written is None:
        raise ValueError(f"'{text}' is no quantity: {right}")
    registry = _registry()
    try:
        own = registry.parse_units(written["unit"].replace("/", "1/", written["unit"][0] == "/"))
    except Exception as error:  # pint raises errors of many kinds for what is no unit
        raise ValueError(f"'{written['unit']}' is no unit: {right}") from error
    return _convert(registry.Quantity(float(written["number"]), own), text, unit, right)


def _convert(quantity: Any, text: str, unit: str, right: str) -> float:
    registry = _registry()
    target = registry.parse_units(unit)
    if quantity.dimensionality != target.dimensionality:
        raise ValueError(f"'{text}' is {_kind_of(quantity)}: {right}")
    # A turn is no radian for a frequency: "192 rpm" are 3.2 Hz.
    turns = unit == "Hz" and "radian" in str(quantity.to_root_units().units)
    value = float(quantity.to("turn/second" if turns else target).magnitude)
    if not math.isfinite(value):
        raise ValueError(f"'{text}' is no finite number: {right}")
    return value


def _kind_of(quantity: Any) -> str:
    for unit, (kind, _) in KINDS.items():
        if _registry().parse_units(unit).dimensionality == quantity.dimensionality:
            return f"{'an' if kind[0] in 'aeiou' else 'a'} {kind}"
    return f"a quantity in {quantity.units:~}"
