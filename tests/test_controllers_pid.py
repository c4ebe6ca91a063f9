"""P, PI, PID: poles found from the laws' own methods, control's prediction of the sampled loop, switches."""

import math

import control
import numpy as np
import pytest
from hypothesis import given, settings
from oracles import in_symbols, numbers

from controllers import PI, PID, IntegralRemedies, Memory, P
from controllers.integral import last_error, reversed_since

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
        return torque / inertia, law.rate_of_integral(state, -speed, torque, torque)

    assert np.poly(linear(rates, 2)) == polynomial_with(-bandwidth, -integral)


@settings(deadline=None, max_examples=50)
@given(resistance=numbers(1e-3, 1e2), inductance=numbers(1e-6, 1.0), bandwidth=bandwidths)
def test_current_loop_cancels_the_winding_and_leaves_one_pole(resistance, inductance, bandwidth):
    law = PI.for_winding(resistance=resistance, inductance=inductance, bandwidth=bandwidth)

    def rates(current, state, reference):
        error = reference - current
        voltage = law.proposed(state, error)
        return (voltage - resistance * current) / inductance, law.rate_of_integral(state, error, voltage, voltage)

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
        return speed, torque / inertia, law.rate_of_integral(state, -angle, torque, torque)

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


# -- anti-windup --------------------------------------------------------------------------------------

LAWS_WITH_INTEGRAL = (
    (PI(proportional=2.0, integral=8.0), 4.0),
    (PI(proportional=2.0, integral=8.0, back_calculation=50.0), 50.0),
    (PI(proportional=2.0, integral=0.0, back_calculation=10.0), 10.0),
    (PID(proportional=2.0, integral=8.0, derivative=0.1), 4.0),
    (PID(proportional=2.0, integral=8.0, derivative=0.1, back_calculation=50.0), 50.0),
)
integrating = pytest.mark.parametrize(("law", "rate"), LAWS_WITH_INTEGRAL, ids=str)
either = pytest.mark.parametrize(
    "make", [lambda **more: PI(proportional=2.0, integral=8.0, **more),
             lambda **more: PID(proportional=2.0, integral=8.0, derivative=0.1, **more)], ids=("PI", "PID")
)  # fmt: skip


@integrating
@settings(deadline=None, max_examples=20)
@given(state=numbers(-10, 10), error=numbers(-10, 10), proposed=numbers(-10, 10), realized=numbers(-10, 10))
def test_integral_follows_what_was_realized(law, rate, state, error, proposed, realized):
    free = law.rate_of_integral(state, error, proposed, proposed)
    assert free == pytest.approx(law.integral * error)
    pull = law.rate_of_integral(state, error, proposed, realized) - free
    assert pull == pytest.approx(rate * (realized - proposed), abs=1e-9)


@settings(deadline=None, max_examples=20)
@given(error=numbers(-10, 10), state=numbers(-10, 10), realized=numbers(-1, 1))
def test_saturated_integral_forgets_the_error_at_the_default_rate(error, state, realized):
    """state' = integral/proportional (realized - state): the time constant of the law itself."""
    law = PI(proportional=2.0, integral=8.0)
    assert law.rate_of_integral(state, error, law.proposed(state, error), realized) == pytest.approx(
        4.0 * (realized - state), abs=1e-9
    )


@either
@pytest.mark.parametrize(
    ("method", "proposed", "realized", "error", "integrates"),
    [
        ("clamping", 3.0, 3.0, 0.5, True),
        ("clamping", 3.0, 1.0, 0.5, False),
        ("clamping", 3.0, 1.0, -0.5, True),
        ("clamping", -3.0, -1.0, -0.5, False),
        ("clamping", -3.0, -1.0, 0.5, True),
        ("clamping", 3.0, 3.0 * (1 + 1e-15), -0.5, True),
        ("clamping", 3.0, 3.0 * (1 - 1e-15), 0.5, True),
        ("conditional", 3.0, 3.0, 0.5, True),
        ("conditional", 3.0, 1.0, 0.5, False),
        ("conditional", 3.0, 1.0, -0.5, False),
        ("conditional", -3.0, -1.0, 0.5, False),
        ("conditional", 3.0, 3.0 * (1 - 1e-15), 0.5, True),
    ],
)
def test_an_integral_that_is_switched_stands_still_where_its_method_says(
    make, method, proposed, realized, error, integrates
):
    law = make(anti_windup=method)
    assert law.rate_of_integral(7.0, error, proposed, realized) == (8.0 * error if integrates else 0.0)
    assert in_symbols(law.rate_of_integral, 7.0, error, proposed, realized) == [8.0 * error if integrates else 0.0]


