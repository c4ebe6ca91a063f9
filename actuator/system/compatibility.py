"""Which parts of an actuator go together; each rule raises with the parts by name and what to do."""

from typing import TYPE_CHECKING

from actuator.parts.current_source import CurrentSource
from actuator.parts.motor import PMSM, DCMotor
from controllers.cascade import Cascade
from controllers.pid import PID
from controllers.sampling import LOOPS
from gear.quantities import show
from gear.transmission import Transmission

if TYPE_CHECKING:
    from actuator.actuator import Actuator

WINDING, OIL = ("winding", "housing"), ("oil", "housing")  # nodes whose temperature fold-back and schedules take


def require_fitting(actuator: "Actuator") -> None:
    """Raise ValueError where the parts of an actuator do not go together."""
    _require_drive(actuator)
    _require_used_sensors(actuator)
    _require_temperatures(actuator)
    if actuator.sampling is None:
        _require_continuous(actuator)
    else:
        _require_periods(actuator)


def _require_drive(actuator: "Actuator") -> None:
    """Motor, inverter, link and controller."""
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
    if actuator.inverter and actuator.inverter.undervoltage and actuator.link is None:
        raise ValueError("Actuator: an undervoltage fold-back needs a DC link whose voltage falls: give it a link")


def _require_used_sensors(actuator: "Actuator") -> None:
    """No sensor that nothing reads."""
    controller, sensors = actuator.controller, actuator.sensors
    cascade = isinstance(controller, Cascade)
    at_load = isinstance(controller, PID) or (cascade and controller.position is not None)
    used = {
        "motor": (cascade, "a Cascade as controller"),
        "load": (at_load and not (cascade and controller.feedback == "motor"), "position feedback from the load"),
        "current": (isinstance(actuator.motor, DCMotor | PMSM), "a motor with a current loop"),
    }
    for name, (read, need) in used.items():
        if getattr(sensors, name) is not None and not read:
            raise ValueError(f"Actuator.sensors.{name} is read by nothing: it needs {need}; leave it out")


def _require_temperatures(actuator: "Actuator") -> None:
    """A node for each temperature that something depends on."""
    nodes = actuator.thermal.nodes if actuator.thermal else {}
    schedule = getattr(actuator.controller, "schedule", None)
    asked = (
        ("an overheat fold-back", WINDING, actuator.inverter is not None and actuator.inverter.overheat is not None),
        ('a schedule over "temperature"', OIL, schedule is not None and schedule.over == "temperature"),
    )
    for what, names, present in asked:
        if present and not any(name in nodes for name in names):
            raise ValueError(
                f"Actuator: {what} needs a thermal network with a node {' or '.join(names)}, got "
                f"{', '.join(nodes) or 'no network'}"
            )


def _require_continuous(actuator: "Actuator") -> None:
    """Nothing that only samples can do."""
    controller = actuator.controller
    for name in ("motor", "load", "current"):
        sensor = getattr(actuator.sensors, name)
        if sensor is not None and (sensor.memory() or sensor.resolution is not None):
            raise ValueError(
                f"Actuator.sensors.{name}: resolution, noise and delay need a sampled controller: give the "
                "actuator a sampling, or leave them out"
            )
    parts = {"controller": controller} | {f"controller.{name}": getattr(controller, name, None) for name in LOOPS}
    for name, law in parts.items():
        if getattr(getattr(law, "remedies", None), "reset_on_reversal", False):
            raise ValueError(f"Actuator.{name}: reset_on_reversal needs a sampled controller: give it a sampling")
    if not isinstance(controller, Cascade):
        return
    if controller.remedies.knocker is not None:
        raise ValueError("Actuator: a Knocker needs a sampled controller: give the actuator a sampling")
    if controller.remedies.dither is not None and controller.remedies.dither.shape == "square":
        raise ValueError(
            "Actuator: the edges of a square Dither need a sampled controller: give the actuator a sampling, or the "
            'shape "sine"'
        )
    if controller.schedule is not None and controller.schedule.over == "load":
        raise ValueError(
            'Actuator: a schedule over "load" rests on the last sample of the torque: give the actuator a sampling'
        )


def _require_periods(actuator: "Actuator") -> None:
    """A period for each loop and for no other, short enough for what runs in it."""
    controller, sampling = actuator.controller, actuator.sampling
    assert sampling is not None
    needed = ("position",) if isinstance(controller, PID) else ()
    if isinstance(controller, Cascade):
        needed = tuple(name for name in LOOPS if getattr(controller, name) is not None)
    present = tuple(name for name in LOOPS if getattr(sampling, name) is not None)
    if present != needed:
        raise ValueError(
            f"Actuator.sampling must have the periods of the loops of its controller "
            f"({', '.join(needed) or 'there is none'}), got {', '.join(present)}"
        )
    if not isinstance(controller, Cascade) or sampling.speed is None:
        return
    for law in (controller.remedies.dither, controller.remedies.knocker):
        if law is not None:
            law.check_period(sampling.speed)
    for name, law in controller.torque_filters.items():
        try:
            law.output([0.0] * len(law.memory()), 0.0, period=sampling.speed)
        except ValueError as error:
            raise ValueError(f"Actuator.controller.torque_filters.{name}: {error}") from None


def require_within_stops(gear: Transmission, low: float, high: float) -> None:
    """Raise ValueError where a reference between two angles of the output [rad] leads beyond an end stop."""
    lower, upper = gear.output_range()
    if low < lower or high > upper:
        raise ValueError(
            f"the reference goes from {show(low, 'rad')} to {show(high, 'rad')}, beyond the end stops of the gear, "
            f"which the output touches at {show(lower, 'rad')} and {show(upper, 'rad')}; keep it between them"
        )
