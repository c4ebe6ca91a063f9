"""Controllers against the poles they are designed for, found from the closed loop that their own methods make."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from oracles import in_symbols, numbers

from controllers import PI, PID, Cascade, P, limited

SERVO = {
    "position": 30.0,
    "speed": 200.0,
    "current": 2000.0,
    "inertia": 1e-4,
    "resistance": 0.5,
    "inductance": 1e-3,
    "speed_limit": 300.0,
}
inertias, bandwidths = numbers(1e-6, 1e2), numbers(0.1, 1e4)


def linear(rates, count):
    """Matrix of a linear law, from its values at the unit vectors."""
    return np.array([rates(*unit) for unit in np.eye(count)]).T


def polynomial_with(*poles):
    return pytest.approx(np.poly(poles), rel=1e-9)


# -- design rules -------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=50)
@given(inertia=inertias, bandwidth=bandwidths, integral=bandwidths)
def test_speed_loop_has_its_poles_at_both_bandwidths(inertia, bandwidth, integral):
    law = PI.for_inertia(inertia=inertia, bandwidth=bandwidth, integral_bandwidth=integral)

    def rates(speed, state):
        torque = law.proposed(state, -speed)
        return torque / inertia, law.derivative(-speed, torque, torque)

    assert np.poly(linear(rates, 2)) == polynomial_with(-bandwidth, -integral)


@settings(deadline=None, max_examples=50)
@given(resistance=numbers(1e-3, 1e2), inductance=numbers(1e-6, 1.0), bandwidth=bandwidths)
def test_current_loop_cancels_the_winding_and_leaves_one_pole(resistance, inductance, bandwidth):
    law = PI.for_winding(resistance=resistance, inductance=inductance, bandwidth=bandwidth)

    def rates(current, state, reference):
        voltage = law.proposed(state, reference - current)
        return (voltage - resistance * current) / inductance, law.derivative(reference - current, voltage, voltage)

    loop = linear(rates, 3)
    assert np.poly(loop[:, :2]) == polynomial_with(-bandwidth, -resistance / inductance)
    for frequency in bandwidth * np.array([0.1, 1.0, 10.0]):
        current, _ = np.linalg.solve(1j * frequency * np.eye(2) - loop[:, :2], loop[:, 2])
        assert current == pytest.approx(bandwidth / (1j * frequency + bandwidth), rel=1e-9)


@settings(deadline=None, max_examples=50)
@given(inertia=inertias, bandwidth=bandwidths)
def test_position_loop_has_all_poles_at_the_bandwidth(inertia, bandwidth):
    law = PID.for_inertia(inertia=inertia, bandwidth=bandwidth)

    def rates(angle, speed, state):
        torque = law.proposed(state, -angle, speed)
        return speed, torque / inertia, law.integral_derivative(-angle, torque, torque)

    assert np.poly(linear(rates, 3)) == polynomial_with(-bandwidth, -bandwidth, -bandwidth)


@settings(deadline=None, max_examples=20)
@given(bandwidth=bandwidths)
def test_proportional_position_loop_closes_at_the_bandwidth(bandwidth):
    law = P.for_bandwidth(bandwidth)
    assert linear(lambda angle: (law.output(-angle),), 1) == pytest.approx(-bandwidth)


@settings(deadline=None, max_examples=20)
@given(time=numbers(1e-5, 1.0), frequency=numbers(0.1, 1e4))
def test_filtered_rate_is_a_derivative_with_one_lag(time, frequency):
    law = PID(proportional=1.0, integral=0.0, derivative=1.0, filter_time=time)
    slope = linear(lambda measured, filtered: (law.rate(measured, filtered),), 2)[0]
    s = 1j * frequency
    filtered = slope[0] / (s - slope[1])  # z' = rate, per unit of the measured position
    assert slope @ [1, filtered] == pytest.approx(s / (time * s + 1), rel=1e-9)


def test_cascade_is_designed_loop_by_loop():
    cascade = Cascade.for_bandwidths(**SERVO)
    assert cascade.position == P.for_bandwidth(30.0)
    assert cascade.speed == PI.for_inertia(inertia=1e-4, bandwidth=200.0, integral_bandwidth=40.0)
    assert cascade.current == PI.for_winding(resistance=0.5, inductance=1e-3, bandwidth=2000.0)
    slower = Cascade.for_bandwidths(**SERVO, integral=5.0)
    assert slower.speed == PI.for_inertia(inertia=1e-4, bandwidth=200.0, integral_bandwidth=5.0)


# -- anti-windup --------------------------------------------------------------------------------------

LAWS_WITH_INTEGRAL = (
    (PI(proportional=2.0, integral=8.0), 4.0),
    (PI(proportional=2.0, integral=8.0, back_calculation=50.0), 50.0),
    (PI(proportional=2.0, integral=0.0, back_calculation=10.0), 10.0),
    (PID(proportional=2.0, integral=8.0, derivative=0.1), 4.0),
    (PID(proportional=2.0, integral=8.0, derivative=0.1, back_calculation=50.0), 50.0),
)
integrating = pytest.mark.parametrize(("law", "rate"), LAWS_WITH_INTEGRAL, ids=str)


def integral_rate(law, *arguments):
    return law.derivative(*arguments) if isinstance(law, PI) else law.integral_derivative(*arguments)


@integrating
@settings(deadline=None, max_examples=20)
@given(error=numbers(-10, 10), proposed=numbers(-10, 10), realized=numbers(-10, 10))
def test_integral_follows_what_was_realized(law, rate, error, proposed, realized):
    assert integral_rate(law, error, proposed, proposed) == pytest.approx(law.integral * error)
    pull = integral_rate(law, error, proposed, realized) - integral_rate(law, error, proposed, proposed)
    assert pull == pytest.approx(rate * (realized - proposed), abs=1e-9)


@settings(deadline=None, max_examples=20)
@given(error=numbers(-10, 10), state=numbers(-10, 10), realized=numbers(-1, 1))
def test_saturated_integral_forgets_the_error_at_the_default_rate(error, state, realized):
    """state' = integral/proportional (realized - state): the time constant of the law itself."""
    law = PI(proportional=2.0, integral=8.0)
    assert law.derivative(error, law.proposed(state, error), realized) == pytest.approx(
        4.0 * (realized - state), abs=1e-9
    )