def saturated_step(law, limit, period=1e-3):
    """Overshoot of a saturated speed loop with inertia 1 after a step of 1."""
    speed, state, top = 0.0, 0.0, 0.0
    for _ in range(40000):
        proposed = law.proposed(state, 1.0 - speed)
        torque = float(np.clip(proposed, -limit, limit))
        state = law.advance(state, 1.0 - speed, proposed, torque, period)
        speed += period * torque
        top = max(top, speed)
    assert speed == pytest.approx(1.0, abs=1e-9)
    return top - 1


def test_every_method_winds_up_less_than_none():
    laws = {
        method: PI(proportional=2.0, integral=8.0, anti_windup=method)
        for method in ("back-calculation", "clamping", "conditional")
    }
    none = saturated_step(PI(proportional=2.0, integral=8.0, back_calculation=0.0), 0.5)
    assert all(saturated_step(law, 0.5) < 0.5 * none for law in laws.values())


# -- set-point weighting ------------------------------------------------------------------------------


@settings(deadline=None, max_examples=30)
@given(share=numbers(0, 1), state=numbers(-5, 5), reference=numbers(-5, 5), measured=numbers(-5, 5))
def test_the_proportional_part_sees_a_share_of_the_reference(share, state, reference, measured):
    pi = PI(proportional=2.0, integral=8.0, setpoint_weight=share)
    pid = PID(proportional=2.0, integral=8.0, derivative=0.1, setpoint_weight=share)
    expected = pytest.approx(2.0 * (share * reference - measured) + state, abs=1e-12)
    assert pi.proposed(state, reference - measured, reference) == expected
    assert pid.proposed(state, reference - measured, 0.0, reference) == expected


def test_weight_one_and_no_weight_are_the_same():
    for weight in (None, 1.0):
        assert PI(proportional=2.0, integral=8.0, setpoint_weight=weight).proposed(0.3, 0.2, 5.0) == 2.0 * 0.2 + 0.3


@either
def test_a_weight_without_reference_is_refused(make):
    law = make(setpoint_weight=0.5)
    with pytest.raises(ValueError, match=f"{type(law).__name__}.proposed needs the reference"):
        law.proposed(*(0.0,) * (2 if isinstance(law, PI) else 3))


# -- sampled ------------------------------------------------------------------------------------------

PERIOD = 1e-3


def test_sampled_current_loop_is_controls_prediction():
    """PI by Euler's rule, kp + ki h/(z - 1), around a winding behind a zero-order hold."""
    law, resistance, inductance = PI.for_winding(resistance=0.5, inductance=1e-3, bandwidth=600.0), 0.5, 1e-3
    plant = control.c2d(control.tf([1], [inductance, resistance]), PERIOD, "zoh")
    rule = control.tf([law.proportional, law.integral * PERIOD - law.proportional], [1, -1], PERIOD)
    times = np.arange(60) * PERIOD
    expected = control.step_response(control.ss(control.feedback(plant * rule)), times).outputs
    decay = math.exp(-resistance / inductance * PERIOD)
    current, state, found = 0.0, 0.0, []
    for _ in times:
        found.append(current)
        voltage = law.proposed(state, 1.0 - current)
        state = law.advance(state, 1.0 - current, voltage, voltage, PERIOD)
        current = decay * current + (1 - decay) / resistance * voltage
    assert np.ptp(found) > 0.5
    assert found == pytest.approx(expected, abs=1e-11)


