"""What an actuator offers to its controller: sensors, loops, inputs, and the motor at the end of it.

Each law stands once, with its controller; the loops that it runs in decide whether that is in continuous time or at
their ticks.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import casadi as ca

from actuator.parts.temperature import MotorTemperature
from actuator.system.builder import SystemBuilder
from actuator.system.current_loop import MotorDrive
from controllers.controller import Controller, PlantMotion
from controllers.loop import Loop
from controllers.sampling import Sampling
from gear.quantities import Scalar, require_known

ANGLES = ("motor", "load")  # measured by a sensor each
NOISES = 4  # so many sensors of one seed have noises of their own: both angles and the currents of two axes


@dataclass(frozen=True, kw_only=True)
class DriveContext:
    """Of what and where a drive is built: the `controllers.controller.Plant` of an actuator."""

    builder: SystemBuilder
    parts: Mapping[str, Any]
    motion: PlantMotion
    loops: Mapping[str, Loop]
    temperature: MotorTemperature | None = None
    oil_or_housing: Scalar | None = None  # K
    losses: dict[str, Scalar] = field(default_factory=dict)  # W, by where they arise
    read: set[str] = field(default_factory=set)  # what the controller has taken of what it may read

    def drive(self) -> Scalar:
        """Torque on the motor's shaft [N m]; without a controller the one asked for, within the motor's limit."""
        controller: Controller | None = self.parts["controller"]
        if controller is None:
            return self.allow(self.input("torque_reference", "N m"), self.motion.motor_speed)
        torque, declared = controller.drive(self), controller.reads()
        for name in declared:
            if name not in self.read:
                raise ValueError(
                    f"Actuator.controller: a {type(controller).__name__} declares that it reads {name!r} "
                    f"({declared[name]}), and does not"
                )
        return torque

    @property
    def oil(self) -> Scalar:
        """Temperature of the oil, or else of the housing [K]."""
        self._take("oil")
        if self.oil_or_housing is None:
            raise ValueError('the temperature of the oil needs a thermal network with a node "oil" or "housing"')
        return self.oil_or_housing

    def loop(self, name: str) -> Loop:
        """One of the controller's loops, by its name."""
        require_known([name], self.loops, "loop")
        return self.loops[name]

    def input(self, name: str, unit: str) -> ca.SX:
        """Declare an input."""
        return self.builder.input(name, unit)

    def output(self, name: str, unit: str, value: Scalar) -> None:
        """Declare an output."""
        self.builder.output(name, unit, value)

    def last(self, name: str) -> ca.SX:
        """A held state of the controller, which may be declared later."""
        return self.builder.held(name)

    def measure(self, name: str) -> Scalar:
        """The angle [rad] that the sensor on the motor or the load shows; the true one without a sensor."""
        self._take(name)
        return self.sense(name, getattr(self.motion, f"{name}_angle"), ANGLES.index(name))

    def sense(self, name: str, true: Scalar, place: int, path: str = "") -> Scalar:
        """What the sensor of that name makes of a true value; the value itself without a sensor.

        Sensors with the same seed have noises of their own, by their place among all.
        """
        sensor = getattr(self.parts["sensors"], name)
        if sensor is None:
            return true
        loop = next(iter(self.loops.values()))  # the fastest
        kept = sensor.memory(true) if name in ANGLES else sensor.memory()
        noise = replace(sensor.white_noise, seed=NOISES * sensor.white_noise.seed + place).memory()
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

    def allow(self, torque: Scalar, motor_speed: Scalar) -> Scalar:
        """What motor and inverter can give of a torque at the motor [N m]."""
        return self._motor.allow_torque(torque, motor_speed)

    def actuate(self, loop: Loop, torque: Scalar, motor_speed: Scalar, motor_angle: Scalar) -> Scalar:
        """Torque on the motor's shaft [N m] from a torque reference, the measured speed and angle of the motor."""
        return self._motor.shaft_torque(loop, torque, motor_speed, motor_angle)

    def _take(self, name: str) -> None:
        controller: Controller = self.parts["controller"]
        if name not in controller.reads():
            raise ValueError(
                f"Actuator.controller: a {type(controller).__name__} takes {name!r} without declaring that it reads it"
            )
        self.read.add(name)

    @cached_property
    def _motor(self) -> MotorDrive:
        controller: Controller | None = self.parts["controller"]
        return MotorDrive(
            builder=self.builder,
            motor=self.parts["motor"],
            inverter=self.parts["inverter"],
            link=self.parts["link"],
            control=None if controller is None else controller.current_control(),
            loop=self.loops.get("current"),
            motion=self.motion,
            temperature=self.temperature,
            losses=self.losses,
            sense=lambda current, axis, k: self.sense("current", current, len(ANGLES) + k, path=axis),
        )


def build_loops(
    builder: SystemBuilder, names: tuple[str, ...], sampling: Sampling | None, numbers: Sampling | None
) -> tuple[dict[str, Loop], ca.SX]:
    """A loop by each name, all in continuous time or each at its own ticks, and which of them are due.

    `sampling` may be symbolic, `numbers` is the same with the numbers that decide how often each is due.
    """
    if sampling is None or numbers is None:
        return {name: Loop(builder) for name in names}, ca.SX(0, 1)
    due = ca.SX.sym("due", len(names))
    return {
        name: Loop(builder, due[k], sampling.period(name), delay=0 if k else numbers.delay)
        for k, name in enumerate(names)
    }, due
