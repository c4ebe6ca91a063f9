"""Linear models by mode, loops in discrete time, margins, poles.

Oracles: two masses on a spring by hand, sliding and stuck; the z-transforms of a double integrator under zero-order
hold with and without a delay; the sampled-data response of a sine by hand; python-control's margins, all of them, on
loops of its documentation; a loop in discrete time with margins in closed form.
"""

import dataclasses
import math
from functools import cache

import control
import numpy as np
import pytest

from actuator import (
    Actuator,
    AngleSensor,
    Load,
    NoEquilibrium,
    TorqueSource,
    complementary_sensitivity,
    disk_margin,
    envelope,
    harmonic_response,
    lifted_margins,
    linearize,
    linearize_modes,
    load_response,
    loop_transfer,
    margins,
    poles,
    sensitivity,
    trim,
    without_quantization,
)
from actuator.parts.sensors import Sensors
from controllers import PID, Sampling
from gear import Bearing, Coupling, Shaft, Transmission
from studies import load_case

# -- two masses on a spring, each in a bearing --------------------------------------------------------------

MOTOR, LOAD, SPRING, DAMPING, VISCOUS = 2e-3, 5e-2, 800.0, 0.3, 0.02
MOTOR_BEARING, LOAD_BEARING = "gear.bearings.motor", "gear.bearings.load"
S = 1j * np.logspace(-1, 4, 60)


@cache
def drive(damping=DAMPING):
    gear = Transmission(
        shafts={"motor": Shaft(inertia=MOTOR), "load": Shaft(inertia=LOAD)},
        couplings={"shaft": Coupling(a="motor", b="load", stiffness=SPRING, damping=damping)},
        bearings={
            "motor": Bearing(shaft="motor", coulomb=0.5, breakaway=0.8, viscous=VISCOUS if damping else 0.0),
            "load": Bearing(shaft="load", coulomb=1.0, breakaway=1.5),
        },
        input="motor",
        output="load",
    )
    return Actuator(motor=TorqueSource(), gear=gear)


@cache
def models(damping=DAMPING):
    return linearize_modes(drive(damping), inputs={"torque_reference": 1.5}, partial=True)


def by_hand(s, spring, viscous):
    """Motor and load angle over motor torque: all sliding; load stuck; motor over load torque with the motor stuck."""
    motor, load = MOTOR * s**2 + viscous * s + spring, LOAD * s**2 + spring
    both = motor * load - spring**2
    return {"sliding": (load / both, spring / both), "load stuck": (1 / motor, 0 * s), "motor stuck": (0 * s, 1 / load)}


def test_the_modes_of_a_drive_are_those_in_which_friction_holds_its_torque():
    # 1.5 N m just moves both; where one stands, the other takes its sliding friction, and 1.5 N m do not go backward
    found = models()
    assert [model.name for model in found] == [
        "stuck",
        "forward",
        "forward, stuck bearings.motor",
        "forward, stuck bearings.load",
    ]
    assert list(found.unreachable) == ["backward"]
    assert found["forward"].contacts == {MOTOR_BEARING: "forward", LOAD_BEARING: "forward"}


@pytest.mark.parametrize("damping", [0.0, DAMPING])
def test_a_drive_sliding_and_with_its_load_stuck_has_the_transfer_functions_of_the_textbook(damping):
    spring = damping * S + SPRING
    hand = by_hand(S, spring, VISCOUS if damping else 0.0)
    outputs = ["motor_angle", "load_angle"]
    found = models(damping)
    np.testing.assert_allclose(
        found["forward"].linear(["torque_reference"], outputs)(S)[:, 0], hand["sliding"], rtol=1e-9
    )
    held = found["forward, stuck bearings.load"].linear(["torque_reference"], outputs)
    np.testing.assert_allclose(held(S)[:, 0], hand["load stuck"], rtol=1e-9, atol=1e-16)
    assert held.nstates == 2


