"""How temperature changes a motor's winding and magnets."""

from dataclasses import dataclass
from typing import NamedTuple

from actuator.parts.electrical import TemperatureCoefficient
from gear.quantities import Scalar, Temperature, check

COPPER = 3.93e-3  # 1/K at 20 degC, IEC 60028
NEODYMIUM = -1.1e-3  # 1/K; samarium-cobalt -0.35e-3, ferrite -2e-3
ROOM = 293.15  # K


class MotorTemperature(NamedTuple):
    """Temperatures of a motor's parts [K]."""

    winding: Scalar
    magnet: Scalar


@dataclass(frozen=True, kw_only=True)
class TemperatureDependence:
    """Linear change of resistance and magnet flux.

        R(T) = R (1 + copper (T_winding - reference)),     psi(T) = psi (1 + magnet (T_magnet - reference))

    Parameters
    ----------
    copper : float
        Temperature coefficient of the resistance [1/K].
    magnet : float
        Temperature coefficient of the remanence [1/K]; negative.
    reference : float
        Temperature at which the motor's own numbers hold [K].
    """

    copper: TemperatureCoefficient = COPPER
    magnet: TemperatureCoefficient = NEODYMIUM
    reference: Temperature = ROOM

    def __post_init__(self) -> None:
        check(self)

    def resistance_factor(self, temperature: MotorTemperature | None) -> Scalar:
        """Resistance over that at the reference [-]; 1 without a temperature."""
        return 1.0 if temperature is None else 1 + self.copper * (temperature.winding - self.reference)

    def flux_factor(self, temperature: MotorTemperature | None) -> Scalar:
        """Magnet flux over that at the reference [-]; 1 without a temperature."""
        return 1.0 if temperature is None else 1 + self.magnet * (temperature.magnet - self.reference)
