"""Steady currents of a synchronous motor within the voltage and the current of its inverter."""

import math
from typing import Any

import numpy as np
from scipy.optimize import fminbound, root_scalar

from actuator.parts.inverter import Inverter
from actuator.parts.temperature import MotorTemperature

FINE = 1e-14  # of the current limit: how closely a corner of circle and ellipse is found


class VoltageEllipse:
    """Steady currents of a PMSM at one speed within the voltage limit V.

        (R id - Xq iq)^2 + (R iq + Xd id + E)^2 <= V^2,     Xd = we Ld, Xq = we Lq, E = we psi

    Solved for iq the discriminant is Z^2 V^2 - (K id + Xq E)^2, with K = R^2 + Xd Xq and Z^2 = R^2 + Xq^2.
    """

    def __init__(self, motor: Any, inverter: Inverter, speed: float, temperature: MotorTemperature | None) -> None:
        self.motor, self.limit, self.speed, self.temperature = motor, inverter.current_limit, speed, temperature
        electrical, self.voltage = motor.pole_pairs * speed, inverter.dc_voltage / math.sqrt(3)
        self.resistance, self.emf = motor.resistance_at(temperature), electrical * motor.flux_at(temperature)
        self.reactance_d, self.reactance_q = electrical * motor.inductance_d, electrical * motor.inductance_q
        self.impedance = math.hypot(self.resistance, self.reactance_q)
        self.determinant = self.resistance**2 + self.reactance_d * self.reactance_q

    def without_weakening(self) -> list[float]:
        """Direct and quadrature current [A] of the largest torque at zero direct current."""
        quadrature = self._quadrature(0.0)
        if self.reactance_q * self.emf > self.impedance * self.voltage or quadrature < -self.limit:
            raise self._too_fast("without direct current")
        return [0.0, quadrature]

    def weakened(self) -> list[float]:
        """Direct and quadrature current [A] of the largest torque with id <= 0.

        Where the torque is positive it is the product of two concave functions of id (the smaller of circle and
        ellipse; the flux with its saliency), so its logarithm is concave and a search finds its one maximum.
        """
        center, half = (
            size / self.determinant for size in (-self.reactance_q * self.emf, self.impedance * self.voltage)
        )
        low, high = max(-self.limit, center - half), min(0.0, center + half)
        if low > high:
            raise self._too_fast("with field weakening")
        near = float(np.asarray(fminbound(lambda direct: -self._torque(direct), low, high)))
        # the maximum may be a corner, where circle and ellipse meet: a root is sharper there than a search
        corners = [
            root_scalar(self._spare, bracket=ends, xtol=FINE * self.limit).root
            for ends in ((low, near), (near, high))
            if self._spare(ends[0]) * self._spare(ends[1]) < 0
        ]
        best = max((low, high, near, *corners), key=self._torque)
        if self._torque(best) < 0:
            raise self._too_fast("with positive torque")
        return [best, self._quadrature(best)]

    def _by_voltage(self, direct: float) -> float:
        room = (self.impedance * self.voltage) ** 2 - (self.determinant * direct + self.reactance_q * self.emf) ** 2
        middle = self.resistance * (self.emf + (self.reactance_d - self.reactance_q) * direct)
        return (math.sqrt(max(room, 0.0)) - middle) / self.impedance**2  # at the ends `room` is zero but for rounding

    def _by_current(self, direct: float) -> float:
        return math.sqrt(max(self.limit**2 - direct**2, 0.0))

    def _quadrature(self, direct: float) -> float:
        return min(self._by_current(direct), self._by_voltage(direct))

    def _spare(self, direct: float) -> float:
        return self._by_current(direct) - self._by_voltage(direct)

    def _torque(self, direct: float) -> float:
        return self.motor.torque([direct, self._quadrature(direct)], self.temperature)

    def _too_fast(self, how: str) -> ValueError:
        return too_fast(self.speed, self.limit, f"{self.voltage:g} V (peak, a phase) {how}")


def too_fast(speed: float, limit: float, voltage: str) -> ValueError:
    """The refusal of a speed at which no current within the limit [A] holds the voltage."""
    return ValueError(
        f"torque_speed_curve: at {speed:g} rad/s no current within {limit:g} A, the current limit, holds the voltage "
        f"at {voltage}; ask for lower speeds"
    )