def test_resonance_is_that_of_free_masses_sliding_and_that_of_the_wall_with_the_load_stuck():
    found = models(0.0)
    free = found["forward"].linear(["torque_reference"], ["motor_speed"])
    held = found["forward, stuck bearings.load"].linear(["torque_reference"], ["motor_speed"])
    assert max(free.poles().imag) == pytest.approx(math.sqrt(SPRING * (1 / MOTOR + 1 / LOAD)), rel=1e-9)
    assert max(free.zeros().imag) == pytest.approx(math.sqrt(SPRING / LOAD), rel=1e-9)
    assert max(held.poles().imag) == pytest.approx(math.sqrt(SPRING / MOTOR), rel=1e-9)


def test_a_stuck_motor_leaves_the_load_on_its_spring():
    contacts = {MOTOR_BEARING: "stuck", LOAD_BEARING: "forward"}
    point = trim(drive(), contacts, inputs={"load_torque": 1.0})
    model = linearize(point, ["load_torque"], ["motor_angle", "load_angle"], minimal=True)
    hand = by_hand(S, DAMPING * S + SPRING, VISCOUS)["motor stuck"]
    np.testing.assert_allclose(model(S)[:, 0], hand, rtol=1e-9, atol=1e-16)
    assert model.state_labels == ["load_angle", "load_speed"]
    np.testing.assert_allclose(load_response(point)(S), hand[1], rtol=1e-9)


@cache
def aileron_modes():
    return linearize_modes(load_case("aileron").actuator, inputs={"reference": 0.1})


@pytest.mark.parametrize("mode", ["stuck", "forward"])
def test_what_is_locked_can_be_left_out_without_another_response(mode):
    point = aileron_modes()[mode].point
    asked = ["inject.voltage", "load_torque"], ["current", "load_angle", "gear.bearings.motor.friction"]
    whole, least = linearize(point, *asked), linearize(point, *asked, minimal=True)
    np.testing.assert_allclose(least(S), whole(S), rtol=1e-6, atol=1e-9)
    assert least.nstates == whole.nstates - (6 if mode == "stuck" else 0)


def test_a_stuck_model_without_what_is_locked_has_no_pole_at_zero_but_the_integrator():
    stuck = poles(aileron_modes()["stuck"].point)
    (integrator,) = (pole for pole in stuck if pole.frequency == 0)
    assert integrator.part == "controller"
    assert integrator.participation["controller.speed.integral"] == pytest.approx(1.0)


def test_a_pole_of_the_winding_is_told_from_one_of_the_motor_shaft():
    found = list(poles(aileron_modes()["forward"].point))
    electrical = max(found, key=lambda pole: pole.participation["motor.current_q"])
    assert (electrical.part, electrical.value.imag) == ("motor winding", 0)
    assert abs(electrical.value + 3843) < 1
    assert "shaft motor" in {pole.part for pole in found}
    assert {pole.part for pole in found} <= {
        "motor winding",
        "shaft motor",
        "shaft idler",
        "shaft surface",
        "controller",
    }


def test_each_mesh_with_a_gap_has_its_flight():
    found = aileron_modes()
    flight = found["forward, free meshes.first"]
    assert not flight.equilibrium
    assert flight.contacts["gear.meshes.first"] == "free"
    # in flight the motor is alone: torque on rotor and pinion, and the drag of its bearing
    inertia, drag = 400e-7, 2e-4
    model = flight.linear(["inject.torque_reference"], ["motor_torque", "motor_speed"])
    torque, speed = model(S)[:, 0]
    np.testing.assert_allclose(speed / torque, 1 / (inertia * S + drag), rtol=1e-6)


def test_the_envelope_holds_every_mode_in_which_something_passes():
    loops = aileron_modes().loops("torque_reference")
    frequencies = np.logspace(0, 3, 50)
    band = envelope(loops, frequencies)
    inside = 0
    for name, loop in loops.items():
        gain = abs(loop(1j * frequencies))
        if name != "stuck":
            assert (gain >= band.gain_low * (1 - 1e-12)).all()
            assert (gain <= band.gain_high * (1 + 1e-12)).all()
            inside += 1
    assert inside == len(loops) - 1
    assert (band.gain_high > 1.2 * band.gain_low).any()


