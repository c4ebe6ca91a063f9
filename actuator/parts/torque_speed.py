"""The torque a drive can hold at a speed, within the voltage and the current of its inverter."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import fminbound, root_scalar

from actuator.parts.dc_motor import DCMotor
from actuator.parts.inverter import Inverter
from actuator.parts.pmsm import PMSM
from actuator.parts.temperature import MotorTemperature

FINE = 1e-14  # of the current limit: how closely a corner of circle and ellipse is found


@dataclass(frozen=True, kw_only=True, eq=False)
class TorqueSpeedCurve:
    """Largest steady torque over speed.

    Attributes
    ----------
    speeds : ndarray
        Of the motor [rad/s], (n,).
    torques : ndarray
        At the shaft, drag taken off and cogging averaged out [N m], (n,).
    currents : dict
        Of each axis [A], (n,).
    """

    speeds: np.ndarray
    torques: np.ndarray
    currents: dict[str, np.ndarray]

    def plot(self, ax: Any = None) -> Any:
        """Torque over speed; returns the axes."""
        import matplotlib.pyplot as plt

        ax = plt.subplots()[1] if ax is None else ax
        ax.plot(self.speeds, self.torques)
        ax.set(xlabel="motor speed [rad/s]", ylabel="torque [N m]")
        ax.grid(visible=True)
        return ax


def torque_speed_curve(
    motor: DCMotor | PMSM,
    inverter: Inverter,
    speeds: Sequence[float],
    *,
    field_weakening: bool = False,
    temperature: MotorTemperature | None = None,
) -> TorqueSpeedCurve:
    """Largest torque in positive direction that can be held at each speed.

        DC motor:        i = min(current_limit, (dc_voltage - torque_constant w)/resistance)
        PMSM, id = 0:    iq the smaller of current_limit and the larger root of
                         (we^2 Lq^2 + R^2) iq^2 + 2 R we psi iq + we^2 psi^2 = dc_voltage^2/3
        with field weakening: the id <= 0 with the largest torque of such an iq, both within the current limit

    Without field weakening the torque is negative beyond the no-load speed: the motor brakes even at full voltage.
    What the bridge loses is not counted, and the voltage limit is the circle.

    Parameters
    ----------
    motor : DCMotor or PMSM
        Without saturation.
    inverter : Inverter
        Its voltage and current limits.
    speeds : sequence
        Of the motor, not negative [rad/s].
    field_weakening : bool
        Whether a PMSM may use direct current; then also maximum torque per ampere at low speed.
    temperature : MotorTemperature or None
        None for the reference.

    Raises
    ------
    ValueError
        For a negative speed, one at which no allowed current holds the voltage (or, with field weakening, has
        positive torque), and a motor with saturation.
    """
    if isinstance(motor, PMSM) and motor.saturation is not None:
        raise ValueError(
            "torque_speed_curve is a closed form of constant inductances; give the motor without saturation "
            "(dataclasses.replace(motor, saturation=None))"
        )
    slowest = min(speeds, default=0.0)
    if slowest < 0:
        raise ValueError(
            f"torque_speed_curve: speeds must be >= 0 rad/s, got {slowest:g} rad/s; the curve of the other "
            "direction is this one turned round"
        )
    found = []
    for speed in speeds:
        if isinstance(motor, DCMotor):
            room = inverter.dc_voltage - motor.torque_constant_at(temperature) * speed
            current = min(inverter.current_limit, room / motor.resistance_at(temperature))
            if current < -inverter.current_limit:
                raise _too_fast(speed, inverter.current_limit, f"{inverter.dc_voltage:g} V")
            found.append([current])
        else:
            ellipse = _VoltageEllipse(motor, inverter, float(speed), temperature)
            found.append(ellipse.weakened() if field_weakening else ellipse.without_weakening())
    torques = [
        motor.torque(current, temperature) + motor.rotor.drag_torque(float(speed))
        for current, speed in zip(found, speeds, strict=True)
    ]
    return TorqueSpeedCurve(
        speeds=np.array(speeds, dtype=float),
        torques=np.array(torques),
        currents=dict(zip(motor.axes, np.array(found).reshape(-1, len(motor.axes)).T, strict=True)),
    )


class _VoltageEllipse:
    """Steady currents of a PMSM at one speed within the voltage limit V.

        (R id - Xq iq)^2 + (R iq + Xd id + E)^2 <= V^2,     Xd = we Ld, Xq = we Lq, E = we psi

    Solved for iq the discriminant is Z^2 V^2 - (K id + Xq E)^2, with K = R^2 + Xd Xq and Z^2 = R^2 + Xq^2.
    """

    def __init__(self, motor: PMSM, inverter: Inverter, speed: float, temperature: MotorTemperature | None) -> None:
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
        return _too_fast(self.speed, self.limit, f"{self.voltage:g} V (peak, a phase) {how}")


def _too_fast(speed: float, limit: float, voltage: str) -> ValueError:
    return ValueError(
        f"torque_speed_curve: at {speed:g} rad/s no current within {limit:g} A, the current limit, holds the voltage "
        f"at {voltage}; ask for lower speeds"
    )
