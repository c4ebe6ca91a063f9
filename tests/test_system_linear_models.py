"""Linear models of whole actuators, one per contact mode, with their loops and margins.

Oracles: transfer functions by hand (two masses on a spring, a shaft in a bearing, a mass under PID); small sines
simulated beside a steady motion, and through the whole drive; the margins of python-control on textbook loops;
1/(1 + L) against the closed loop.
"""

import dataclasses
import math
from functools import cache

import control
import numpy as np
import pytest

from actuator import (
    Actuator,
    NoEquilibrium,
    OperatingPoint,
    Ramp,
    Sine,
    TorqueSource,
    frequency_response,
    linearize,
    linearize_modes,
    loop_transfer,
    margins,
    simulate,
    trim,
)
from controllers import PID
from gear import Bearing, Coupling, Shaft, Transmission
from studies import load_case

pytestmark = pytest.mark.thorough

# -- two masses on a spring ---------------------------------------------------------------------------------

MOTOR, LOAD, SPRING = 2e-3, 5e-2, 800.0  # kg m^2, kg m^2, N m/rad


def two_masses(damping):
    gear = Transmission(
        shafts={"motor": Shaft(inertia=MOTOR), "load": Shaft(inertia=LOAD)},
        couplings={"shaft": Coupling(a="motor", b="load", stiffness=SPRING, damping=damping)},
        input="motor",
        output="load",
    )
    return Actuator(motor=TorqueSource(), gear=gear)


@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_two_masses_on_a_spring_have_the_transfer_functions_of_the_textbook(damping):
    model = linearize(
        trim(two_masses(damping), "forward"), ["torque_reference"], ["motor_angle", "load_angle", "motor_speed"]
    )
    s = 1j * np.logspace(-1, 4, 60)
    spring = damping * s + SPRING
    both = s**2 * (MOTOR * LOAD * s**2 + (MOTOR + LOAD) * spring)
    expected = [(LOAD * s**2 + spring) / both, spring / both, s * (LOAD * s**2 + spring) / both]
    np.testing.assert_allclose(model(s)[:, 0], expected, rtol=1e-9)


def test_resonance_and_antiresonance_are_those_of_two_masses_on_a_spring():
    model = linearize(trim(two_masses(0.0), "forward"), ["torque_reference"], ["motor_speed"])
    resonance, antiresonance = math.sqrt(SPRING * (1 / MOTOR + 1 / LOAD)), math.sqrt(SPRING / LOAD)
    assert max(model.poles().imag) == pytest.approx(resonance, rel=1e-9)
    assert max(model.zeros().imag) == pytest.approx(antiresonance, rel=1e-9)


# -- a shaft in a bearing: stuck and sliding ----------------------------------------------------------------

INERTIA, COULOMB, BREAKAWAY, VISCOUS = 0.2, 1.0, 1.5, 0.4
BEARING = "gear.bearings.only"
FREQUENCIES = 1j * np.logspace(-1, 3, 20)


@cache
def shaft_in_bearing():
    bearing = Bearing(shaft="shaft", coulomb=COULOMB, breakaway=BREAKAWAY, viscous=VISCOUS)
    gear = Transmission(
        shafts={"shaft": Shaft(inertia=INERTIA)}, bearings={"only": bearing}, input="shaft", output="shaft"
    )
    return Actuator(motor=TorqueSource(), gear=gear)


def stuck_shaft(torque):
    return trim(shaft_in_bearing(), "stuck", inputs={"torque_reference": torque}, guess={})


@pytest.mark.parametrize("torque", [0.0, 1.4, -1.4])
def test_a_stuck_bearing_passes_no_motion_and_takes_all_torque(torque):
    point = stuck_shaft(torque)
    model = linearize(point, ["torque_reference"], ["shaft.speed", f"{BEARING}.friction"])
    assert point.outputs[f"{BEARING}.friction"] == pytest.approx(torque, abs=1e-12)
    np.testing.assert_allclose(model(FREQUENCIES)[:, 0], [np.zeros(20), np.ones(20)], rtol=0, atol=1e-12)
    np.testing.assert_allclose(model.poles(), 0, atol=1e-12)


def test_a_stuck_shaft_needs_no_guess():
    assert trim(shaft_in_bearing(), "stuck", inputs={"torque_reference": 1.4}).states["shaft.speed"] == 0


