"""Which parts go together, and where their memories begin.

Oracles: the rules, each broken on purpose; a drive that stands still at an angle and is told to stay there.
"""

from dataclasses import dataclass, fields, replace
from typing import Annotated

import numpy as np
import pytest
from annotated_types import Unit
from test_system_energy import SALIENT, drive, gear

from actuator import (
    Actuator,
    AngleSensor,
    CurrentSensor,
    DCMotor,
    Inverter,
    OverheatDerating,
    Sensors,
    ThermalNetwork,
    ThermalNode,
    TorqueSource,
    UndervoltageDerating,
    WhiteNoise,
    simulate,
)
from controllers import (
    PI,
    PID,
    Cascade,
    Controller,
    Dither,
    FilteredDerivative,
    IntegralRemedies,
    Knocker,
    Notch,
    PositionObserver,
    RateAndAccelerationLimit,
    RateLimit,
    Remedies,
    Sampling,
    ScheduledGain,
)
from gear import Bearing, EndStop, Shaft, Transmission

SAMPLED = Sampling(current=1e-4, speed=5e-4, position=1e-3)
PLAIN = PID.for_inertia(inertia=0.1, bandwidth=20.0)


def law(**more):
    return lambda a: replace(a, controller=replace(a.controller, **more))


def speed_law(**more):
    return lambda a: replace(a, controller=replace(a.controller, speed=replace(a.controller.speed, **more)))


def part(**more):
    return lambda a: replace(a, **more)


def sampled(change):
    return lambda a: change(replace(a, sampling=SAMPLED))


LOOSE = Inverter(dc_voltage=270.0, current_limit=30.0)
NONSENSE = {
    "no link to sag": (
        part(link=None, inverter=replace(LOOSE, undervoltage=UndervoltageDerating(full=250.0, none=200.0))),
        "undervoltage derating needs a DC link",
    ),
    "no winding to heat": (
        part(inverter=replace(LOOSE, overheat=OverheatDerating(full=350.0, none=400.0))),
        "overheat derating needs a thermal network with a node winding or housing, got no network",
    ),
    "no oil to warm": (
        law(schedule=ScheduledGain(over="temperature", points=(250.0,), values=(1.0,))),
        'schedule over "temperature" needs a thermal network with a node oil or housing',
    ),
    "load, not sampled": (
        law(schedule=ScheduledGain(over="load", points=(0.0,), values=(1.0,))),
        'schedule over "load" rests on the last sample',
    ),
    "square, not sampled": (
        law(remedies=Remedies(dither=Dither(amplitude=0.1, frequency=500.0, shape="square"))),
        "square Dither need a sampled controller",
    ),
    "knocks, not sampled": (
        law(remedies=Remedies(knocker=Knocker(amplitude=0.1, width=1e-3, interval=1e-2))),
        "Knocker needs a sampled controller",
    ),
    "reversal, not sampled": (
        speed_law(remedies=IntegralRemedies(reset_on_reversal=True)),
        "controller.speed: reset_on_reversal needs a sampled controller",
    ),
    "resolution, not sampled": (
        part(sensors=Sensors(motor=AngleSensor(resolution=1e-3))),
        "sensors.motor: resolution, noise and delay need a sampled controller",
    ),
    "dither too fast": (
        sampled(law(remedies=Remedies(dither=Dither(amplitude=0.1, frequency=1e4, shape="square")))),
        r"Dither of 10000 rad/s needs two samples a cycle, a period of at most 0.000314159 s, got 0.0005 s",
    ),
    "knock too short": (
        sampled(law(remedies=Remedies(knocker=Knocker(amplitude=0.1, width=2e-4, interval=1e-2)))),
        r"pulse of 0.0002 s needs a period of at most that, got 0.0005 s",
    ),
    "filter too fast": (
        sampled(law(torque_filters={"resonance": Notch(frequency=7e3, damping=0.3)})),
        r"torque_filters.resonance: filter: 7000 rad/s needs .* below 0.000448799 s, got 0.0005 s",
    ),
    "sensor that nothing reads": (
        lambda a: replace(law(feedback="motor")(a), sensors=Sensors(load=AngleSensor(offset=1e-3))),
        "sensors.load is read by nothing: a Cascade reads motor; remove it",
    ),
}


@pytest.mark.parametrize("name", NONSENSE)
def test_parts_that_do_not_fit_are_refused_by_name(name):
    change, text = NONSENSE[name]
    with pytest.raises(ValueError, match=text):
        change(drive())


