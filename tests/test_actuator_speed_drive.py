"""What a cascade asks of its speed loop: with a position loop, and without one, a speed drive.

Oracles: clipping; the step response of an inertia under PI control in closed form; where a deceived loop settles.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from oracles import PAPER_PAIR, numbers

from actuator import Actuator, Step, TorqueSource, simulate
from controllers import PI, Cascade, FeedForward, Knocker, P, RateLimit, Remedies, Sampling
from gear import Mesh, Shaft, Transmission

INERTIA, FAST, SLOW = 0.3, 40.0, 8.0
SPEED = PI.for_inertia(inertia=INERTIA, bandwidth=FAST, integral_bandwidth=SLOW)
CASCADE = Cascade(position=None, speed=SPEED, current=None, speed_limit=5.0)


def servo(controller, sampling=None):
    gear = Transmission(shafts={"arm": Shaft(inertia=INERTIA)}, input="arm", output="arm")
    return Actuator(motor=TorqueSource(), gear=gear, controller=controller, sampling=sampling)


GEARED = Transmission(
    shafts={"fast": Shaft(inertia=1e-3), "slow": Shaft(inertia=INERTIA)},
    meshes={"mesh": Mesh(a="fast", b="slow", pair=PAPER_PAIR)},
    input="fast",
    output="slow",
)
POSITION = replace(servo(replace(CASCADE, position=P(gain=5.0))), gear=GEARED).system()  # a wheel turns round: -3


@settings(deadline=None, max_examples=50)
@given(reference=numbers(-1, 1), angle=numbers(-1, 1))
def test_the_speed_reference_is_that_of_the_motor_and_limited(reference, angle):
    x, u = POSITION.state_vector({"fast.angle": -3 * angle}), POSITION.input_vector({"reference": reference})
    y = POSITION.outputs_function(x, [0.0] * len(POSITION.modes), u, POSITION.parameter_values()).full().ravel()
    found = dict(zip((output.name for output in POSITION.outputs), y, strict=True))
    assert found["speed_reference"] == pytest.approx(np.clip(-3 * 5.0 * (reference - angle), -5.0, 5.0), abs=1e-12)


@pytest.mark.parametrize(("asked", "given"), [(2.0, 2.0), (-3.0, -3.0), (9.0, 5.0)])
def test_a_step_of_speed_is_the_closed_form_within_the_speed_limit(asked, given):
    run = simulate(servo(CASCADE), 1.0, inputs={"speed_reference": asked}, compiled=False, tolerance=1e-9)
    expected = 1 + (FAST * np.exp(-FAST * run.t) - SLOW * np.exp(-SLOW * run.t)) / (SLOW - FAST)
    np.testing.assert_allclose(run["motor_speed"], given * expected, atol=1e-6)
    np.testing.assert_allclose(run["speed_error"], asked - run["motor_speed"], atol=1e-12)


def test_a_speed_drive_has_no_position_loop():
    system = servo(CASCADE).system()
    inputs, outputs = ({signal.name for signal in signals} for signals in (system.inputs, system.outputs))
    assert not inputs & {"reference", "inject.position", "inject.speed_reference"}
    assert not outputs & {"position", "position_error", "speed_reference"}


def test_its_sampling_has_no_position_period():
    sampled = servo(CASCADE, Sampling(speed=1e-3, delay=0))
    fine, coarse = (
        simulate(sampled, 0.5, inputs={"speed_reference": 1.0}, parameters={"sampling.speed": period}, compiled=False)
        for period in (1e-4, 1e-3)
    )
    continuous = simulate(servo(CASCADE), 0.5, inputs={"speed_reference": 1.0}, compiled=False)
    errors = [
        np.abs(np.interp(continuous.t, run.t, run["motor_speed"]) - continuous["motor_speed"]).max()
        for run in (fine, coarse)
    ]
    assert errors[1] < 0.05
    assert errors[0] < errors[1] / 5
    with pytest.raises(ValueError, match=r"loops of its controller \(speed\), got speed, position"):
        servo(CASCADE, Sampling(speed=1e-3, position=1e-3))


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"reference": RateLimit(rate=1.0)}, "reference"),
        ({"reference": RateLimit(rate=1.0), "feed_forward": FeedForward()}, "reference"),
        ({"remedies": Remedies(knocker=Knocker(amplitude=1.0, interval=0.1, width=0.01))}, "knocker"),
    ],
)
def test_parts_that_need_a_position_are_refused(change, name):
    with pytest.raises(ValueError, match=rf"without a position loop .* leave {name} out"):
        replace(CASCADE, **change)


@pytest.mark.parametrize(("feedback", "seen"), [("motor", 1.0), ("load", 0.0)])
def test_an_error_of_the_motor_s_angle_deceives_the_loop_that_is_closed_by_it(feedback, seen):
    cascade = replace(CASCADE, position=P(gain=5.0), feedback=feedback)
    inputs = {"reference": 0.3, "motor_angle_error": Step(time=0.1, after=0.02)}
    run = simulate(servo(cascade), 6.0, inputs=inputs, compiled=False, tolerance=1e-9)
    assert run["load_angle"][-1] == pytest.approx(0.3 - 0.02 * seen, abs=1e-6)
    assert run["position_error"][-1] == pytest.approx(0.02 * seen, abs=1e-6)
