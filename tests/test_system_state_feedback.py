"""State feedback in a whole actuator: a controller that is one file.

Oracles: the poles that were placed, against those of the linearized actuator; its step response against scipy.signal
on the equations of two masses written here by hand; sampled poles exp(p h); energies that add up.
"""

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from actuator import (
    PMSM,
    Actuator,
    AngleSensor,
    CurrentSource,
    Inverter,
    Sensors,
    TorqueSource,
    find_causes,
    find_remedies,
    linearize,
    simulate,
    trim,
)
from controllers import PI, FilteredDerivative, LoopPeriod, LowPass, Sampling, StateFeedback
from gear import Bearing, Coupling, ExternalPair, Linear, Mesh, Shaft, Transmission
from studies.cases import load_case

MOTOR, LOAD, SPRING, DAMPING = 2e-3, 5e-2, 800.0, 0.3  # kg m^2, kg m^2, N m/rad, N m s/rad
PLACED = [-60.0, -80 + 60j, -80 - 60j, -100 + 120j, -100 - 120j]  # 1/s
PERIOD = 1e-3


def law(period=None, poles=PLACED, ratio=1.0, motor=MOTOR):
    return StateFeedback.for_poles(
        poles,
        motor_inertia=motor,
        load_inertia=LOAD,
        stiffness=SPRING,
        damping=DAMPING,
        ratio=ratio,
        period=period,
    )


def two_masses(**bearings):
    return Transmission(
        shafts={"motor": Shaft(inertia=MOTOR), "load": Shaft(inertia=LOAD)},
        couplings={"shaft": Coupling(a="motor", b="load", stiffness=SPRING, damping=DAMPING)},
        bearings=bearings,
        input="motor",
        output="load",
    )


def drive(controller=None, **parts):
    parts = {"motor": TorqueSource(), "gear": two_masses()} | parts
    return Actuator(controller=law() if controller is None else controller, **parts)


def ordered(values):
    return np.array(sorted(values, key=lambda value: (round(value.real, 6), value.imag)))


def closed_loop(gains):
    """dx/dt = a x + b r by hand, x = motor angle and speed, load angle and speed, integral."""
    a = np.array(
        [
            [0, 1, 0, 0, 0],
            [-SPRING / MOTOR, -DAMPING / MOTOR, SPRING / MOTOR, DAMPING / MOTOR, 0],
            [0, 0, 0, 1, 0],
            [SPRING / LOAD, DAMPING / LOAD, -SPRING / LOAD, -DAMPING / LOAD, 0],
            [0, 0, -gains.integral, 0, 0],
        ]
    )
    a[1] += np.array([-gains.motor_angle, -gains.motor_speed, -gains.load_angle, -gains.load_speed, 1]) / MOTOR
    b = np.array([[0], [(gains.motor_angle + gains.load_angle) / MOTOR], [0], [0], [gains.integral]])
    return a, b


def test_the_poles_of_the_linearized_actuator_are_those_that_were_placed():
    found = linearize(trim(drive(), "forward"), ["reference"], ["load_angle"]).poles()
    np.testing.assert_allclose(ordered(found), ordered(PLACED), rtol=1e-6)
    np.testing.assert_allclose(ordered(np.linalg.eigvals(closed_loop(law())[0])), ordered(PLACED), rtol=1e-6)


def test_a_prefilter_adds_its_pole_and_no_other():
    filtered = drive(replace(law(), prefilter=LowPass(frequency=50.0)))
    found = linearize(trim(filtered, "forward"), ["reference"], ["load_angle"]).poles()
    np.testing.assert_allclose(ordered(found), ordered([*PLACED, -50.0]), rtol=1e-6)