def test_a_current_sensor_needs_a_current():
    inertia = Transmission(shafts={"arm": Shaft(inertia=0.1)}, input="arm", output="arm")
    with pytest.raises(ValueError, match=r"sensors.current is read by nothing: it needs a motor with a current loop"):
        Actuator(motor=TorqueSource(), gear=inertia, controller=PLAIN, sensors=Sensors(current=CurrentSensor()))


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: PI(proportional=1.0, integral=1.0, limit=0.0), r"PI.limit must be > 0 output, got 0 output"),
        (lambda: TorqueSource(torque_limit=0.0), r"TorqueSource.torque_limit must be > 0 N m, got 0 N m"),
        (lambda: replace(LOOSE, current_limit=0.0), r"Inverter.current_limit must be > 0 A, got 0 A"),
        (lambda: AngleSensor(resolution=-1e-3), r"AngleSensor.resolution must be > 0 rad, got -0.001 rad"),
        (lambda: CurrentSensor(resolution=-0.1), r"CurrentSensor.resolution must be > 0 A, got -0.1 A"),
        (lambda: RateLimit(rate=0.0), r"RateLimit.rate must be > 0 signal/s, got 0 signal/s"),
    ],
)
def test_limits_of_zero_and_negative_resolutions_are_refused_with_their_units(make, text):
    with pytest.raises(ValueError, match=text):
        make()


def test_a_parameter_is_held_against_the_rules_between_parts():
    plant = replace(drive(), sampling=SAMPLED)
    plant = law(remedies=Remedies(dither=Dither(amplitude=0.1, frequency=1e3)))(plant)
    with pytest.raises(ValueError, match="Dither of 20000 rad/s needs two samples a cycle"):
        simulate(plant, 0.1, parameters={"controller.remedies.dither.frequency": 2e4})


def test_a_reference_beyond_a_stop_is_refused_and_a_stop_can_be_moved():
    stops = {"ends": EndStop(shaft="flap", lower=-0.2, upper=0.2, stiffness=1e4)}
    plant = replace(drive(), gear=gear(stops=stops))
    with pytest.raises(ValueError, match=r"0.3 rad to 0.3 rad, .* at -0.2 rad and 0.2 rad; keep it between them"):
        simulate(plant, 0.01, inputs={"reference": 0.3})
    simulate(plant, 0.01, inputs={"reference": 0.3}, parameters={"gear.stops.ends.upper": 0.4}, compiled=False)


# -- where memories begin -------------------------------------------------------------------------------

STANDING = Transmission(
    shafts={"arm": Shaft(inertia=0.1)},
    bearings={"arm": Bearing(shaft="arm", coulomb=5.0, breakaway=6.0)},
    input="arm",
    output="arm",
)
LAWS = {
    "filtered derivative": {"speed_from": FilteredDerivative(time=2e-3)},
    "observer": {"speed_from": PositionObserver(bandwidth=500.0)},
    "limited rate": {"reference": RateLimit(rate=1.0)},
    "limited acceleration": {"reference": RateAndAccelerationLimit(rate=1.0, acceleration=10.0)},
}
LATE = Sensors(motor=AngleSensor(delay=3), load=AngleSensor(delay=2))


@pytest.mark.parametrize("sampling", [None, Sampling(speed=1e-3, position=2e-3)])
@pytest.mark.parametrize("name", LAWS)
def test_a_drive_that_stands_where_it_should_stays_there_without_a_twitch(name, sampling):
    base = Cascade.for_bandwidths(
        position=10.0, speed=50.0, current=1.0, inertia=0.1, resistance=1.0, inductance=1.0, speed_limit=10.0
    )
    plant = Actuator(
        motor=TorqueSource(),
        gear=STANDING,
        controller=replace(base, current=None, **LAWS[name]),
        sampling=sampling,
        sensors=LATE if sampling else Sensors(),
    )
    run = simulate(plant, 0.1, inputs={"reference": 0.7}, start={"arm.angle": 0.7}, compiled=False)
    assert abs(run["motor_torque"]).max() < 1e-9
    assert abs(run["load_angle"] - 0.7).max() == 0


def test_the_derivative_of_a_pid_begins_where_it_is():
    plant = Actuator(motor=TorqueSource(), gear=STANDING, controller=replace(PLAIN, filter_time=1e-3))
    run = simulate(plant, 0.1, inputs={"reference": 0.7}, start={"arm.angle": 0.7}, compiled=False)
    assert abs(run["motor_torque"]).max() < 1e-9


def test_temperatures_and_link_voltage_begin_at_their_parameters():
    nodes = {"winding": ThermalNode(temperature=300.0, capacity=10.0), "magnet": ThermalNode(temperature=300.0)}
    plant = replace(drive(), thermal=ThermalNetwork(nodes=nodes, paths={}))
    given = {"thermal.nodes.winding.temperature": 350.0, "link.source_voltage": 260.0}
    run = simulate(plant, 1e-3, parameters=given, compiled=False)
    assert run["thermal.winding"][0] == 350.0
    assert run["link.voltage"][0] == 260.0


def test_every_sensor_has_a_noise_of_its_own():
    sensor = {"white_noise": WhiteNoise(seed=3)}
    sensors = Sensors(
        motor=AngleSensor(noise=1e-4, **sensor),
        load=AngleSensor(noise=1e-4, **sensor),
        current=CurrentSensor(noise=0.1, **sensor),
    )
    system = replace(drive(motor=SALIENT), sampling=SAMPLED, sensors=sensors).system()
    begins = [state.initial for state in system.states if state.name.endswith(".noise")]
    assert len(begins) == 4
    assert len(set(begins)) == 4
    again = replace(drive(motor=SALIENT), sampling=SAMPLED, sensors=sensors).system()
    assert np.array_equal(begins, [state.initial for state in again.states if state.name.endswith(".noise")])


