"""What an element asks of the material it is made of."""

from collections.abc import Sequence
from typing import Any, Protocol


class Law(Protocol):
    """An isochoric strain energy W(I1_bar) with its constants."""

    @property
    def constants(self) -> tuple[float, ...]:
        """Passed to the functions below as `c` [Pa]."""

    @property
    def energy_density(self) -> Any:
        """W(I1_bar, c) [J/m^3]."""

    @property
    def energy_slope(self) -> Any:
        """dW/dI1_bar(I1_bar, c) [Pa]."""


class Branch(Protocol):
    """A Maxwell branch: spring [Pa] and relaxation time [s]."""

    @property
    def shear_modulus(self) -> float: ...

    @property
    def relaxation_time(self) -> float: ...


class Material(Protocol):
    """A nearly incompressible viscoelastic solid."""

    @property
    def law(self) -> Law: ...

    @property
    def bulk_modulus(self) -> float: ...

    @property
    def density(self) -> float: ...

    @property
    def branches(self) -> Sequence[Branch]: ...

    @property
    def impedance(self) -> float:
        """rho c_d [Pa s/m] of compression waves."""
