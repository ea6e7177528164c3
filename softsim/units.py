"""Conversion between texts such as "36 mm" and SI floats.

This is the only module that uses pint. Angles are a dimension of their own, so that a frequency is
never converted to an angular velocity implicitly: "192 Hz" is 192, and "192 rpm" as a frequency is
192/60 turns per second.
"""

import difflib
import math
import re
from collections import Counter
from dataclasses import dataclass
from decimal import Decimal
from functools import cache, lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pint import UnitRegistry

DEFINITIONS = """
nano- = 1e-9 = n-
micro- = 1e-6 = µ- = u- = μ-
milli- = 1e-3 = m-
centi- = 1e-2 = c-
kilo- = 1e3 = k-
mega- = 1e6 = M-
giga- = 1e9 = G-
meter = [length] = m
second = [time] = s
gram = [mass] = g
radian = [angle] = rad
inch = 0.0254 * meter = in
foot = 12 * inch = ft
liter = 1e-3 * meter ** 3 = l
minute = 60 * second = min
hour = 3600 * second = h
tonne = 1e6 * gram = t
pound = 453.59237 * gram = lb
ounce = pound / 16 = oz
newton = kilogram * meter / second ** 2 = N
pound_force = 4.4482216152605 * newton = lbf
slug = pound_force * second ** 2 / foot
joule = newton * meter = J
pascal = newton / meter ** 2 = Pa
bar = 1e5 * pascal
psi = 6894.757293168361 * pascal
mmHg = 133.322387415 * pascal
hertz = 1 / second = Hz
degree = 0.01745329251994329576923690768 * radian = deg = °
turn = 6.283185307179586476925286767 * radian = turn
rpm = turn / minute
"""
# fmt: off
UNIT_NAMES = (
    "nm", "um", "mm", "cm", "m", "in", "ft", "ul", "ml", "l", "ms", "s", "min", "h", "mg", "g",
    "kg", "t", "oz", "lb", "slug", "mN", "N", "kN", "lbf", "J", "Pa", "kPa", "MPa", "GPa", "bar",
    "mbar", "psi", "mmHg", "Hz", "kHz", "rpm", "rad", "deg", "turn",
)
# fmt: on
RADIANS_PER_TURN = Decimal("6.283185307179586476925286767")

NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,4})?"
QUANTITY = re.compile(rf"\s*(?P<number>{NUMBER})\s*(?P<unit>.{{0,60}}?)\s*", re.ASCII)
FACTOR = re.compile(
    r"\s*(?P<join>(?:1\s*)?/|[*·]|)\s*(?P<name>[A-Za-zµμ]+|°)(?:(?:\^|\*\*)?(?P<power>-?\d))?"
)


@dataclass(frozen=True)
class Kind:
    """Kind of quantity of an SI unit: its name with article, an example, and units for display."""

    name: str
    example: str
    shown_in: tuple[str, ...]


# `shown_in` runs from small to large.
KINDS = {
    "m": Kind("a length", "36 mm", ("um", "mm", "m")),
    "s": Kind("a duration", "24 s", ("us", "ms", "s")),
    "m^2": Kind("an area", "2 mm^2", ("mm^2", "cm^2", "m^2")),
    "m^3": Kind("a volume", "5 ml", ("ul", "ml", "l")),
    "1/m": Kind("a curvature", "0.015 1/mm", ("1/m", "1/mm")),
    "m^3/s": Kind("a volume flow", "10 ml/s", ("ul/s", "ml/s", "l/s")),
    "Pa*s": Kind("a viscosity", "1.81e-5 Pa*s", ("Pa*s",)),
    "kg": Kind("a mass", "10 g", ("mg", "g", "kg")),
    "rad": Kind("an angle", "30 deg", ("deg",)),
    "Hz": Kind("a frequency", "192 Hz", ("Hz", "kHz")),
    "N": Kind("a force", "0.5 N", ("uN", "mN", "N", "kN")),
    "J": Kind("an energy", "2 mJ", ("uJ", "mJ", "J")),
    "Pa": Kind("a pressure", "36 kPa", ("Pa", "kPa", "MPa", "GPa")),
    "N/m^3": Kind("a force per volume", "10 mN/mm^3", ("N/m^3", "kN/m^3", "mN/mm^3")),
    "1/Pa": Kind("an inverse pressure", "0.5 1/MPa", ("1/MPa", "1/kPa", "1/Pa")),
    "Pa/s": Kind("a pressure rate", "1.3 kPa/s", ("Pa/s", "kPa/s", "MPa/s")),
    "m/s": Kind("a speed", "5 mm/s", ("um/s", "mm/s", "m/s")),
    "m/s^2": Kind("an acceleration", "9.81 m/s^2", ("mm/s^2", "m/s^2")),
    "rad/s": Kind("an angular velocity", "20 rad/s", ("rad/s",)),
    "kg/m^3": Kind("a density", "1070 kg/m^3", ("kg/m^3",)),
    "kg/m": Kind("a mass per length", "2.4 g/m", ("mg/m", "g/m", "kg/m")),
    "kg*m^2": Kind("a moment of inertia", "0.5 kg*mm^2", ("g*mm^2", "kg*mm^2", "kg*m^2")),
    "N*m/rad": Kind("a turning stiffness", "0.5 N*mm/rad", ("N*mm/rad", "N*m/rad")),
    "N*s/m": Kind("a damping coefficient", "1.3 N*s/m", ("mN*s/m", "N*s/m")),
    "N*m^2": Kind("a bending stiffness", "20 N*mm^2", ("N*mm^2", "N*m^2")),
    "N/m": Kind("a stiffness", "200 N/m", ("mN/m", "N/m", "kN/m", "MN/m")),
    "J/m^2": Kind("an energy per area", "50 mJ/m^2", ("mJ/m^2", "J/m^2")),
}

