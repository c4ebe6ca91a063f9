"""What an actuator asks of its controller, and what it offers to one: a new controller is one file beside this.

A controller is a frozen dataclass of gains whose `drive` builds the law: from references and measured motion to the
torque on the motor's shaft, for CasADi expressions, in loops that run in continuous time or at ticks. What it does not
say it does not have: each analysis that asks for more is refused by name.
"""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol

import numpy as np

from controllers.loop import Loop
from gear.quantities import Scalar

if TYPE_CHECKING:
    from controllers.countermeasures import Countermeasure, StickingCycle
    from controllers.sampling import Sampling


class CurrentControl(NamedTuple):
    """How the currents of a motor at an inverter are controlled."""

    law: Any  # a PI on each axis, voltage [V] from current error [A]
    decoupling: bool = True  # back-emf and the coupling of the axes are added to the voltage demand
    mtpa: bool = False  # maximum torque per ampere and field weakening, not quadrature current alone


@dataclass(frozen=True, kw_only=True)
class PlantMotion:
    """True motion of motor and load, which a tachometer or an ideal sensor shows."""

    motor_angle: Scalar  # rad
    motor_speed: Scalar  # rad/s
    load_angle: Scalar  # rad
    load_speed: Scalar  # rad/s
    ratio: float  # motor turns per load turn


class Plant(Protocol):
    """What a controller reads and moves."""

    @property
    def motion(self) -> PlantMotion:
        """True motion."""
        ...

    @property
    def oil(self) -> Scalar:
        """Temperature of the oil, or else of the housing [K]; a controller that takes it lists "oil" in `reads`."""
        ...

    def loop(self, name: str) -> Loop:
        """One of the loops that the controller declares."""
        ...

    def input(self, name: str, unit: str) -> Any:
        """Declare an input of the actuator, such as a reference."""
        ...

    def output(self, name: str, unit: str, value: Scalar) -> None:
        """Declare an output of the actuator."""
        ...

    def measure(self, name: str) -> Scalar:
        """The angle that the sensor on the "motor" or the "load" shows [rad]; once each."""
        ...

    def last(self, name: str) -> Scalar:
        """A held signal of the controller as it stands since the last tick."""
        ...

    def allow(self, torque: Scalar, motor_speed: Scalar) -> Scalar:
        """What motor and inverter can give of a torque at the motor [N m]."""
        ...

    def actuate(self, loop: Loop, torque: Scalar, motor_speed: Scalar, motor_angle: Scalar) -> Scalar:
        """Torque on the motor's shaft [N m] from a torque reference of a loop; motion as it is measured."""
        ...


class Controller(Protocol):
    """What every controller says of itself.

    Attributes
    ----------
    remainder : str
        Name of the motor torque that `contributions` leave unexplained.
    """

    remainder: ClassVar[str] = "motor torque"

    @abstractmethod
    def loops(self) -> tuple[str, ...]:
        """Names of its loops from the inside out, each with a period where the controller is sampled."""

    @abstractmethod
    def reads(self) -> Mapping[str, str]:
        """What it reads: "motor" and "load" (angles), "oil" (temperature), and what for, in words."""

    @abstractmethod
    def drive(self, plant: Plant) -> Scalar:
        """Build the law; returns the torque on the motor's shaft [N m]."""

    def commands(self) -> tuple[str, ...]:
        """Kinds of motor that it can drive: by "torque", "current" or "voltage"."""
        return ("torque", "current") if self.current_control() is None else ("voltage",)

    def current_control(self) -> CurrentControl | None:
        """Its current loop, "current" among `loops`; None without one."""
        return None

    def loop_signals(self) -> tuple[str, ...]:
        """Signals at which its loops can be opened, from the outside in."""
        return ()

    def check_continuous(self) -> None:
        """Raise ValueError where it needs to be sampled."""

    def check_sampling(self, sampling: "Sampling") -> None:
        """Raise ValueError where the periods do not suit it."""

    # -- what analyses ask -------------------------------------------------------------------------------

    def in_continuous_time(self) -> "Controller":
        """The same law without what needs samples."""
        return self

    def contributions(self, signals: Mapping[str, np.ndarray], ratio: float) -> dict[str, np.ndarray]:
        """Parts of the motor torque [N m] by the action they come from, of signals in time."""
        return {}

    def countermeasures(self, cycle: "StickingCycle") -> "list[Countermeasure]":
        """What it offers against a cycle of stick and slip, with settings."""
        raise ValueError(f"a {type(self).__name__} offers no countermeasures against hunting")

    # -- what tuning asks --------------------------------------------------------------------------------

    def tunable_gains(self) -> tuple[str, ...]:
        """Names of the gains that can be tuned, from the controller on; ValueError with the reason if none can."""
        raise ValueError(f"a {type(self).__name__} declares no gains to tune")

    def gains_for_bandwidth(self, bandwidth: float, inertia: float, ratio: float) -> dict[str, float]:
        """Those gains in closed form, for the bandwidth [rad/s] of the position and the inertia at the motor."""
        raise ValueError(f"a {type(self).__name__} has no closed form of its gains")

    # -- its integral ------------------------------------------------------------------------------------

    def integrating_path(self) -> str:
        """Field that holds the law with the integral: "speed"; empty for the controller itself."""
        return ""

    def error_at_integral(self, ratio: float) -> float:
        """Error that the integral sees per rad of position error at the load."""
        raise ValueError(f"a {type(self).__name__} has no integral")


def integrating_law(controller: Controller) -> Any:
    """The law of a controller that integrates: a field of it, or itself."""
    path = controller.integrating_path()
    return getattr(controller, path) if path else controller


def prefix_of_integral(controller: Controller) -> str:
    """What the names of parameters of the integrating law begin with."""
    path = controller.integrating_path()
    return f"controller.{path}." if path else "controller."
