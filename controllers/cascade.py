"""Cascade of position, speed and current control."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np

from controllers.compensation import Dither, FrictionCompensation, Knocker
from controllers.controller import Controller, CurrentControl, Plant
from controllers.countermeasures import (
    COMPENSATED,
    OVER,
    Countermeasure,
    StickingCycle,
    at_the_integral,
    reset_on_reversal,
    retune,
    with_switchable_integral,
)
from controllers.feedforward import FeedForward
from controllers.filters import Filter, LowPass, Notch
from controllers.loop import Loop
from controllers.observer import DisturbanceObserver, PositionObserver, SpeedEstimator
from controllers.pid import ANGLE, PI, P, never_reset, proportional_part, require_no_reset
from controllers.reference import Motion, RateAndAccelerationLimit, ReferenceLimit
from controllers.sampling import Sampling
from controllers.scheduling import ScheduledGain
from controllers.shapes import saturate
from controllers.units import SpeedLimit
from gear.quantities import Scalar, check, check_choice
from gear.quantities.registry import part
from gear.quantities.roles import InLoop

CurrentDemand = Literal["quadrature", "MTPA"]
FORMER_DEMAND = {"least current": "MTPA"}
DITHER_HZ = 60.0
KNOCK_TICKS, KNOCK_INTERVAL = 3, 0.1  # ticks that a pulse lasts, and s from pulse to pulse
STANDSTILL = 0.02  # part of the largest motor speed in a cycle below which friction is taken to be static
APART = 4.0  # speed bandwidth over that of the position loop, and over the rate of the integral, in the closed form
SPEED_GAINS: tuple[str, ...] = ("speed.proportional", "speed.integral")


@dataclass(frozen=True, kw_only=True)
class Remedies:
    """What is added to the torque demand against stiction; each None is switched off.

    Parameters
    ----------
    compensation : FrictionCompensation or None
        Of dry friction, with a boost to break away.
    dither : Dither or None
        A small fast oscillation.
    knocker : Knocker or None
        Pulses in the direction of the position error. It needs a sampled controller.
    """

    compensation: FrictionCompensation | None = None
    dither: Dither | None = None
    knocker: Knocker | None = None


class Demand(NamedTuple):
    """What the speed loop is asked for."""

    speed: Scalar  # of the motor [rad/s]
    torque: Scalar = 0.0  # fed forward [N m]
    error: Scalar = 0.0  # of the position, at the motor [rad]


@part(Controller)
@dataclass(frozen=True, kw_only=True)
class Cascade(Controller):
    """Position -> speed -> current, the structure of nearly every servo drive.

        motor speed reference = ratio * position law (reference - measured position), limited
        motor torque demand   = speed PI on motor speed, with what is added to it, filtered, limited
        voltage demand        = current PI on each axis of the motor, plus decoupling

    Parameters
    ----------
    position : P, PI or None
        Gain [1/s] on the position error at the load; None for a speed drive, whose reference is the motor's speed.
    speed : PI
        Torque at the motor [N m] from the speed error of the motor [rad/s].
    current : PI or None
        Voltage [V] from current error [A], the same on each axis of the motor; None for a motor that gets its
        current or torque at once.
    speed_limit : float
        Of the motor speed reference [rad/s].
    feedback : "load" or "motor"
        Where the position is measured; at the motor it is divided by the gear ratio.
    decoupling : bool
        Whether the back-emf and the coupling of the axes are added to the voltage demand.
    reference : ReferenceLimit or None
        Limits of the position reference, at the load.
    feed_forward : FeedForward or None
        From the limited reference, which it needs.
    speed_from : SpeedEstimator or None
        The motor's speed from its measured angle; None for a tachometer.
    torque_filters : mapping of str to Filter
        In a row on the torque demand.
    disturbance_observer : DisturbanceObserver or None
        Its estimate is taken from the torque demand.
    remedies : Remedies
        Against stiction, on the torque demand.
    current_demand : "quadrature" or "MTPA"
        Torque by quadrature current alone, or by maximum torque per ampere with field weakening at the voltage limit,
        for a PMSM.
    schedule : ScheduledGain or None
        Factor on the gains of the speed law over "temperature" [K] (of the oil or else the housing) or "load" (the
        torque demand of the last sample [N m]).

    Raises
    ------
    ValueError
        Where parts do not go together.
    """

    position: Annotated[P | PI | None, InLoop("position")]
    speed: Annotated[PI, InLoop("speed")]
    current: Annotated[PI | None, InLoop("current", "electrical")] = None
    speed_limit: SpeedLimit
    feedback: Literal["load", "motor"] = "load"
    decoupling: bool = True
    reference: ReferenceLimit | None = None
    feed_forward: FeedForward | None = None
    speed_from: SpeedEstimator | None = None
    torque_filters: Mapping[str, Filter] = field(default_factory=dict)
    disturbance_observer: DisturbanceObserver | None = None
    remedies: Remedies = field(default_factory=Remedies)
    current_demand: CurrentDemand = "quadrature"
    schedule: ScheduledGain | None = None

    def __post_init__(self) -> None:
        check(self)
        check_choice(self, "feedback", ("load", "motor"))
        former = FORMER_DEMAND.get(self.current_demand)
        if former is not None:
            raise ValueError(f'Cascade.current_demand "{self.current_demand}" is now called "{former}"')
        check_choice(self, "current_demand", ("quadrature", "MTPA"))
        if self.position is None:
            self._require_no_position()
        if self.feed_forward is not None and self.reference is None:
            raise ValueError(
                "Cascade.feed_forward needs the speed of the reference: limit it, with reference = RateLimit or "
                "RateAndAccelerationLimit"
            )
        if self.schedule is not None and self.schedule.over not in ("temperature", "load"):
            raise ValueError(f'Cascade.schedule is over "temperature" or "load", got {self.schedule.over!r}')

    def _require_no_position(self) -> None:
        """Raise where a part needs the position loop that a speed drive lacks."""
        needing = {"reference": self.reference, "feed_forward": self.feed_forward, "knocker": self.remedies.knocker}
        for name, law in needing.items():
            if law is not None:
                raise ValueError(
                    f"Cascade without a position loop (position = None) has no position error: leave {name} out, "
                    "or give it a position law"
                )

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

    # -- in an actuator ----------------------------------------------------------------------------------

    remainder: ClassVar[str] = "current loop, limits and additions"

    @classmethod
    def examples(cls) -> "tuple[Cascade, ...]":
        """For a motor that gets its torque at once, plain and with most that it can have; with a current loop."""
        whole = cls.for_bandwidths(
            position=20.0, speed=100.0, current=2000.0, inertia=1e-4, resistance=0.3, inductance=4e-4, speed_limit=400.0
        )
        plain = replace(whole, current=None)
        rich = replace(
            plain,
            reference=RateAndAccelerationLimit(rate=5.0, acceleration=100.0),
            feed_forward=FeedForward(inertia=1e-4),
            speed_from=PositionObserver(bandwidth=1000.0),
            torque_filters={"resonance": Notch(frequency=300.0, damping=0.3), "noise": LowPass(frequency=2e3)},
            disturbance_observer=DisturbanceObserver(inertia=1e-4, bandwidth=200.0),
        )
        return (plain, rich, whole)

    def loops(self) -> tuple[str, ...]:
        """Those that it has of current, speed and position."""
        return tuple(name for name in ("current", "speed", "position") if getattr(self, name) is not None)

    def reads(self) -> dict[str, str]:
        """The motor, for the position the load, for a schedule the oil."""
        found = {"motor": "the speed loop"}
        if self.position is not None and self.feedback == "load":
            found["load"] = "the position loop"
        if self.schedule is not None and self.schedule.over == "temperature":
            found["oil"] = 'a schedule over "temperature"'
        return found

    def current_control(self) -> CurrentControl | None:
        """Of the current law."""
        if self.current is None:
            return None
        return CurrentControl(self.current, self.decoupling, self.current_demand == "MTPA")

    def loop_signals(self) -> tuple[str, ...]:
        """Of the loops that it has."""
        outer = () if self.position is None else ("position", "speed_reference")
        return (*outer, "torque_reference", *(() if self.current is None else ("voltage",)))

    def check_continuous(self) -> None:
        """Raise ValueError for a knocker, a square dither, a reset on reversal, a schedule over the last sample."""
        for name in self.loops():
            require_no_reset(f"controller.{name}", getattr(self, name))
        if self.remedies.knocker is not None:
            raise ValueError("a Knocker needs a sampled controller: give the actuator a sampling")
        if self.remedies.dither is not None and self.remedies.dither.shape == "square":
            raise ValueError(
                'the jumps of a square Dither need a sampled controller: give the actuator a sampling, or shape "sine"'
            )
        if self.schedule is not None and self.schedule.over == "load":
            raise ValueError(
                'a schedule over "load" rests on the last sample of the torque: give the actuator a sampling'
            )

    def check_sampling(self, sampling: Sampling) -> None:
        """Raise ValueError where the samples are too slow for what runs in the speed loop."""
        period = sampling.period("speed")
        for law in (self.remedies.dither, self.remedies.knocker):
            if law is not None:
                law.check_period(period)
        for name, law in self.torque_filters.items():
            try:
                law.output([0.0] * len(law.memory()), 0.0, period=period)
            except ValueError as error:
                raise ValueError(f"controller.torque_filters.{name}: {error}") from None

    def drive(self, plant: Plant) -> Scalar:
        """Position and speed loop, and what the motor makes of their torque demand."""
        inner = plant.loop("speed")
        motor_angle = plant.measure("motor") + plant.input("motor_angle_error", "rad")
        asked = self._speed_demand(plant) if self.position is None else self._position_loop(plant, motor_angle)
        motor_speed = _motor_speed(self.speed_from, inner, motor_angle, plant.motion.motor_speed)

        law: PI = self.speed
        if self.schedule is not None:
            law = self.schedule.scale(law, self._scheduled_by(plant))
        integral = inner.memory("controller.speed", law, "N m")
        speed_error = asked.speed - motor_speed
        demanded = law.proposed(integral[0], speed_error, asked.speed) + asked.torque
        demanded += _added(self.remedies, inner, motor_speed, asked.error)
        observer = self.disturbance_observer
        seen = [] if observer is None else inner.memory("controller.disturbance_observer", observer)
        if observer is not None:
            demanded -= inner.output(observer, seen, 0.0, motor_speed)
        for name, law_of_filter in self.torque_filters.items():
            memory = inner.memory(f"controller.torque_filters.{name}", law_of_filter, "N m")
            unfiltered, demanded = demanded, inner.output(law_of_filter, memory, demanded)
            inner.remember(law_of_filter, memory, unfiltered)
        allowed = plant.allow(saturate(demanded, law.limit), motor_speed)
        inner.integrate(law, integral, speed_error, demanded, allowed)
        if observer is not None:
            inner.remember(observer, seen, allowed, motor_speed)
        torque_reference = inner.signal("torque_reference", "N m", allowed)
        return plant.actuate(inner, torque_reference, motor_speed, motor_angle)

    def _speed_demand(self, plant: Plant) -> Demand:
        """The motor speed that is asked for, of a drive without position loop."""
        asked = plant.input("speed_reference", "rad/s")
        plant.output("speed_error", "rad/s", asked - plant.motion.motor_speed)
        return Demand(saturate(asked, self.speed_limit))

    def _position_loop(self, plant: Plant, motor_angle: Scalar) -> Demand:
        """What the position loop asks of the speed loop."""
        motion, outer = plant.motion, plant.loop("position")
        asked = plant.input("reference", "rad")
        load_angle = plant.measure("load") if self.feedback == "load" else motor_angle / motion.ratio
        position = outer.signal("position", "rad", load_angle)
        path = _limited_reference(self.reference, outer, asked, load_angle)
        error, forward = path.value - position, self.feed_forward
        pushed = 0.0 if forward is None else forward.speed(motion.ratio * path.rate)
        speed = self._speed_reference(outer, error, path.value, pushed, motion.ratio)
        torque: Scalar = 0.0
        if forward is not None:
            ahead = forward.torque(motion.ratio * path.rate, motion.ratio * path.acceleration)
            torque = outer.hold("controller.torque_ahead", "N m", ahead)[0]
        true = motion.load_angle if self.feedback == "load" else motion.motor_angle / motion.ratio
        plant.output("position_error", "rad", asked - true)
        return Demand(outer.signal("speed_reference", "rad/s", speed), torque, motion.ratio * error)

    def _speed_reference(self, loop: Loop, error: Scalar, reference: Scalar, pushed: Scalar, ratio: Scalar) -> Scalar:
        """Motor speed reference within its limit."""
        law: Any = self.position
        if not law.integrates:
            return saturate(ratio * law.output(error) + pushed, self.speed_limit)
        integral = loop.memory("controller.position", law, "rad/s")
        proposed = law.proposed(integral[0], error, reference)
        within = saturate(ratio * saturate(proposed, law.limit) + pushed, self.speed_limit)
        loop.integrate(law, integral, error, proposed, (within - pushed) / ratio)
        return within

    def _scheduled_by(self, plant: Plant) -> Scalar:
        """The quantity over which the gains of the speed law are scheduled."""
        over = None if self.schedule is None else self.schedule.over
        return plant.oil if over == "temperature" else plant.last("controller.torque_reference")

    # -- for analyses and tuning -------------------------------------------------------------------------

    def in_continuous_time(self) -> "Cascade":
        """Without knocker and reset on reversal."""
        laws: dict[str, Any] = {name: never_reset(getattr(self, name)) for name in self.loops()}
        return replace(self, remedies=replace(self.remedies, knocker=None), **laws)

    def contributions(self, signals: Mapping[str, np.ndarray], ratio: float) -> dict[str, np.ndarray]:
        """Of the two actions of the speed law [N m]."""
        asked = signals["speed_reference"]
        return {
            "proportional action": proportional_part(self.speed, asked - signals["motor_speed"], asked),
            "integral action": signals["controller.speed.integral"],
        }

    def countermeasures(self, cycle: StickingCycle) -> list[Countermeasure]:
        """At the integral of the speed law, by its gains, by what is added to the torque, by the place of measuring."""
        ready: Any = with_switchable_integral(self)
        if self.remedies.compensation is None:
            silent = FrictionCompensation(
                coulomb=0.0,
                breakaway=0.0,
                standstill=STANDSTILL * cycle.speed,
                width=abs(cycle.ratio) * cycle.amplitude,
            )
            ready = replace(ready, remedies=replace(ready.remedies, compensation=silent))
        to_law = self.error_at_integral(cycle.ratio)
        gain, integral = abs(self.speed.proportional * to_law), abs(self.speed.integral * to_law)
        level = COMPENSATED * cycle.half
        levels = {"remedies.compensation.coulomb": level / 2, "remedies.compensation.breakaway": level}
        less = {f"integral gain / {k}": {"speed.integral": 1 / k} for k in (4, 16)}
        stiffer, softer = dict.fromkeys(SPEED_GAINS, 4.0), {"position.gain": 0.5, "position.proportional": 0.5}
        return [
            *at_the_integral(ready, cycle, gain=gain, integral=integral, unit="rad/s"),
            Countermeasure("friction compensation", f"{level:.3g} N m", ready, levels),
            *retune(
                self,
                {
                    **less,
                    "speed loop gains * 4": stiffer,
                    "position gain / 2": softer,
                    "speed loop gains * 4, position gain / 2": stiffer | softer,
                },
            ),
            *reset_on_reversal(self, cycle),
            *self._by_shaking(cycle),
        ]

    def _by_shaking(self, cycle: StickingCycle) -> list[Countermeasure]:
        """What moves the drive against stiction, and the position measured at the motor."""
        found, level = [], OVER * cycle.half
        period = None if cycle.sampling is None else cycle.sampling.period("speed")
        dither = Dither(amplitude=level, frequency=2 * math.pi * DITHER_HZ)
        if period is None or dither.frequency * period <= math.pi:
            shaken = replace(self, remedies=replace(self.remedies, dither=dither))
            text = f"{level:.3g} N m at {DITHER_HZ:g} Hz"
            found.append(Countermeasure("dither", text, shaken, {}, period=1 / DITHER_HZ))
        if period is not None:
            knocker = Knocker(amplitude=level, width=KNOCK_TICKS * period, interval=KNOCK_INTERVAL)
            knocked = replace(self, remedies=replace(self.remedies, knocker=knocker))
            found.append(Countermeasure("knocker", f"{level:.3g} N m", knocked, {}, period=KNOCK_INTERVAL))
        if self.feedback == "load":
            moved = replace(self, feedback="motor")
            found.append(Countermeasure("position measured at the motor", "", moved, {}, cycle.lost))
        return found

    def tunable_gains(self) -> tuple[str, ...]:
        """Of the position and the speed law; a position law that integrates is refused."""
        if self.position is None or self.position.integrates:
            raise ValueError(
                f"tuning takes a Cascade with a P position law, not {type(self.position).__name__}: "
                "of two integrals in a row the outer one would hunt where the inner one has its dead band"
            )
        return ("position.gain", *SPEED_GAINS)

    def gains_for_bandwidth(self, bandwidth: float, inertia: float, ratio: float) -> dict[str, float]:
        """Bandwidths that are apart by a factor of four, by loop shaping on the inertia that the motor turns."""
        law = PI.for_inertia(inertia=inertia, bandwidth=APART * bandwidth, integral_bandwidth=bandwidth)
        return dict(zip(self.tunable_gains(), (bandwidth, law.proportional, law.integral), strict=True))

    def integrating_path(self) -> str:
        """The speed law."""
        return "speed"

    def error_at_integral(self, ratio: float) -> float:
        """Error of the motor's speed, by the gain of the position law."""
        law = self.position
        if law is None:
            raise ValueError("a Cascade without position law has no position error")
        return ratio * law.gain_on_error()


