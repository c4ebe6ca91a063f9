"""Cascade of position, speed and current control."""

from dataclasses import dataclass
from typing import Literal

from controllers.pid import PI, P, limited
from controllers.rules import Scalar, Speed, check


@dataclass(frozen=True, kw_only=True)
class Cascade:
    """Position -> speed -> current, the structure of nearly every servo drive.

        motor speed reference = ratio * position.gain * (reference - measured position), limited
        motor torque demand   = speed PI on motor speed
        voltage demand        = current PI on each axis of the motor, plus decoupling

    Parameters
    ----------
    position : P
        Gain [1/s] on the position error at the load.
    speed : PI
        Torque at the motor [N m] from the speed error of the motor [rad/s].
    current : PI
        Voltage [V] from current error [A], the same on each axis of the motor.
    speed_limit : float
        Of the motor speed reference [rad/s].
    feedback : "load" or "motor"
        Where the position is measured; at the motor it is divided by the gear ratio.
    decoupling : bool
        Whether the back-emf and the coupling of the axes are added to the voltage demand.
    """

    position: P
    speed: PI
    current: PI
    speed_limit: Speed
    feedback: Literal["load", "motor"] = "load"
    decoupling: bool = True

    def __post_init__(self) -> None:
        check(self)
        if self.feedback not in ("load", "motor"):
            raise ValueError(f'Cascade.feedback must be "load" or "motor", got {self.feedback!r}')

    @classmethod
    def for_bandwidths(  # noqa: PLR0913 - a design has this many numbers
        cls,
        *,
        position: float,
        speed: float,
        current: float,
        inertia: float,
        resistance: float,
        inductance: float,
        speed_limit: float,
        integral: float | None = None,
        feedback: Literal["load", "motor"] = "load",
    ) -> "Cascade":
        """From loop bandwidths [rad/s], the inertia seen by the motor [kg m^2] and its winding.

        `integral` is the rate of the speed integrator [rad/s], a fifth of the speed bandwidth if not given.
        """
        return cls(
            position=P.for_bandwidth(position),
            speed=PI.for_inertia(
                inertia=inertia, bandwidth=speed, integral_bandwidth=speed / 5 if integral is None else integral
            ),
            current=PI.for_winding(resistance=resistance, inductance=inductance, bandwidth=current),
            speed_limit=speed_limit,
            feedback=feedback,
        )

    def speed_reference(self, error: Scalar, ratio: Scalar) -> Scalar:
        """Motor speed reference [rad/s] from the position error at the load [rad]."""
        return limited(ratio * self.position.output(error), self.speed_limit)