def test_sampled_pid_is_controls_prediction():
    """The derivative is that of the held measurement behind its lag, g (z - 1)/(z - exp(-h/T))."""
    law = PID.for_inertia(inertia=0.1, bandwidth=40.0, filter_time=2e-3)
    decay = math.exp(-PERIOD / 2e-3)
    plant = control.c2d(control.ss(control.tf([1], [0.1, 0, 0])), PERIOD, "zoh")
    derivative = control.tf(np.array([1, -1]) * law.derivative * (1 - decay) / PERIOD, [1, -decay], PERIOD)
    rule = control.tf([law.proportional, law.integral * PERIOD - law.proportional], [1, -1], PERIOD)
    loop = control.feedback(control.feedback(plant, control.ss(derivative)) * control.ss(rule))
    times = np.arange(200) * PERIOD
    expected = control.step_response(loop, times).outputs
    angle, speed, state, filtered, found = 0.0, 0.0, 0.0, 0.0, []
    for _ in times:
        found.append(angle)
        torque = law.proposed(state, 1.0 - angle, law.rate(angle, filtered, PERIOD))
        state = law.advance(state, 1.0 - angle, torque, torque, PERIOD)
        filtered = law.advance_filtered(angle, filtered, PERIOD)
        angle, speed = angle + PERIOD * speed + PERIOD**2 / 2 * torque / 0.1, speed + PERIOD * torque / 0.1
    assert np.ptp(found) > 1
    assert found == pytest.approx(expected, abs=1e-11)


@either
@settings(deadline=None, max_examples=20)
@given(state=numbers(-5, 5), error=numbers(-5, 5), proposed=numbers(-5, 5), realized=numbers(-5, 5))
def test_a_sample_is_an_euler_step(make, state, error, proposed, realized):
    law = make(remedies=IntegralRemedies(dead_band=0.5, leakage=3.0))
    step = law.advance(state, error, proposed, realized, 0.01) - state
    assert step == pytest.approx(0.01 * law.rate_of_integral(state, error, proposed, realized), abs=1e-12)


# -- remedies against stiction ------------------------------------------------------------------------


@either
@pytest.mark.parametrize(("error", "integrated"), [(0.05, 0.0), (-0.1, 0.0), (0.3, 0.2), (-0.3, -0.2)])
def test_an_error_inside_the_dead_band_is_not_integrated(make, error, integrated):
    law = make(remedies=IntegralRemedies(dead_band=0.1))
    assert law.rate_of_integral(1.0, error, 1.0, 1.0) == pytest.approx(8.0 * integrated)


@either
def test_a_leaking_integral_decays_at_its_rate(make):
    law = make(remedies=IntegralRemedies(leakage=3.0))
    assert law.rate_of_integral(2.0, 0.0, 1.0, 1.0) == pytest.approx(-6.0)


@either
def test_remedies_switched_off_change_nothing(make):
    plain, off = make(), make(remedies=IntegralRemedies())
    arguments = (0.3, 0.2, 0.1, 0.7)
    assert off.rate_of_integral(*arguments) == plain.rate_of_integral(*arguments)
    assert off.memory("N m", 2.0) == plain.memory("N m", 2.0) == (Memory("integral", "N m", 2.0),)


@either
def test_the_integral_starts_again_where_the_error_turns(make):
    law = make(remedies=IntegralRemedies(reset_on_reversal=True))
    assert [memory.name for memory in law.memory()] == ["integral", "last_error"]
    state, last, states = 0.0, 0.0, []
    for error in (1.0, 0.5, 0.0, -0.5, -1.0, 1.0, 1.0):
        state, last = law.advance(state, error, 0.0, 0.0, 0.25, last), last_error(last, error)
        states.append(state)
    # 2 per sample and unit of error; through zero the sign before it counts
    assert states == pytest.approx([2.0, 3.0, 3.0, 0.0, -2.0, 0.0, 2.0])


def test_reversal_is_the_same_in_symbols():
    for remembered, error in ((1.0, -1.0), (1.0, 2.0), (-1.0, 0.0), (0.0, 1.0)):
        assert in_symbols(reversed_since, remembered, error) == reversed_since(remembered, error)
        assert in_symbols(last_error, remembered, error) == last_error(remembered, error)