def test_there_is_no_envelope_where_nothing_passes():
    with pytest.raises(ValueError, match="nothing passes in any of the modes stuck"):
        envelope({"stuck": aileron_modes()["stuck"].loop("position")})


def test_an_unreachable_mode_is_named_with_the_reachable_ones():
    with pytest.raises(KeyError, match="no reachable mode named 'forwards'; did you mean forward"):
        aileron_modes()["forwards"]


def test_where_no_mode_is_reachable_the_reason_is_given():
    inputs = {"reference": 0.1, "load_torque": -300.0}
    with pytest.raises(NoEquilibrium, match="aileron: "):
        linearize_modes(load_case("aileron").actuator, inputs=inputs, parameters={"load.stiffness": 0.0})


# -- sampled control ----------------------------------------------------------------------------------------

INERTIA, PERIOD = 0.3, 1e-2
PROPORTIONAL, INTEGRAL, DERIVATIVE = 40.0, 90.0, 5.0


@cache
def servo(delay=0, sensor=None):
    pid = PID(proportional=PROPORTIONAL, integral=INTEGRAL, derivative=DERIVATIVE)
    gear = Transmission(shafts={"arm": Shaft(inertia=INERTIA)}, input="arm", output="arm")
    return Actuator(
        motor=TorqueSource(),
        gear=gear,
        controller=pid,
        sampling=Sampling(position=PERIOD, delay=delay),
        sensors=Sensors(load=sensor),
    )


def loop_by_hand(z, delay):
    """Double integrator under zero-order hold, PID with Euler's integral and the speed as derivative, and a delay."""
    position = PERIOD**2 / (2 * INERTIA) * (z + 1) / (z - 1) ** 2
    speed = PERIOD / INERTIA / (z - 1)
    return ((PROPORTIONAL + INTEGRAL * PERIOD / (z - 1)) * position + DERIVATIVE * speed) * z ** (-float(delay))


ANGLES = np.linspace(0.05, 3.1, 40)
Z = np.exp(1j * ANGLES)


@pytest.mark.parametrize("delay", [0, 1])
def test_the_loop_of_a_sampled_servo_is_its_z_transform(delay):
    point = trim(servo(delay), "forward", inputs={"reference": 0.2})
    loop = loop_transfer(point, "torque_reference")
    assert loop.dt == PERIOD
    np.testing.assert_allclose(loop(Z), loop_by_hand(Z, delay), rtol=1e-9)
    position = loop_transfer(point, "position")  # the speed loop stays closed
    back = 1 + DERIVATIVE * PERIOD / INERTIA / (Z - 1) * Z ** (-float(delay))
    through = loop_by_hand(Z, delay) - back + 1
    np.testing.assert_allclose(position(Z), through / back, rtol=1e-9)


@pytest.mark.parametrize("delay", [0, 1])
def test_margins_of_a_sampled_servo_bring_its_z_transform_to_minus_one(delay):
    found = margins(loop_transfer(trim(servo(delay), "forward"), "torque_reference"))
    assert found.stable
    for crossing in found.gain_crossings:
        late = np.exp(-1j * crossing.frequency * crossing.delay_s)
        assert loop_by_hand(np.exp(1j * crossing.frequency * PERIOD), delay) * late == pytest.approx(-1, rel=1e-9)
    for crossing in found.phase_crossings:
        there = loop_by_hand(np.exp(1j * crossing.frequency * PERIOD), delay)
        assert crossing.gain * there == pytest.approx(-1, rel=1e-8)
    assert found.lower_gain < 1 < found.upper_gain < math.inf
    assert min(crossing.delay_s for crossing in found.gain_crossings) == found.delay_s


