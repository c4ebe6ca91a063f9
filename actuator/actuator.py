"""One actuator: motor, inverter, controller, gear and load, composed into a HybridSystem."""

import pickle  # of its own fields
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, lru_cache
from typing import Any

import casadi as ca

from actuator.parts.dc_link import DCLink
from actuator.parts.inverter import Inverter
from actuator.parts.load import Load, OutputLoad
from actuator.parts.motor import Motor
from actuator.parts.sensors import Sensors
from actuator.parts.thermal import ThermalNetwork
from actuator.system.builder import SystemBuilder
from actuator.system.compatibility import require_compatible
from actuator.system.contacts import ContactMechanics
from actuator.system.drive import DriveContext, build_loops
from actuator.system.heat import HeatFlow
from actuator.system.hybrid import Clock, HybridSystem
from actuator.system.outputs import Mechanics, observe
from actuator.system.parameters import Parameter, parameterize, with_values
from controllers.controller import Controller, PlantMotion
from controllers.sampling import Sampling
from gear.quantities.roles import FrictionMemory, Heat, ShaftAngle, ShaftSpeed
from gear.transmission import Transmission

ANGLE = 1e-4  # rad, a usual size; an angle is fine when the deflection of teeth is
SPEED = 0.1  # rad/s, a usual size
PARTS = ("controller", "sampling", "sensors", "link", "inverter", "motor", "thermal", "gear", "load")
SAME_RATIO = 1e-9
MOST_BUILT = 16  # actuators that a process keeps of those that came from another one
SHARED = {"cse": True}  # what several laws work out is worked out once: a fifth of all operations


