"""What a motor, load or controller has to keep, as small checks: for those of this package and for a user's own.

    for check in motor_contract(motor):
        check(motor)

A contract yields the checks that suit what the part declares. Each raises AssertionError with the class, the values
and the rule. They take parts with numbers, such as those of `examples()`.
"""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from actuator.actuator import Actuator
from actuator.parts.current_source import CurrentSource
from actuator.parts.dc_motor import DCMotor
from actuator.parts.inverter import Inverter
from actuator.parts.thermal import ThermalNetwork, ThermalNode
from actuator.parts.torque_source import TorqueSource
from actuator.simulation.simulate import simulate
from actuator.system.hybrid import HybridSystem
from actuator.system.parameters import parameterize
from controllers.cascade import Cascade
from controllers.controller import Controller
from controllers.countermeasures import StickingCycle
from controllers.sampling import SERVO_LOOPS, LoopPeriod, Sampling
from gear.contracts import check_units
from gear.couplings import Coupling
from gear.quantities.roles import IntegralGain, LoopGain, LoopSignal
from gear.shafts import Shaft
from gear.transmission import Transmission

Check = Callable[[Any], None]

CLOSE = 1e-9  # relative: of two ways to work out the same number
TORQUES = (-3.0, -0.2, 0.0, 0.05, 1.0, 50.0)  # N m
CURRENTS = (-4.0, 0.5, 7.0)  # A
ANGLES, SPEEDS = (-0.4, 0.0, 0.7), (-30.0, 0.2, 150.0)  # rad, rad/s
FORCE = 13.0  # on a load from outside, in the unit of its input
STANDS = 1e-9  # rad, how exactly a drive stays that stands where it should
PERIOD = 5e-4  # s
CYCLE = StickingCycle(
    amplitude=0.01, half=0.5, worst_error=lambda gain: 0.02, speed=1.0, lost=1e-3, ratio=1.0, sampling=None
)


# -- motors -------------------------------------------------------------------------------------------------


def motor_contract(motor: Any) -> Iterator[Check]:
    """What a motor has to keep, by what drives it."""
    yield from (check_units, check_limit, check_drives, check_motor_symbols)
    if motor.driven_by != "torque":
        yield check_torque_of_its_current
    if motor.driven_by == "current":
        yield check_demanded_current
    if motor.driven_by == "voltage":
        yield check_power_balance


def check_limit(motor: Any) -> None:
    """A limit makes torques smaller, keeps their sign and their order."""
    allowed = [float(motor.allow_torque(torque)) for torque in TORQUES]
    for torque, got in zip(TORQUES, allowed, strict=True):
        within = abs(got) <= abs(torque) * (1 + CLOSE) and got * torque >= 0
        assert within, f"{_name(motor)}: of {torque:g} N m it allows {got:g} N m; a limit makes torques smaller"
    assert allowed == sorted(allowed), f"{_name(motor)}: a larger torque is allowed less, {allowed} of {TORQUES} N m"


def check_torque_of_its_current(motor: Any) -> None:
    """The current for a torque gives that torque, at the reference temperature and without saturation."""
    linear = motor.without_saturation()
    for torque in TORQUES:
        current = linear.current_for(torque)
        currents = linear.references(current) if linear.driven_by == "voltage" else [current]
        got = float(linear.torque(currents))
        assert _close(got, torque), f"{_name(motor)}: its current for {torque:g} N m gives {got:g} N m"


def check_demanded_current(motor: Any) -> None:
    """A current that is the one demanded stays; another moves towards it."""
    count = len(motor.axes)
    for demanded, off in itertools.product(CURRENTS, (0.0, 1.0)):
        rates = [float(rate) for rate in motor.derivatives([demanded + off] * count, demanded)]
        assert len(rates) == count, f"{_name(motor)}: {count} axes have {len(rates)} derivatives"
        right = all(rate < 0 if off else abs(rate) <= CLOSE for rate in rates)
        assert right, f"{_name(motor)}: at {demanded + off:g} A of {demanded:g} A demanded its rates are {rates} A/s"


