"""One actuator: motor, inverter, controller, gear and load, composed into a HybridSystem."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca

from actuator.contacts import ContactMechanics
from actuator.hybrid import HybridSystem, Quantity
from actuator.inverter import Inverter
from actuator.load import Load
from actuator.motor import PMSM, DCMotor, TorqueSource
from actuator.parameters import parameterize, with_values
from controllers.cascade import Cascade
from controllers.pid import PID, limited
from gear.transmission import Transmission

# usual sizes, for the error control; an angle is fine when the teeth's deflection is
ANGLE, SPEED, CURRENT, VOLTAGE, TORQUE = 1e-4, 0.1, 1.0, 1.0, 1.0
PARTS = ("controller", "inverter", "motor", "gear", "load")
SAME_RATIO = 1e-9
PREFIX = "inject."  # inputs that are added to a signal inside a loop


@dataclass(frozen=True, kw_only=True)
class Actuator:
    """A geared positioning actuator.

    Power flows motor -> gear -> load, positive torque accelerates in positive direction, and the position
    is that of the gear's output shaft. Without a controller the motor torque is an input.

    Inputs
        reference            position reference [rad], with a controller
        torque_reference     motor torque demand [N m], without one
        load_torque          torque on the output shaft [N m]
        inject.<signal>      added to a signal of the loop: position, speed_reference, torque_reference,
                             voltage (torque axis); zero unless asked for

    Parameters
    ----------
    motor : TorqueSource, DCMotor or PMSM
        TorqueSource with a PID or no controller; the others with an inverter and a Cascade.
    gear : Transmission
        From the motor shaft (input) to the load shaft (output).
    load : Load
        On the output shaft.
    inverter : Inverter or None
        For DCMotor and PMSM.
    controller : PID, Cascade or None
        Position controller.
    name : str
        For messages and reports.

    Raises
    ------
    ValueError
        Where the parts do not go together.
    """

    motor: TorqueSource | DCMotor | PMSM
    gear: Transmission
    load: Load = field(default_factory=Load)
    inverter: Inverter | None = None
    controller: PID | Cascade | None = None
    name: str = "actuator"

    def __post_init__(self) -> None:
        electric = isinstance(self.motor, DCMotor | PMSM)
        kind = type(self.motor).__name__
        if electric and not (self.inverter and isinstance(self.controller, Cascade)):
            raise ValueError(
                f"Actuator: a {kind} needs an inverter and a Cascade as controller, whose current loop drives it"
            )
        if not electric and (self.inverter or isinstance(self.controller, Cascade)):
            raise ValueError(
                f"Actuator: a {kind} has no current: leave the inverter out and use a PID or no controller"
            )

    def system(self) -> HybridSystem:
        """The actuator as a HybridSystem, every number a named parameter."""
        return self._assembly.system

    @cached_property
    def _assembly(self) -> "_Assembly":
        return _Assembly(self)

    def __hash__(self) -> int:
        return id(self)

    def __eq__(self, other: object) -> bool:
        return self is other


class _Assembly:
    """One pass through the actuator in the direction of power flow; the equations stand in `_equations`."""

    def __init__(self, actuator: Actuator) -> None:
        parts: dict[str, Any] = {}
        parameters = []
        for name in PARTS:
            parts[name], found = parameterize(getattr(actuator, name), name)
            parameters += found
        self.parts, self.ratio = parts, actuator.gear.ratio()
        gear: Transmission = parts["gear"]
        self.kinematics = actuator.gear.kinematics(gear)
        inertia = {name: shaft.inertia for name, shaft in gear.shafts.items()}
        inertia[gear.input] += getattr(parts["motor"], "inertia", 0)
        inertia[gear.output] += parts["load"].inertia
        self.inertia = inertia
        self.contacts = ContactMechanics(gear, actuator.gear.redundant(), self.kinematics, inertia)

        self.states: list[Quantity] = []
        self.symbols: dict[str, ca.SX] = {}
        self._declare_states()
        self.angle, self.speed = (
            self.kinematics.expand({shaft: self.symbols[f"{shaft}.{what}"] for shaft in self.kinematics.independent})
            for what in ("angle", "speed")
        )
        self.input_names = self._input_names()
        self.u = {quantity.name: ca.SX.sym(quantity.name) for quantity in self.input_names}

        mode_names = self.contacts.mode_names()
        m = ca.SX.sym("m", len(mode_names))
        x = ca.vertcat(*self.symbols.values())
        u = ca.vertcat(*self.u.values())
        p = ca.vertcat(*(parameter.symbol for parameter in parameters))
        self.outputs: dict[str, tuple[str, ca.SX]] = {}
        rates, torque = self._equations(m)
        angle, speed = self.angle, self.speed
        modes = self.contacts.modes(m)
        forces = self.contacts.forces(angle, speed, torque, modes)
        for shaft in self.kinematics.independent:
            rates[f"{shaft}.angle"], rates[f"{shaft}.speed"] = speed[shaft], forces.acceleration[shaft]
        self._observe(forces, modes, angle, speed, self.contacts.rigid_forces(forces, angle, speed, torque))

        arguments = [x, m, u, p]
        fired = ca.SX.sym("fired", len(self.contacts.margin_names()))
        settle = self.contacts.reset_function("settle", arguments, fired, angle, speed, torque, m)
        self.system = HybridSystem(
            name=actuator.name,
            states=tuple(self.states),
            modes=tuple(mode_names),
            inputs=tuple(self.input_names),
            outputs=tuple(Quantity(name, unit) for name, (unit, _) in self.outputs.items()),
            margin_names=tuple(self.contacts.margin_names()),
            parameters=tuple(parameters),
            travel=_travel(actuator.gear),
            flow=ca.Function("flow", arguments, [ca.vertcat(*(rates[state.name] for state in self.states))]),
            margins=ca.Function("margins", arguments, [self.contacts.margins(forces, modes)]),
            reset=self._whole_reset(settle, arguments),
            check=lambda values: _check_values(actuator, values),
            outputs_function=ca.Function(
                "outputs", arguments, [ca.vertcat(*(value for _, value in self.outputs.values()))]
            ),
        )

    # -- names ----------------------------------------------------------------------------------------

    def _declare_states(self) -> None:
        controller, motor = self.parts["controller"], self.parts["motor"]
        axes = getattr(motor, "axes", ())
        if isinstance(controller, PID):
            self._state("controller.integral", "N m", TORQUE)
            if controller.filter_time is not None:
                self._state("controller.filtered_position", "rad", ANGLE)
        if isinstance(controller, Cascade):
            self._state("controller.speed.integral", "N m", TORQUE)
            for axis in axes:
                self._state(f"controller.{axis}.integral", "V", VOLTAGE)
        for axis in axes:
            self._state(f"motor.{axis}", "A", CURRENT)
        for shaft in self.kinematics.independent:
            self._state(f"{shaft}.angle", "rad", ANGLE)
        for shaft in self.kinematics.independent:
            self._state(f"{shaft}.speed", "rad/s", SPEED)

    def _state(self, name: str, unit: str, nominal: float) -> None:
        self.states.append(Quantity(name, unit, nominal))
        self.symbols[name] = ca.SX.sym(name)

    def _input_names(self) -> list[Quantity]:
        found = [Quantity("load_torque", "N m")]
        controller = self.parts["controller"]
        if controller is None:
            return [Quantity("torque_reference", "N m"), *found]
        found = [Quantity("reference", "rad"), *found, Quantity(PREFIX + "position", "rad")]
        if isinstance(controller, Cascade):
            found.append(Quantity(PREFIX + "speed_reference", "rad/s"))
        found.append(Quantity(PREFIX + "torque_reference", "N m"))
        if isinstance(controller, Cascade):
            found.append(Quantity(PREFIX + "voltage", "V"))
        return found

    # -- equations ------------------------------------------------------------------------------------

    def _equations(self, m: ca.SX) -> tuple[dict[str, ca.SX], dict[str, ca.SX]]:
        """Rates of the controller and motor states, and the torques they and the load put on the shafts."""
        gear, load = self.parts["gear"], self.parts["load"]
        angle, speed = self.angle, self.speed
        rates: dict[str, ca.SX] = {}
        drive: Callable = {PID: self._pid, Cascade: self._cascade}.get(type(self.parts["controller"]), self._open)
        motor_torque = drive(rates)
        load_torque = load.torque(angle[gear.output], speed[gear.output]) + self.u["load_torque"]
        torque = dict.fromkeys(gear.shafts, ca.SX(0))
        torque[gear.input] += motor_torque
        torque[gear.output] += load_torque
        self._output("motor_torque", "N m", motor_torque)
        self._output("total_load_torque", "N m", load_torque)
        return rates, torque

    def _open(self, rates: dict[str, ca.SX]) -> ca.SX:
        return limited(self.u["torque_reference"], self.parts["motor"].torque_limit)

    def _pid(self, rates: dict[str, ca.SX]) -> ca.SX:
        pid, integral = self.parts["controller"], self.symbols["controller.integral"]
        output_shaft = self.parts["gear"].output
        position = self._point("position", "rad", self.angle[output_shaft])
        rate = self.speed[output_shaft]
        if pid.filter_time is not None:
            rate = pid.rate(position, self.symbols["controller.filtered_position"])
            rates["controller.filtered_position"] = rate
        error = self.u["reference"] - position
        proposed = pid.proposed(integral, error, rate)
        at_motor = limited(limited(proposed, pid.limit) / self.ratio, self.parts["motor"].torque_limit)
        torque = at_motor * self.ratio
        rates["controller.integral"] = pid.integral_derivative(error, proposed, torque)
        # the demand is at the load; an ideal motor in front of a gear turns `ratio` times as fast
        self._output("position_error", "rad", error)
        return self._point("torque_reference", "N m", at_motor)

    def _cascade(self, rates: dict[str, ca.SX]) -> ca.SX:
        cascade, motor, inverter = self.parts["controller"], self.parts["motor"], self.parts["inverter"]
        gear = self.parts["gear"]
        motor_speed = self.speed[gear.input]
        at_load = self.angle[gear.output]
        at_motor = self.angle[gear.input] / self.ratio
        position = self._point("position", "rad", at_load if cascade.feedback == "load" else at_motor)
        error = self.u["reference"] - position

        speed_reference = self._point("speed_reference", "rad/s", cascade.speed_reference(error, self.ratio))
        speed_error = speed_reference - motor_speed
        demanded = cascade.speed.proposed(self.symbols["controller.speed.integral"], speed_error)
        asked = inverter.allow(motor.current_for(limited(demanded, cascade.speed.limit)))
        allowed = asked * motor.current_for(1.0) ** -1
        rates["controller.speed.integral"] = cascade.speed.derivative(speed_error, demanded, allowed)
        torque_reference = self._point("torque_reference", "N m", allowed)

        currents = [self.symbols[f"motor.{axis}"] for axis in motor.axes]
        references = motor.references(motor.current_for(torque_reference))
        errors = [reference - current for reference, current in zip(references, currents, strict=True)]
        coupling = motor.coupling_voltages(currents, motor_speed)
        wanted = []
        for axis, current_error, motion in zip(motor.axes, errors, coupling, strict=True):
            proposal = cascade.current.proposed(self.symbols[f"controller.{axis}.integral"], current_error)
            wanted.append(limited(proposal + motion if cascade.decoupling else proposal, cascade.current.limit))
        realized = inverter.realize(wanted)
        for axis, current_error, want, got in zip(motor.axes, errors, wanted, realized, strict=True):
            rates[f"controller.{axis}.integral"] = cascade.current.derivative(current_error, want, got)
        realized[-1] = self._point("voltage", "V", realized[-1])
        for axis, rate in zip(motor.axes, motor.derivatives(currents, realized, motor_speed), strict=True):
            rates[f"motor.{axis}"] = rate

        self._output("position_error", "rad", error)
        self._output("current", "A", currents[-1])
        self._output("voltage_magnitude", "V", ca.sqrt(sum(v**2 for v in realized) + 1e-12))
        return motor.torque(currents)

    def _point(self, name: str, unit: str, computed: ca.SX) -> ca.SX:
        """A named signal of the loop: observed as computed, used with what is injected there."""
        self._output(name, unit, computed)
        injected = self.u.get(PREFIX + name)
        return computed if injected is None else computed + injected

    # -- outputs --------------------------------------------------------------------------------------

    def _output(self, name: str, unit: str, value: Any) -> None:
        self.outputs[name] = (unit, ca.SX(value))

    def _observe(self, forces: Any, modes: Any, angle: dict, speed: dict, rigid: dict) -> None:
        gear: Transmission = self.parts["gear"]
        for side, shaft in (("motor", gear.input), ("load", gear.output)):
            self._output(f"{side}_angle", "rad", angle[shaft])
            self._output(f"{side}_speed", "rad/s", speed[shaft])
        self._output("motor_angle_at_load", "rad", angle[gear.input] / self.ratio)
        friction: dict[str, ca.SX] = {}
        for k, contact in enumerate(self.contacts.contacts):
            unit = ("m/s", "N") if contact.name.startswith("meshes.") else ("rad/s", "N m")
            self._output(f"gear.{contact.name}.slip_speed", unit[0], forces.slip[k])
            self._output(f"gear.{contact.name}.friction", unit[1], forces.friction[k])
            work = -forces.friction[k] * sum(arm * speed[shaft] for shaft, arm in contact.torque.items())
            self._output(f"gear.{contact.name}.friction_loss", "W", work)
            friction[contact.name] = forces.friction[k]
        for name, normal in {**forces.normal, **rigid}.items():
            mesh, path = gear.meshes[name], f"gear.meshes.{name}"
            self._output(f"{path}.normal_force", "N", normal)
            if name in forces.motions:
                self._output(f"{path}.deflection", "m", forces.motions[name].deflection)
            flank = ca.if_else(normal < 0, -1, 1)
            bearing = mesh.bearing_force(normal, friction.get(f"meshes.{name}", 0.0), flank)
            self._output(f"{path}.bearing_force_x", "N", bearing.x)
            self._output(f"{path}.bearing_force_y", "N", bearing.y)
        kinetic = sum(self.inertia[shaft] * speed[shaft] ** 2 / 2 for shaft in gear.shafts)
        self._output("mechanical_energy", "J", kinetic + gear.elastic_energy(forces.motions, angle, modes.flank))

    def _whole_reset(self, settle: ca.Function, arguments: list[ca.SX]) -> ca.Function:
        """Reset of the mechanics, everything else unchanged; speeds are the last states."""
        inputs = [ca.MX.sym(f"input{i}", settle.size1_in(i)) for i in range(1 + len(arguments))]
        speeds, modes, fault = settle(*inputs)
        count = speeds.shape[0]
        x = inputs[1]
        return ca.Function("reset", inputs, [ca.vertcat(x[: x.shape[0] - count], speeds), modes, fault])


def _check_values(actuator: Actuator, values: Mapping[str, float]) -> None:
    """Raise where parameters break a rule, or change what the model was built on."""
    parts = {name: with_values(getattr(actuator, name), name, values) for name in PARTS}
    before, after = actuator.gear.ratio(), parts["gear"].ratio()
    if abs(after - before) > SAME_RATIO * abs(before):
        raise ValueError(
            f"{actuator.name}: these parameters change the gear ratio from {before:.6g} to {after:.6g}, on which the "
            "model is built; make a new Actuator"
        )


def _travel(gear: Transmission) -> dict[str, int]:
    """Direction of each contact when the output moves forward."""
    turns = gear.travel()
    slips = {
        f"gear.{contact.name}": sum(float(c) * turns[shaft] for shaft, c in contact.slip.items())
        for contact in gear.contacts()
    }
    return {name: -1 if slip < 0 else 1 for name, slip in slips.items()}
