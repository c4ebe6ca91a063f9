"""Feed-forward of what a reference is known to need."""

from dataclasses import dataclass

from controllers.shapes import direction
from controllers.units import OptionalInertia, Share, Speed, SpeedBand, Torque, ViscousFriction
from gear.quantities import Scalar, check


@dataclass(frozen=True, kw_only=True)
class FeedForward:
    """Speed and torque added to the demands of a cascade, from the motion of the reference.

        speed  = speed_share * w
        torque = inertia * a + viscous * w + coulomb * direction(w)

    `direction` is the sign of w without its jump: zero within +-dead_band and 1 from dead_band + width on. As
    the speed is that of the reference, the drive does not shake where the measured one is near zero.

    Parameters
    ----------
    inertia : float
        Of everything that turns, seen by the motor [kg m^2].
    viscous : float
        [N m s/rad].
    coulomb : float
        Level of dry friction, seen by the motor [N m].
    speed_share : float
        Share of the reference's speed that goes past the position loop [-], 1 for no lag.
    dead_band, width : float
        Of the reference speed [rad/s].
    """

    inertia: OptionalInertia = 0.0
    viscous: ViscousFriction = 0.0
    coulomb: Torque = 0.0
    speed_share: Share = 1.0
    dead_band: SpeedBand = 0.0
    width: Speed = 0.1

    def __post_init__(self) -> None:
        check(self)

    def speed(self, speed: Scalar) -> Scalar:
        """Motor speed [rad/s] added to the speed reference, from the reference's speed at the motor [rad/s]."""
        return self.speed_share * speed

    def torque(self, speed: Scalar, acceleration: Scalar) -> Scalar:
        """Motor torque [N m] from the reference's speed [rad/s] and acceleration [rad/s^2], both at the motor."""
        dry = self.coulomb * direction(speed, self.dead_band, self.width)
        return self.inertia * acceleration + self.viscous * speed + dry