# -- parts of other classes -----------------------------------------------------------------------------

MASS = Transmission(shafts={"arm": Shaft(inertia=0.1)}, input="arm", output="arm")


class MyPID(PID):
    """A subclass, as a user may have one."""


class MyCascade(Cascade):
    """Another."""


class MySource(TorqueSource):
    """A motor."""


@dataclass(frozen=True, kw_only=True)
class Spring(Controller):
    """A controller that needs no registration: torque against the deflection of the motor."""

    stiffness: Annotated[float, Unit("N m/rad")] = 2.0

    def loops(self):
        return ("spring",)

    def reads(self):
        return {"motor": "the spring"}

    def drive(self, plant):
        loop = plant.loop("spring")
        torque = plant.allow(self.stiffness * (plant.input("reference", "rad") - plant.measure("motor")), 0.0)
        return plant.actuate(loop, loop.signal("torque_reference", "N m", torque), 0.0, 0.0)


def replaced(kind, law):
    return kind(**{field.name: getattr(law, field.name) for field in fields(law)})


def test_a_subclass_works_as_its_base():
    speed = Cascade.for_bandwidths(
        position=10.0, speed=50.0, current=1.0, inertia=0.1, resistance=1.0, inductance=1.0, speed_limit=10.0
    )
    for kind, law in ((MyPID, PLAIN), (MyCascade, replace(speed, current=None))):
        runs = [
            simulate(
                Actuator(motor=motor, gear=MASS, controller=controller), 0.2, inputs={"reference": 0.1}, compiled=False
            )
            for motor, controller in ((TorqueSource(), law), (MySource(), replaced(kind, law)))
        ]
        assert np.array_equal(runs[0]["load_angle"], runs[1]["load_angle"])
        assert runs[1]["load_angle"][-1] > 0.05
    whole = drive()
    again = replace(whole, controller=replaced(MyCascade, whole.controller))
    assert [state.name for state in again.system().states] == [state.name for state in whole.system().states]


def test_a_controller_of_an_unknown_class_works_by_what_it_says_of_itself():
    plant = Actuator(motor=TorqueSource(), gear=MASS, controller=Spring())
    run = simulate(plant, 1.0, inputs={"reference": 0.1}, resolution=0.01, compiled=False)
    np.testing.assert_allclose(run["load_angle"], 0.1 * (1 - np.cos(np.sqrt(20.0) * run.t)), atol=1e-6)


def spring(**methods):
    return type("Broken", (Spring,), methods)()


@pytest.mark.parametrize(
    ("parts", "text"),
    [
        ({"controller": object()}, r"Actuator.controller: object is no Controller: it lacks loops\(self\)"),
        ({"motor": Shaft(inertia=1.0)}, r"Actuator.motor: Shaft is no Motor: it lacks axes"),
        ({"load": object()}, r"Actuator.load: object is no OutputLoad: it lacks inertia_at\(self, angle"),
        (
            {"controller": spring(reads=lambda self: {"wind": "a sail"})},
            r"a Broken reads 'wind' \(a sail\), which no actuator has; it may read motor, load, oil",
        ),
        (
            {"controller": spring(), "sensors": Sensors(load=AngleSensor(offset=1.0))},
            "sensors.load is read by nothing: a Broken reads motor; remove it",
        ),
        (
            {"controller": spring(reads=lambda self: {"motor": "it", "oil": "a schedule"})},
            "a schedule needs a thermal network with a node oil or housing, got no network",
        ),
        ({"controller": spring(commands=lambda self: ("current",))}, "TorqueSource is driven by torque, and a Broken"),
        ({"sensors": Sensors(motor=AngleSensor(offset=1.0))}, "sensors.motor is read by nothing: there is no contr"),
    ],
)
def test_what_is_unknown_unread_or_unmet_is_refused_by_name(parts, text):
    with pytest.raises(ValueError, match=text):
        Actuator(**{"motor": TorqueSource(), "gear": MASS} | parts)


@pytest.mark.parametrize(
    ("reads", "text"),
    [
        ({}, "a Broken takes 'motor' without declaring that it reads it"),
        ({"motor": "it", "load": "nothing"}, r"a Broken declares that it reads 'load' \(nothing\), and does not"),
    ],
)
def test_what_a_controller_declares_to_read_is_what_it_reads(reads, text):
    plant = Actuator(motor=TorqueSource(), gear=MASS, controller=spring(reads=lambda self: reads))
    with pytest.raises(ValueError, match=text):
        plant.system()


def test_the_former_name_of_a_current_demand_is_refused_with_the_new_one():
    with pytest.raises(ValueError, match='Cascade.current_demand "least current" is now called "MTPA"'):
        law(current_demand="least current")(drive())
    with pytest.raises(ValueError, match='current_demand "MTPA" is for a motor with two axes, not for a DCMotor'):
        dc = DCMotor(resistance=1.0, inductance=1e-3, torque_constant=0.05, inertia=1e-5)
        law(current_demand="MTPA")(replace(drive(), motor=dc))
