"""Bench tests and what the load feels, on drives whose answers are known.

Oracles: the step of a damped oscillator in closed form; friction over proportional gain as hysteresis, resolution and
threshold; the hunting mass of `test_system_hunting_mass`; torque limit less friction as stall torque; spring and gap by
hand; the mechanical impedance of a servo without friction.
"""

import dataclasses
import math
from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

from actuator import (
    PMSM,
    Actuator,
    Bench,
    Load,
    Rotor,
    RotorDrag,
    TemperatureDependence,
    ThermalNetwork,
    TorqueSource,
    back_driving,
    block_motor,
    dynamic_stiffness,
    free_play,
    hold_test,
    rate_test,
    remove_drive,
    soak_test,
    staircase_test,
    step_test,
    temperature_sets,
    triangle_test,
)
from controllers import PI, PID, Cascade, P
from gear import Bearing, Coupling, Shaft, Transmission
from studies import load_case

pytestmark = pytest.mark.thorough

INERTIA, FREQUENCY, DAMPING = 0.2, 20.0, 0.5
PROPORTIONAL, DERIVATIVE = INERTIA * FREQUENCY**2, 2 * DAMPING * FREQUENCY * INERTIA
STROKE = 1.0


@cache
def servo(coulomb=0.0, breakaway=0.0, derivative=DERIVATIVE):
    """A PD on an inertia in a bearing: an oscillator of second order."""
    bearings = {"guide": Bearing(shaft="arm", coulomb=coulomb, breakaway=breakaway)} if breakaway else {}
    gear = Transmission(shafts={"arm": Shaft(inertia=INERTIA)}, bearings=bearings, input="arm", output="arm")
    law = PID(proportional=PROPORTIONAL, integral=0.0, derivative=derivative)
    return Actuator(motor=TorqueSource(), gear=gear, controller=law)


def bench(plant, **more):
    return Bench(plant=plant, stroke=STROKE, compiled=False, **more)


# -- steps --------------------------------------------------------------------------------------------------


def oscillator(time):
    """Unit step of the damped oscillator."""
    turned = FREQUENCY * math.sqrt(1 - DAMPING**2)
    ratio = DAMPING / math.sqrt(1 - DAMPING**2)
    return 1 - math.exp(-DAMPING * FREQUENCY * time) * (math.cos(turned * time) + ratio * math.sin(turned * time))


@pytest.mark.parametrize("size", [0.005, 1.0])
def test_a_step_of_an_oscillator_has_its_overshoot_and_times_in_closed_form(size):
    (step,) = step_test(bench(servo()), sizes=[size], duration=1.5, resolution=2e-4).steps
    rise = brentq(lambda t: oscillator(t) - 0.9, 0, 0.12) - brentq(lambda t: oscillator(t) - 0.1, 0, 0.12)
    times = np.linspace(0, 1.5, 200001)
    outside = np.flatnonzero(abs(np.array([oscillator(t) - 1 for t in times])) > 0.02)
    assert step.size_rad == pytest.approx(size * STROKE)
    assert step.overshoot == pytest.approx(math.exp(-math.pi * DAMPING / math.sqrt(1 - DAMPING**2)), rel=1e-3)
    assert step.rise_s == pytest.approx(rise, abs=4e-4)
    assert step.settling_s == pytest.approx(times[outside[-1]], abs=4e-4)
    assert step.error_rad == pytest.approx(0, abs=1e-5 * size)


def test_a_step_below_the_threshold_never_rises_and_keeps_its_error():
    size = 0.5 * 1.5 / PROPORTIONAL
    (step,) = step_test(bench(servo(1.0, 1.5)), sizes=[size], duration=0.5).steps
    assert (step.rise_s, step.settling_s, step.overshoot) == (math.inf, math.inf, 0.0)
    assert step.error_rad == pytest.approx(size * STROKE)
    assert step.numbers["error at the end"] == (step.error_rad, "rad")


def test_the_numbers_of_several_steps_say_which():
    found = step_test(bench(servo()), sizes=[0.01, 0.1], duration=0.5)
    assert "step 0.573 deg, overshoot" in found.numbers
    assert len(found.plot().axes[0].get_lines()) == 2


