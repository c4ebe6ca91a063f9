"""Roles: what a system says of its parameters and signals.

Oracles: lists written by hand for the shipped aileron; the rule of each friction law, read in its own constructor.
"""

from dataclasses import replace

import pytest

from actuator import Actuator, AngleSensor, Load, Sensors, TorqueSource
from actuator.system.hybrid import EventKind, ModeKind, Place
from actuator.system.parameters import at_least_sliding, breakaway_floor, motion_integrals, scaled_breakaway
from controllers import PI, PID, Cascade, DisturbanceObserver, FrictionCompensation, P, Remedies
from gear import (
    Bearing,
    Coulomb,
    EfficiencyPoint,
    ExternalPair,
    FrictionPoint,
    FrictionTable,
    Linear,
    Mesh,
    Shaft,
    Stribeck,
    TabulatedEfficiency,
    Transmission,
)
from gear.quantities.roles import (
    Breakaway,
    Compensates,
    ControllerMemory,
    Gap,
    Heat,
    LoopSignal,
    Resolution,
    SensorOf,
    ShaftAngle,
    ShaftSpeed,
    SlidingFriction,
)
from studies import load_case

PAIR = ExternalPair(teeth_a=20, teeth_b=60, module=1e-3)
SPEED_LOOP = PI(proportional=0.1, integral=1.0)


def names(quantities):
    return [quantity.name for quantity in quantities]


def values_of(system):
    return {parameter.name: parameter.default for parameter in system.parameters}


def servo(friction, controller=None, **more):
    """One mesh with the friction, and a bearing."""
    gear = Transmission(
        shafts={"motor": Shaft(inertia=1e-4), "load": Shaft(inertia=1e-2)},
        meshes={
            "teeth": Mesh(
                a="motor", b="load", pair=PAIR, elasticity=Linear(stiffness=1e7, damping=1e3), friction=friction
            )
        },
        bearings={"hinge": Bearing(shaft="load", coulomb=0.5, breakaway=0.8)},
        input="motor",
        output="load",
    )
    return Actuator(motor=TorqueSource(torque_limit=1.0), gear=gear, load=Load(), controller=controller, **more)


@pytest.fixture(scope="module")
def aileron():
    return load_case("aileron").actuator.system()


def test_the_aileron_says_what_its_parameters_are(aileron):
    assert names(aileron.parameters_having(Breakaway)) == [
        "gear.meshes.first.friction.static",
        "gear.meshes.second.friction.static",
        "gear.bearings.motor.breakaway",
        "gear.bearings.idler.breakaway",
        "gear.bearings.hinge.breakaway",
    ]
    assert len(aileron.parameters_having(SlidingFriction)) == 5
    assert names(aileron.parameters_having(Gap)) == [
        f"gear.meshes.{mesh}.elasticity.gap" for mesh in ("first", "second")
    ]
    assert names(motion_integrals(aileron.parameters)) == ["controller.speed.integral"]


def test_the_aileron_says_what_its_signals_are(aileron):
    shafts = ["motor", "idler", "surface"]
    assert [q.role(ShaftAngle).shaft for q in aileron.signals_having(ShaftAngle)] == shafts
    assert [q.role(ShaftSpeed).shaft for q in aileron.signals_having(ShaftSpeed)] == shafts
    owners = {q.name: q.owner for q in aileron.states}
    assert owners["motor.current_q"] == "motor winding"
    assert owners["motor.speed"] == "shaft motor"
    assert [q.role(Heat).loss for q in aileron.signals_having(Heat)] == [
        *("copper", "iron", "drag", "inverter", "friction", "damping")
    ]
    assert names(aileron.signals_having(ControllerMemory)) == names(
        state for state in aileron.states if state.owner == "controller"
    )
    opened = {q.role(LoopSignal).signal for q in aileron.inputs if q.role(LoopSignal)}
    assert opened == {"position", "speed_reference", "torque_reference", "voltage"}


def test_contacts_modes_and_events_belong_together(aileron):
    modes, events = aileron.mode_variables, aileron.events
    assert [contact.motion for contact in aileron.contacts] == [m.name for m in modes if m.kind == ModeKind.MOTION]
    for contact in aileron.contacts:
        assert (contact.flank is not None) == (contact.place == Place.MESH)
        assert [e.side for e in events if e.at == contact.name and e.kind == EventKind.FRICTION] == [1, -1]
    assert {e.place for e in events if e.kind == EventKind.GAP} == {Place.MESH}
    # the output moves forward: motor and surface turn with it (two external meshes), the idler against it
    assert {c.name: c.direction for c in aileron.contacts if c.place == Place.BEARING} == {
        "gear.bearings.motor": 1,
        "gear.bearings.idler": -1,
        "gear.bearings.hinge": 1,
    }


