"""Exact models of sampled control for tuning: their loops and steps, derivatives, and an actuator tuned at its ticks.

Oracles: `loop_transfer`, `linearize` and `lifted_margins` of the same operating point; the loop of an inertia under a
sampled speed law in closed form, up to half the rate of that law; difference quotients.
"""

import math
from dataclasses import replace

import control
import numpy as np
import pytest

from actuator import Actuator, AngleSensor, CurrentSource, Load, Sensors, linearize, loop_transfer, trim
from actuator.linear.derivatives.build_sampled import sampled_gain_model
from actuator.linear.derivatives.continuous import gain_model
from actuator.linear.margins.lifted import lifted_margins
from controllers import Cascade, Sampling
from controllers.pid import PI, P
from gear import Bearing, Shaft, Transmission
from studies.corners import Corner
from studies.specification import Demand, Specification, Tuning, load_specification
from studies.tuning.check import check_corners
from studies.tuning.loops import curves_at, gain_margin, phase_and_delay_margin
from studies.tuning.measures import measures
from studies.tuning.modes import corner_modes
from studies.tuning.plant import NotTunable, prepare_linear
from studies.tuning.study import tune

pytestmark = pytest.mark.thorough

POSITION, SPEED, INTEGRAL = (f"controller.{name}" for name in ("position.gain", "speed.proportional", "speed.integral"))
GAINS = {POSITION: 20.0, SPEED: 0.8, INTEGRAL: 8.0}
INPUTS = ("reference", "load_torque", "inject.speed_reference", "inject.torque_reference")
OUTPUTS = ("load_angle", "current", "speed_reference", "torque_reference")
INERTIA = 0.01
LOOPS = ("speed_reference", "torque_reference")


def servo(sampling=None, sensors=None, **changed):
    """One inertia with friction behind a motor that gets its current at once."""
    bearings = {"shaft": Bearing(shaft="shaft", coulomb=0.1, breakaway=0.16, viscous=0.0)}
    gear = Transmission(shafts={"shaft": Shaft(inertia=INERTIA / 2)}, bearings=bearings, input="shaft", output="shaft")
    gains = GAINS | changed
    law = PI(proportional=gains[SPEED], integral=gains[INTEGRAL])
    return Actuator(
        name="servo",
        motor=CurrentSource(torque_constant=1.0, inertia=INERTIA / 2),
        gear=gear,
        load=Load(),
        controller=Cascade(position=P(gain=gains[POSITION]), speed=law, current=None, speed_limit=1e3),
        sampling=sampling or Sampling(speed=1e-3, position=4e-3),
        sensors=sensors or Sensors(),
    )


def demand(**changed):
    usual = {
        "stroke": 1.0,
        "amplitude": 0.05,
        "bandwidth": 1.0,
        "gain_margin": 1.5,
        "phase_margin": 0.5,
        "delay_margin": 3e-4,
        "overshoot": 0.5,
        "stiffness": 0.1,
        "standing_error": 0.1,
        "stiction_margin": 1.3,
    }
    return Demand(**{**usual, **changed})


@pytest.fixture(scope="module")
def plant():
    return servo()


def model_at(plant, gains=GAINS):
    point = trim(plant, "forward", inputs={"reference": 0.1}, parameters=dict(gains))
    return point, sampled_gain_model(point, tuple(gains), INPUTS, OUTPUTS)


def quotient(plant, name, seen):
    """Of whatever is seen of a model, by one gain."""
    up, down = (seen(model_at(plant, {**GAINS, name: GAINS[name] * (1 + step)})[1]) for step in (1e-4, -1e-4))
    return (up - down) / (2e-4 * GAINS[name])


# -- loops and steps --------------------------------------------------------------------------------------


def test_a_signal_that_is_renewed_once_has_the_loop_of_loop_transfer(plant):
    point, model = model_at(plant)
    frequencies = np.logspace(0, np.log10(0.99 * model.highest("speed_reference")), 30)
    expected = loop_transfer(point, "speed_reference")(np.exp(1j * frequencies * 4e-3))
    assert model.loops("speed_reference", frequencies) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("outer", [1e-3, 2e-3, 4e-3, 5e-3])
