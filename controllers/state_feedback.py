"""State feedback of a drive with two masses, with integral action and a prefilter of the reference."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar

import numpy as np
from scipy.linalg import expm
from scipy.signal import place_poles

from controllers.controller import Controller, CurrentControl, Plant
from controllers.countermeasures import (
    Countermeasure,
    StickingCycle,
    at_the_integral,
    reset_on_reversal,
    retune,
    with_switchable_integral,
)
from controllers.filters import LowPass
from controllers.integral import AntiWindup, IntegralRemedies, advance_integral, memory_of, rate_of
from controllers.loop import Loop
from controllers.observer import SpeedEstimator
from controllers.pid import ANGLE, PI, never_reset, require_no_reset
from controllers.sampling import Sampling
from controllers.shapes import saturate
from controllers.units import AngleGain, AngleIntegralGain, Rate, SpeedGain, TorqueLimit
from gear.quantities import Scalar, check
from gear.quantities.registry import part
from gear.quantities.roles import InLoop

LOOP = "state"


@part(Controller)
@dataclass(frozen=True, kw_only=True)
class StateFeedback(Controller):
    """Torque from angle and speed of motor and load, all seen at the load: phi = phi_motor/ratio, w = phi'.

        u = motor_angle (r - phi) - motor_speed w + load_angle (r - phi_l) - load_speed w_l + z
        z' = integral (r - phi_l) + back_calculation (realized - u)

    with r the reference behind its prefilter and u/ratio the torque of the motor. The angles turn together only where
    the gear does not twist, so some gains may be negative.

    Parameters
    ----------
    motor_angle, load_angle : float
        [N m/rad].
    motor_speed, load_speed : float
        [N m s/rad].
    integral : float
        [N m/(rad s)], of the error at the load.
    back_calculation : float
        Rate [1/s] at which the integral follows a limited torque.
    limit : float or None
        Of the magnitude of the torque at the load [N m].
    prefilter : LowPass or None
        On the reference; it takes out the overshoot that the zero of the integral action makes.
    speed_from : SpeedEstimator or None
        Both speeds from the measured angles; None for tachometers.
    remedies : IntegralRemedies or None
        Against stiction.
    current : PI or None
        Of the currents of a motor at an inverter; None for a motor that gets its current or torque at once.

    References
    ----------
    G. F. Franklin, J. D. Powell, A. Emami-Naeini, "Feedback Control of Dynamic Systems" (2010), sections 7.5 and 7.10.
    """

    motor_angle: AngleGain
    motor_speed: SpeedGain
    load_angle: AngleGain
    load_speed: SpeedGain
    integral: AngleIntegralGain
    back_calculation: Rate
    limit: TorqueLimit | None = None
    prefilter: LowPass | None = None
    speed_from: SpeedEstimator | None = None
    remedies: IntegralRemedies | None = None
    current: Annotated[PI | None, InLoop("current", "electrical")] = None

    remainder: ClassVar[str] = "current loop, limits and delay"
    anti_windup: ClassVar[AntiWindup] = "back-calculation"

    # the integral is that of every law with one
    memory, rate_of_integral, advance = memory_of, rate_of, advance_integral

    def __post_init__(self) -> None:
        check(self)

    @classmethod
    def examples(cls) -> "tuple[StateFeedback, ...]":
        """For two masses on a spring, plain and with options."""
        plain = cls.for_poles(
            [-40.0, -42.0, -44.0, -46.0, -48.0],
            motor_inertia=1e-3,
            load_inertia=0.01,
            stiffness=50.0,
            damping=0.01,
            ratio=1.0,
        )
        return (plain, replace(plain, limit=5.0, prefilter=LowPass(frequency=30.0)))

    @classmethod
    def for_poles(  # noqa: PLR0913 - a design has this many numbers
        cls,
        poles: Sequence[complex],
        *,
        motor_inertia: float,
        load_inertia: float,
        stiffness: float,
        damping: float,
        ratio: float,
        period: float | None = None,
    ) -> "StateFeedback":
        """By pole placement on two masses, motor and load, on a spring.

            motor_inertia ratio^2 phi'' = u - T,   load_inertia phi_l'' = T
            T = stiffness x + damping x',   x = phi - phi_l

        Parameters
        ----------
        poles : sequence of complex
            Five of the closed loop [1/s], all different, complex ones in pairs.
        motor_inertia, load_inertia : float
            Of all that turns with the motor and with the load, each at its own speed [kg m^2].
        stiffness, damping : float
            Between them, at the load [N m/rad], [N m s/rad].
        ratio : float
            Motor turns per load turn.
        period : float or None
            Of the samples [s], at which the poles are exp(pole period), for a controller without delay; None for
            continuous time.
        """
        inertia, twist = motor_inertia * ratio**2, np.array([1.0, 0.0, -1.0, 0.0])
        torque = stiffness * twist + damping * np.roll(twist, 1)
        a = np.zeros((5, 5))
        a[0, 1] = a[2, 3] = 1.0
        a[1, :4], a[3, :4] = -torque / inertia, torque / load_inertia
        b = np.array([[0.0], [1 / inertia], [0.0], [0.0], [0.0]])
        a[4, 2], wanted = -1.0, np.array(poles)
        if period is not None:
            step = expm(np.block([[a[:4, :4], b[:4]], [np.zeros((1, 5))]]) * period)
            a, b = np.eye(5), np.zeros((5, 1))
            a[:4, :4], b[:4] = step[:4, :4], step[:4, 4:]
            a[4, 2], wanted = -period, np.exp(wanted * period)
        placed: Any = place_poles(a, b, wanted)
        gains = placed.gain_matrix[0]
        return cls(
            motor_angle=float(gains[0]),
            motor_speed=float(gains[1]),
            load_angle=float(gains[2]),
            load_speed=float(gains[3]),
            integral=float(-gains[4]),
            back_calculation=float(max(abs(pole) for pole in poles)),
        )

    def loops(self) -> tuple[str, ...]:
        """One, and that of the currents."""
        return (LOOP,) if self.current is None else ("current", LOOP)

    def reads(self) -> dict[str, str]:
        """Both sides of the gear."""
        return {"motor": "the feedback of the motor's state", "load": "the feedback of the load's state"}

    def current_control(self) -> CurrentControl | None:
        """Of the current law, with decoupling."""
        return None if self.current is None else CurrentControl(self.current)

    def loop_signals(self) -> tuple[str, ...]:
        """The measured position of the load, and the torque asked for."""
        return ("position", "torque_reference", *(() if self.current is None else ("voltage",)))

    def check_continuous(self) -> None:
        """Raise ValueError for an integral that is reset on reversal."""
        require_no_reset("controller", self)

    def check_sampling(self, sampling: Sampling) -> None:
        """Raise ValueError where the samples are too slow for the prefilter."""
        if self.prefilter is not None:
            self.prefilter.output([0.0], 0.0, period=sampling.period(LOOP))

    def drive(self, plant: Plant) -> Scalar:
        """The law above."""
        motion, loop, ratio = plant.motion, plant.loop(LOOP), plant.motion.ratio
        asked = plant.input("reference", "rad")
        motor_angle, load_angle = plant.measure("motor"), plant.measure("load")
        position = loop.signal("position", "rad", load_angle)
        reference = asked
        if self.prefilter is not None:
            filtered = loop.memory("controller.prefilter", self.prefilter, "rad", ANGLE, first=load_angle)
            reference = loop.output(self.prefilter, filtered, asked)
            loop.remember(self.prefilter, filtered, asked)
        motor_speed = self._speed(loop, "motor", motor_angle, motor_angle, motion.motor_speed)
        load_speed = self._speed(loop, "load", load_angle, position, motion.load_speed)
        integral = loop.memory("controller", self, "N m")
        error = reference - position
        proportional = self.motor_angle * (reference - motor_angle / ratio) + self.load_angle * error
        damping = self.motor_speed * motor_speed / ratio + self.load_speed * load_speed
        demanded = proportional - damping + integral[0]
        allowed = plant.allow(saturate(demanded, self.limit) / ratio, motor_speed)
        loop.integrate(self, integral, error, demanded, allowed * ratio)
        plant.output("position_error", "rad", asked - motion.load_angle)
        torque_reference = loop.signal("torque_reference", "N m", allowed)
        return plant.actuate(loop, torque_reference, motor_speed, motor_angle)

    def _speed(self, loop: Loop, side: str, first: Scalar, angle: Scalar, true: Scalar) -> Scalar:
        law = self.speed_from
        if law is None:
            return true
        memory = loop.memory(f"controller.speed_from.{side}", law, "rad", ANGLE, first=first)
        loop.remember(law, memory, angle)
        return loop.output(law, memory, angle)

    # -- for analyses ------------------------------------------------------------------------------------

    def in_continuous_time(self) -> "StateFeedback":
        """Without the reset on reversal."""
        return never_reset(self)

    def contributions(self, signals: Mapping[str, np.ndarray], ratio: float) -> dict[str, np.ndarray]:
        """Of angles, speeds and integral [N m at the motor]."""
        reference = signals["reference"] if self.prefilter is None else signals["controller.prefilter.filtered"]
        motor, load = reference - signals["motor_angle_at_load"], reference - signals["load_angle"]
        speeds = self.motor_speed * signals["motor_speed"] / ratio + self.load_speed * signals["load_speed"]
        return {
            "proportional action": (self.motor_angle * motor + self.load_angle * load) / ratio,
            "derivative action": -speeds / ratio,
            "integral action": signals["controller.integral"] / ratio,
        }

    def countermeasures(self, cycle: StickingCycle) -> list[Countermeasure]:
        """At the integral, and by less of it."""
        gain, integral = (abs(k / cycle.ratio) for k in (self.motor_angle + self.load_angle, self.integral))
        ready = with_switchable_integral(self)
        return [
            *at_the_integral(ready, cycle, gain=gain, integral=integral, unit="rad"),
            *retune(self, {f"integral gain / {k}": {"integral": 1 / k} for k in (4, 16)}),
            *reset_on_reversal(self, cycle),
        ]

    def error_at_integral(self, ratio: float) -> float:
        """The position error itself."""
        return 1.0
