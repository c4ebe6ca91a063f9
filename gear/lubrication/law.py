"""What is asked of a lubricant, of an oil and of a law of viscosity. A new one is a new file in this folder."""

from abc import abstractmethod
from collections.abc import Callable
from typing import Protocol

from gear.quantities import Scalar

DensityLaw = Callable[[Scalar], Scalar]  # [kg/m^3] from temperature [K]


class Lubricant(Protocol):
    """What friction and drag ask of the lubricant in use.

    Where it depends on a temperature, that is a field with the role `OilTemperature`, by which `at_temperature` and the
    thermal network change it.
    """

    @abstractmethod
    def dynamic_viscosity(self) -> Scalar:
        """[Pa s]."""

    @abstractmethod
    def kinematic_viscosity(self) -> Scalar:
        """[m^2/s]."""


class OilProperties(Protocol):
    """An oil over its range of temperatures."""

    @abstractmethod
    def dynamic_viscosity(self, temperature: Scalar) -> Scalar:
        """[Pa s] at a temperature [K]."""

    @abstractmethod
    def kinematic_viscosity(self, temperature: Scalar) -> Scalar:
        """[m^2/s] at a temperature [K]."""


class ViscosityLaw(Protocol):
    """What an oil asks of its law of viscosity."""

    @abstractmethod
    def dynamic_viscosity(self, temperature: Scalar, density: DensityLaw) -> Scalar:
        """[Pa s] at a temperature [K], for an oil with this density over temperature."""

    @abstractmethod
    def lowest(self, density: DensityLaw) -> Scalar:
        """Temperature [K] down to which the law has a finite viscosity."""