def test_an_integrator_behind_a_hold_and_a_delay_has_its_margins_in_closed_form():
    # L = g/(z (z - 1)): real at w T = pi/3 where |z - 1| = 1; gain one where 2 sin(w T/2) = g
    gain, period = 0.3, 0.02
    found = margins(control.ss([[1.0, gain], [0.0, 0.0]], [[0.0], [1.0]], [[1.0, 0.0]], 0.0, period))
    crossover = 2 * math.asin(gain / 2) / period
    assert found.gain == pytest.approx(1 / gain, rel=1e-9)
    assert found.gain_frequency == pytest.approx(math.pi / 3 / period, rel=1e-9)
    assert found.phase_rad == pytest.approx(math.pi / 2 - 1.5 * crossover * period, rel=1e-9)
    assert found.phase_frequency == pytest.approx(crossover, rel=1e-9)
    assert found.delay_s == pytest.approx((math.pi / 2 / crossover - 1.5 * period), rel=1e-9)


def test_a_gain_margin_at_half_the_sampling_rate_is_found():
    # z = 0 -> z = -k/... : the pole of 0.5/z moves out of the unit circle at z = -1, with twice the gain
    found = margins(control.ss([[0.0]], [[1.0]], [[0.5]], 0.0, 0.1))
    assert found.gain == pytest.approx(2.0, rel=1e-9)
    assert found.gain_frequency == pytest.approx(math.pi / 0.1, rel=1e-9)


@pytest.mark.parametrize("delay", [0, 1])
def test_a_sine_through_a_sampled_servo_comes_out_as_sampled_data_theory_says(delay):
    point = trim(servo(delay), "forward")
    w = np.array([0.3, 5.0, 40.0, 200.0, 290.0, 500.0])  # up to beyond half the sampling rate
    z = np.exp(1j * w * PERIOD)
    hold = (1 - 1 / z) / (1j * w * PERIOD)
    control_law = (PROPORTIONAL + INTEGRAL * PERIOD / (z - 1)) * z ** (-float(delay))
    expected = hold * control_law / (INERTIA * (1j * w) ** 2) / (1 + loop_by_hand(z, delay))
    found = harmonic_response(point, ["reference"], ["load_angle"], w)
    np.testing.assert_allclose(found[0, 0], expected, rtol=1e-8)


@cache
def sampled_aileron():
    actuator = load_case("aileron").actuator
    sampled = dataclasses.replace(actuator, sampling=Sampling(current=1e-4, speed=5e-4, position=1e-3))
    return trim(sampled, "forward", inputs={"reference": 0.1})


@pytest.mark.parametrize(("signal", "channels"), [("position", 1), ("speed_reference", 1), ("torque_reference", 2)])
def test_a_loop_of_several_rates_closes_to_the_whole_model(signal, channels):
    loop = loop_transfer(sampled_aileron(), signal)
    assert loop.ninputs == channels
    whole = linearize(sampled_aileron(), [], [])
    closed = sensitivity(sampled_aileron(), signal)
    expected, found = (sorted(abs(np.linalg.eigvals(model.A)))[-6:] for model in (whole, closed))
    np.testing.assert_allclose(found, expected, rtol=1e-8)


def test_fast_sampling_of_a_loop_of_several_rates_is_continuous_control():
    fast = dataclasses.replace(
        load_case("aileron").actuator, sampling=Sampling(current=1e-6, speed=2e-6, position=4e-6)
    )
    point = trim(fast, "forward", inputs={"reference": 0.1})
    continuous = loop_transfer(aileron_modes()["forward"].point, "speed_reference")
    w = np.logspace(0, 3, 10)
    # what is left is the delay of hold and computing
    found = loop_transfer(point, "speed_reference")(np.exp(4e-6j * w))
    np.testing.assert_allclose(found, continuous(1j * w), rtol=0.02)


def test_margins_of_a_signal_that_is_renewed_several_times_are_refused_by_name():
    with pytest.raises(ValueError, match="2 inputs and 2 outputs.*`lifted_margins` is for that"):
        margins(loop_transfer(sampled_aileron(), "torque_reference"))


