"""Lubricating oils: viscosity and density over temperature."""

from dataclasses import dataclass
from numbers import Real

from gear.lubrication.law import OilProperties, ViscosityLaw
from gear.quantities import Density, Expansion, Scalar, Temperature, check
from gear.quantities.registry import part

ROUNDING = 1e-6  # K; a temperature converted from degC may miss the end of the range by rounding


@part(OilProperties)
@dataclass(frozen=True, kw_only=True)
class Oil(OilProperties):
    """A lubricant between its lowest and highest temperature.

        density(T) = density (1 - expansion (T - density_temperature))
        dynamic viscosity = density * kinematic viscosity

    Parameters
    ----------
    law : ViscosityLaw
        Viscosity over temperature.
    density : float
        At `density_temperature` [kg/m^3].
    density_temperature : float
        [K].
    expansion : float
        Thermal expansion coefficient [1/K].
    lowest, highest : float
        Temperatures between which the oil may be used [K].
    name : str
        For messages.

    Raises
    ------
    ValueError
        Where a number out of the range is asked for. An expression is not held against the range.
    """

    law: ViscosityLaw
    density: Density
    density_temperature: Temperature
    expansion: Expansion
    lowest: Temperature
    highest: Temperature
    name: str = "oil"

    def __post_init__(self) -> None:
        check(self)
        if self.lowest >= self.highest:
            raise ValueError(f"Oil.lowest must be < {self.highest:g} K, the highest, got {self.lowest:g} K")
        end = self.law.lowest(self._density)
        if self.lowest <= end:
            raise ValueError(f"Oil.lowest must be > {end:.4g} K, where its law ends, got {self.lowest:g} K")
        if self._density(self.highest) <= 0:
            raise ValueError(f"Oil.expansion {self.expansion:g} 1/K leaves no density at {self.highest:g} K")

    def _density(self, temperature: Scalar) -> Scalar:
        return self.density * (1 - self.expansion * (temperature - self.density_temperature))

    def density_at(self, temperature: Scalar) -> Scalar:
        """[kg/m^3] at a temperature [K]."""
        self.require_within(temperature)
        return self._density(temperature)

    def dynamic_viscosity(self, temperature: Scalar) -> Scalar:
        """[Pa s] at a temperature [K]."""
        self.require_within(temperature)
        return self.law.dynamic_viscosity(temperature, self._density)

    def kinematic_viscosity(self, temperature: Scalar) -> Scalar:
        """[m^2/s] at a temperature [K]."""
        return self.dynamic_viscosity(temperature) / self.density_at(temperature)

    def require_within(self, temperature: Scalar) -> None:
        """Refuse a number out of the range; an expression has no value yet."""
        if isinstance(temperature, Real) and not (
            self.lowest - ROUNDING <= float(temperature) <= self.highest + ROUNDING
        ):
            raise ValueError(
                f"{self.name}: temperature must be from {self.lowest:g} K to {self.highest:g} K, got {temperature:g} K"
            )
