"""From a torque demand to the torque of the motor: current control, inverter, DC link, winding."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import casadi as ca

from actuator.parts.current_source import CurrentSource
from actuator.parts.dc_motor import DCMotor
from actuator.parts.park import rotated
from actuator.parts.pmsm import PMSM
from actuator.parts.torque_source import TorqueSource
from actuator.system.builder import PREFIX, Loop, SystemBuilder
from actuator.system.parameters import unchecked
from controllers.current_reference import CurrentReference
from controllers.pid import PI
from controllers.shapes import limited
from gear.quantities import Scalar
from gear.quantities.roles import LoopSignal

if TYPE_CHECKING:
    from actuator.system.drive import Site

SQUARE_FLOOR = 1e-12  # V^2; keeps the slope of a magnitude finite at zero


class PlantVoltages:
    """What the motor of an actuator can be asked for: its currents within those of the inverter, at its link's voltage.

    Without a DC link of its own the inverter has a constant voltage.
    """

    def __init__(self, parts: Mapping[str, Any], book: SystemBuilder) -> None:
        self.motor, self.inverter, self.link = parts["motor"], parts["inverter"], parts["link"]
        self.voltage: Scalar | None = None
        if self.link is not None:
            self.voltage = book.state("link.voltage", "V", initial=self.link.source_voltage, owner="DC link")
        self.demand: CurrentReference | None = None
        if isinstance(self.motor, PMSM) and parts["controller"].current_demand == "least current":
            names = ("pole_pairs", "flux", "inductance_d", "inductance_q")
            self.demand = unchecked(CurrentReference, **{name: getattr(self.motor, name) for name in names})

    def allowed_torque(self, torque: Scalar, speed: Scalar, temperature: Scalar | None) -> Scalar:
        """The torque [N m] that the motor may be asked for of one demanded."""
        if isinstance(self.motor, TorqueSource):
            return limited(torque, self.motor.torque_limit)
        if isinstance(self.motor, CurrentSource):
            return self.motor.torque([self.motor.allow(self.motor.current_for(torque))])
        if self.demand is not None:
            return self.demand.torque(*self.currents(torque, speed, temperature))
        current = self.inverter.allow(self.motor.current_for(torque), self.voltage, temperature)
        return current / self.motor.current_for(1.0)

    def currents(self, torque: Scalar, speed: Scalar, temperature: Scalar | None) -> list[Scalar]:
        """Current references [A] for a torque that is allowed."""
        if self.demand is None:
            return self.motor.references(self.motor.current_for(torque))
        most = self.inverter.current_limit_at(self.voltage, temperature)
        link = self.inverter.dc_voltage if self.voltage is None else self.voltage
        # the resistance takes its part of the voltage
        left = link / ca.sqrt(3) - self.motor.resistance * most
        return self.demand.references(torque, speed, left, most)


def winding(site: "Site", voltages: PlantVoltages, torque: Scalar, speed: Scalar, angle: Scalar) -> Scalar:
    """Torque on the rotor [N m] from the torque reference, the measured speed and the measured angle of the motor."""
    motor = site.parts["motor"]
    if isinstance(motor, TorqueSource):
        return site.loops["speed"].delayed("controller.torque", "N m", torque)
    if isinstance(motor, CurrentSource):
        return _current_source(site, motor, torque)
    loop = site.loops["current"]
    currents = [site.book.state(f"motor.{axis}", "A", owner="motor winding") for axis in motor.axes]
    measured = [site.sensed("current", current, path=axis) for axis, current in zip(motor.axes, currents, strict=True)]
    references = voltages.currents(torque, speed, site.winding)
    electrical = [motor.pole_pairs * value for value in (angle, site.motion.motor_angle)] if _turns(motor) else [0, 0]
    realized = _current_control(site, voltages, references, measured, speed, electrical[0])
    applied = _applied(motor, loop, realized, electrical, speed)
    site.book.output("voltage", "V", applied[-1])
    applied[-1] += site.book.input(PREFIX + "voltage", "V", LoopSignal("voltage"))
    at_terminals = voltages.inverter.terminal_voltages(applied, currents, electrical[1], voltages.voltage)
    rates = motor.derivatives(currents, at_terminals, site.motion.motor_speed, site.temperature)
    for axis, rate in zip(motor.axes, rates, strict=True):
        site.book.rate(f"motor.{axis}", rate)
    _powers(site, voltages, currents, at_terminals, electrical[1])
    site.book.output("current", "A", currents[-1])
    site.book.output("voltage_magnitude", "V", ca.sqrt(sum(v**2 for v in applied) + SQUARE_FLOOR))
    return motor.shaft_torque(currents, site.motion.motor_angle, site.motion.motor_speed, site.temperature)


def _turns(motor: DCMotor | PMSM) -> bool:
    """Whether the axes of the motor turn with its rotor."""
    return isinstance(motor, PMSM)


def _current_source(site: "Site", motor: CurrentSource, torque: Scalar) -> Scalar:
    demanded = site.loops["speed"].delayed("controller.current", "A", motor.current_for(torque))
    currents = [site.book.state(f"motor.{axis}", "A", owner="motor winding") for axis in motor.axes]
    for axis, rate in zip(motor.axes, motor.derivatives(currents, demanded), strict=True):
        site.book.rate(f"motor.{axis}", rate)
    site.book.output("current", "A", currents[0] if currents else demanded)
    speed = site.motion.motor_speed
    site.losses.update(iron=motor.rotor.iron_loss(speed), drag=motor.rotor.friction_loss(speed))
    return motor.shaft_torque(currents or [demanded], site.motion.motor_angle, site.motion.motor_speed)


def _current_control(
    site: "Site", voltages: PlantVoltages, references: list, measured: list, speed: Scalar, angle: Scalar
) -> list[Scalar]:
    """The voltages that the inverter realizes of those demanded on each axis, which drive the integrals."""
    cascade, motor, loop = site.parts["controller"], site.parts["motor"], site.loops["current"]
    law: PI = cascade.current
    integrals = [loop.memory(f"controller.{axis}", law, "V") for axis in motor.axes]
    errors = [reference - current for reference, current in zip(references, measured, strict=True)]
    wanted = []
    for integral, error, reference, emf in zip(
        integrals, errors, references, motor.coupling_voltages(measured, speed), strict=True
    ):
        proposal = law.proposed(integral[0], error, reference)
        wanted.append(proposal + emf if cascade.decoupling else proposal)
    realized = voltages.inverter.realize([limited(voltage, law.limit) for voltage in wanted], angle, voltages.voltage)
    for integral, error, want, got in zip(integrals, errors, wanted, realized, strict=True):
        loop.integrate(law, integral, error, want, got)
    return realized


def _applied(motor: Any, loop: Loop, realized: list, electrical: list, speed: Scalar) -> list[Scalar]:
    """Voltages on the axes of the motor [V].

    A sampled inverter holds them until the next tick: in the frame of the phases, not in that of the rotor,
    which turns away meanwhile. So the vector is turned ahead by where the rotor will be in the middle of that time.
    """
    names = [f"controller.voltage_{k}" for k in range(len(realized))]
    if not loop.sampled or not _turns(motor):
        return [loop.delayed(name, "V", value) for name, value in zip(names, realized, strict=True)]
    ahead = (loop.delay + 0.5) * loop.period * motor.pole_pairs * speed  # the middle of a period
    phases = rotated(realized, electrical[0] + ahead)
    held = [loop.delayed(name, "V", value) for name, value in zip(names, phases, strict=True)]
    return rotated(held, -electrical[1])


def _powers(site: "Site", voltages: PlantVoltages, currents: list, terminals: list, angle: Scalar) -> None:
    """Where the electrical power goes, and what the link is left with."""
    motor, book = site.parts["motor"], site.book
    losses = motor.losses(currents, site.motion.motor_speed, site.temperature)
    conduction = voltages.inverter.conduction_loss(currents, angle)
    into_motor = motor.electrical_power(currents, terminals)
    site.losses.update(copper=losses.copper, iron=losses.iron, drag=losses.friction, inverter=conduction)
    book.output("electrical_power", "W", into_motor + conduction)
    book.output("magnetic_energy", "J", motor.magnetic_energy(currents) + motor.rotor.energy(site.motion.motor_angle))
    if voltages.link is not None:
        drawn = (into_motor + conduction) / voltages.voltage
        book.rate("link.voltage", voltages.link.rate(voltages.voltage, drawn))
        powers = voltages.link.powers(voltages.voltage)
        book.output("source_power", "W", powers.source)
        book.output("link_energy", "J", voltages.link.energy(voltages.voltage))
        site.losses.update(link=powers.source_loss, chopper=powers.chopper_loss)
