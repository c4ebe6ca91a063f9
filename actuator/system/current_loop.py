"""From a torque reference to the torque of the motor: current control, inverter, DC link, winding."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca

from actuator.parts.dc_link import DCLink
from actuator.parts.inverter import Inverter
from actuator.parts.park import rotate
from actuator.parts.temperature import MotorTemperature
from actuator.system.builder import SystemBuilder
from actuator.system.parameters import unchecked
from controllers.controller import CurrentControl, PlantMotion
from controllers.current_reference import CurrentReference
from controllers.loop import PREFIX, Loop
from controllers.shapes import saturate
from gear.quantities import Scalar
from gear.quantities.roles import LoopSignal

SQUARE_FLOOR = 1e-12  # V^2; keeps the slope of a magnitude finite at zero
WINDING = "motor winding"  # owner of the currents


@dataclass(kw_only=True)
class MotorDrive:
    """The motor of an actuator with what feeds it, by the kind of drive that the motor declares.

    Without a DC link of its own the inverter has a constant voltage.
    """

    builder: SystemBuilder
    motor: Any  # symbolic, of the protocol of its kind
    inverter: Inverter
    link: DCLink | None
    control: CurrentControl | None
    loop: Loop | None  # of the currents
    motion: PlantMotion
    temperature: MotorTemperature | None
    losses: dict[str, Scalar]  # W, filled
    sense: Callable[[Scalar, str, int], Scalar]  # (current, axis, place) -> measured

    def allow_torque(self, torque: Scalar, speed: Scalar) -> Scalar:
        """The torque [N m] that the motor may be asked for of one demanded."""
        if self.motor.driven_by != "voltage":
            return self.motor.allow_torque(torque)
        if self._mtpa is not None:
            return self._mtpa.torque(*self._references(torque, speed))
        current = self.inverter.allow(self.motor.current_for(torque), self._voltage, self._winding)
        return current / self.motor.current_for(1.0)

    def shaft_torque(self, loop: Loop, torque: Scalar, speed: Scalar, angle: Scalar) -> Scalar:
        """Torque on the rotor [N m] from the torque reference, the measured speed and angle of the motor."""
        if self.motor.driven_by == "torque":
            return loop.hold_delayed("controller.torque", "N m", torque)
        if self.motor.driven_by == "current":
            return self._by_current(loop, torque)
        return self._by_voltage(torque, speed, angle)

    @cached_property
    def _voltage(self) -> Scalar | None:
        """Of the link [V]; None for the inverter's own."""
        link = self.link
        return None if link is None else self.builder.state("link.voltage", "V", initial=link.source_voltage)

    @cached_property
    def _mtpa(self) -> CurrentReference | None:
        constants = self.motor.constants_for_mtpa() if self.control is not None and self.control.mtpa else None
        return None if constants is None else unchecked(CurrentReference, **constants)

    @property
    def _winding(self) -> Scalar | None:
        """Temperature of the winding [K], by which the current limit is derated."""
        return None if self.temperature is None else self.temperature.winding

    def _references(self, torque: Scalar, speed: Scalar) -> list[Scalar]:
        """Current references [A] for a torque that is allowed."""
        if self._mtpa is None:
            return self.motor.references(self.motor.current_for(torque))
        most = self.inverter.current_limit_at(self._voltage, self._winding)
        link = self.inverter.dc_voltage if self._voltage is None else self._voltage
        # the resistance takes its part of the voltage
        left = link / ca.sqrt(3) - self.motor.resistance_at() * most
        return self._mtpa.references(torque, speed, left, most)

    def _by_current(self, loop: Loop, torque: Scalar) -> Scalar:
        motor, motion = self.motor, self.motion
        demanded = loop.hold_delayed("controller.current", "A", motor.current_for(torque))
        states = self._currents()
        self._rates(motor.derivatives(states, demanded))
        currents = states or [demanded]
        self.builder.output("current", "A", currents[-1])
        self.losses.update(motor.losses(currents, motion.motor_speed).known())
        return motor.shaft_torque(currents, motion.motor_angle, motion.motor_speed)

    def _by_voltage(self, torque: Scalar, speed: Scalar, angle: Scalar) -> Scalar:
        motor, motion, builder = self.motor, self.motion, self.builder
        assert self.loop is not None
        currents = self._currents()
        measured = [
            self.sense(current, axis, k) for k, (axis, current) in enumerate(zip(motor.axes, currents, strict=True))
        ]
        references = self._references(torque, speed)
        turns = motor.frame_turns
        electrical = [0, 0] if turns is None else [turns * value for value in (angle, motion.motor_angle)]
        realized = self._control_currents(references, measured, speed, electrical[0])
        applied = self._apply_voltages(self.loop, realized, electrical, speed)
        builder.output("voltage", "V", applied[-1])
        applied[-1] += builder.input(PREFIX + "voltage", "V", LoopSignal("voltage"))
        terminals = self.inverter.terminal_voltages(applied, currents, electrical[1], self._voltage)
        self._rates(motor.derivatives(currents, terminals, motion.motor_speed, self.temperature))
        self._balance_powers(currents, terminals, electrical[1])
        builder.output("current", "A", currents[-1])
        builder.output("voltage_magnitude", "V", ca.sqrt(sum(v**2 for v in applied) + SQUARE_FLOOR))
        return motor.shaft_torque(currents, motion.motor_angle, motion.motor_speed, self.temperature)

    def _currents(self) -> list[ca.SX]:
        return [self.builder.state(f"motor.{axis}", "A", owner=WINDING) for axis in self.motor.axes]

    def _rates(self, rates: list[Scalar]) -> None:
        for axis, rate in zip(self.motor.axes, rates, strict=True):
            self.builder.rate(f"motor.{axis}", rate)

    def _control_currents(self, references: list, measured: list, speed: Scalar, angle: Scalar) -> list[Scalar]:
        """The voltages that the inverter realizes of those demanded on each axis, which drive the integrals."""
        motor, loop = self.motor, self.loop
        assert self.control is not None and loop is not None
        law = self.control.law
        integrals = [loop.memory(f"controller.{axis}", law, "V") for axis in motor.axes]
        errors = [reference - current for reference, current in zip(references, measured, strict=True)]
        wanted = []
        for integral, error, reference, emf in zip(
            integrals, errors, references, motor.coupling_voltages(measured, speed), strict=True
        ):
            proposal = law.proposed(integral[0], error, reference)
            wanted.append(proposal + emf if self.control.decoupling else proposal)
        demanded = [saturate(voltage, law.limit) for voltage in wanted]
        realized = self.inverter.realize(demanded, angle, self._voltage)
        for integral, error, want, got in zip(integrals, errors, wanted, realized, strict=True):
            loop.integrate(law, integral, error, want, got)
        return realized

    def _apply_voltages(self, loop: Loop, realized: list, electrical: list, speed: Scalar) -> list[Scalar]:
        """Voltages on the axes of the motor [V].

        A sampled inverter holds them until the next tick: in the frame of the phases, not in that of the rotor,
        which turns away meanwhile. So the vector is turned ahead by where the rotor will be in the middle of that
        time.
        """
        names = [f"controller.voltage_{k}" for k in range(len(realized))]
        turns = self.motor.frame_turns
        if not loop.sampled or turns is None:
            return [loop.hold_delayed(name, "V", value) for name, value in zip(names, realized, strict=True)]
        ahead = (loop.delay + 0.5) * loop.period * turns * speed  # the middle of a period
        phases = rotate(realized, electrical[0] + ahead)
        held = [loop.hold_delayed(name, "V", value) for name, value in zip(names, phases, strict=True)]
        return rotate(held, -electrical[1])

    def _balance_powers(self, currents: list, terminals: list, angle: Scalar) -> None:
        """Where the electrical power goes, and what the link is left with."""
        motor, builder, link = self.motor, self.builder, self.link
        losses = motor.losses(currents, self.motion.motor_speed, self.temperature)
        conduction = self.inverter.conduction_loss(currents, angle)
        into_motor = motor.electrical_power(currents, terminals)
        self.losses.update(losses.known(), inverter=conduction)
        builder.output("electrical_power", "W", into_motor + conduction)
        builder.output("magnetic_energy", "J", motor.stored_energy(currents, self.motion.motor_angle))
        if link is not None:
            voltage = self._voltage
            builder.rate("link.voltage", link.rate(voltage, (into_motor + conduction) / voltage))
            powers = link.powers(voltage)
            builder.output("source_power", "W", powers.source)
            builder.output("link_energy", "J", link.energy(voltage))
            self.losses.update(link=powers.source_loss, chopper=powers.chopper_loss)