def lifted_by_hand(loop):
    """The same loop over two of its periods."""
    a, b, c, d = loop.A, loop.B, loop.C, loop.D
    return control.ss(
        a @ a, np.hstack([a @ b, b]), np.vstack([c, c @ a]), np.block([[d, 0 * d], [c @ b, d]]), 2 * loop.dt
    )


@pytest.mark.parametrize("delay", [0, 1])
def test_margins_of_a_lifted_loop_are_those_of_the_loop(delay):
    loop = loop_transfer(trim(servo(delay), "forward"), "torque_reference")
    expected = margins(loop)
    for lifted in (loop, lifted_by_hand(loop)):
        found = lifted_margins(lifted)
        assert found.stable
        assert found.lower_gain == pytest.approx(expected.lower_gain, rel=1e-5)
        assert found.upper_gain == pytest.approx(expected.upper_gain, rel=1e-5)
        assert found.phase_rad == pytest.approx(abs(expected.phase_rad), rel=1e-5)
        assert found.peak_sensitivity == pytest.approx(expected.peak_sensitivity, rel=1e-3)


def test_a_loop_of_several_rates_has_margins_near_those_of_continuous_control():
    found = lifted_margins(loop_transfer(sampled_aileron(), "torque_reference"))
    continuous = margins(aileron_modes()["forward"].loop("torque_reference"))
    assert found.stable
    assert found.lower_gain == pytest.approx(continuous.lower_gain, rel=0.1)
    assert 1 < found.upper_gain < math.inf  # which the continuous loop does not have
    # half a sample of hold and what the current loop takes
    assert 0.5 * continuous.phase_rad < found.phase_rad < continuous.phase_rad


def test_an_unstable_loop_has_no_room():
    loop = control.ss([[1.0]], [[1.0]], [[3.0]], 0.0, 0.1)  # closed: z = -2
    assert lifted_margins(loop).stable is False
    assert lifted_margins(loop).phase_rad == 0


def test_lifted_margins_of_a_continuous_loop_are_refused():
    with pytest.raises(ValueError, match="needs a loop in discrete time"):
        lifted_margins(control.ss(-1, 1, 1, 0))


def test_a_voltage_that_turns_with_the_rotor_cannot_be_opened():
    with pytest.raises(ValueError, match="voltage is not held between ticks"):
        loop_transfer(sampled_aileron(), "voltage")


def test_sensors_that_count_are_refused_and_can_be_taken_without_quantization():
    counting = servo(sensor=AngleSensor(resolution=1e-4))
    with pytest.raises(ValueError, match=r"sensors.load.resolution makes steps.*without_quantization"):
        loop_transfer(trim(counting, "forward"), "position")
    smooth = loop_transfer(trim(without_quantization(counting), "forward"), "torque_reference")
    np.testing.assert_allclose(smooth(Z), loop_by_hand(Z, 0), rtol=1e-9)
    assert linearize_modes(counting)["forward"].loop("position").dt == PERIOD


def test_a_sensor_that_is_late_delays_the_position_by_its_ticks():
    late = loop_transfer(trim(servo(sensor=AngleSensor(delay=2)), "forward"), "position")
    prompt = loop_transfer(trim(servo(), "forward"), "position")
    np.testing.assert_allclose(late(Z), prompt(Z) / Z**2, rtol=1e-9)


def test_a_harmonic_response_without_sampling_is_refused():
    with pytest.raises(ValueError, match="harmonic_response is for sampled control"):
        harmonic_response(aileron_modes()["forward"].point, ["reference"], ["load_angle"], np.ones(1))


# -- sensitivities ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("signal", ["position", "torque_reference"])
def test_sensitivity_and_its_complement_are_those_of_the_loop(signal):
    point = aileron_modes()["forward"].point
    loop = loop_transfer(point, signal)(S)
    np.testing.assert_allclose(sensitivity(point, signal)(S), 1 / (1 + loop), rtol=1e-6)
    np.testing.assert_allclose(complementary_sensitivity(point, signal)(S), loop / (1 + loop), rtol=1e-6)


