"""A motor whose drive controls the current, without its voltages."""

from dataclasses import dataclass, field

import casadi as ca

from actuator.parts.electrical import Lag, RotorInertia, TorqueConstant, TorqueLimit
from actuator.parts.motor import CurrentDriven
from actuator.parts.rotor import MotorLosses, Rotor
from gear.quantities import Scalar, check
from gear.quantities.registry import part


@part(CurrentDriven)
@dataclass(frozen=True, kw_only=True)
class CurrentSource(CurrentDriven):
    """A motor that gets the current it is asked for, at once or after a lag.

        lag i' = demanded - i  (without a lag, i = demanded),     torque = torque_constant i

    Parameters
    ----------
    torque_constant : float
        [N m/A], per ampere of the demanded current: rms where that is rms.
    inertia : float
        Of the rotor [kg m^2].
    lag : float or None
        Time constant of the current [s]; None for none.
    torque_limit : float or None
        Of the magnitude [N m]; None for none.
    rotor : Rotor
        Cogging and drag.
    """

    torque_constant: TorqueConstant
    inertia: RotorInertia
    lag: Lag | None = None
    torque_limit: TorqueLimit | None = None
    rotor: Rotor = field(default_factory=Rotor)

    def __post_init__(self) -> None:
        check(self)

    @classmethod
    def examples(cls) -> "tuple[CurrentSource, ...]":
        """At once and with a lag, and with all that it can have."""
        return (
            cls(torque_constant=0.1, inertia=1e-4),
            cls(torque_constant=0.1, inertia=1e-4, lag=1e-3, torque_limit=1.0, rotor=Rotor.examples()[-1]),
        )

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the current states: none without a lag."""
        return () if self.lag is None else ("current",)

    def torque(self, currents: list[Scalar]) -> Scalar:
        """Electromagnetic torque [N m]."""
        return self.torque_constant * currents[0]

    def shaft_torque(self, currents: list[Scalar], angle: Scalar, speed: Scalar) -> Scalar:
        """Torque on the rotor [N m] with cogging and drag, at its mechanical angle and speed."""
        return self.torque(currents) + self.rotor.torque(angle, speed)

    def current_for(self, torque: Scalar) -> Scalar:
        """Current [A] for a torque [N m]."""
        return torque / self.torque_constant

    def rotor_inertia(self) -> Scalar:
        """[kg m^2]."""
        return self.inertia

    def has_rotor_torque(self) -> bool:
        """Whether the rotor has cogging or drag."""
        return self.rotor.acts()

    def allow_torque(self, torque: Scalar) -> Scalar:
        """The torque [N m] of the current that may be asked for."""
        current = self.current_for(torque)
        if self.torque_limit is not None:
            limit = self.current_for(self.torque_limit)
            current = ca.fmax(-limit, ca.fmin(limit, current))
        return self.torque([current])

    def derivatives(self, currents: list[Scalar], demanded: Scalar) -> list[Scalar]:
        """Time derivatives of the current states [A/s]; none without a lag."""
        return [] if self.lag is None else [(demanded - currents[0]) / self.lag]

    def losses(self, currents: list[Scalar], speed: Scalar) -> MotorLosses:
        """Of iron and drag [W]; the resistance is not known."""
        return MotorLosses(iron=self.rotor.iron_loss(speed), friction=self.rotor.friction_loss(speed))