Dimension = frozenset[tuple[str, int]]
FREQUENCY: Dimension = frozenset({("[time]", -1)})
TURNING: Dimension = frozenset({("[angle]", 1), ("[time]", -1)})


def parse(text: str, unit: str) -> float:
    """Return the quantity in `text`, such as "36 mm", in the SI unit `unit`, a key of `KINDS`.

    Raises
    ------
    ValueError: no unit, an unknown one, one of another dimension, no number, or one too large.
    """
    kind = KINDS[unit]
    match = QUANTITY.fullmatch(text)
    if match is None:
        raise ValueError(f'{text!r} is not {kind.name}: write it like "{kind.example}"')
    if not match["unit"]:
        usual = f"{match['number']} {usual_unit(unit)}"
        raise ValueError(f'{kind.name} needs a unit: write "{usual}"')
    try:
        factor = _factor(match["unit"], unit)
    except ValueError as error:
        raise ValueError(f"{text!r} {error}") from None
    value = float(Decimal(match["number"]) * factor)
    if not math.isfinite(value):
        raise ValueError(f"{text!r} is too large for {kind.name}")
    return value


def unit_of(text: str) -> str:
    """Return the unit in a text that `parse` accepts: "mm" of "36 mm"."""
    match = QUANTITY.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not a quantity")
    return match["unit"]


def number_in(text: str, unit: str, si: str) -> float:
    """Return the number of a quantity, which `parse` accepts as `si`, in `unit`.

    The result is 0.2 for "200 Pa" in kPa.
    """
    match = QUANTITY.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not a quantity")
    return float(Decimal(match["number"]) * _factor(match["unit"], si) / _factor(unit, si))


def size_of(unit: str, si: str) -> float:
    """Return the size of one `unit` in `si`, a key of `KINDS`: 0.001 for "mm" in "m".

    Raises
    ------
    ValueError: an unknown unit, or one of another dimension.
    """
    return float(_factor(unit, si))


def usual_unit(si: str) -> str:
    """Return the usual unit of quantities that are `si` in SI: "mm" for "m"."""
    return KINDS[si].example.split(" ", 1)[1]


def format_quantity(value: float, unit: str) -> str:
    """Return `value`, in the SI unit `unit`, as a text with six digits.

    For example, 0.036 in "m" gives "36 mm".
    """
    shown = [(name, float(_factor(name, unit))) for name in KINDS[unit].shown_in]
    # a value that rounds to 1 of a unit is shown in it: 0.99999999 m as "1 m", not "1000 mm"
    fitting = [one for one in shown if abs(value) >= (1.0 - 5e-7) * one[1]]
    name, size = fitting[-1] if fitting and math.isfinite(value) else shown[0]
    return f"{value / size:.6g} {name}" if value else f"0 {unit}"


@lru_cache(maxsize=1024)
def count_text(count: int, thing: str) -> str:
    """Return a count with its noun: "1 case", "2 cases"."""
    return f"{count:,} {thing}" + ("" if count == 1 else "s")


def _factor(expression: str, unit: str) -> Decimal:
    """Return the size of one `expression` in `unit`; raise ValueError if dimensions differ."""
    scale, dimension = _measure(expression)
    due_scale, due = _measure(unit)
    if due == FREQUENCY and dimension == TURNING:
        scale, dimension = scale / RADIANS_PER_TURN, due
    if dimension != due:
        kind = KINDS[unit]
        given = [k.name for other, k in KINDS.items() if _measure(other)[1] == dimension]
        what = f"is {given[0]}, " if given else ""
        is_due = f"{kind.name} is needed"
        raise ValueError(f'{what or "measures something else: "}{is_due}, such as "{kind.example}"')
    return scale / due_scale


@lru_cache(maxsize=1024)
def _measure(expression: str) -> tuple[Decimal, Dimension]:
    """Return the scale to base units and the dimension of a product of powers of units."""
    scale, powers, position = Decimal(1), Counter[str](), 0
    plain = expression.translate({ord("²"): "2", ord("³"): "3"})
    while position < len(plain):
        match = FACTOR.match(plain, position)
        if match is None:
            raise ValueError(f'has no readable unit in {expression!r}: write it like "kg/m^3"')
        power = int(match["power"] or 1) * (-1 if match["join"].endswith("/") else 1)
        unit_scale, dimension = _named_unit(match["name"])
        scale *= unit_scale**power
        for base, exponent in dimension:
            powers[base] += exponent * power
        position = match.end()
    return scale, frozenset((base, power) for base, power in powers.items() if power)


def _named_unit(name: str) -> tuple[Decimal, Dimension]:
    """Return scale and dimension of a unit with its prefix; raise ValueError if unknown."""
    from pint.errors import UndefinedUnitError

    try:
        unit = _registry().Unit(name)
        scale = Decimal(str(_registry().get_root_units(unit)[0]))
    except (UndefinedUnitError, ValueError):  # pint reads "nan" as a prefix without a unit
        close = difflib.get_close_matches(name.lower(), [u.lower() for u in UNIT_NAMES], n=9)
        meant = [u for u in UNIT_NAMES if u.lower() in close[:1]]
        hint = f"did you mean {' or '.join(meant)}?" if meant else f"known: {', '.join(UNIT_NAMES)}"
        raise ValueError(f"has the unknown unit {name!r}: {hint}") from None
    return scale, frozenset((base, int(str(p))) for base, p in unit.dimensionality.items())


@cache
def _registry() -> "UnitRegistry":
    import pint  # slow to import, and a scene without quantities or a --help needs none

    registry: UnitRegistry = pint.UnitRegistry(None, non_int_type=Decimal)
    registry.load_definitions(DEFINITIONS.strip().splitlines())
    return registry
