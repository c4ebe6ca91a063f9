"""The torque a drive can hold at a speed, within the voltage and the current of its inverter."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from actuator.parts.inverter import Inverter
from actuator.parts.motor import VoltageDriven
from actuator.parts.temperature import MotorTemperature


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
        from actuator.plots.bench import plot_torque_speed

        return plot_torque_speed(self, ax)


def torque_speed_curve(
    motor: VoltageDriven,
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
    motor : VoltageDriven
        DCMotor, PMSM or another with such a closed form; without saturation.
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
    slowest = min(speeds, default=0.0)
    if slowest < 0:
        raise ValueError(
            f"torque_speed_curve: speeds must be >= 0 rad/s, got {slowest:g} rad/s; the "
            "curve is symmetric, use abs(speed)"
        )
    found = [
        motor.steady_currents(inverter, float(speed), field_weakening=field_weakening, temperature=temperature)
        for speed in speeds
    ]
    torques = [
        motor.torque(current, temperature) + motor.drag_torque(float(speed))
        for current, speed in zip(found, speeds, strict=True)
    ]
    return TorqueSpeedCurve(
        speeds=np.array(speeds, dtype=float),
        torques=np.array(torques),
        currents=dict(zip(motor.axes, np.array(found).reshape(-1, len(motor.axes)).T, strict=True)),
    )