@pytest.mark.parametrize(("mode", "sign"), [("forward", 1), ("backward", -1)])
@pytest.mark.parametrize("speed", [0.0, 5.0])
def test_a_sliding_bearing_leaves_the_viscous_part_only(mode, sign, speed):
    torque = sign * (COULOMB + VISCOUS * speed)
    drifting = ["shaft.angle"]
    point = trim(shaft_in_bearing(), mode, inputs={"torque_reference": torque}, drifting=drifting)
    model = linearize(point, ["torque_reference"], ["shaft.speed", f"{BEARING}.friction"], drifting=drifting)
    assert point.states["shaft.speed"] == pytest.approx(sign * speed, abs=1e-9)
    np.testing.assert_allclose(
        model(FREQUENCIES)[:, 0], [1 / (INERTIA * FREQUENCIES + VISCOUS), np.zeros(20)], rtol=1e-9, atol=1e-12
    )


# -- loops --------------------------------------------------------------------------------------------------


@cache
def mass_under_pid():
    gear = Transmission(shafts={"mass": Shaft(inertia=1.0)}, input="mass", output="mass")
    return Actuator(motor=TorqueSource(), gear=gear, controller=PID(proportional=3, integral=4, derivative=6))


@pytest.mark.parametrize(
    ("signal", "expected"),
    [
        ("position", lambda s: (3 + 4 / s) / (s**2 + 6 * s)),
        ("torque_reference", lambda s: (3 + 4 / s + 6 * s) / s**2),
    ],
)
def test_the_loop_of_a_mass_under_pid_is_that_by_hand(signal, expected):
    point = trim(mass_under_pid(), "forward", inputs={"reference": 1.0})
    assert point.states["mass.angle"] == pytest.approx(1.0, abs=1e-9)
    np.testing.assert_allclose(loop_transfer(point, signal)(FREQUENCIES), expected(FREQUENCIES), rtol=1e-9)


@cache
def aileron():
    return load_case("aileron").actuator


@pytest.mark.parametrize("signal", ["position", "speed_reference", "torque_reference", "voltage"])
@pytest.mark.parametrize("mode", ["stuck", "forward", "backward"])
def test_one_over_one_plus_l_is_the_sensitivity_of_the_closed_loop(mode, signal):
    point = trim(aileron(), mode, inputs={"reference": 0.1})
    closed = linearize(point, [f"inject.{signal}"], [signal])
    s = 1j * np.logspace(-1, 5, 40)
    np.testing.assert_allclose(1 / (1 + loop_transfer(point, signal)(s)), 1 + closed(s), rtol=1e-6)


# -- margins ------------------------------------------------------------------------------------------------

s = control.tf("s")
STABLE = {
    "three lags": 10 / (s * (s + 1) * (s + 5)),
    "double integrator with lead": 4 * (s + 1) / s**2,
    "lag": 5 / (s + 1),
    "conditionally stable": 20 * (s + 1) ** 2 / (s**3 * (s / 50 + 1)),
    "third order": 4 / (s + 1) ** 3,
    "resonance below one": 10 / (s * (s**2 + 2 * s + 100)),
    "no crossing": 0.5 / (s + 1),
    "integrator, crossing at 1 rad/s": 1 / s,
    "crossing at 10^3.5 rad/s": 1e4 * (s + 1e3) / (s * (s + 1e4)),
}
UNSTABLE = {
    "three lags, too much gain": 50 / (s * (s + 1) * (s + 5)),
    "third order, too much gain": 10 / (s + 1) ** 3,
    "resonance above one": 100 / (s * (s**2 + 0.2 * s + 100)),
}


@pytest.mark.parametrize("name", STABLE)
def test_margins_are_those_of_python_control(name):
    loop = control.ss(STABLE[name])
    found = margins(loop)
    gain, phase, sensitivity, at_phase, at_gain, _ = control.stability_margins(STABLE[name])
    assert found.gain == pytest.approx(gain, rel=1e-6)
    assert found.gain_frequency == pytest.approx(at_phase, rel=1e-6, nan_ok=True)
    assert found.phase_deg == pytest.approx(phase, rel=1e-6)
    assert found.phase_frequency == pytest.approx(at_gain, rel=1e-6, nan_ok=True)
    assert found.delay_s == pytest.approx(math.radians(phase) / at_gain if math.isfinite(phase) else math.inf, rel=1e-6)
    if 0 < sensitivity < 1:
        assert found.peak_sensitivity == pytest.approx(1 / sensitivity, rel=1e-3)