def check_power_balance(motor: Any) -> None:
    """Electrical power is that of the shaft, the losses and the change of what is stored."""
    for point in itertools.product(itertools.product(CURRENTS, repeat=len(motor.axes)), ANGLES, SPEEDS):
        currents, angle, speed = list(point[0]), *point[1:]
        voltages = [10.0 + 3 * k for k in range(len(currents))]
        rates = motor.derivatives(currents, voltages, speed)
        symbols = ca.SX.sym("x", len(currents) + 1)
        stored = motor.stored_energy(ca.vertsplit(symbols[:-1]), symbols[-1])
        slopes = ca.Function("slopes", [symbols], [ca.jacobian(stored, symbols)])
        change = float(ca.mtimes(slopes([*currents, angle]), ca.DM([*map(float, rates), speed])))
        given = float(motor.electrical_power(currents, voltages))
        taken = float(motor.shaft_torque(currents, angle, speed)) * speed + change
        taken += sum(float(loss) for loss in motor.losses(currents, speed).known().values())
        assert _close(given, taken), (
            f"{_name(motor)}: at {currents} A, {angle:g} rad, {speed:g} rad/s it is given {given:.9g} W, and shaft, "
            f"losses and stored energy take {taken:.9g} W"
        )


def check_motor_symbols(motor: Any) -> None:
    """Its laws are the same for numbers and for symbols, of the motor's own numbers too."""
    symbolic, parameters = parameterize(motor, "motor")
    currents = [2.0 - k for k in range(max(len(motor.axes), motor.driven_by != "torque"))]
    voltages = [5.0 + k for k in range(len(motor.axes))]

    def laws(part: Any, currents: list, voltages: list, angle: Any, speed: Any) -> list:
        if part.driven_by == "torque":
            return [part.allow_torque(speed)]
        inputs = (voltages, speed) if part.driven_by == "voltage" else (5.0,)
        return [*part.derivatives(currents, *inputs), part.shaft_torque(currents, angle, speed), part.torque(currents)]

    _compare(motor, laws, symbolic, parameters, (currents, voltages, 0.3, 20.0))


def check_drives(motor: Any) -> None:
    """An actuator can be built with it, and it turns the way it is told to."""
    if motor.driven_by == "torque":
        plant = Actuator(motor=motor, gear=_gear())
        rates = _rates(plant.system(), {"torque_reference": 0.01})
        turned = rates["motor.speed"]
        assert turned > 0, f"{_name(motor)}: a positive torque accelerates it by {turned:g} rad/s^2"
        return
    plant = _drive(Cascade.examples()[2 if motor.driven_by == "voltage" else 0], motor)
    run = simulate(plant, 0.02, inputs={"reference": 0.01}, compiled=False)
    assert run["load_angle"][-1] > 0, f"{_name(motor)}: a positive reference turns it to {run['load_angle'][-1]:g} rad"


# -- loads --------------------------------------------------------------------------------------------------


def load_contract(load: Any) -> Iterator[Check]:
    """What a load has to keep."""
    yield from (check_units, check_inertia, check_load_power, check_load_symbols)


def check_inertia(load: Any) -> None:
    """Its inertia is not negative at any angle."""
    for angle in ANGLES:
        inertia = float(load.inertia_at(angle))
        assert inertia >= 0, f"{_name(load)}: its inertia at {angle:g} rad is {inertia:g} kg m^2"


def check_load_power(load: Any) -> None:
    """What acts on it takes the power that its torque and its changing inertia give.

    power = -torque speed - speed^3 (d inertia/d angle)/2, as torque = inertia acceleration where it turns alone.
    """
    at = ca.SX.sym("angle")
    slope = ca.Function("slope", [at], [ca.jacobian(ca.SX(load.inertia_at(at)), at)])
    own = () if load.own_input is None else (FORCE,)
    for angle, speed in itertools.product(ANGLES, SPEEDS):
        taken = float(load.power(angle, speed, *own))
        given = -float(load.torque(angle, speed, *own)) * speed - speed**3 * float(slope(angle)) / 2
        assert _close(taken, given), (
            f"{_name(load)}: at {angle:g} rad and {speed:g} rad/s its power is {taken:.9g} W, its torque gives "
            f"{given:.9g} W"
        )


