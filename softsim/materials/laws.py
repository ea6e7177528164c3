"""Laws by their names in scenes and commands."""

from collections.abc import Mapping

from softsim.errors import MaterialError
from softsim.materials.law import Law
from softsim.materials.mooney_rivlin import MooneyRivlin
from softsim.materials.neo_hooke import NeoHooke
from softsim.materials.ogden import Ogden
from softsim.materials.yeoh import Yeoh

LAWS: Mapping[str, type[Law]] = {
    "yeoh": Yeoh, "neo_hooke": NeoHooke, "mooney_rivlin": MooneyRivlin, "ogden": Ogden,
}  # fmt: skip
"""Name -> law, made from its fields in order."""


def named_law(name: str) -> type[Law]:
    """Return the law of this name, or raise MaterialError."""
    if name not in LAWS:
        raise MaterialError(f"there is no law '{name}'", hint=f"one of {', '.join(LAWS)}")
    return LAWS[name]