@pytest.mark.parametrize("name", UNSTABLE)
def test_a_loop_that_is_unstable_when_closed_has_a_negative_phase_margin(name):
    gain, phase, *_ = control.stability_margins(UNSTABLE[name])
    assert phase < 0
    found = margins(control.ss(UNSTABLE[name]))
    assert found.gain == pytest.approx(gain, rel=1e-6)
    assert found.phase_deg == pytest.approx(phase, rel=1e-6)


def test_a_gain_margin_at_standstill_is_found():
    # positive feedback of one half: twice the gain is unstable, at frequency zero
    assert margins(control.ss(-0.5 / (s + 1) ** 2)).gain == pytest.approx(2.0, rel=1e-3)


def test_a_delay_of_the_margin_brings_the_loop_to_minus_one():
    loop = control.ss(STABLE["three lags"])
    found = margins(loop)
    frequency = found.delay_frequency
    assert loop(1j * frequency) * np.exp(-1j * frequency * found.delay_s) == pytest.approx(-1, rel=1e-9)
    assert found.gain * loop(1j * found.gain_frequency) == pytest.approx(-1, rel=1e-9)


# -- against simulation -------------------------------------------------------------------------------------

SLOPE = 0.5  # rad/s of the reference
FLOATING = {"load.stiffness": 0.0}  # so that no position differs from another


@pytest.fixture(scope="module")
def steady():
    """The aileron drive on its way at constant speed, all contacts sliding; `trim` cannot hold a common speed."""
    system, travel = aileron().system(), aileron().gear.speed_ratios()
    run = simulate(system, 1.0, inputs={"reference": Ramp(slope=SLOPE)}, parameters=FLOATING)
    assert run.changes[-1].time < 0.1
    assert "stuck" not in {str(modes[-1]) for modes in run.modes.values()}
    # the same motion as it passes through zero, where angles have the most digits
    passed = {name: run[name][-1] - travel[name.removesuffix(".angle")] * SLOPE for name in angles(system)}
    x, m = system.state_vector(run.state() | passed), run.mode_values[:, -1]
    u, p = system.input_vector({}), system.parameter_values(FLOATING)
    speeds = {f"{shaft}.angle": SLOPE * turns for shaft, turns in travel.items()}
    a = linearize(point_at(system, x, m, u, p), [], [], drifting=[state.name for state in system.states]).A
    for _ in range(3):
        x = x - np.linalg.solve(a, system.flow(x, m, u, p).full().ravel() - system.state_vector(speeds))
    return point_at(system, x, m, u, p)


def angles(system):
    return [state.name for state in system.states if state.name.endswith(".angle")]


def point_at(system, x, m, u, p):
    return OperatingPoint(system=system, x=x, m=m, u=u, p=p, rates=system.flow(x, m, u, p).full().ravel())


@pytest.mark.parametrize(("signal", "amplitude"), [("torque_reference", 0.02), ("speed_reference", 0.3)])
@pytest.mark.parametrize("frequency", [1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 4000 / (2 * math.pi)])
def test_a_small_sine_is_amplified_as_the_linear_model_says(steady, signal, amplitude, frequency):
    outputs = ["motor_speed", "current"]
    model = linearize(steady, [f"inject.{signal}"], outputs, drifting=angles(steady.system))
    settling = 0.3 + 1 / frequency
    run = simulate(
        steady.system,
        settling + max(0.1, 3 / frequency),
        inputs={
            "reference": Ramp(slope=SLOPE),
            f"inject.{signal}": Sine(amplitude=amplitude, frequency=frequency),
        },
        start=steady.states,
        parameters=FLOATING,
        resolution=0.04 / frequency,
    )
    assert run.changes == ()
    late = run.t > settling
    angle = 2 * np.pi * frequency * run.t[late]
    shapes = np.column_stack([np.sin(angle), np.cos(angle), np.ones_like(angle)])
    expected = model(2j * np.pi * frequency)[:, 0]
    for name, response in zip(outputs, expected, strict=True):
        sine, cosine, _ = np.linalg.lstsq(shapes, run[name][late])[0]
        assert abs(complex(sine, cosine) / amplitude / response - 1) < 1e-4, name


def test_without_stiction_a_sine_stream_through_the_aileron_is_its_linear_response():
    frictionless = {
        parameter.name: 0.0
        for parameter in aileron().system().parameters
        if parameter.name.startswith("gear.")
        and parameter.name.endswith((".sliding", ".static", ".coulomb", ".breakaway"))
    }
    frequencies = [2.0, 8.0, 20.0]
    measured = frequency_response(
        aileron(),
        amplitudes=[2e-4, 2e-3],
        frequencies=frequencies,
        seen=("load_angle", "motor_torque"),
        sets={"frictionless": frictionless},
        workers=1,
    )
    model = linearize_modes(aileron(), parameters=frictionless)["forward"]
    expected = model.linear(["reference"], ["load_angle", "motor_torque"])(2j * np.pi * np.array(frequencies))[:, 0]
    for amplitude in measured.data.amplitude:
        response = measured.data.response.sel(amplitude=amplitude).values[0, 0].T
        np.testing.assert_allclose(response, expected, rtol=1e-3)


