"""The brushed permanent-magnet DC motor."""

import math
from dataclasses import dataclass, field, replace
from typing import Any

from actuator.parts.electrical import Inductance, Resistance, RotorInertia, TorqueConstant
from actuator.parts.inverter import Inverter
from actuator.parts.motor import VoltageDriven
from actuator.parts.rotor import MotorLosses, Rotor
from actuator.parts.temperature import MotorTemperature, TemperatureDependence
from actuator.parts.voltage_limit import too_fast
from gear.quantities import Scalar, check
from gear.quantities.registry import part


@part(VoltageDriven)
@dataclass(frozen=True, kw_only=True)
class DCMotor(VoltageDriven):
    """Brushed permanent-magnet DC motor.

        inductance i' = v - resistance i - torque_constant w,     torque = torque_constant i

    Parameters
    ----------
    resistance, inductance : float
        Of the armature, terminal to terminal [ohm], [H].
    torque_constant : float
        [N m/A], the same number as the voltage constant [V s/rad].
    inertia : float
        Of the rotor [kg m^2].
    rotor : Rotor
        Cogging and drag.
    temperature_dependence : TemperatureDependence or None
        Of resistance and torque constant; None for none.
    """

    resistance: Resistance
    inductance: Inductance
    torque_constant: TorqueConstant
    inertia: RotorInertia
    rotor: Rotor = field(default_factory=Rotor)
    temperature_dependence: TemperatureDependence | None = None

    def __post_init__(self) -> None:
        check(self)

    @classmethod
    def examples(cls) -> "tuple[DCMotor, ...]":
        """Plain, and with all that it can have."""
        plain = cls(resistance=1.0, inductance=1e-3, torque_constant=0.05, inertia=1e-5)
        return (plain, replace(plain, rotor=Rotor.examples()[-1], temperature_dependence=TemperatureDependence()))

    @property
    def axes(self) -> tuple[str, ...]:
        """Of the armature."""
        return ("current",)

    def rotor_inertia(self) -> Scalar:
        """[kg m^2]."""
        return self.inertia

    def has_rotor_torque(self) -> bool:
        """Whether the rotor has cogging or drag."""
        return self.rotor.acts()

    @classmethod
    def from_data_sheet(
        cls,
        *,
        terminal_resistance_ohm: float,
        terminal_inductance_mH: float,
        rotor_inertia_gcm2: float,
        torque_constant_mNm_per_A: float | None = None,
        speed_constant_rpm_per_V: float | None = None,
        **more: Any,
    ) -> "DCMotor":
        """From the numbers of a data sheet; one of torque constant and speed constant, which say the same.

        Raises
        ------
        ValueError
            For both constants, or none.
        """
        constants = []
        if torque_constant_mNm_per_A is not None:
            constants.append(1e-3 * torque_constant_mNm_per_A)
        if speed_constant_rpm_per_V is not None:
            constants.append(60 / (2 * math.pi * speed_constant_rpm_per_V))
        if len(constants) != 1:
            raise ValueError(
                "DCMotor.from_data_sheet needs one of torque_constant_mNm_per_A, speed_constant_rpm_per_V; "
                f"got {torque_constant_mNm_per_A} and {speed_constant_rpm_per_V}"
            )
        return cls(
            resistance=terminal_resistance_ohm,
            inductance=1e-3 * terminal_inductance_mH,
            torque_constant=constants[0],
            inertia=1e-7 * rotor_inertia_gcm2,
            **more,
        )

    def resistance_at(self, temperature: MotorTemperature | None = None) -> Scalar:
        """[ohm] at a temperature; None for the reference."""
        law = self.temperature_dependence
        return self.resistance if law is None else self.resistance * law.resistance_factor(temperature)

    def torque_constant_at(self, temperature: MotorTemperature | None = None) -> Scalar:
        """[N m/A] at a temperature; None for the reference."""
        law = self.temperature_dependence
        return self.torque_constant if law is None else self.torque_constant * law.flux_factor(temperature)

    def torque(self, currents: list[Scalar], temperature: MotorTemperature | None = None) -> Scalar:
        """Electromagnetic torque [N m]."""
        return self.torque_constant_at(temperature) * currents[0]

    def shaft_torque(
        self, currents: list[Scalar], angle: Scalar, speed: Scalar, temperature: MotorTemperature | None = None
    ) -> Scalar:
        """Torque on the rotor [N m] with cogging and drag, at its mechanical angle and speed."""
        return self.torque(currents, temperature) + self.rotor.torque(angle, speed)

    def current_for(self, torque: Scalar) -> Scalar:
        """Current [A] for a torque [N m], by the number of the data sheet."""
        return torque / self.torque_constant

    def references(self, current: Scalar) -> list[Scalar]:
        """Current reference of each axis [A] from the torque-producing one."""
        return [current]

    def coupling_voltages(
        self, currents: list[Scalar], speed: Scalar, temperature: MotorTemperature | None = None
    ) -> list[Scalar]:
        """Voltages [V] from motion."""
        return [self.torque_constant_at(temperature) * speed]

    def derivatives(
        self,
        currents: list[Scalar],
        voltages: list[Scalar],
        speed: Scalar,
        temperature: MotorTemperature | None = None,
    ) -> list[Scalar]:
        """Time derivatives of the currents [A/s]."""
        motion = self.coupling_voltages(currents, speed, temperature)[0]
        return [(voltages[0] - self.resistance_at(temperature) * currents[0] - motion) / self.inductance]

    def electrical_power(self, currents: list[Scalar], voltages: list[Scalar]) -> Scalar:
        """Into the terminals [W]."""
        return voltages[0] * currents[0]

    def magnetic_energy(self, currents: list[Scalar]) -> Scalar:
        """Stored by the current [J]."""
        return self.inductance * currents[0] ** 2 / 2

    def stored_energy(self, currents: list[Scalar], angle: Scalar) -> Scalar:
        """Of the current and of the cogging [J]."""
        return self.magnetic_energy(currents) + self.rotor.energy(angle)

    def drag_torque(self, speed: Scalar) -> Scalar:
        """Of the rotor, cogging averaged out [N m]."""
        return self.rotor.drag_torque(speed)

    def steady_currents(
        self, inverter: Inverter, speed: float, *, field_weakening: bool, temperature: MotorTemperature | None
    ) -> list[float]:
        """I = min(current_limit, (dc_voltage - torque_constant w)/resistance); there is no field to weaken."""
        room = inverter.dc_voltage - self.torque_constant_at(temperature) * speed
        current = min(inverter.current_limit, room / self.resistance_at(temperature))
        if current < -inverter.current_limit:
            raise too_fast(speed, inverter.current_limit, f"{inverter.dc_voltage:g} V")
        return [current]

    def losses(self, currents: list[Scalar], speed: Scalar, temperature: MotorTemperature | None = None) -> MotorLosses:
        """Where the motor makes heat [W]."""
        return MotorLosses(
            copper=self.resistance_at(temperature) * currents[0] ** 2,
            iron=self.rotor.iron_loss(speed),
            friction=self.rotor.friction_loss(speed),
        )