# -- triangle -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("coulomb", [0.0, 2.0])
def test_the_hysteresis_of_a_triangle_is_friction_over_stiffness(coulomb):
    period, size = 8.0, 0.2
    slope = 4 * size * STROKE / period
    found = triangle_test(bench(servo(coulomb, coulomb)), size=size, period=period, points=2000)
    assert found.hysteresis_rad == pytest.approx(2 * (coulomb + DERIVATIVE * slope) / PROPORTIONAL, rel=0.01)
    assert found.lost_motion_rad == pytest.approx(0, abs=1e-9)  # motor and load are one


SPRING, GAP = 2000.0, 4e-3


@cache
def geared(gap=GAP, motor_friction=0.5, load_friction=1.0):
    """A motor in a bearing, a coupling with play, and a load in a bearing."""
    return Actuator(
        motor=TorqueSource(),
        gear=Transmission(
            shafts={"motor": Shaft(inertia=2e-3), "load": Shaft(inertia=5e-2)},
            couplings={"shaft": Coupling(a="motor", b="load", stiffness=SPRING, damping=1.0, gap=gap)},
            bearings={
                "motor": Bearing(shaft="motor", coulomb=motor_friction, breakaway=motor_friction),
                "load": Bearing(shaft="load", coulomb=load_friction, breakaway=load_friction),
            },
            input="motor",
            output="load",
        ),
    )


def test_the_lost_motion_of_a_triangle_is_play_and_windup():
    plant = dataclasses.replace(
        geared(),
        controller=Cascade(
            position=P(gain=20.0),
            speed=PI(proportional=1.0, integral=2.0),
            current=None,
            speed_limit=100.0,
            feedback="motor",
        ),
    )
    found = triangle_test(bench(plant), size=0.2, period=8.0, points=2000)
    assert found.lost_motion_rad == pytest.approx(GAP + 2 * 1.0 / SPRING, rel=0.02)
    assert "lost motion" in found.plot().axes[1].get_title()


# -- staircase ----------------------------------------------------------------------------------------------


def staircase_by_hand(coulomb, breakaway, increment, count):
    """Steps between slides on the way up, and until the first on the way down.

    A slide is half a swing about coulomb/P, where friction balances the spring: it ends beyond it by the overshoot.
    """
    over = math.exp(-math.pi * DAMPING / math.sqrt(1 - DAMPING**2))
    error, slides, back = 0.0, [], 0
    for k in range(1, count + 1):
        error += increment
        if PROPORTIONAL * error > breakaway:
            error = coulomb / PROPORTIONAL - over * (error - coulomb / PROPORTIONAL)
            slides.append(k)
    while PROPORTIONAL * error > -breakaway:
        error -= increment
        back += 1
    return max(np.diff(slides)) * increment, back * increment


@pytest.mark.parametrize(("increment", "count"), [(2e-3, 22), (3.1e-3, 17)])
def test_resolution_and_threshold_of_a_staircase_are_those_of_its_slides(increment, count):
    coulomb, breakaway = 1.0, 1.5
    found = staircase_test(bench(servo(coulomb, breakaway)), increment=increment, count=count, dwell=0.6)
    resolution, threshold = staircase_by_hand(coulomb, breakaway, increment, count)
    assert found.resolution_rad == pytest.approx(resolution)
    assert found.threshold_rad == pytest.approx(threshold)
    assert found.numbers["threshold"][1] == "rad"
    assert found.plot().axes[0].get_ylabel() == "angle in deg"


def test_a_staircase_on_which_nothing_moves_says_so():
    found = staircase_test(bench(servo(1.0, 1.5)), increment=1e-6, count=3, dwell=0.1)
    assert (found.resolution_rad, found.threshold_rad) == (math.inf, math.inf)


# -- hold ---------------------------------------------------------------------------------------------------


