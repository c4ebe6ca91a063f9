"""Which parts of an actuator go together; each rule raises with the parts by name and what to do."""

from typing import Any

from actuator.parts.load import OutputLoad
from actuator.parts.motor import CurrentDriven, Motor, TorqueDriven, VoltageDriven
from actuator.system.drive import ANGLES
from controllers.controller import Controller
from gear.quantities import show
from gear.quantities.registry import PartError, require_contract
from gear.transmission import Transmission

KINDS: dict[str, type] = {"torque": TorqueDriven, "current": CurrentDriven, "voltage": VoltageDriven}
NODES = {"winding": ("winding", "housing"), "oil": ("oil", "housing")}  # of the thermal network, by what is asked for
READABLE = (*ANGLES, "oil")  # by a controller
Parts = Any  # an Actuator, which imports this file


def require_compatible(actuator: Parts) -> None:
    """Raise ValueError where the parts of an actuator do not go together."""
    _require_contracts(actuator)
    _require_drive(actuator)
    _require_read(actuator)
    _require_temperatures(actuator)
    if actuator.sampling is None:
        _require_continuous(actuator)
    else:
        _require_periods(actuator)


def _require_contracts(actuator: Parts) -> None:
    """Parts that do what is asked of one in their place, whatever class they are."""
    _require_part("motor", actuator.motor, Motor)
    kind = getattr(actuator.motor, "driven_by", None)
    if kind not in KINDS:
        raise ValueError(f"Actuator.motor: driven_by must be one of {', '.join(KINDS)}, got {kind!r}")
    _require_part("motor", actuator.motor, KINDS[kind])
    _require_part("load", actuator.load, OutputLoad)
    if actuator.controller is not None:
        _require_part("controller", actuator.controller, Controller)


def _require_part(name: str, part: Any, slot: type) -> None:
    try:
        require_contract(type(part), slot)
    except PartError as error:
        raise ValueError(f"Actuator.{name}: {error}") from None


def _require_drive(actuator: Parts) -> None:
    """Motor, inverter, link and controller."""
    motor, controller, name = actuator.motor, actuator.controller, type(actuator.motor).__name__
    control = None if controller is None else controller.current_control()
    if motor.driven_by == "voltage":
        if not (actuator.inverter and control):
            raise ValueError(
                f"Actuator: a {name} needs an inverter and a Cascade as controller, whose current loop drives it, or "
                "another controller with a current loop"
            )
    elif actuator.inverter or actuator.link or control:
        raise ValueError(f"Actuator: a {name} has no voltage: leave inverter, link and the current loop out")
    if controller is None and motor.driven_by != "torque":
        raise ValueError(
            f"Actuator: a {name} needs a controller that commands its {motor.driven_by}, such as a Cascade"
        )
    if controller is not None and motor.driven_by not in controller.commands():
        raise ValueError(
            f"Actuator: a {name} is driven by {motor.driven_by}, and a {type(controller).__name__} commands "
            f"{' or '.join(controller.commands())}"
        )
    if control is not None and control.mtpa and motor.constants_for_mtpa() is None:
        raise ValueError(f'Actuator: current_demand "MTPA" is for a motor with two axes, not for a {name}')
    if actuator.inverter and actuator.inverter.undervoltage and actuator.link is None:
        raise ValueError("Actuator: undervoltage derating needs a DC link whose voltage falls: give it a link")


def _require_read(actuator: Parts) -> None:
    """No sensor that nothing reads, and nothing read that no actuator has."""
    controller, sensors = actuator.controller, actuator.sensors
    reads = {} if controller is None else controller.reads()
    who = "there is no controller" if controller is None else f"a {type(controller).__name__}"
    for name, purpose in reads.items():
        if name not in READABLE:
            raise ValueError(
                f"Actuator.controller: {who} reads {name!r} ({purpose}), which no actuator has; it may read "
                f"{', '.join(READABLE)}"
            )
    for name in ANGLES:
        if getattr(sensors, name) is not None and name not in reads:
            read = who if controller is None else f"{who} reads {' and '.join(reads) or 'none'}"
            raise ValueError(f"Actuator.sensors.{name} is read by nothing: {read}; remove it")
    if sensors.current is not None and actuator.motor.driven_by != "voltage":
        raise ValueError("Actuator.sensors.current is read by nothing: it needs a motor with a current loop; remove it")


def _require_temperatures(actuator: Parts) -> None:
    """A node for each temperature that something depends on."""
    nodes = actuator.thermal.nodes if actuator.thermal else {}
    reads = {} if actuator.controller is None else actuator.controller.reads()
    asked = {"oil": reads["oil"]} if "oil" in reads else {}
    if actuator.inverter is not None and actuator.inverter.overheat is not None:
        asked["winding"] = "overheat derating"
    for node, purpose in asked.items():
        if not any(name in nodes for name in NODES[node]):
            raise ValueError(
                f"Actuator: {purpose} needs a thermal network with a node {' or '.join(NODES[node])}, got "
                f"{', '.join(nodes) or 'no network'}"
            )


def _require_continuous(actuator: Parts) -> None:
    """Nothing that only samples can do."""
    for name, sensor in actuator.sensors.present().items():
        if sensor.memory() or sensor.resolution is not None:
            raise ValueError(
                f"Actuator.sensors.{name}: resolution, noise and delay need a sampled controller: give the "
                "actuator a sampling, or leave them out"
            )
    if actuator.controller is not None:
        try:
            actuator.controller.check_continuous()
        except ValueError as error:
            raise ValueError(f"Actuator: {error}") from None


def _require_periods(actuator: Parts) -> None:
    """A period for each loop and for no other, short enough for what runs in it."""
    controller, sampling = actuator.controller, actuator.sampling
    needed = () if controller is None else controller.loops()
    if sampling.loops() != needed:
        raise ValueError(
            f"Actuator.sampling must have the periods of the loops of its controller "
            f"({', '.join(needed) or 'there is none'}), got {', '.join(sampling.loops())}"
        )
    if controller is not None:
        try:
            controller.check_sampling(sampling)
        except ValueError as error:
            raise ValueError(f"Actuator: {error}") from None


def require_within_stops(gear: Transmission, low: float, high: float) -> None:
    """Raise ValueError where a reference between two angles of the output [rad] leads beyond an end stop."""
    lower, upper = gear.output_range()
    if low < lower or high > upper:
        raise ValueError(
            f"the reference goes from {show(low, 'rad')} to {show(high, 'rad')}, beyond the end stops of the gear, "
            f"which the output touches at {show(lower, 'rad')} and {show(upper, 'rad')}; keep it between them"
        )