def test_a_sine_below_the_stiction_of_the_aileron_moves_nothing():
    measured = frequency_response(aileron(), amplitudes=[2e-4, 0.05], frequencies=[10.0], workers=1)
    assert measured.data.moves.values.ravel().tolist() == [False, True]
    assert abs(measured.select(amplitude=2e-4).item()) < 1e-9


# -- refusals -----------------------------------------------------------------------------------------------


def test_a_state_off_equilibrium_is_refused_with_its_rates():
    point = dataclasses.replace(stuck_shaft(0.0), rates=np.array([0.0, 0.25]))
    with pytest.raises(NoEquilibrium, match=r"d\(shaft.speed\)/dt = 0.25") as caught:
        linearize(point, ["torque_reference"], ["shaft.speed"])
    assert caught.value.rates == {"shaft.speed": 0.25}


def test_a_torque_that_friction_does_not_balance_is_refused_with_the_rates():
    with pytest.raises(NoEquilibrium, match="no equilibrium found in this contact mode") as caught:
        trim(shaft_in_bearing(), "forward", inputs={"torque_reference": 3.0})
    assert set(caught.value.rates) == {"shaft.angle", "shaft.speed"}
    assert max(map(abs, caught.value.rates.values())) > 1


@pytest.mark.parametrize("torque", [1.6, -1.6])
def test_a_stuck_mode_beyond_its_limit_is_refused(torque):
    with pytest.raises(NoEquilibrium, match="does not hold at this operating point"):
        stuck_shaft(torque)


def test_a_drive_that_cannot_carry_its_load_is_refused():
    # with the aerodynamic stiffness it would come to rest where that carries the load, 5 rad away
    with pytest.raises(NoEquilibrium, match="torque and voltage limits"):
        trim(
            aileron(),
            "forward",
            inputs={"reference": 0.1, "load_torque": -300.0},
            parameters={"load.stiffness": 0.0},
        )


def shaft_model(inputs=("torque_reference",), outputs=("shaft.speed",), drifting=()):
    return linearize(stuck_shaft(0.0), inputs, outputs, drifting=drifting)


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: shaft_model(inputs=["torque_ref"]), "no input named 'torque_ref'; did you mean torque_reference"),
        (lambda: shaft_model(outputs=["shaftspeed"]), "no output named 'shaftspeed'; did you mean shaft.speed"),
        (lambda: trim(shaft_in_bearing(), "stuck", drifting=["angle"]), "no state named 'angle'; did you mean shaft."),
        (lambda: trim(shaft_in_bearing(), "sliding"), "no contact mode named 'sliding'; did you mean "),
        (lambda: trim(shaft_in_bearing(), {"gear.bearings.one": "stuck"}), f"did you mean {BEARING}"),
        (lambda: trim(shaft_in_bearing(), {}), f"no mode given for contact {BEARING}; each needs stuck, forward or"),
        (lambda: trim(shaft_in_bearing(), "forward", inputs={"torque": 1.0}), "no input named 'torque'; did you mean "),
        (
            lambda: loop_transfer(trim(mass_under_pid(), "forward"), "torque"),
            "no loop signal named 'torque'; did you mean torque_reference",
        ),
    ],
)
def test_an_unknown_name_is_refused_with_the_nearest_ones(ask, message):
    with pytest.raises(KeyError) as caught:
        ask()
    assert message in str(caught.value)


def test_an_unknown_drifting_state_is_refused():
    with pytest.raises(KeyError, match="shaft.angle"):
        shaft_model(drifting=["shaft.angel"])


def test_a_loop_signal_of_an_actuator_without_loops_is_refused_in_words():
    with pytest.raises(KeyError) as caught:
        loop_transfer(stuck_shaft(0.0), "position")
    assert "did you mean ?" not in str(caught.value)


def test_every_output_of_a_linear_model_keeps_its_name():
    model = linearize(
        trim(two_masses(0.0), "forward"), ["torque_reference"], ["motor_speed", "motor.speed", "load_speed"]
    )
    assert len(model.output_labels) == 3