def test_the_state_of_the_contacts_is_that_of_the_outputs(aileron):
    x, u, p = aileron.state_vector({"motor.speed": 2.0, "idler.speed": -0.4}), aileron.input_vector(), None
    p = aileron.parameter_values()
    _, m, _ = aileron.reset([0] * len(aileron.events), x, [0] * len(aileron.modes), u, p)
    slip, friction, static, sliding = aileron.contact_state(x, m, u, p)
    outputs = dict(zip(names(aileron.outputs), aileron.outputs_function(x, m, u, p).full().ravel(), strict=True))
    for k, contact in enumerate(aileron.contacts):
        assert float(slip[k]) == outputs[f"{contact.name}.slip_speed"]
        assert float(friction[k]) == outputs[f"{contact.name}.friction"]
        assert float(static[k]) >= float(sliding[k]) >= 0


LAWS = {
    "Coulomb": (Coulomb(sliding=0.1, static=0.3), "static", 0.1),
    "Stribeck": (Stribeck(static=0.3, coulomb=0.12, stribeck_speed=0.01), "static", 0.12),
    "FrictionTable": (
        FrictionTable(
            points=(FrictionPoint(speed=0.0, coefficient=0.2), FrictionPoint(speed=1.0, coefficient=0.1)), static=0.3
        ),
        "static",
        0.2,
    ),
    "TabulatedEfficiency": (
        TabulatedEfficiency(points=(EfficiencyPoint(speed=0.0, a_drives=0.8, b_drives=0.7),), breakout=1.4),
        "breakout",
        1.0,
    ),
}


@pytest.mark.parametrize(("law", "field", "floor"), LAWS.values(), ids=LAWS)
def test_breakaway_of_every_law_is_scaled_down_to_its_sliding_friction(law, field, floor):
    system = servo(law).system()
    values = values_of(system)
    path = f"gear.meshes.teeth.friction.{field}"
    assert scaled_breakaway(system.parameters, 2.0, values) == pytest.approx(
        {path: 2 * getattr(law, field), "gear.bearings.hinge.breakaway": 1.6}
    )
    least = scaled_breakaway(system.parameters, 1e-3, values)
    assert least == pytest.approx({path: floor, "gear.bearings.hinge.breakaway": 0.5})
    replace(law, **{field: least[path]})  # the law takes its own floor
    with pytest.raises(ValueError, match=type(law).__name__):
        replace(law, **{field: 0.999 * floor})
    system.parameter_values(least)


def test_the_floor_follows_sliding_friction_that_is_changed_too():
    system = servo(Coulomb(sliding=0.1, static=0.3)).system()
    static, *_ = system.parameters_having(Breakaway)
    values = values_of(system) | {"gear.meshes.teeth.friction.sliding": 0.25}
    assert breakaway_floor(static, values) == 0.25
    assert at_least_sliding(static, 0.2, values) == 0.25
    sliding, *_ = system.parameters_having(SlidingFriction)
    assert at_least_sliding(sliding, 0.01, values) == 0.01


def test_a_compensation_is_not_the_friction_it_compensates():
    compensation = FrictionCompensation(coulomb=0.1, breakaway=0.2, standstill=0.01, width=1e-3)
    controller = Cascade(
        position=P(gain=10.0),
        speed=SPEED_LOOP,
        current=None,
        speed_limit=50.0,
        remedies=Remedies(compensation=compensation),
    )
    system = servo(Coulomb(sliding=0.1, static=0.3), controller).system()
    assert names(system.parameters_having(Breakaway)) == [
        "gear.meshes.teeth.friction.static",
        "gear.bearings.hinge.breakaway",
    ]
    assert names(system.parameters_having(Compensates)) == ["controller.remedies.compensation.breakaway"]


def test_every_integral_that_acts_on_motion_is_found():
    observer = DisturbanceObserver(inertia=1e-3, bandwidth=100.0)
    cascade = Cascade(
        position=PI(proportional=10.0, integral=5.0),
        speed=SPEED_LOOP,
        current=None,
        speed_limit=50.0,
        disturbance_observer=observer,
    )
    law = Coulomb(sliding=0.1, static=0.3)
    assert names(motion_integrals(servo(law, cascade).system().parameters)) == [
        "controller.position.integral",
        "controller.speed.integral",
        "controller.disturbance_observer.bandwidth",
    ]
    pid = servo(law, PID(proportional=1.0, integral=1.0, derivative=0.1)).system()
    assert names(motion_integrals(pid.parameters)) == ["controller.integral"]


def test_a_sensor_passes_its_place_on_to_its_numbers():
    from controllers import Sampling

    system = servo(
        Coulomb(sliding=0.1, static=0.3),
        PID(proportional=1.0, integral=1.0, derivative=0.1),
        sampling=Sampling(position=1e-3),
        sensors=Sensors(load=AngleSensor(resolution=1e-4)),
    ).system()
    (resolution,) = system.parameters_having(Resolution)
    assert (resolution.name, resolution.role(SensorOf).reads) == ("sensors.load.resolution", "load")


def test_a_line_says_what_is_declared(aileron):
    said = aileron.describe("gear.meshes.first.friction.static")
    assert said == "gear.meshes.first.friction.static = 0.3, Breakaway(floor='sliding'), of gear.meshes.first.friction"
    assert aileron.describe("motor.current_q") == "motor.current_q [A], of motor winding"
    with pytest.raises(
        KeyError, match=r"no parameter or signal named 'motor\.current_p'; did you mean motor\.current_q"
    ):
        aileron.describe("motor.current_p")