def check_load_symbols(load: Any) -> None:
    """Torque and inertia are the same for numbers and for symbols."""
    symbolic, parameters = parameterize(load, "load")
    own = () if load.own_input is None else (FORCE,)

    def laws(part: Any, angle: Any, speed: Any) -> list:
        return [part.torque(angle, speed, *own), part.inertia_at(angle)]

    _compare(load, laws, symbolic, parameters, (0.3, 2.0))


# -- controllers --------------------------------------------------------------------------------------------


def controller_contract(controller: Any) -> Iterator[Check]:
    """What a controller has to keep."""
    yield from (check_units, check_loop_signals, check_gains, check_stands_still, check_contributions)
    yield from (check_sampled, check_offers, check_tunable)


def check_loop_signals(controller: Any) -> None:
    """The signals at which its loops can be opened are those that it declares."""
    system = actuator_for(controller).system()
    roles = [signal.role(LoopSignal) for signal in system.signals_having(LoopSignal)]
    found = {role.signal for role in roles if role is not None}
    assert found == set(controller.loop_signals()), (
        f"{_name(controller)}: its loops can be opened at {sorted(found)}, and it declares "
        f"{sorted(controller.loop_signals())}"
    )


def check_gains(controller: Any) -> None:
    """Its gains say what they are: analyses find them by their role."""
    parameters = parameterize(controller, "controller")[1]
    gains = [each for each in parameters if each.role(LoopGain) is not None or each.role(IntegralGain) is not None]
    assert gains, f"{_name(controller)}: none of its numbers has the role of a gain (gear.quantities.roles)"


def check_stands_still(controller: Any) -> None:
    """A drive that stands at zero, and is told to, stays there."""
    run = simulate(actuator_for(controller), 0.05, compiled=False)
    moved = float(abs(run["load_angle"]).max())
    assert moved <= STANDS, f"{_name(controller)}: standing on its reference it moves by {moved:g} rad"


def check_contributions(controller: Any) -> None:
    """What it says of its torque are signals over time, under other names than what is left."""
    plant = actuator_for(controller)
    inputs = {q.name: 1e-3 for q in plant.system().inputs if q.name in ("reference", "speed_reference")}
    run = simulate(plant, 0.02, inputs=inputs, compiled=False)
    for name, torque in controller.contributions(run.signals, plant.gear.ratio()).items():
        assert name != controller.remainder, f"{_name(controller)}: {name!r} is what is left, and no contribution"
        right = np.shape(torque) == run.t.shape and np.isfinite(torque).all()
        assert right, f"{_name(controller)}: {name!r} is no torque at each of the {len(run.t)} times"


def check_sampled(controller: Any) -> None:
    """It runs at ticks, each of its loops with a period of its own, and continuously without what needs them."""
    plant = actuator_for(controller)
    sampled = replace(plant, sampling=sampling_for(controller))
    clocks = [clock.name for clock in sampled.system().clocks]
    assert clocks == list(controller.loops()), (
        f"{_name(controller)}: its loops are {list(controller.loops())}, and what ticks is {clocks}"
    )
    replace(plant, controller=controller.in_continuous_time()).system()


def check_offers(controller: Any) -> None:
    """The numbers of its countermeasures are parameters of the controllers that they are for."""
    cycle = CYCLE._replace(sampling=sampling_for(controller))
    for each in _asked(lambda: controller.countermeasures(cycle), []):
        names = {parameter.name for parameter in parameterize(each.controller, "controller")[1]}
        unknown = [path for path in each.numbers if f"controller.{path}" not in names]
        assert not unknown, f"{_name(controller)}: its {each.name!r} sets {unknown}, which its controller has not"


