"""The laws by the names that scenes and commands know them by."""

from collections.abc import Mapping

from softsim.materials.law import Law
from softsim.materials.neo_hooke import NeoHooke
from softsim.materials.yeoh import Yeoh

LAWS: Mapping[str, type[Law]] = {"yeoh": Yeoh, "neo_hooke": NeoHooke}
"""Name -> law, made from its fields in order."""