def test_the_compliance_of_a_servo_at_low_frequency_is_that_of_its_gains():
    gear = Transmission(shafts={"arm": Shaft(inertia=INERTIA)}, input="arm", output="arm")
    stiff = Actuator(
        motor=TorqueSource(),
        gear=gear,
        load=Load(stiffness=7.0),
        controller=PID(proportional=3, integral=0, derivative=6),
    )
    response = load_response(trim(stiff, "forward"))
    np.testing.assert_allclose(response(S), 1 / (INERTIA * S**2 + 6 * S + 3 + 7), rtol=1e-9)


# -- margins ------------------------------------------------------------------------------------------------

s = control.tf("s")
EXAMPLES = {
    "stability_margins": 8937 * (s + 1) * (s + 100) / (s * (s + 10) * (s**2 + 20 * s + 4e4)),
    "disk_margins, SISO": 25 / (s**3 + 10 * s**2 + 10 * s + 10),
    "conditionally stable": 20 * (s + 1) ** 2 / (s**3 * (s / 50 + 1)),
    "several crossings": 0.7 * (s**2 + 0.02 * s + 1) * (s + 2) ** 2 / (s * (s**2 + 0.01 * s + 2) * (s / 30 + 1) ** 2),
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_crossing_is_that_of_python_control(name):
    loop = EXAMPLES[name]
    gains, phases, _, at_gains, at_phases, _ = control.stability_margins(loop, returnall=True)
    found = margins(control.ss(loop))
    np.testing.assert_allclose([c.frequency for c in found.phase_crossings], np.sort(at_gains), rtol=1e-6)
    np.testing.assert_allclose([c.gain for c in found.phase_crossings], gains[np.argsort(at_gains)], rtol=1e-6)
    np.testing.assert_allclose([c.frequency for c in found.gain_crossings], np.sort(at_phases), rtol=1e-6)
    turned = np.degrees([c.phase_rad for c in found.gain_crossings])
    expected = (phases[np.argsort(at_phases)] + 180) % 360 - 180
    np.testing.assert_allclose(turned, expected, rtol=1e-6)


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.parametrize("skew", [-1.0, 0.0, 0.5, 1.0])
def test_disk_margins_are_those_of_python_control(name, skew):
    loop = control.ss(EXAMPLES[name])
    found = disk_margin(loop, skew=skew)
    if not margins(loop).stable:
        assert found.size == 0
        return
    near = found.frequency * np.linspace(0.999, 1.001, 201)
    size, gain, phase = control.disk_margins(loop, near, skew=skew)
    assert found.size == pytest.approx(size, rel=1e-6)
    assert 20 * math.log10(min(found.gain_high, 1 / max(found.gain_low, 1e-300))) == pytest.approx(gain, rel=1e-5)
    assert math.degrees(found.phase_rad) == pytest.approx(phase, rel=1e-5)


def test_the_disk_touches_minus_one():
    loop = control.ss(EXAMPLES["stability_margins"])
    found = disk_margin(loop)
    value = loop(1j * found.frequency)
    # some change z of that size makes (1 + z/2)/(1 - z/2) L = -1
    z = 2 * (1 + value) / (1 - value)
    assert abs(z) == pytest.approx(found.size, rel=1e-9)


def test_a_conditionally_stable_loop_has_a_lower_gain_margin():
    found = margins(control.ss(EXAMPLES["conditionally stable"]))
    assert 0 < found.lower_gain < 1
    assert found.upper_gain == pytest.approx(
        min((c.gain for c in found.phase_crossings if c.gain > 1), default=math.inf)
    )


def test_margins_of_one_signal_and_of_several_values_are_asked_in_one_way():
    one = margins(control.ss(EXAMPLES["conditionally stable"]))
    several = lifted_margins(control.ss(0.5 * np.eye(2), np.eye(2), 0.1 * np.eye(2), np.zeros((2, 2)), 1.0))
    assert one.range_db == (one.gain_db,)
    assert several.range_db == pytest.approx((-math.inf, 20 * math.log10(15)))  # 0.5 - 0.1 k leaves the circle at 15
    for found in (one, several):
        assert {unit for _, _, _, unit in found.rows()} <= {"dB", "deg", "s", "-"}
        assert found.numbers()["stable"] is found.stable
    assert [frequency for _, frequency, _, _ in several.rows()] == [None] * 3


# -- poles --------------------------------------------------------------------------------------------------


def test_poles_of_a_mass_on_a_spring_are_shared_by_its_angle_and_its_speed():
    gear = Transmission(shafts={"mass": Shaft(inertia=2.0)}, input="mass", output="mass")
    spring = Actuator(motor=TorqueSource(), gear=gear, load=Load(stiffness=50.0, damping=4.0))
    (pole,) = poles(trim(spring, "forward"))
    assert pole.frequency == pytest.approx(5.0, rel=1e-12)
    assert pole.damping == pytest.approx(4 / (2 * math.sqrt(50 * 2)), rel=1e-12)
    assert pole.participation == pytest.approx({"mass.angle": 0.5, "mass.speed": 0.5}, rel=1e-9)
    assert pole.part == "shaft mass"


@pytest.mark.parametrize("integral", [0.0, INTEGRAL])
def test_a_stuck_shaft_under_pid_has_the_pole_of_its_integral_alone(integral):
    gear = Transmission(
        shafts={"arm": Shaft(inertia=INERTIA)},
        bearings={"arm": Bearing(shaft="arm", coulomb=1.0, breakaway=1.5)},
        input="arm",
        output="arm",
    )
    pid = PID(proportional=PROPORTIONAL, integral=integral, derivative=DERIVATIVE)
    arm = Actuator(motor=TorqueSource(), gear=gear, controller=pid)
    (pole,) = poles(trim(arm, "stuck"))
    assert (pole.value, pole.parts) == (0, {"controller": 1.0})


def test_poles_of_two_masses_far_apart_belong_to_their_masses():
    found = models()["forward, stuck bearings.load"].point
    (pole,) = poles(found)
    assert pole.parts["shaft motor"] == pytest.approx(1.0)
    assert pole.frequency == pytest.approx(math.sqrt(SPRING / MOTOR), rel=1e-9)


def test_poles_in_discrete_time_are_those_of_the_flow_and_delays_are_infinitely_fast():
    found = poles(trim(servo(1), "forward"))
    z = np.roots(closed_polynomial())
    expected = sorted(abs(np.log(z[abs(z) > 1e-9].astype(complex))) / PERIOD)
    finite = [pole for pole in found if math.isfinite(pole.frequency)]
    pairs = sorted(pole.frequency for pole in finite for _ in range(1 if pole.value.imag == 0 else 2))
    np.testing.assert_allclose(pairs, expected, rtol=1e-6)
    assert any(math.isinf(pole.frequency) for pole in found)


def closed_polynomial():
    """Numerator of 1 + L with one delay: z (z - 1)^3 + ..."""
    one, both = np.array([1, -1]), np.array([1, 1])
    square = np.polymul(one, one)
    rigid = PERIOD**2 / (2 * INERTIA) * both
    forward = np.polyadd(
        np.polymul(np.polyadd(PROPORTIONAL * one, [INTEGRAL * PERIOD]), rigid),
        DERIVATIVE * PERIOD / INERTIA * square,
    )
    return np.polyadd(np.polymul([1, 0], np.polymul(square, one)), forward)


def test_the_table_of_poles_reads_and_becomes_a_dataset():
    found = poles(aileron_modes()["forward"].point)
    text = str(found)
    assert "controller.speed.integral" in text
    assert len(text.splitlines()) == 1 + len(found)
    data = found.to_xarray()
    np.testing.assert_allclose(data.participation.sum("state"), 1, rtol=1e-9)
    assert data.frequency.attrs["units"] == "rad/s"


def test_the_chart_has_a_line_for_every_mode_in_which_something_passes():
    gain, _ = aileron_modes().plot("torque_reference").axes
    assert len(gain.get_lines()) == 1 + sum(name != "stuck" for name in aileron_modes().loops("torque_reference"))
