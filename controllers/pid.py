"""P, PI and PID laws: gains frozen, state passed in, designed by bandwidth.

Anti-windup by what was realized: a law proposes an output, something (its own limit, a current limit, the
voltage of the inverter) realizes part of it, and the integral is driven by the difference, so every limiter
outside is handled without a special case.
"""

from dataclasses import dataclass

import casadi as ca

from controllers.rules import DerivativeGain, IntegralGain, Limit, PositiveGain, Rate, Scalar, Time, check


def limited(value: Scalar, limit: Scalar | None) -> Scalar:
    """`value` held within +-limit; unchanged for limit None."""
    return value if limit is None else ca.fmax(-limit, ca.fmin(limit, value))


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
    """Proportional-integral law with output limit and back-calculation.

        proposed   = proportional * error + state
        state'     = integral * error + back_calculation * (realized - proposed)

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

    References
    ----------
    K. J. Astrom, T. Hagglund, "Advanced PID Control" (2006), section 3.5.
    """

    proportional: PositiveGain
    integral: IntegralGain
    limit: Limit | None = None
    back_calculation: Rate | None = None

    def __post_init__(self) -> None:
        check(self)

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

    def proposed(self, state: Scalar, error: Scalar) -> Scalar:
        """Output before any limit."""
        return self.proportional * error + state

    def derivative(self, error: Scalar, proposed: Scalar, realized: Scalar) -> Scalar:
        """Time derivative of the integral state."""
        rate = self.integral / self.proportional if self.back_calculation is None else self.back_calculation
        return self.integral * error + rate * (realized - proposed)


@dataclass(frozen=True, kw_only=True)
class PID:
    """Position controller with torque as output, the derivative on the measurement.

        proposed = proportional * error + state - derivative * rate
        state'   = integral * error + back_calculation * (realized - proposed)

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

    References
    ----------
    K. J. Astrom, T. Hagglund, "Advanced PID Control" (2006), sections 3.3 and 3.5.
    """

    proportional: PositiveGain
    integral: IntegralGain
    derivative: DerivativeGain
    filter_time: Time | None = None
    limit: Limit | None = None
    back_calculation: Rate | None = None

    def __post_init__(self) -> None:
        check(self)

    @classmethod
    def for_inertia(cls, *, inertia: float, bandwidth: float, filter_time: float | None = None) -> "PID":
        """For an inertia [kg m^2]: all three closed-loop poles at `bandwidth` [rad/s]."""
        return cls(
            proportional=3 * inertia * bandwidth**2,
            integral=inertia * bandwidth**3,
            derivative=3 * inertia * bandwidth,
            filter_time=filter_time,
        )

    def rate(self, measured: Scalar, filtered: Scalar) -> Scalar:
        """Filtered derivative of the measurement; only with `filter_time`."""
        return (measured - filtered) / self.filter_time

    def proposed(self, state: Scalar, error: Scalar, rate: Scalar) -> Scalar:
        """Output before any limit."""
        return self.proportional * error + state - self.derivative * rate

    def integral_derivative(self, error: Scalar, proposed: Scalar, realized: Scalar) -> Scalar:
        """Time derivative of the integral state."""
        rate = self.integral / self.proportional if self.back_calculation is None else self.back_calculation
        return self.integral * error + rate * (realized - proposed)