def test_behind_a_gear_the_angles_are_brought_to_each_other_by_the_ratio():
    # two wheels, contact of the stiffness that two masses on a spring have at the load
    pair = ExternalPair(teeth_a=20, teeth_b=60, module=2e-3)
    square = pair.radius_b**2 * np.cos(pair.working_angle)  # deflection on the pitch circle, force along the normal
    elastic = Linear(stiffness=SPRING / square, damping=DAMPING / square)
    gear = Transmission(
        shafts={"motor": Shaft(inertia=MOTOR), "load": Shaft(inertia=LOAD)},
        meshes={"only": Mesh(a="motor", b="load", pair=pair, elasticity=elastic)},
        input="motor",
        output="load",
    )
    plant = drive(law(ratio=gear.ratio()), gear=gear)
    found = linearize(trim(plant, "forward"), ["reference"], ["load_angle"]).poles()
    np.testing.assert_allclose(ordered(found), ordered(PLACED), rtol=1e-6)
    run = simulate(plant, 0.5, inputs={"reference": 0.1}, compiled=False)
    assert run["load_angle"][-1] == pytest.approx(0.1, rel=1e-6)


def test_its_step_is_that_of_its_equations():
    run = simulate(drive(), 0.2, inputs={"reference": 0.1}, resolution=1e-3, compiled=False)
    a, b = closed_loop(law())
    _, angle, _ = scipy.signal.lsim((a, b, np.eye(5)[2:3], [[0.0]]), np.full(run.t.shape, 0.1), run.t)
    np.testing.assert_allclose(run["load_angle"], angle, atol=1e-7)


def test_sampled_it_has_the_poles_that_were_placed_at_its_ticks():
    sampled = law(period=PERIOD)
    plant = drive(sampled, sampling=Sampling(others={"state": LoopPeriod(period=PERIOD)}, delay=0))
    run = simulate(plant, 0.2, inputs={"reference": 0.1}, resolution=PERIOD, compiled=False)
    wanted = np.exp(np.array(PLACED) * PERIOD)
    # the free response at the ticks obeys the characteristic polynomial of the poles: sum of c_k y[n - k] = 0
    errors = run["load_angle"][::1] - 0.1
    at_ticks = np.interp(np.arange(1, 150) * PERIOD, run.t, errors)
    residual = scipy.signal.lfilter(np.poly(wanted).real, [1.0], at_ticks)[6:]
    assert abs(residual).max() < 1e-7 * abs(at_ticks).max()


def test_the_limited_torque_does_not_wind_up_its_integral():
    def overshoot(rate):
        tight = drive(replace(law(), limit=2.0, back_calculation=rate))
        run = simulate(tight, 3.0, inputs={"reference": 1.0}, compiled=False)
        assert abs(run["motor_torque"]).max() == pytest.approx(2.0)
        return run["load_angle"].max() - 1.0, run["load_angle"][-1]

    assert law().back_calculation == pytest.approx(max(map(abs, PLACED)))
    beyond, end = overshoot(law().back_calculation)
    assert end == pytest.approx(1.0, rel=1e-4)
    assert beyond < 0.5 * overshoot(1.0)[0]


def test_it_drives_a_motor_at_an_inverter_and_one_that_gets_its_current():
    motor = PMSM(pole_pairs=4, resistance=0.3, inductance_d=4e-4, inductance_q=4e-4, flux=0.05, inertia=1e-9)
    current = PI.for_winding(resistance=0.3, inductance=4e-4, bandwidth=1e4)
    at_inverter = drive(
        replace(law(), current=current), motor=motor, inverter=Inverter(dc_voltage=300.0, current_limit=200.0)
    )
    by_current = drive(motor=CurrentSource(torque_constant=0.1, inertia=1e-9))
    for plant in (at_inverter, by_current):
        run = simulate(plant, 0.3, inputs={"reference": 0.05}, compiled=False)
        assert run["load_angle"][-1] == pytest.approx(0.05, rel=1e-3)
    sampled = replace(
        at_inverter, sampling=Sampling(current=1e-4, others={"state": LoopPeriod(period=5e-4)}), name="sampled"
    )
    run = simulate(sampled, 0.3, inputs={"reference": 0.05}, compiled=False)
    assert run["load_angle"][-1] == pytest.approx(0.05, rel=1e-3)


