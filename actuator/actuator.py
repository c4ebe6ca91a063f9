"""One actuator: motor, inverter, controller, gear and load, composed into a HybridSystem."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca

from actuator.contacts import ContactMechanics
from actuator.current_source import CurrentSource
from actuator.dc_link import DCLink
from actuator.drive import ANGLE, Motion, Site, cascade_drive, loops_of, open_drive, pid_drive
from actuator.heat import Heat
from actuator.hybrid import Clock, HybridSystem
from actuator.inverter import Inverter
from actuator.ledger import Ledger
from actuator.linear_load import LinearLoad
from actuator.load import Load
from actuator.motor import PMSM, DCMotor, TorqueSource
from actuator.observe import Mechanics, observe
from actuator.parameters import Parameter, parameterize, with_values
from actuator.sensors import Sensors
from actuator.thermal import ThermalNetwork
from controllers.cascade import Cascade
from controllers.pid import PID
from controllers.sampling import LOOPS, Sampling
from gear.transmission import Transmission

SPEED = 0.1  # rad/s, a usual size
PARTS = ("controller", "sampling", "sensors", "link", "inverter", "motor", "thermal", "gear", "load")
SAME_RATIO = 1e-9


@dataclass(frozen=True, kw_only=True)
class Actuator:
    """A geared positioning actuator.

    Power flows motor -> gear -> load, positive torque accelerates in positive direction, and the position
    is that of the gear's output shaft. Without a controller the motor torque is an input.

    Inputs
        reference            position reference [rad], with a controller
        torque_reference     motor torque demand [N m], without one
        load_torque          torque on the output shaft [N m]
        load_force           force on the rod of a LinearLoad [N]
        inject.<signal>      added to a signal of the loop: position, speed_reference, torque_reference,
                             voltage (torque axis); zero unless asked for

    Parameters
    ----------
    motor : TorqueSource, CurrentSource, DCMotor or PMSM
        TorqueSource with a PID, a Cascade without current loop, or no controller; CurrentSource with a Cascade without
        current loop; the others with an inverter and a Cascade.
    gear : Transmission
        From the motor shaft (input) to the load shaft (output).
    load : Load or LinearLoad
        On the output shaft.
    inverter : Inverter or None
        For DCMotor and PMSM.
    link : DCLink or None
        The voltage of the inverter as a state; None for a constant one.
    controller : PID, Cascade or None
        Position controller.
    sampling : Sampling or None
        Periods at which the loops of the controller run; None in continuous time, for design.
    sensors : Sensors
        Of angles and currents; those left out are ideal.
    thermal : ThermalNetwork or None
        Temperatures of motor, housing and oil; None where nothing depends on them.
    name : str
        For messages and reports.

    Raises
    ------
    ValueError
        Where the parts do not go together.
    """

    motor: TorqueSource | CurrentSource | DCMotor | PMSM
    gear: Transmission
    load: Load | LinearLoad = field(default_factory=Load)
    inverter: Inverter | None = None
    link: DCLink | None = None
    controller: PID | Cascade | None = None
    sampling: Sampling | None = None
    sensors: Sensors = field(default_factory=Sensors)
    thermal: ThermalNetwork | None = None
    name: str = "actuator"

    def __post_init__(self) -> None:
        _require_drive(self)
        _require_sampling(self)

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


def _require_drive(actuator: Actuator) -> None:
    """Raise where motor, inverter and controller do not go together."""
    controller, kind = actuator.controller, type(actuator.motor).__name__
    if isinstance(actuator.motor, DCMotor | PMSM):
        if not (actuator.inverter and isinstance(controller, Cascade) and controller.current):
            raise ValueError(
                f"Actuator: a {kind} needs an inverter and a Cascade as controller, whose current loop drives it"
            )
    elif actuator.inverter or actuator.link or (isinstance(controller, Cascade) and controller.current):
        raise ValueError(
            f"Actuator: a {kind} has no voltage: leave inverter, link and the current loop of a Cascade out"
        )
    if isinstance(actuator.motor, CurrentSource) and not isinstance(controller, Cascade):
        raise ValueError(f"Actuator: a {kind} needs a Cascade as controller, with current = None")
    if isinstance(controller, Cascade) and controller.current_demand != "quadrature":
        if not isinstance(actuator.motor, PMSM):
            raise ValueError(f'Actuator: current_demand "{controller.current_demand}" is for a PMSM, not for a {kind}')


def _require_sampling(actuator: Actuator) -> None:
    """Raise where what needs samples has none, or other ones."""
    controller, sampling = actuator.controller, actuator.sampling
    remedies = controller.remedies if isinstance(controller, Cascade) else None
    if sampling is None:
        for name in ("motor", "load", "current"):
            sensor = getattr(actuator.sensors, name)
            if sensor is not None and (sensor.memory() or sensor.resolution is not None):
                raise ValueError(
                    f"Actuator.sensors.{name}: resolution, noise and delay need a sampled controller: give the "
                    "actuator a sampling, or leave them out"
                )
        if remedies is not None and remedies.knocker is not None:
            raise ValueError("Actuator: a Knocker needs a sampled controller: give the actuator a sampling")
        return
    current = isinstance(controller, Cascade) and controller.current
    needed = {PID: ("position",), Cascade: LOOPS if current else LOOPS[1:]}.get(type(controller), ())
    present = tuple(name for name in LOOPS if getattr(sampling, name) is not None)
    if present != needed:
        raise ValueError(
            f"Actuator.sampling must have the periods of the loops of its controller "
            f"({', '.join(needed) or 'there is none'}), got {', '.join(present)}"
        )
    for law in (remedies.dither, remedies.knocker) if remedies and sampling.speed else ():
        if law is not None:
            law.check_period(sampling.speed)


class _Assembly:
    """One pass through the actuator in the direction of power flow."""

    def __init__(self, actuator: Actuator) -> None:
        parts: dict[str, Any] = {}
        parameters: list[Parameter] = []
        for name in PARTS:
            parts[name], found = parameterize(getattr(actuator, name), name)
            parameters += found
        if actuator.link is not None:
            parts["link_start"] = actuator.link.source_voltage
        book = Ledger()
        heat = Heat(book, parts["thermal"], actuator.thermal)
        gear: Transmission = heat.oiled(parts["gear"])
        kinematics = actuator.gear.kinematics(gear)
        symbols = [
            {shaft: ca.SX.sym(f"{shaft}.{what}") for shaft in kinematics.independent} for what in ("angle", "speed")
        ]
        angle, speed = (kinematics.expand(known) for known in symbols)
        motion = Motion(
            motor_angle=angle[gear.input],
            motor_speed=speed[gear.input],
            load_angle=angle[gear.output],
            load_speed=speed[gear.output],
            ratio=actuator.gear.ratio(),
        )
        inertia = {name: shaft.inertia for name, shaft in gear.shafts.items()}
        inertia[gear.input] += getattr(parts["motor"], "inertia", 0)
        inertia[gear.output] += parts["load"].inertia_at(motion.load_angle)
        contacts = ContactMechanics(gear, actuator.gear.redundant(), kinematics, inertia)

        loops, due = loops_of(book, parts["sampling"], actuator.sampling)
        site = Site(
            book=book,
            parts=parts,
            motion=motion,
            loops=loops,
            sensors=actuator.sensors,
            temperature=heat.of_motor(),
            housing=heat.of_housing(),
        )
        drive = {PID: pid_drive, Cascade: cascade_drive}.get(type(parts["controller"]), open_drive)
        torque = dict.fromkeys(gear.shafts, ca.SX(0))
        motor_torque, load_torque = drive(site), self._load_torque(book, parts["load"], motion)
        torque[gear.input] += motor_torque
        torque[gear.output] += load_torque
        book.output("motor_torque", "N m", motor_torque)
        book.output("total_load_torque", "N m", load_torque)

        m = ca.SX.sym("m", len(contacts.mode_names()))
        modes = contacts.modes(m)
        forces = contacts.forces(angle, speed, torque, modes)
        for known, unit, nominal, rates in (
            (symbols[0], "rad", ANGLE, speed),
            (symbols[1], "rad/s", SPEED, forces.acceleration),
        ):
            for shaft, symbol in known.items():
                book.state(symbol.name(), unit, nominal, symbol=symbol)
                book.rate(symbol.name(), rates[shaft])
        seen = Mechanics(contacts, forces, modes, angle, speed, torque)
        observe(book, seen, motion)
        site.losses.update(seen.losses())
        heat.feed(site.losses)

        arguments = [book.x(), m, book.u(), ca.vertcat(*(parameter.symbol for parameter in parameters))]
        fired = ca.SX.sym("fired", len(contacts.margin_names()))
        settle = contacts.reset_function("settle", arguments, fired, angle, speed, torque, m)
        clocks = _clocks(actuator.sampling)
        self.system = HybridSystem(
            name=actuator.name,
            states=book.states,
            modes=tuple(contacts.mode_names()),
            inputs=book.inputs,
            outputs=book.outputs,
            margin_names=tuple(contacts.margin_names()),
            parameters=tuple(parameters),
            travel=_travel(actuator.gear),
            flow=ca.Function("flow", arguments, [book.flow()]),
            margins=ca.Function("margins", arguments, [contacts.margins(forces, modes)]),
            reset=_whole_reset(settle, arguments, [state.name for state in book.states], list(symbols[1].values())),
            check=lambda values: _check_values(actuator, values),
            outputs_function=ca.Function("outputs", arguments, [book.y()]),
            clocks=clocks,
            tick=ca.Function("tick", [due, *arguments], [book.after_tick()]) if clocks else None,
            period=ca.Function("period", arguments[3:], [parts["sampling"].base]) if clocks else None,
        )

    def _load_torque(self, book: Ledger, load: Any, motion: Motion) -> ca.SX:
        """Of the load itself and from outside, as a torque on the output shaft."""
        outside = book.input("load_torque", "N m")
        if not isinstance(load, LinearLoad):
            return load.torque(motion.load_angle, motion.load_speed) + outside
        force = book.input("load_force", "N")
        book.output("rod_position", "m", load.position(motion.load_angle))
        book.output("rod_speed", "m/s", load.speed(motion.load_angle, motion.load_speed))
        return load.torque(motion.load_angle, motion.load_speed, force) + outside


def _whole_reset(settle: ca.Function, arguments: list[ca.SX], states: list[str], speeds: list[ca.SX]) -> ca.Function:
    """Reset of the mechanics, everything else unchanged."""
    inputs = [ca.MX.sym(f"input{i}", settle.size1_in(i)) for i in range(1 + len(arguments))]
    after, modes, fault = settle(*inputs)
    x, first = inputs[1], states.index(speeds[0].name())
    return ca.Function("reset", inputs, [ca.vertcat(x[:first, :], after, x[first + len(speeds) :, :]), modes, fault])


def _clocks(sampling: Sampling | None) -> tuple[Clock, ...]:
    """One per loop that has a period, the fastest first."""
    if sampling is None:
        return ()
    return tuple(Clock(name, sampling.every(name)) for name in LOOPS if getattr(sampling, name) is not None)


def _check_values(actuator: Actuator, values: Mapping[str, float]) -> None:
    """Raise where parameters break a rule, or change what the model was built on."""
    parts = {name: with_values(getattr(actuator, name), name, values) for name in PARTS}
    clocks = _clocks(parts["sampling"])
    if clocks != _clocks(actuator.sampling):
        raise ValueError(
            f"{actuator.name}: these periods change how many ticks lie between the samples of a loop, on which "
            "the model is built; change all periods by the same factor, or make a new Actuator"
        )
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