def test_holding_finds_the_cycle_of_the_hunting_mass():
    gear = Transmission(
        shafts={"mass": Shaft(inertia=1.0)},
        bearings={"guide": Bearing(shaft="mass", coulomb=1.0, breakaway=1.5)},
        input="mass",
        output="mass",
    )
    mass = Actuator(motor=TorqueSource(), gear=gear, controller=PID(proportional=3.0, integral=4.0, derivative=6.0))
    found = hold_test(bench(mass), step=1.0, duration=150.0, resolution=0.02)
    assert found.verdict.verdict == "hunting"
    assert found.numbers["period"] == (pytest.approx(23.3693, rel=1e-3), "s")
    assert found.numbers["amplitude"] == (pytest.approx(0.067240, rel=1e-3), "rad")
    assert found.plot().axes


# -- rate and stall -----------------------------------------------------------------------------------------


@cache
def limited():
    gear = Transmission(
        shafts={"arm": Shaft(inertia=0.01)},
        bearings={"guide": Bearing(shaft="arm", coulomb=1.0, breakaway=1.0)},
        input="arm",
        output="arm",
    )
    law = Cascade(position=P(gain=20.0), speed=PI(proportional=1.0, integral=10.0), current=None, speed_limit=0.7)
    return Actuator(motor=TorqueSource(torque_limit=5.0), gear=gear, controller=law)


def test_the_rate_is_the_speed_limit_and_the_stall_torque_what_friction_leaves_of_the_motors():
    found = rate_test(bench(limited()), highest=8.0, duration=20.0)
    assert found.rate == pytest.approx(0.7, rel=0.01)
    assert found.stall_torque == pytest.approx(5.0 - 1.0, rel=0.01)
    assert found.plot().axes[1].get_title().startswith("stall at 4")


def test_a_load_too_small_to_stall_is_said_to_be():
    found = rate_test(bench(limited()), highest=2.0)
    assert math.isnan(found.stall_torque)
    assert found.plot().axes[1].get_title() == "does not stall"


def test_a_load_that_does_not_move_is_refused():
    stuck = dataclasses.replace(limited(), motor=TorqueSource(torque_limit=0.5))
    with pytest.raises(ValueError, match="does not move over its stroke"):
        rate_test(bench(stuck), highest=2.0, duration=1.0)


# -- soak ---------------------------------------------------------------------------------------------------


def test_a_soak_tells_the_temperatures_apart():
    sets = {"-55 degC": {"gear.bearings.guide.coulomb": 3.0, "gear.bearings.guide.breakaway": 3.0}, "20 degC": {}}
    found = soak_test(bench(servo(0.5, 0.5)), sets, step=0.1, duration=2.0)
    cold, warm = found.points
    assert (cold.name, warm.name) == ("-55 degC", "20 degC")
    assert abs(cold.step.error_rad) > abs(warm.step.error_rad)
    assert found.numbers["20 degC, overshoot"][0] > found.numbers["-55 degC, overshoot"][0]
    assert len(found.plot().axes[0].get_lines()) == 2


def test_a_soaked_actuator_starts_at_its_temperature_whatever_holds_its_load():
    network = ThermalNetwork.of_motor(
        winding_to_housing=1.0,
        housing_to_ambient=2.0,
        winding_time_constant=50.0,
        motor_time_constant=1000.0,
        ambient=293.15,
    )
    aileron = load_case("aileron").actuator
    warm = dataclasses.replace(
        aileron,
        thermal=network,
        motor=dataclasses.replace(aileron.motor, temperature_dependence=TemperatureDependence()),
    )
    sets = temperature_sets(warm, [218.15])
    (point,) = soak_test(Bench(plant=warm, stroke=0.7), sets, duration=0.5).points
    assert point.step.run["thermal.winding"][0] == 218.15
    assert point.step.run["thermal.winding"][-1] > 218.15
    assert point.step.run["thermal.housing"][0] == 218.15


def test_a_soak_without_temperatures_is_refused():
    with pytest.raises(ValueError, match="at least one temperature"):
        soak_test(bench(servo()), {})


def test_a_bench_without_a_stroke_is_refused():
    with pytest.raises(ValueError, match="stroke must be > 0 rad, got 0 rad"):
        Bench(plant=servo(), stroke=0.0)


