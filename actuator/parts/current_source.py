"""A motor whose drive controls the current, without its voltages."""

from dataclasses import dataclass, field

import casadi as ca

from actuator.parts.electrical import Lag, RotorInertia, TorqueConstant, TorqueLimit
from actuator.parts.rotor import Rotor
from gear.quantities import Scalar, check


@dataclass(frozen=True, kw_only=True)
class CurrentSource:
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

    def allow(self, current: Scalar) -> Scalar:
        """The current [A] that may be asked for."""
        if self.torque_limit is None:
            return current
        limit = self.current_for(self.torque_limit)
        return ca.fmax(-limit, ca.fmin(limit, current))

    def derivatives(self, currents: list[Scalar], demanded: Scalar) -> list[Scalar]:
        """Time derivatives of the current states [A/s]; none without a lag."""
        return [] if self.lag is None else [(demanded - currents[0]) / self.lag]