def test_the_unfolded_loop_of_a_speed_law_in_closed_form(outer):
    # torque held for T: speed after T is speed + T/J torque, so L = Kp T/J/(z - 1); the position loop is nearly open
    plant = servo(Sampling(speed=1e-3, position=outer, delay=0), **{POSITION: 1e-7, INTEGRAL: 1e-9})
    point = trim(plant, "forward")
    model = sampled_gain_model(point, (SPEED,), INPUTS, OUTPUTS)
    highest = model.highest("torque_reference")
    assert highest == pytest.approx(math.pi / 1e-3)
    frequencies = np.linspace(30.0, 0.999 * highest, 41)
    expected = 0.8 * 1e-3 / INERTIA / (np.exp(1j * frequencies * 1e-3) - 1)
    found = model.loop("torque_reference", frequencies)
    assert found.value == pytest.approx(expected, rel=1e-4)
    assert found.slopes[:, 0] == pytest.approx(expected / 0.8, rel=1e-4)
    room = gain_margin(curves_at(point, {SPEED: 0.8}), "torque_reference")
    assert math.exp(room.size) == pytest.approx(2 * INERTIA / (0.8 * 1e-3), rel=1e-4)  # at half the rate, z = -1


@pytest.mark.parametrize("at", LOOPS)
def test_loops_have_exact_derivatives(plant, at):
    model = model_at(plant)[1]
    frequencies = np.linspace(5.0, 0.97 * model.highest(at), 23)
    found = model.loop(at, frequencies)
    assert found.value == pytest.approx(model.loops(at, frequencies), rel=1e-12)
    for k, name in enumerate(GAINS):
        expected = quotient(plant, name, lambda other: other.loops(at, frequencies))
        assert abs(found.slopes[:, k] - expected).max() < 1e-5 * abs(expected).max()
    up, down = (model.loops(at, frequencies * (1 + step)) for step in (1e-6, -1e-6))
    assert found.by_frequency == pytest.approx((up - down) / (2e-6 * frequencies), rel=1e-5)


def test_responses_and_steps_are_those_of_linearize(plant):
    point, model = model_at(plant)
    frequencies = np.logspace(0, 2.8, 20)
    exact = linearize(point, ["reference", "load_torque"], ["load_angle", "current"])
    for k, given in enumerate(("reference", "load_torque")):
        for i, seen in enumerate(("load_angle", "current")):
            expected = exact(np.exp(1j * frequencies * 4e-3))[i, k]
            assert model.responses(given, seen, frequencies) == pytest.approx(expected, rel=1e-8)
            assert model.response(given, seen, frequencies).value == pytest.approx(expected, rel=1e-8)
            steps = np.asarray(control.step_response(exact[i, k], T=4e-3 * np.arange(40))[1])
            assert model.steps(given, seen, 4e-3, 40) == pytest.approx(steps, rel=1e-8, abs=1e-10)
    for time in (0.041, 0.044):  # in the middle of a period of the position law, and at its end
        found = model.step_at("reference", "load_angle", time)
        assert float(found.value) == pytest.approx(model.steps("reference", "load_angle", 1e-3, 60)[round(time / 1e-3)])
        for k, name in enumerate(GAINS):
            expected = quotient(
                plant, name, lambda other, time=time: other.step_at("reference", "load_angle", time).value
            )
            assert found.slopes[k] == pytest.approx(float(expected), rel=1e-6)


@pytest.mark.parametrize("gains", [GAINS, {POSITION: 60.0, SPEED: 2.0, INTEGRAL: 300.0}])
def test_margins_are_those_of_the_closed_poles(plant, gains):
    point = trim(plant, "forward", inputs={"reference": 0.1}, parameters=gains)
    curves = curves_at(point, gains)
    expected = lifted_margins(loop_transfer(point, "torque_reference"))
    size = gain_margin(curves, "torque_reference").size
    nearest = min(abs(math.log(expected.upper_gain)), abs(math.log(max(expected.lower_gain, 1e-9))))
    assert expected.stable
    assert size == pytest.approx(nearest, rel=1e-4)
    phase, delay = phase_and_delay_margin(curves, "torque_reference")
    assert phase.size == pytest.approx(expected.phase_rad, rel=1e-6)
    assert delay.size > 0


