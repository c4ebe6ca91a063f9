"""What a bridge of transistors and diodes takes off the voltage: dead time and conduction, averaged over a period."""

from dataclasses import dataclass

import casadi as ca

from actuator.parts.electrical import Current, DeadTime, Frequency, SeriesResistance, VoltageDrop
from gear.quantities import Scalar, check


@dataclass(frozen=True, kw_only=True)
class Bridge:
    """Voltage error of each leg by its current, averaged over the switching period.

        error(i) = -(dead_time switching_frequency dc_voltage + forward_drop) direction(i) - on_resistance i
        direction(i) = i/threshold within +-1

    Below the threshold the ripple changes the sign of the current within a period, and the error fades.
    Transistors and diodes are taken to drop the same.

    Parameters
    ----------
    dead_time : float
        Between the turn-off of one transistor of a leg and the turn-on of the other [s].
    switching_frequency : float
        [Hz].
    threshold : float
        Leg current from which on its direction is clear [A]; about half the ripple, peak to peak.
    forward_drop : float
        Of a device, at small current [V].
    on_resistance : float
        Of a device [ohm].

    References
    ----------
    S.-G. Jeong, M.-H. Park, "The Analysis and Compensation of Dead-Time Effects in PWM Inverters", IEEE
    Trans. Industrial Electronics 38 (1991), 108-114.
    """

    dead_time: DeadTime
    switching_frequency: Frequency
    threshold: Current
    forward_drop: VoltageDrop = 0.0
    on_resistance: SeriesResistance = 0.0

    def __post_init__(self) -> None:
        check(self)
        if 2 * self.dead_time * self.switching_frequency >= 1:
            raise ValueError(
                f"Bridge.dead_time must be < {0.5 / self.switching_frequency:g} s, half a period of "
                f"{self.switching_frequency:g} Hz, got {self.dead_time:g} s"
            )

    def _direction(self, current: Scalar) -> Scalar:
        return ca.fmax(-1, ca.fmin(1, current / self.threshold))

    def conduction_drop(self, current: Scalar) -> Scalar:
        """Voltage [V] that a leg loses as heat in its devices."""
        return self.forward_drop * self._direction(current) + self.on_resistance * current

    def error(self, current: Scalar, dc_voltage: Scalar) -> Scalar:
        """Voltage [V] of a leg beyond what was demanded; the current [A] leaves the leg."""
        held_back = self.dead_time * self.switching_frequency * dc_voltage * self._direction(current)
        return -held_back - self.conduction_drop(current)