# -- limits and the same law in symbols ---------------------------------------------------------------


@settings(deadline=None, max_examples=50)
@given(value=numbers(-10, 10), limit=numbers(1e-3, 5))
def test_limit_holds_the_value_on_both_sides(value, limit):
    assert limited(value, limit) == np.clip(value, -limit, limit)
    assert limited(value, None) == value


@settings(deadline=None, max_examples=20)
@given(error=numbers(-100, 100), ratio=numbers(-200, 200))
def test_speed_reference_is_that_of_the_motor_and_limited(error, ratio):
    cascade = Cascade.for_bandwidths(**SERVO)
    assert cascade.speed_reference(error, ratio) == pytest.approx(np.clip(30.0 * ratio * error, -300.0, 300.0))


@pytest.mark.parametrize(
    ("law", "values"),
    [
        (limited, (3.0, 2.0)),
        (P(gain=3.0).output, (0.2,)),
        (PI(proportional=2.0, integral=8.0).proposed, (0.3, -0.2)),
        (PI(proportional=2.0, integral=8.0).derivative, (0.3, -0.2, 0.1)),
        (PID(proportional=2.0, integral=8.0, derivative=0.1).proposed, (0.3, -0.2, 5.0)),
        (PID(proportional=2.0, integral=8.0, derivative=0.1).integral_derivative, (0.3, -0.2, 0.1)),
        (PID(proportional=2.0, integral=8.0, derivative=0.1, filter_time=1e-3).rate, (0.3, 0.2)),
        (Cascade.for_bandwidths(**SERVO).speed_reference, (0.5, 80.0)),
    ],
)
def test_laws_are_the_same_in_numbers_and_in_symbols(law, values):
    assert in_symbols(law, *values) == pytest.approx(law(*values))


# -- errors -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: P(gain=-1.0), "P.gain must be >= 0 1/s, got -1"),
        (lambda: PI(proportional=0.0, integral=1.0), "PI.proportional must be > 0 output/error, got 0"),
        (lambda: PI(proportional=1.0, integral=-1.0), r"PI.integral must be >= 0 output/\(error s\), got -1"),
        (lambda: PI(proportional=1.0, integral=1.0, limit=0.0), "PI.limit must be > 0 output, got 0"),
        (lambda: PI(proportional=1.0, integral=1.0, back_calculation=-1.0), "PI.back_calculation must be >= 0 1/s"),
        (lambda: PI(proportional=math.nan, integral=1.0), "PI.proportional must be > 0 output/error, got nan"),
        (lambda: PI(proportional=True, integral=1.0), "PI.proportional must be > 0 output/error, got True"),
        (
            lambda: PID(proportional=1.0, integral=1.0, derivative=1.0, filter_time=0.0),
            "PID.filter_time must be > 0 s, got 0",
        ),
        (lambda: Cascade.for_bandwidths(**SERVO | {"speed_limit": 0.0}), "Cascade.speed_limit must be > 0 rad/s"),
        (
            lambda: Cascade.for_bandwidths(**SERVO, feedback="output"),
            """Cascade.feedback must be "load" or "motor", got 'output'""",
        ),
    ],
)
def test_gains_without_meaning_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
