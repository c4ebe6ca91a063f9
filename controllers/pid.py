"""P, PI and PID laws: gains frozen, state passed in, designed by bandwidth."""

from dataclasses import dataclass

from controllers.integral import AntiWindup, IntegralRemedies, advanced, check_anti_windup, memory_of, rate_of
from controllers.shapes import closing_rate
from controllers.units import DerivativeGain, IntegralGain, Limit, PositiveGain, Rate, Share, Time
from gear.quantities import Scalar, check


@dataclass(frozen=True, kw_only=True)
class P:
    """Proportional law, output = gain * error.

    Parameters
    ----------
    gain : float
        [output/error]; in a position loop with speed as output it is the bandwidth [1/s].
    """

    gain: Rate

    def __post_init__(self) -> None:
        check(self)

    @classmethod
    def for_bandwidth(cls, bandwidth: float) -> "P":
        """For a plant that integrates (speed to position) and a closed-loop bandwidth [rad/s]."""
        return cls(gain=bandwidth)

    def output(self, error: Scalar) -> Scalar:
        """Proposed output."""
        return self.gain * error


@dataclass(frozen=True, kw_only=True)
class PI:
    """Proportional-integral law with output limit and anti-windup.

        proposed   = proportional * (error - (1 - setpoint_weight) * reference) + state
        state'     = integral * error + anti-windup

    Parameters
    ----------
    proportional : float
        [output/error].
    integral : float
        [output/(error s)].
    limit : float or None
        Of the magnitude of the output.
    back_calculation : float or None
        Rate [1/s] at which the integral follows a limited output; None for integral/proportional.
    anti_windup : "back-calculation", "clamping" or "conditional"
        What the integral does while the output is limited.
    setpoint_weight : float or None
        Share of the reference that the proportional part sees [-]; None for all of it.
    remedies : IntegralRemedies or None
        Against stiction.

    References
    ----------
    K. J. Astrom, T. Hagglund, "Advanced PID Control" (2006), sections 3.4 and 3.5.
    """

    proportional: PositiveGain
    integral: IntegralGain
    limit: Limit | None = None
    back_calculation: Rate | None = None
    anti_windup: AntiWindup = "back-calculation"
    setpoint_weight: Share | None = None
    remedies: IntegralRemedies | None = None

    def __post_init__(self) -> None:
        check(self)
        check_anti_windup(self)

    @classmethod
    def for_inertia(cls, *, inertia: float, bandwidth: float, integral_bandwidth: float) -> "PI":
        """Speed control of an inertia [kg m^2]: torque from speed error, closed-loop poles at both rates [rad/s]."""
        return cls(
            proportional=inertia * (bandwidth + integral_bandwidth), integral=inertia * bandwidth * integral_bandwidth
        )

    @classmethod
    def for_winding(cls, *, resistance: float, inductance: float, bandwidth: float) -> "PI":
        """Current control of a winding: its zero cancels R/L, leaving one pole at `bandwidth` [rad/s]."""
        return cls(proportional=bandwidth * inductance, integral=bandwidth * resistance)

    def proposed(self, state: Scalar, error: Scalar, reference: Scalar | None = None) -> Scalar:
        """Output before any limit; `reference` is needed with a set-point weight."""
        return self.proportional * _weighted(self, error, reference) + state

    # the integral is that of every law with one
    memory, rate_of_integral, advance = memory_of, rate_of, advanced


@dataclass(frozen=True, kw_only=True)
class PID:
    """Position controller with torque as output, the derivative on the measurement.

        proposed = proportional * (error - (1 - setpoint_weight) * reference) + state - derivative * rate
        state'   = integral * error + anti-windup

    `rate` is the measured speed, or with `filter_time` T the filtered derivative of the measured position
    y, rate = (y - z)/T with z' = rate.

    Parameters
    ----------
    proportional, integral, derivative : float
        [N m/rad], [N m/(rad s)], [N m s/rad] for a position in rad and a torque.
    filter_time : float or None
        T [s]; None where the speed is measured.
    limit : float or None
        Of the magnitude of the output.
    back_calculation : float or None
        Rate [1/s] at which the integral follows a limited output; None for integral/proportional.
    anti_windup : "back-calculation", "clamping" or "conditional"
        What the integral does while the output is limited.
    setpoint_weight : float or None
        Share of the reference that the proportional part sees [-]; None for all of it.
    remedies : IntegralRemedies or None
        Against stiction.

    References
    ----------
    K. J. Astrom, T. Hagglund, "Advanced PID Control" (2006), sections 3.3 to 3.5.
    """

    proportional: PositiveGain
    integral: IntegralGain
    derivative: DerivativeGain
    filter_time: Time | None = None
    limit: Limit | None = None
    back_calculation: Rate | None = None
    anti_windup: AntiWindup = "back-calculation"
    setpoint_weight: Share | None = None
    remedies: IntegralRemedies | None = None

    def __post_init__(self) -> None:
        check(self)
        check_anti_windup(self)

    @classmethod
    def for_inertia(cls, *, inertia: float, bandwidth: float, filter_time: float | None = None) -> "PID":
        """For an inertia [kg m^2]: all three closed-loop poles at `bandwidth` [rad/s]."""
        return cls(
            proportional=3 * inertia * bandwidth**2,
            integral=inertia * bandwidth**3,
            derivative=3 * inertia * bandwidth,
            filter_time=filter_time,
        )

    def rate(self, measured: Scalar, filtered: Scalar, period: Scalar | None = None) -> Scalar:
        """Filtered derivative of the measurement; only with `filter_time`.

        The filtered position is a memory of its own, beside that of the integral.
        """
        if self.filter_time is None:
            raise ValueError("PID.rate needs a filter_time [s]; without one the speed is measured")
        if period is None:
            return (measured - filtered) / self.filter_time
        return closing_rate(1 / self.filter_time, period) * (measured - filtered)

    def advance_filtered(self, measured: Scalar, filtered: Scalar, period: Scalar) -> Scalar:
        """Filtered position after a sample, exact for a measurement that is held."""
        return filtered + period * self.rate(measured, filtered, period)

    def proposed(self, state: Scalar, error: Scalar, rate: Scalar, reference: Scalar | None = None) -> Scalar:
        """Output before any limit; `reference` is needed with a set-point weight."""
        return self.proportional * _weighted(self, error, reference) + state - self.derivative * rate

    # the integral is that of every law with one
    memory, rate_of_integral, advance = memory_of, rate_of, advanced


def _weighted(law: PI | PID, error: Scalar, reference: Scalar | None) -> Scalar:
    if law.setpoint_weight is None:
        return error
    if reference is None:
        raise ValueError(f"{type(law).__name__}.proposed needs the reference, as it has a setpoint_weight")
    return error - (1 - law.setpoint_weight) * reference