def _motor_speed(law: SpeedEstimator | None, loop: Loop, angle: Scalar, true: Scalar) -> Scalar:
    """The motor's speed as the controller knows it."""
    if law is None:
        return true
    memory = loop.memory("controller.speed_from", law, "rad", ANGLE, first=angle)
    loop.remember(law, memory, angle)
    return loop.output(law, memory, angle)


def _limited_reference(law: ReferenceLimit | None, loop: Loop, asked: Scalar, position: Scalar) -> Motion:
    """The reference within its limits, with its rates; it begins where the drive is."""
    if law is None:
        return Motion(asked, 0.0, 0.0)
    memory = loop.memory("controller.reference", law, "rad", ANGLE, first=position)
    loop.remember(law, memory, asked)
    return law.motion(memory, asked, loop.period)


def _added(remedies: Remedies, loop: Loop, speed: Scalar, error: Scalar) -> Scalar:
    """Torque against stiction, from the motor's speed and the position error, both at the motor."""
    added: Scalar = 0.0
    if remedies.compensation is not None:
        added += remedies.compensation.output(speed, error)
    for name, inputs in (("dither", ()), ("knocker", (error,))):
        law = getattr(remedies, name)
        if law is not None:
            memory = loop.memory(f"controller.{name}", law)
            added += loop.output(law, memory, *inputs)
            loop.remember(law, memory, *inputs)
    return added
