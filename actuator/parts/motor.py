"""What an actuator asks of its motor: a new one is one file beside this that states what drives it.

    TorqueDriven     gives the torque that it is asked for, within a limit
    CurrentDriven    gets the current that it is asked for, at once or by states of its own
    VoltageDriven    gets voltages from an inverter, and its currents are controlled

Methods take floats and CasADi expressions. Angles and speeds are those of the rotor, currents one to each name in
`axes`, the torque-producing one last; torques are positive in the direction of the signals.
"""

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar, Literal, Protocol

from actuator.parts.inverter import Inverter
from actuator.parts.rotor import MotorLosses
from actuator.parts.temperature import MotorTemperature
from gear.quantities import Scalar

DrivenBy = Literal["torque", "current", "voltage"]


class Motor(Protocol):
    """What every motor says of itself."""

    driven_by: ClassVar[DrivenBy]

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of its current states [A]."""
        return ()

    def rotor_inertia(self) -> Scalar:
        """Inertia [kg m^2] that it adds to the input shaft of the gear."""
        return 0.0

    def has_rotor_torque(self) -> bool:
        """Whether something acts on the rotor that stays when it is switched off, such as cogging and drag."""
        return False

    def allow_torque(self, torque: Scalar) -> Scalar:
        """The torque [N m] that it may be asked for, of one demanded; an inverter has limits of its own."""
        return torque

    def without_saturation(self) -> "Motor":
        """The same motor with a linear magnetic circuit: `current_for` and `torque` undo each other at any torque."""
        return self


class TorqueDriven(Motor, Protocol):
    """A motor that gives the torque that it is asked for."""

    driven_by: ClassVar[DrivenBy] = "torque"


class CurrentDriven(Motor, Protocol):
    """A motor that gets the current that it is asked for. Without axes its current is the one demanded."""

    driven_by: ClassVar[DrivenBy] = "current"

    @abstractmethod
    def current_for(self, torque: Scalar) -> Scalar:
        """Current [A] for a torque [N m]."""

    def derivatives(self, currents: list[Scalar], demanded: Scalar) -> list[Scalar]:
        """Time derivatives of the currents [A/s]."""
        return []

    @abstractmethod
    def torque(self, currents: list[Scalar]) -> Scalar:
        """Electromagnetic torque [N m]."""

    @abstractmethod
    def shaft_torque(self, currents: list[Scalar], angle: Scalar, speed: Scalar) -> Scalar:
        """Torque on the rotor [N m] with all that acts on it."""

    def losses(self, currents: list[Scalar], speed: Scalar) -> MotorLosses:
        """Where the motor makes heat [W]."""
        return MotorLosses()


class VoltageDriven(Motor, Protocol):
    """A motor at an inverter: one axis that stands (DC), or two that turn with the rotor (d, q)."""

    driven_by: ClassVar[DrivenBy] = "voltage"

    @property
    def frame_turns(self) -> int | None:
        """Electrical turns of its axes per turn of the rotor (pole pairs); None where they stand."""
        return None

    @abstractmethod
    def current_for(self, torque: Scalar) -> Scalar:
        """Torque-producing current [A] for a torque [N m]."""

    @abstractmethod
    def references(self, current: Scalar) -> list[Scalar]:
        """Current reference of each axis [A] from the torque-producing one."""

    def constants_for_mtpa(self) -> Mapping[str, Scalar] | None:
        """Fields of `CurrentReference` (maximum torque per ampere); None for a motor without a direct axis."""
        return None

    @abstractmethod
    def resistance_at(self, temperature: MotorTemperature | None = None) -> Scalar:
        """[ohm] at a temperature; None for the reference."""

    @abstractmethod
    def coupling_voltages(
        self, currents: list[Scalar], speed: Scalar, temperature: MotorTemperature | None = None
    ) -> list[Scalar]:
        """Voltages of each axis [V] from motion."""

    @abstractmethod
    def derivatives(
        self,
        currents: list[Scalar],
        voltages: list[Scalar],
        speed: Scalar,
        temperature: MotorTemperature | None = None,
    ) -> list[Scalar]:
        """Time derivatives of the currents [A/s]."""

    @abstractmethod
    def torque(self, currents: list[Scalar], temperature: MotorTemperature | None = None) -> Scalar:
        """Electromagnetic torque [N m]."""

    @abstractmethod
    def shaft_torque(
        self, currents: list[Scalar], angle: Scalar, speed: Scalar, temperature: MotorTemperature | None = None
    ) -> Scalar:
        """Torque on the rotor [N m] with all that acts on it."""

    @abstractmethod
    def electrical_power(self, currents: list[Scalar], voltages: list[Scalar]) -> Scalar:
        """Into the terminals [W]."""

    @abstractmethod
    def stored_energy(self, currents: list[Scalar], angle: Scalar) -> Scalar:
        """Magnetic energy [J] of the currents and of the angle of the rotor."""

    @abstractmethod
    def losses(self, currents: list[Scalar], speed: Scalar, temperature: MotorTemperature | None = None) -> MotorLosses:
        """Where the motor makes heat [W]."""

    def drag_torque(self, speed: Scalar) -> Scalar:
        """Mean torque of the rotor's drag over a turn [N m]."""
        return 0.0

    def steady_currents(
        self, inverter: Inverter, speed: float, *, field_weakening: bool, temperature: MotorTemperature | None
    ) -> list[float]:
        """Currents [A] of the largest torque that an inverter can hold at a speed [rad/s].

        Raises
        ------
        ValueError
            Where no allowed current holds the voltage, and for a motor without this closed form.
        """
        raise ValueError(f"torque_speed_curve: a {type(self).__name__} has no closed form of its steady currents")