@either
def test_reset_on_reversal_is_refused_in_continuous_time_and_without_memory(make):
    law = make(remedies=IntegralRemedies(reset_on_reversal=True))
    with pytest.raises(ValueError, match=f"{type(law).__name__}: reset_on_reversal needs a sampled controller"):
        law.rate_of_integral(0.0, 1.0, 0.0, 0.0)
    with pytest.raises(ValueError, match=f"{type(law).__name__}.advance needs the last error"):
        law.advance(0.0, 1.0, 0.0, 0.0, 0.1)


# -- the same law in symbols, and errors --------------------------------------------------------------


@pytest.mark.parametrize(
    ("law", "values"),
    [
        (P(gain=3.0).output, (0.2,)),
        (PI(proportional=2.0, integral=8.0).proposed, (0.3, -0.2)),
        (PI(proportional=2.0, integral=8.0).rate_of_integral, (0.5, 0.3, -0.2, 0.1)),
        (PI(proportional=2.0, integral=8.0, setpoint_weight=0.3).proposed, (0.3, -0.2, 0.9)),
        (PID(proportional=2.0, integral=8.0, derivative=0.1).proposed, (0.3, -0.2, 5.0)),
        (PID(proportional=2.0, integral=8.0, derivative=0.1).rate_of_integral, (0.5, 0.3, -0.2, 0.1)),
        (PID(proportional=2.0, integral=8.0, derivative=0.1, filter_time=1e-3).rate, (0.3, 0.2)),
        (PID(proportional=2.0, integral=8.0, derivative=0.1, filter_time=1e-3).rate, (0.3, 0.2, 1e-3)),
        (
            PI(
                proportional=2.0,
                integral=8.0,
                remedies=IntegralRemedies(dead_band=0.1, leakage=1.0, reset_on_reversal=True),
            ).advance,
            (0.5, 0.3, -0.2, 0.1, 1e-3, 0.4),
        ),
    ],
)
def test_laws_are_the_same_in_numbers_and_in_symbols(law, values):
    assert in_symbols(law, *values) == pytest.approx(law(*values))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: P(gain=-1.0), "P.gain must be >= 0 1/s, got -1"),
        (lambda: PI(proportional=0.0, integral=1.0), "PI.proportional must be > 0 output/error, got 0"),
        (lambda: PI(proportional=1.0, integral=-1.0), r"PI.integral must be >= 0 output/\(error s\), got -1"),
        (lambda: PI(proportional=1.0, integral=1.0, limit=0.0), "PI.limit must be > 0 output, got 0"),
        (lambda: PI(proportional=1.0, integral=1.0, back_calculation=-1.0), "PI.back_calculation must be >= 0 1/s"),
        (
            lambda: PI(proportional=math.nan, integral=1.0),
            "PI.proportional must be a finite number .output/error., got nan",
        ),
        (
            lambda: PI(proportional=True, integral=1.0),
            "PI.proportional must be a finite number .output/error., got True",
        ),
        (
            lambda: PID(proportional=1.0, integral=1.0, derivative=1.0, filter_time=0.0),
            "PID.filter_time must be > 0 s, got 0",
        ),
        (
            lambda: PID(proportional=1.0, integral=1.0, derivative=1.0).rate(0.0, 0.0),
            r"PID.rate needs a filter_time \[s\]",
        ),
        (
            lambda: PI(proportional=1.0, integral=1.0, anti_windup="none"),
            """PI.anti_windup must be "back-calculation", "clamping" or "conditional", got 'none'""",
        ),
        (
            lambda: PI(proportional=1.0, integral=1.0, anti_windup="clamping", back_calculation=5.0),
            'PI.back_calculation 5 1/s has no meaning with anti_windup "clamping"',
        ),
        (
            lambda: PID(proportional=1.0, integral=1.0, derivative=1.0, setpoint_weight=1.5),
            "PID.setpoint_weight must be <= 1, got 1.5",
        ),
        (lambda: IntegralRemedies(dead_band=-0.1), "IntegralRemedies.dead_band must be >= 0 error, got -0.1 error"),
        (lambda: IntegralRemedies(leakage=-1.0), "IntegralRemedies.leakage must be >= 0 1/s, got -1 1/s"),
        (lambda: IntegralRemedies(reset_on_reversal=1), "reset_on_reversal must be True or False, got 1"),
    ],
)
def test_gains_without_meaning_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
