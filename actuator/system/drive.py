"""The drive: from reference and measured motion to the torque of the motor, in the direction of the signals.

One function per kind of controller. Each law stands once; the loops it runs in decide whether that is in
continuous time or at their ticks.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import casadi as ca

from actuator.parts.temperature import MotorTemperature
from actuator.system.builder import Loop, SystemBuilder
from actuator.system.current_loop import PlantVoltages, winding
from controllers.cascade import Cascade, Remedies
from controllers.pid import PI, PID
from controllers.reference import Motion as Path
from controllers.sampling import LOOPS, Sampling
from controllers.shapes import limited
from gear.quantities import Scalar

ANGLE = 1e-4  # rad, a usual size; an angle is fine when the deflection of teeth is
SENSED = ("motor", "load", "current")


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Angles [rad] and speeds [rad/s] of the motor and of the load, and the gear ratio between them."""

    motor_angle: Scalar
    motor_speed: Scalar
    load_angle: Scalar
    load_speed: Scalar
    ratio: float


@dataclass(frozen=True, kw_only=True)
class Site:
    """What a drive is built of and where: the book, symbolic parts, motion, loops, and what the rest of it knows."""

    book: SystemBuilder
    parts: Mapping[str, Any]
    motion: Motion
    loops: Mapping[str, Loop]
    temperature: MotorTemperature | None = None
    oil: Scalar | None = None  # K, or of the housing, for schedules
    losses: dict[str, Scalar] = field(default_factory=dict)  # W, by where they arise

    @property
    def winding(self) -> Scalar | None:
        """Temperature of the winding [K], by which the current limit folds back."""
        return None if self.temperature is None else self.temperature.winding

    @property
    def fastest(self) -> Loop:
        """The loop in which sensors are read."""
        return next(iter(self.loops.values()))

    def sensed(self, name: str, true: Scalar, path: str = "") -> Scalar:
        """What the sensor of that name makes of a true value; the value itself without a sensor.

        Sensors with the same seed have noises of their own.
        """
        sensor = getattr(self.parts["sensors"], name)
        if sensor is None:
            return true
        loop, place = self.fastest, (*SENSED, "current_q").index("current_q" if path == "current_q" else name)
        kept = sensor.memory() if name == "current" else sensor.memory(true)
        noise = replace(sensor.white_noise, seed=(len(SENSED) + 1) * sensor.white_noise.seed + place).memory()
        memory = [
            loop.state(
                f"sensors.{path or name}.{part.name}",
                *(noise if part.name == noise.name else part)[1:],
                roles=(),
                owner=f"sensor {path or name}",
            )
            for part in kept
        ]
        for symbol, after in zip(memory, sensor.advance(memory, true), strict=True):
            loop.after(symbol, lambda: 0.0, lambda after=after: after)
        return sensor.read(memory, true)


class Demand(NamedTuple):
    """What the speed loop is asked for."""

    speed: Scalar  # of the motor [rad/s]
    torque: Scalar = 0.0  # fed forward [N m]
    error: Scalar = 0.0  # of the position, at the motor [rad]


def open_drive(site: Site) -> Scalar:
    """No controller: the torque asked for, within the motor's limit."""
    return limited(site.book.input("torque_reference", "N m"), site.parts["motor"].torque_limit)


def pid_drive(site: Site) -> Scalar:
    """A PID on the position of the load, whose output is the torque at the load that the motor has to bring."""
    pid: PID = site.parts["controller"]
    motion, loop = site.motion, site.loops["position"]
    reference = site.book.input("reference", "rad")
    measured = site.sensed("load", motion.load_angle)
    position = loop.signal("position", "rad", measured)
    integral = loop.memory("controller", pid, "N m")
    rate = motion.load_speed
    if pid.filter_time is not None:
        filtered = loop.state("controller.filtered_position", "rad", ANGLE, initial=ca.SX(measured))
        rate = pid.rate(position, filtered, loop.period)
        loop.after(filtered, lambda: rate, lambda: pid.advance_filtered(position, filtered, loop.period))
    error = reference - position
    proposed = pid.proposed(integral[0], error, rate, reference)
    at_motor = limited(limited(proposed, pid.limit) / motion.ratio, site.parts["motor"].torque_limit)
    # the demand is at the load; an ideal motor in front of a gear turns `ratio` times as fast
    loop.integrate(pid, integral, error, proposed, at_motor * motion.ratio)
    site.book.output("position_error", "rad", reference - motion.load_angle)
    return loop.applied("torque_reference", "N m", at_motor)


