"""What a law is, and the laws by the names that scenes and commands know them by."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from softsim.materials.neo_hooke import NeoHooke
from softsim.materials.yeoh import Yeoh


class Law(Protocol):
    """An isochoric strain energy W(I1_bar), linear in its constants."""

    @property
    def constants(self) -> tuple[float, ...]:
        """Passed to the functions below as `c` [Pa]."""

    @property
    def initial_shear_modulus(self) -> float:
        """mu0 = 2 dW/dI1_bar at rest [Pa]."""

    @property
    def energy_density(self) -> Any:
        """W(I1_bar, c) [J/m^3]."""

    @property
    def energy_slope(self) -> Any:
        """dW/dI1_bar(I1_bar, c) [Pa]."""

    @property
    def energy_curvature(self) -> Any:
        """d2W/dI1_bar2(I1_bar, c) [Pa]."""


LAWS: Mapping[str, Callable[..., Law]] = {"yeoh": Yeoh, "neo_hooke": NeoHooke}
"""Name -> law, made from its constants [Pa] in order, C10 first."""
