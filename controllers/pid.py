"""P, PI and PID laws: gains frozen, state passed in, designed by bandwidth."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar

import casadi as ca
import numpy as np

from controllers.controller import Controller, Plant
from controllers.countermeasures import (
    Countermeasure,
    StickingCycle,
    at_the_integral,
    reset_on_reversal,
    retune,
    with_switchable_integral,
)
from controllers.integral import AntiWindup, IntegralRemedies, advance_integral, check_anti_windup, memory_of, rate_of
from controllers.shapes import closing_rate, saturate
from controllers.units import DerivativeGain, IntegralGain, Limit, PositiveGain, Rate, Share, Time
from gear.quantities import Scalar, check
from gear.quantities.registry import part
from gear.quantities.roles import LoopGain

ANGLE = 1e-4  # rad, a usual size; an angle is fine when the deflection of teeth is
ABOVE = 10.0  # rate of the filter of the derivative over the bandwidth, in the closed form
RETUNED: tuple[str, ...] = ("proportional", "integral", "derivative")


@dataclass(frozen=True, kw_only=True)
class P:
    """Proportional law, output = gain * error.

    Parameters
    ----------
    gain : float
        [output/error]; in a position loop with speed as output it is the bandwidth [1/s].
    """

    gain: Annotated[Rate, LoopGain("proportional")]

    def __post_init__(self) -> None:
        check(self)

    @classmethod
    def for_bandwidth(cls, bandwidth: float) -> "P":
        """For a plant that integrates (speed to position) and a closed-loop bandwidth [rad/s]."""
        return cls(gain=bandwidth)

    def output(self, error: Scalar) -> Scalar:
        """Proposed output."""
        return self.gain * error

    def gain_on_error(self) -> Scalar:
        """Gain of the proportional action [output/error]."""
        return self.gain

    integrates: ClassVar[bool] = False
    remedies: ClassVar[None] = None  # those of an integral


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
    memory, rate_of_integral, advance = memory_of, rate_of, advance_integral
    integrates: ClassVar[bool] = True

    def gain_on_error(self) -> Scalar:
        """Gain of the proportional action [output/error]."""
        return self.proportional


@part(Controller)
@dataclass(frozen=True, kw_only=True)
class PID(Controller):
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
    memory, rate_of_integral, advance = memory_of, rate_of, advance_integral

    # -- in an actuator ----------------------------------------------------------------------------------

    remainder: ClassVar[str] = "limits and delay"

    @classmethod
    def examples(cls) -> "tuple[PID, ...]":
        """With a measured speed, and with a filtered derivative and all options."""
        plain = cls.for_inertia(inertia=0.01, bandwidth=20.0)
        options = IntegralRemedies(dead_band=1e-3, leakage=0.1)
        return (plain, replace(plain, filter_time=1e-3, limit=5.0, setpoint_weight=0.5, remedies=options))

    def loops(self) -> tuple[str, ...]:
        """One, on the position."""
        return ("position",)

    def reads(self) -> dict[str, str]:
        """The load."""
        return {"load": "the position loop"}

    def commands(self) -> tuple[str, ...]:
        """A motor that gives the torque it is asked for."""
        return ("torque",)

    def loop_signals(self) -> tuple[str, ...]:
        """The measured position, and the torque asked for."""
        return ("position", "torque_reference")

    def check_continuous(self) -> None:
        """Raise ValueError for an integral that is reset on reversal."""
        require_no_reset("controller", self)

    def drive(self, plant: Plant) -> Scalar:
        """Position of the load to the torque at the load that the motor has to bring."""
        motion, loop = plant.motion, plant.loop("position")
        reference = plant.input("reference", "rad")
        measured = plant.measure("load")
        position = loop.signal("position", "rad", measured)
        integral = loop.memory("controller", self, "N m")
        rate = motion.load_speed
        if self.filter_time is not None:
            filtered = loop.state("controller.filtered_position", "rad", ANGLE, initial=ca.SX(measured))
            rate = self.rate(position, filtered, loop.period)
            loop.after(filtered, lambda: rate, lambda: self.advance_filtered(position, filtered, loop.period))
        error = reference - position
        proposed = self.proposed(integral[0], error, rate, reference)
        at_motor = plant.allow(saturate(proposed, self.limit) / motion.ratio, motion.motor_speed)
        # the demand is at the load; an ideal motor in front of a gear turns `ratio` times as fast
        loop.integrate(self, integral, error, proposed, at_motor * motion.ratio)
        plant.output("position_error", "rad", reference - motion.load_angle)
        return loop.apply("torque_reference", "N m", at_motor)

    def in_continuous_time(self) -> "PID":
        """Without the reset on reversal."""
        return never_reset(self)

    def contributions(self, signals: Mapping[str, np.ndarray], ratio: float) -> dict[str, np.ndarray]:
        """Of the three actions [N m at the motor]."""
        reference, position = signals["reference"], signals["position"]
        rate = signals["load_speed"]
        if self.filter_time is not None:
            rate = (position - signals["controller.filtered_position"]) / self.filter_time
        return {
            "proportional action": proportional_part(self, reference - position, reference) / ratio,
            "integral action": signals["controller.integral"] / ratio,
            "derivative action": -self.derivative * rate / ratio,
        }

    def countermeasures(self, cycle: StickingCycle) -> list[Countermeasure]:
        """At the integral, and by other gains."""
        ready = with_switchable_integral(self)
        gain, integral = abs(self.proportional / cycle.ratio), abs(self.integral / cycle.ratio)
        less = {f"integral gain / {k}": {"integral": 1 / k} for k in (4, 16)}
        return [
            *at_the_integral(ready, cycle, gain=gain, integral=integral, unit="rad"),
            *retune(self, {**less, "all gains * 4": dict.fromkeys(RETUNED, 4.0)}),
            *reset_on_reversal(self, cycle),
        ]

    def error_at_integral(self, ratio: float) -> float:
        """The position error itself."""
        return 1.0

    def tunable_gains(self) -> tuple[str, ...]:
        """All four, or without the filter three."""
        return (*RETUNED, "filter_time") if self.filter_time is not None else RETUNED

    def gains_for_bandwidth(self, bandwidth: float, inertia: float, ratio: float) -> dict[str, float]:
        """Three poles at one rate, and the filter of the derivative a decade above."""
        law = PID.for_inertia(inertia=inertia * ratio**2, bandwidth=bandwidth, filter_time=1 / (ABOVE * bandwidth))
        return {name: getattr(law, name) for name in self.tunable_gains()}


def proportional_part(law: PI | PID, error: Any, reference: Any) -> Any:
    """Output of the proportional action alone."""
    weight = 1.0 if law.setpoint_weight is None else law.setpoint_weight
    return law.proportional * (error - (1 - weight) * reference)


def require_no_reset(name: str, law: Any) -> None:
    """Raise ValueError for an integral that is reset on reversal."""
    if law.remedies is not None and law.remedies.reset_on_reversal:
        raise ValueError(f"{name}: reset_on_reversal needs a sampled controller: give it a sampling")


def never_reset(law: Any) -> Any:
    """The same law without the reset on reversal."""
    return law if law.remedies is None else replace(law, remedies=replace(law.remedies, reset_on_reversal=False))


def _weighted(law: PI | PID, error: Scalar, reference: Scalar | None) -> Scalar:
    if law.setpoint_weight is None:
        return error
    if reference is None:
        raise ValueError(f"{type(law).__name__}.proposed needs the reference, as it has a setpoint_weight")
    return error - (1 - law.setpoint_weight) * reference