def check_tunable(controller: Any) -> None:
    """What it says can be tuned are numbers of it, and its closed form gives each of them."""
    gains: Sequence[str] = _asked(controller.tunable_gains, ())
    names = {parameter.name for parameter in parameterize(controller, "controller")[1]}
    unknown = [path for path in gains if f"controller.{path}" not in names]
    assert not unknown, f"{_name(controller)}: it says that {unknown} can be tuned, which it has not"
    found: Mapping[str, float] = _asked(lambda: controller.gains_for_bandwidth(10.0, 0.01, 1.0), {})
    assert not found or set(found) == set(gains), (
        f"{_name(controller)}: its closed form gives {sorted(found)} of {sorted(gains)}"
    )


def actuator_for(controller: Controller) -> Actuator:
    """Two masses on a spring, with a motor that the controller can drive and all that it reads."""
    kind = controller.commands()[0]
    motor = {
        "torque": TorqueSource(),
        "current": CurrentSource(torque_constant=0.1, inertia=1e-5),
        "voltage": DCMotor(resistance=0.3, inductance=4e-4, torque_constant=0.05, inertia=1e-5),
    }[kind]
    return _drive(controller, motor)


def sampling_for(controller: Controller) -> Sampling:
    """The same period for each of its loops."""
    periods: dict[str, Any] = {name: PERIOD for name in controller.loops() if name in SERVO_LOOPS}
    others = {name: LoopPeriod(period=PERIOD) for name in controller.loops() if name not in SERVO_LOOPS}
    return Sampling(**periods, others=others)


# -- for all ------------------------------------------------------------------------------------------------


def _name(part: Any) -> str:
    return type(part).__name__


def _close(one: float, other: float) -> bool:
    return abs(one - other) <= CLOSE * max(1.0, abs(one), abs(other))


def _asked(question: Callable[[], Any], otherwise: Any) -> Any:
    """The answer of a part, or `otherwise` where it says with a ValueError that it has none."""
    try:
        return question()
    except ValueError:
        return otherwise


def _compare(part: Any, laws: Callable, symbolic: Any, parameters: list, values: tuple) -> None:
    """Hold laws of numbers against the same laws of symbols, of the part's own numbers and of its arguments."""
    symbols = [[ca.SX.sym("a") for _ in value] if isinstance(value, list) else ca.SX.sym("a") for value in values]
    flat = ca.vertcat(*(ca.vertcat(*each) if isinstance(each, list) else each for each in symbols))
    own = ca.vertcat(*(parameter.symbol for parameter in parameters))
    function = ca.Function("laws", [flat, own], [ca.vertcat(*laws(symbolic, *symbols))])
    numbers = [number for value in values for number in (value if isinstance(value, list) else [value])]
    got = function(numbers, [parameter.default for parameter in parameters]).full().ravel()
    expected = [float(value) for value in laws(part, *values)]
    for one, other in zip(got, expected, strict=True):
        assert _close(one, other), f"{_name(part)}: its laws are {expected} for numbers and {got.tolist()} for symbols"


def _gear() -> Transmission:
    return Transmission(
        shafts={"motor": Shaft(inertia=1e-3), "load": Shaft(inertia=1e-2)},
        couplings={"shaft": Coupling(a="motor", b="load", stiffness=1e3, damping=1.0)},
        input="motor",
        output="load",
    )


def _drive(controller: Any, motor: Any) -> Actuator:
    reads = controller.reads()
    nodes = {name: ThermalNode(temperature=300.0) for name in ("oil",) if name in reads}
    return Actuator(
        motor=motor,
        gear=_gear(),
        controller=controller,
        inverter=Inverter(dc_voltage=100.0, current_limit=50.0) if motor.driven_by == "voltage" else None,
        thermal=ThermalNetwork(nodes=nodes, paths={}) if nodes else None,
    )


def _rates(system: HybridSystem, inputs: Mapping[str, float]) -> dict[str, float]:
    x = [state.initial for state in system.states]
    u = [inputs.get(quantity.name, 0.0) for quantity in system.inputs]
    p = [parameter.default for parameter in system.parameters]
    rates = system.flow(x, [0] * len(system.mode_variables), u, p).full().ravel()
    return dict(zip((state.name for state in system.states), rates.tolist(), strict=True))