def cascade_drive(site: Site) -> Scalar:
    """Position and speed loop, and what the motor makes of their torque demand."""
    cascade, motion, book = site.parts["controller"], site.motion, site.book
    inner = site.loops["speed"]
    motor_angle = site.sensed("motor", motion.motor_angle) + book.input("motor_angle_error", "rad")
    asked = _speed_demand(site, cascade) if cascade.position is None else _position_loop(site, cascade, motor_angle)
    motor_speed = _speed(cascade.speed_from, inner, motor_angle, motion.motor_speed)

    law: PI = cascade.speed
    if cascade.schedule is not None:
        law = cascade.schedule.applied(law, _scheduled_by(cascade.schedule.over, site, inner))
    integral = inner.memory("controller.speed", law, "N m")
    speed_error = asked.speed - motor_speed
    demanded = law.proposed(integral[0], speed_error, asked.speed) + asked.torque
    demanded += _added(cascade.remedies, inner, motor_speed, asked.error)
    observer = cascade.disturbance_observer
    seen = [] if observer is None else inner.memory("controller.disturbance_observer", observer)
    if observer is not None:
        demanded -= inner.output(observer, seen, 0.0, motor_speed)
    for name, law_of_filter in cascade.torque_filters.items():
        memory = inner.memory(f"controller.torque_filters.{name}", law_of_filter, "N m")
        unfiltered, demanded = demanded, inner.output(law_of_filter, memory, demanded)
        inner.remember(law_of_filter, memory, unfiltered)
    voltages = PlantVoltages(site.parts, site.book)
    allowed = voltages.allowed_torque(limited(demanded, law.limit), motor_speed, site.winding)
    inner.integrate(law, integral, speed_error, demanded, allowed)
    if observer is not None:
        inner.remember(observer, seen, allowed, motor_speed)
    torque_reference = inner.signal("torque_reference", "N m", allowed)
    return winding(site, voltages, torque_reference, motor_speed, motor_angle)


def _speed_demand(site: Site, cascade: Cascade) -> Demand:
    """The motor speed that is asked for, of a drive without position loop."""
    asked = site.book.input("speed_reference", "rad/s")
    site.book.output("speed_error", "rad/s", asked - site.motion.motor_speed)
    return Demand(limited(asked, cascade.speed_limit))


def _position_loop(site: Site, cascade: Cascade, motor_angle: Scalar) -> Demand:
    """What the position loop asks of the speed loop."""
    motion, book, outer = site.motion, site.book, site.loops["position"]
    asked = book.input("reference", "rad")
    load_angle = site.sensed("load", motion.load_angle) if cascade.feedback == "load" else motor_angle / motion.ratio
    position = outer.signal("position", "rad", load_angle)
    path = _path(cascade.reference, outer, asked, load_angle)
    error, forward = path.value - position, cascade.feed_forward
    pushed = 0.0 if forward is None else forward.speed(motion.ratio * path.rate)
    speed = _speed_asked(cascade, outer, error, path.value, pushed, motion.ratio)
    torque: Scalar = 0.0
    if forward is not None:
        ahead = forward.torque(motion.ratio * path.rate, motion.ratio * path.acceleration)
        torque = outer.hold("controller.torque_ahead", "N m", ahead)[0]
    true = motion.load_angle if cascade.feedback == "load" else motion.motor_angle / motion.ratio
    book.output("position_error", "rad", asked - true)
    return Demand(outer.signal("speed_reference", "rad/s", speed), torque, motion.ratio * error)


def _path(law: Any, loop: Loop, asked: Scalar, position: Scalar) -> Path:
    """The reference within its limits, with its rates; it begins where the drive is."""
    if law is None:
        return Path(asked, 0.0, 0.0)
    memory = loop.memory("controller.reference", law, "rad", ANGLE, first=position)
    loop.remember(law, memory, asked)
    return law.motion(memory, asked, loop.period)


def _speed_asked(cascade: Any, loop: Loop, error: Scalar, reference: Scalar, pushed: Scalar, ratio: Scalar) -> Scalar:
    """Motor speed reference within its limit."""
    law = cascade.position
    if not isinstance(law, PI):
        return limited(ratio * law.output(error) + pushed, cascade.speed_limit)
    integral = loop.memory("controller.position", law, "rad/s")
    proposed = law.proposed(integral[0], error, reference)
    within = limited(ratio * limited(proposed, law.limit) + pushed, cascade.speed_limit)
    loop.integrate(law, integral, error, proposed, (within - pushed) / ratio)
    return within


def _speed(law: Any, loop: Loop, angle: Scalar, true: Scalar) -> Scalar:
    """The motor's speed as the controller knows it."""
    if law is None:
        return true
    memory = loop.memory("controller.speed_from", law, "rad", ANGLE, first=angle)
    loop.remember(law, memory, angle)
    return loop.output(law, memory, angle)


def _scheduled_by(over: str, site: Site, loop: Loop) -> Scalar:
    if over == "temperature":
        if site.oil is None:
            raise ValueError(
                'a schedule over "temperature" needs a thermal network with a node "oil" or "housing": give one'
            )
        return site.oil
    if not loop.sampled:
        raise ValueError('a schedule over "load" rests on the last sample: give the controller a sampling')
    return site.book.held("controller.torque_reference")


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


def loops_of(book: SystemBuilder, sampling: Sampling | None, numbers: Sampling | None) -> tuple[dict[str, Loop], ca.SX]:
    """A loop by each name, all in continuous time or each at its own ticks, and which of them are due.

    `sampling` may be symbolic, `numbers` is the same with the numbers that decide which loops there are.
    """
    if sampling is None or numbers is None:
        return {name: Loop(book) for name in LOOPS}, ca.SX(0, 1)
    present = [name for name in LOOPS if getattr(numbers, name) is not None]
    due = ca.SX.sym("due", len(present))
    return {
        name: Loop(book, due[k], getattr(sampling, name), delay=0 if k else numbers.delay)
        for k, name in enumerate(present)
    }, due