def test_speeds_may_be_estimated_from_counted_angles():
    counted = Sensors(motor=AngleSensor.of_counts(2**20), load=AngleSensor.of_counts(2**20))
    plant = drive(
        replace(law(period=PERIOD), speed_from=FilteredDerivative(time=1e-4)),
        sampling=Sampling(others={"state": LoopPeriod(period=PERIOD)}, delay=0),
        sensors=counted,
    )
    run = simulate(plant, 0.5, inputs={"reference": 0.1}, compiled=False)
    assert run["load_angle"][-1] == pytest.approx(0.1, abs=1e-4)


def test_periods_are_those_of_its_own_loops():
    with pytest.raises(ValueError, match=r"periods of the loops of its controller \(state\), got position"):
        drive(sampling=Sampling(position=1e-3))
    with pytest.raises(ValueError, match="Sampling.others.speed is the field speed"):
        Sampling(others={"speed": LoopPeriod(period=1e-3)})


# -- hunting ------------------------------------------------------------------------------------------------

STICKING = {
    "motor": Bearing(shaft="motor", coulomb=0.05, breakaway=0.08),
    "load": Bearing(shaft="load", coulomb=0.5, breakaway=1.5),
}


@pytest.fixture(scope="module")
def hunting():
    soft = law(poles=[-6.0, -8 + 4j, -8 - 4j, -120 + 640j, -120 - 640j])  # the last two are those of the spring
    plant = drive(soft, gear=two_masses(**STICKING))
    return plant, simulate(plant, 30.0, inputs={"reference": 0.2}, resolution=5e-3)


def test_it_hunts_by_its_integral_and_the_causes_say_so(hunting):
    plant, run = hunting
    causes = find_causes(plant, run, inputs={"reference": 0.2}, resolution=5e-3)
    assert causes.hunting.cycles
    needed = {each.cause for each in causes.counterfactuals if each.needed}
    assert {"integral action", "breakaway above sliding friction"} <= needed
    energy = causes.energy
    assert {"proportional action", "derivative action", "integral action"} <= energy.elements.keys()
    assert abs(energy.unexplained) < 1e-3 * max(map(abs, energy.elements.values()))
    assert abs(energy.elements["current loop, limits and delay"]) < 1e-6 * max(map(abs, energy.elements.values()))


def test_remedies_are_those_that_it_offers(hunting):
    plant, run = hunting
    table = find_remedies(plant, run, inputs={"reference": 0.2}, resolution=5e-3)
    names = {each.name for each in table.ranked}
    assert {"integrator dead band", "faster anti-windup", "retuning"} <= names
    band = next(each for each in table.ranked if each.name == "integrator dead band")
    assert not band.hunting.cycles


# -- files --------------------------------------------------------------------------------------------------

TOML = """
title = "State feedback on two masses"
[scenario]
duration = 0.2
inputs.reference = { type = "Step", time = 0.0, after = 0.1 }
[motor]
type = "TorqueSource"
[controller]
type = "StateFeedback"
motor_angle = 20.0
motor_speed = 0.4
load_angle = -3.0
load_speed = 0.5
integral = 300.0
back_calculation = 20.0
prefilter.frequency = 50.0
[sampling]
delay = 0
others.state.period_ms = 1
[gear]
input = "motor"
output = "load"
shafts.motor.inertia = 2e-3
shafts.load.inertia = 5e-2
couplings.shaft = { a = "motor", b = "load", stiffness = 800, damping = 0.3 }
"""


def test_a_file_names_it(tmp_path):
    file = tmp_path / "feedback.toml"
    file.write_text(TOML)
    found = load_case(file).actuator
    assert found.controller == StateFeedback(
        motor_angle=20.0,
        motor_speed=0.4,
        load_angle=-3.0,
        load_speed=0.5,
        integral=300.0,
        back_calculation=20.0,
        prefilter=LowPass(frequency=50.0),
    )
    assert found.sampling == Sampling(others={"state": LoopPeriod(period=1e-3)}, delay=0)