def test_every_measure_has_exact_slopes(plant):
    modes = corner_modes(prepare_linear(plant), Corner("", {}), 1.5, GAINS)
    task = demand(peak_current=50.0)
    middle = measures(modes, GAINS, task, {})
    assert {"overshoot", "peak current", "slip"} < {m.name for m in middle}
    for k, name in enumerate(GAINS):
        up, down = (measures(modes, {**GAINS, name: GAINS[name] * math.exp(step)}, task, {}) for step in (1e-5, -1e-5))
        for here, above, below in zip(middle, up, down, strict=True):
            assert here.slopes[k] == pytest.approx((above.slack - below.slack) / 2e-5, rel=1e-4, abs=1e-5), here.name


def test_counts_are_taken_out_of_the_linear_models():
    counting = servo(sensors=Sensors(load=AngleSensor(resolution=1e-3)))
    corner = Corner("coarse", {"sensors.load.resolution": 2e-3})
    modes = corner_modes(prepare_linear(counting), corner, 1.5, GAINS)
    smooth = corner_modes(prepare_linear(servo()), Corner("smooth", {}), 1.5, GAINS)
    assert modes.friction == pytest.approx(smooth.friction)


# -- the whole study --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def tuned():
    sensors = Sensors(load=AngleSensor(resolution=2 * math.pi / 2**18))
    slow = servo(Sampling(speed=1e-3, position=2e-3), sensors, **{SPEED: 0.2, INTEGRAL: 8.0, POSITION: 20.0})
    task = Specification(
        title="Sampled servo",
        case="",
        demand=demand(peak_current=3.0),
        tuning=Tuning(gains=(POSITION, SPEED), dead_band=True, range=5.0),
    )
    return tune(task, slow, margins=(), workers=1)


def test_a_sampled_servo_that_hunts_is_tuned_until_it_does_not(tuned):
    assert tuned.before_checks[0].hunts(1.0)
    assert tuned.met
    assert tuned.plant.sampling is not None  # simulated at its ticks
    last = tuned.rounds[-1].checks[0]
    assert last.peak_current < 3.0 * 1.001
    assert last.standing_error <= tuned.design.standing_error * 1.01
    assert tuned.margins[0].rests >= 1.3
    assert tuned.margins_before[0].hunts <= 1.3


def test_ticks_cost_margin(tuned):
    # the same gains in continuous time have more phase at the torque, by about the lag of one and a half ticks
    point = trim(replace(tuned.plant, sampling=None, sensors=Sensors()), "forward", parameters=tuned.design.gains)
    free = gain_model(point, (SPEED,), INPUTS, OUTPUTS)
    frequencies = np.linspace(50.0, 300.0, 6)
    sampled = model_at(servo(Sampling(speed=1e-3, position=2e-3)), tuned.design.gains | {INTEGRAL: 8.0})[1]
    lost = np.angle(free.loop("torque_reference", frequencies).value / sampled.loops("torque_reference", frequencies))
    assert (lost > 0.4e-3 * frequencies).all()


def test_a_bandwidth_beyond_the_ticks(plant):
    task = Specification(
        title="", case="", demand=demand(bandwidth=130.0), tuning=Tuning(gains=(POSITION,), dead_band=True)
    )
    with pytest.raises(NotTunable, match=r"130 Hz is more than half the rate of a loop that is sampled every 4 ms"):
        tune(task, plant, workers=1)


@pytest.mark.slow
def test_the_sampled_aileron_at_its_worst_corner():
    task, case = load_specification("aileron-sampled")
    corner = task.all_corners(case.actuator)[1]
    assert corner.name == "-55 degC, bias -8 N m"
    one = replace(task, corners={"only": {"bias": task.corners["load"]["bias -8 N m"]}})
    tuned = tune(one, case.actuator, margins=(), workers=1)
    assert tuned.met
    (again,) = check_corners(tuned.plant, tuned.corners, tuned.parameters, task.demand, workers=1)
    assert not again.hunts(1.3)
    assert again.peak_current <= 20.0