# -- what the load feels ------------------------------------------------------------------------------------


def test_the_dynamic_stiffness_of_a_servo_without_friction_is_that_of_its_gains():
    frequencies = np.array([0.5, 2.0, 6.0])
    found = dynamic_stiffness(
        servo(), amplitudes=[0.1, 10.0], frequencies=frequencies, compiled=False, workers=1, agreement=1e-5
    ).data.isel(set=0, load=0)
    w = 2 * np.pi * frequencies
    expected = PROPORTIONAL + 1j * w * DERIVATIVE - INERTIA * w**2
    for k in (0, 1):
        np.testing.assert_allclose(found.stiffness[k], expected, rtol=1e-3)
        np.testing.assert_allclose(found.compliance[k], 1 / expected, rtol=1e-3)
        np.testing.assert_allclose(found.impedance[k], expected / (1j * w), rtol=1e-3)


def test_a_torque_that_friction_takes_meets_an_infinite_stiffness():
    found = dynamic_stiffness(servo(1.0, 1.5), amplitudes=[1.4, 3.0], frequencies=[1.0], compiled=False, workers=1)
    held, moved = found.data.stiffness.values.ravel()
    assert np.isinf(held)
    assert abs(moved) < math.inf
    words = [text.get_text() for text in found.plot().legends[0].get_texts()]
    assert words == ["1.4 N m: no motion", "3 N m"]


@pytest.mark.parametrize(("gap", "friction"), [(GAP, 1.0), (2 * GAP, 0.5)])
def test_the_free_play_of_a_blocked_drive_is_its_gap_less_what_friction_bends(gap, friction):
    found = free_play(block_motor(geared(gap, load_friction=friction)), torque=10.0, compiled=False)
    assert found.width_rad == pytest.approx(gap - 2 * friction / SPRING, rel=0.02)
    assert found.lost_motion_rad == pytest.approx(gap + 2 * friction / SPRING, rel=0.02)
    assert found.stiffness == pytest.approx(SPRING, rel=0.01)
    assert found.numbers["free play"] == (found.width_rad, "rad")
    assert "free play" in found.plot().axes[0].get_title()


def test_a_load_that_nothing_holds_has_no_play():
    with pytest.raises(ValueError, match="block the motor"):
        free_play(geared(), torque=10.0, inputs={"load_torque": 3.0}, compiled=False)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_drive_is_driven_back_by_the_friction_of_both_sides(sign):
    found = back_driving(remove_drive(geared()), highest=sign * 3.0, compiled=False)
    assert found.torque == pytest.approx(sign * (0.5 + 1.0), rel=0.01)
    assert not found.locks
    assert "driven back" in found.plot().axes[0].get_title()


def test_a_drive_that_is_not_driven_back_locks():
    found = back_driving(remove_drive(geared()), highest=1.4, compiled=False)
    assert found.locks
    assert found.numbers == {"back-driving torque": (math.inf, "N m")}
    assert "locks up to 1.4 N m" in found.plot().axes[0].get_title()


def test_an_unpowered_actuator_keeps_the_inertia_of_its_rotor():
    aileron = load_case("aileron").actuator
    assert isinstance(aileron.motor, PMSM)
    loose = remove_drive(aileron)
    before = aileron.motor.inertia + aileron.gear.shafts["motor"].inertia
    assert loose.gear.shafts["motor"].inertia == pytest.approx(before)
    assert "motor_torque" in [output.name for output in loose.system().outputs]


def test_an_unpowered_rotor_with_drag_is_refused():
    aileron = load_case("aileron").actuator
    dragging = dataclasses.replace(
        aileron, motor=dataclasses.replace(aileron.motor, rotor=Rotor(drag=RotorDrag(viscous=1e-4)))
    )
    with pytest.raises(ValueError, match="no place for the cogging and drag of a rotor"):
        remove_drive(dragging)


def test_a_load_of_its_own_stays_on_an_unpowered_actuator():
    loaded = dataclasses.replace(geared(), load=Load(stiffness=7.0))
    assert remove_drive(loaded).load == Load(stiffness=7.0)