@dataclass(frozen=True, kw_only=True)
class Actuator:
    """A geared positioning actuator.

    Power flows motor -> gear -> load, positive torque accelerates in positive direction, and the position
    is that of the gear's output shaft. Without a controller the motor torque is an input.

    Inputs
        reference            position reference [rad], with a position controller
        speed_reference      motor speed reference [rad/s], with a Cascade that has no position law
        torque_reference     motor torque demand [N m], without one
        motor_angle_error    added to the measured angle of the motor [rad], with a Cascade: noise as a signal
        load_torque          torque on the output shaft [N m]
        load_force           force on the rod of a LinearLoad [N]
        inject.<signal>      added to a signal of the loop: position, speed_reference, torque_reference,
                             voltage (torque axis); zero unless asked for

    Parameters
    ----------
    motor : Motor
        Driven by torque (TorqueSource), with a PID, a Cascade without current loop, or no controller; by current
        (CurrentSource), with a Cascade without current loop; by voltage (DCMotor, PMSM), with an inverter and a
        controller that has a current loop.
    gear : Transmission
        From the motor shaft (input) to the load shaft (output).
    load : OutputLoad
        On the output shaft.
    inverter : Inverter or None
        For a motor that is driven by voltage.
    link : DCLink or None
        The voltage of the inverter as a state; None for a constant one.
    controller : Controller or None
        PID, Cascade, StateFeedback or another: of the position, or, of a Cascade without position law, of the speed.
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

    motor: Motor
    gear: Transmission
    load: OutputLoad = field(default_factory=Load)
    inverter: Inverter | None = None
    link: DCLink | None = None
    controller: Controller | None = None
    sampling: Sampling | None = None
    sensors: Sensors = field(default_factory=Sensors)
    thermal: ThermalNetwork | None = None
    name: str = "actuator"

    def __post_init__(self) -> None:
        require_compatible(self)

    def system(self) -> HybridSystem:
        """The actuator as a HybridSystem, every number a named parameter."""
        return self._assembly.system

    @cached_property
    def _assembly(self) -> "_Assembly":
        return _Assembly(self)

    def __reduce__(self) -> tuple[Any, ...]:
        """Without its model, which cannot travel; what arrives more than once in a process is one actuator there."""
        return _arrived, (pickle.dumps({each.name: getattr(self, each.name) for each in fields(self)}),)

    def __hash__(self) -> int:
        return id(self)

    def __eq__(self, other: object) -> bool:
        return self is other


@lru_cache(maxsize=MOST_BUILT)
def _arrived(packed: bytes) -> Actuator:
    return Actuator(**pickle.loads(packed))  # packed by an actuator


class _Assembly:
    """One pass through the actuator in the direction of power flow."""

    def __init__(self, actuator: Actuator) -> None:
        parts: dict[str, Any] = {}
        parameters: list[Parameter] = []
        for name in PARTS:
            parts[name], found = parameterize(getattr(actuator, name), name)
            parameters += found
        builder = SystemBuilder()
        heat = HeatFlow(builder, parts["thermal"])
        gear: Transmission = heat.warm_oils(parts["gear"])
        kinematics = actuator.gear.kinematics(gear)
        symbols = [
            {shaft: ca.SX.sym(f"{shaft}.{what}") for shaft in kinematics.independent} for what in ("angle", "speed")
        ]
        angle, speed = (kinematics.expand(known) for known in symbols)
        motion = PlantMotion(
            motor_angle=angle[gear.input],
            motor_speed=speed[gear.input],
            load_angle=angle[gear.output],
            load_speed=speed[gear.output],
            ratio=actuator.gear.ratio(),
        )
        inertia = {name: shaft.inertia for name, shaft in gear.shafts.items()}
        inertia[gear.input] += parts["motor"].rotor_inertia()
        inertia[gear.output] += parts["load"].inertia_at(motion.load_angle)
        creeping = actuator.gear.laws_with_memory()
        memory = {path: [ca.SX.sym(f"gear.{path}.{k.name}") for k in law.memory()] for path, law in creeping.items()}
        contacts = ContactMechanics(gear, actuator.gear, kinematics, inertia, memory)

        names = () if actuator.controller is None else actuator.controller.loops()
        loops, due = build_loops(builder, names, parts["sampling"], actuator.sampling)
        context = DriveContext(
            builder=builder,
            parts=parts,
            motion=motion,
            loops=loops,
            temperature=heat.of_motor(),
            oil_or_housing=heat.of_oil(),
        )
        torque = dict.fromkeys(gear.shafts, ca.SX(0))
        motor_torque, load_torque = context.drive(), self._load_torque(builder, parts["load"], motion)
        torque[gear.input] += motor_torque
        torque[gear.output] += load_torque
        builder.output("motor_torque", "N m", motor_torque)
        builder.output("total_load_torque", "N m", load_torque)

        m = ca.SX.sym("m", len(contacts.mode_variables()))
        modes = contacts.modes(m)
        forces = contacts.forces(angle, speed, torque, modes)
        for known, unit, nominal, role, rates in (
            (symbols[0], "rad", ANGLE, ShaftAngle, speed),
            (symbols[1], "rad/s", SPEED, ShaftSpeed, forces.acceleration),
        ):
            for shaft, symbol in known.items():
                owner = f"shaft {shaft}"
                builder.state(symbol.name(), unit, nominal, symbol=symbol, roles=(role(shaft),), owner=owner)
                builder.rate(symbol.name(), rates[shaft])
        for path, law in creeping.items():
            more = {"roles": (FrictionMemory(f"gear.{path}"),), "owner": f"{type(law).__name__} of gear.{path}"}
            for kept, symbol, rate in zip(law.memory(), memory[path], forces.by_memory[path][1], strict=True):
                builder.state(symbol.name(), kept.unit, kept.nominal, initial=kept.initial, symbol=symbol, **more)
                builder.rate(symbol.name(), rate)
        seen = Mechanics(contacts, forces, modes, angle, speed, torque)
        observe(builder, seen, motion)
        context.losses.update(seen.losses())
        for name, loss in context.losses.items():
            builder.output(f"{name}_loss", "W", loss, Heat(name))
        heat.feed(context.losses)

        arguments = [builder.x(), m, builder.u(), ca.vertcat(*(parameter.symbol for parameter in parameters))]
        fired = ca.SX.sym("fired", len(contacts.events()))
        pose = contacts.pose_function("pose", arguments, fired, angle, speed, torque, m)
        posed, modes_after, speeds_after = pose(fired, *arguments)
        first = [state.name for state in builder.states].index(next(iter(symbols[1].values())).name())
        x, count = arguments[0], len(symbols[1])
        x_after = ca.vertcat(x[:first, :], speeds_after, x[first + count :, :])
        pose = ca.Function("pose", [fired, *arguments], [posed, modes_after, x_after], SHARED)
        clocks = _clocks(actuator.sampling)
        self.system = HybridSystem(
            name=actuator.name,
            states=builder.states,
            mode_variables=tuple(contacts.mode_variables()),
            inputs=builder.inputs,
            outputs=builder.outputs,
            events=tuple(contacts.events()),
            parameters=tuple(parameters),
            contacts=tuple(contacts.records(_travel(actuator.gear))),
            flow=ca.Function("flow", arguments, [builder.flow()], SHARED),
            contact_state=ca.Function("contact_state", arguments, contacts.state(forces), SHARED),
            margins=ca.Function("margins", arguments, [contacts.margins(forces, modes)], SHARED),
            pose=pose,
            reset=contacts.reset_function("reset", pose),
            check=lambda values: _check_values(actuator, values),
            outputs_function=ca.Function("outputs", arguments, [builder.y()], SHARED),
            clocks=clocks,
            tick=ca.Function("tick", [due, *arguments], [builder.after_tick()]) if clocks else None,
            period=ca.Function("period", arguments[3:], [parts["sampling"].base]) if clocks else None,
            begin=builder.begin(arguments[3]),
        )

    def _load_torque(self, builder: SystemBuilder, load: Any, motion: PlantMotion) -> ca.SX:
        """Of the load itself and from outside, as a torque on the output shaft."""
        at, outside = (motion.load_angle, motion.load_speed), builder.input("load_torque", "N m")
        own = () if load.own_input is None else (builder.input(*load.own_input),)
        for name, (unit, value) in load.signals(*at).items():
            builder.output(name, unit, value)
        builder.output("load_power", "W", load.power(*at, *own) - outside * motion.load_speed)
        return load.torque(*at, *own) + outside


def _clocks(sampling: Sampling | None) -> tuple[Clock, ...]:
    """One per loop that has a period, the fastest first."""
    if sampling is None:
        return ()
    return tuple(Clock(name, sampling.every(name)) for name in sampling.loops())


def _check_values(actuator: Actuator, values: Mapping[str, float]) -> None:
    """Raise where parameters break a rule, or change what the model was built on."""
    changed = replace(actuator, **{name: with_values(getattr(actuator, name), name, values) for name in PARTS})
    if _clocks(changed.sampling) != _clocks(actuator.sampling):
        raise ValueError(
            f"{actuator.name}: these periods change how many ticks lie between the samples of a loop, on which "
            "the model is built; change all periods by the same factor, or make a new Actuator"
        )
    before, after = actuator.gear.ratio(), changed.gear.ratio()
    if abs(after - before) > SAME_RATIO * abs(before):
        raise ValueError(
            f"{actuator.name}: these parameters change the gear ratio from {before:.6g} to {after:.6g}, on which the "
            "model is built; make a new Actuator"
        )


def _travel(gear: Transmission) -> dict[str, int]:
    """Direction of each contact when the output moves forward."""
    turns = gear.speed_ratios()
    slips = {
        f"gear.{contact.name}": sum(float(c) * turns[shaft] for shaft, c in contact.slip.items())
        for contact in gear.contacts()
    }
    return {name: -1 if slip < 0 else 1 for name, slip in slips.items()}
