"""Limited references: limits kept, no overshoot, the time of the bang-bang optimum, scipy for the continuous forms."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from oracles import in_symbols, numbers
from scipy.integrate import solve_ivp

from controllers import RateAndAccelerationLimit, RateLimit

targets = numbers(-10, 10).filter(lambda value: abs(value) > 1e-3)


def sampled(law, signal, count, period, memory):
    """Values and rates of the sampled form."""
    found = []
    for k in range(count):
        motion = law.motion(memory, signal(k), period)
        assert law.output(memory, signal(k), period=period) == motion.value
        memory = law.advance(memory, signal(k), period=period)
        found.append(motion)
    return np.array(found).T


def continuous(law, signal, times, memory):
    """Memory of the continuous form, rows by time."""
    solved = solve_ivp(
        lambda t, y: np.array(law.rates(list(y), signal), dtype=float),
        (0, times[-1]), memory, t_eval=times, rtol=1e-9, atol=1e-12, max_step=times[-1] / 500,
    )  # fmt: skip
    return solved.y


# -- rate -----------------------------------------------------------------------------------------------


def test_sampled_rate_limit_is_a_ramp_that_ends_on_the_input():
    value, rate, _ = sampled(RateLimit(rate=2.0), lambda k: 1.0, 12, 0.1, [0.0])
    assert value == pytest.approx(np.minimum(0.2 * np.arange(1, 13), 1.0), abs=1e-12)
    assert rate == pytest.approx([2.0] * 5 + [0.0] * 7, abs=1e-12)


@settings(deadline=None, max_examples=20)
@given(start=numbers(-5, 5), target=targets)
def test_continuous_rate_limit_is_a_ramp_that_ends_in_a_decay(start, target):
    """At rate until the distance is rate * time, then an exponential: along it, the law's rate is the slope."""
    law, times = RateLimit(rate=2.0, time=0.05), np.linspace(0, 3, 40)
    distance = abs(target - start)
    ramp = max((distance - 0.1) / 2.0, 0.0)
    left = np.where(
        times < ramp, distance - 2.0 * times, min(distance, 0.1) * np.exp(-np.maximum(times - ramp, 0) / 0.05)
    )
    slope = np.where(times < ramp, 2.0, left / 0.05)
    side = math.copysign(1, target - start)
    found = [law.rates([value], target)[0] for value in target - side * left]
    assert np.array(found, dtype=float) == pytest.approx(side * slope, abs=1e-9)


# -- rate and acceleration ------------------------------------------------------------------------------


@settings(deadline=None, max_examples=100)
@given(target=targets, rate=numbers(0.1, 20), acceleration=numbers(0.5, 200), samples=numbers(0.3, 150))
def test_sampled_reference_stops_on_the_input_within_its_limits(target, rate, acceleration, samples):
    law = RateAndAccelerationLimit(rate=rate, acceleration=acceleration)
    distance = abs(target)
    # triangle or trapezium of the rate, in continuous time
    fastest = min(rate, math.sqrt(acceleration * distance))
    optimum = distance / fastest + fastest / acceleration
    period, count = optimum / samples, math.ceil(samples) + 4
    value, speed, change = sampled(law, lambda k: target, count, period, [0.0, 0.0])
    assert np.abs(speed).max() <= rate * (1 + 1e-12)
    assert np.abs(change).max() <= acceleration * (1 + 1e-9)
    assert (value / target).max() <= 1 + 1e-12
    assert np.diff(value / target).min() >= -1e-12
    assert value[-1] == pytest.approx(target, rel=1e-9)  # at most four samples after the optimum


def test_sampled_reference_turns_for_an_input_that_jumps_while_it_moves():
    law = RateAndAccelerationLimit(rate=2.0, acceleration=10.0)
    value, speed, change = sampled(law, lambda k: 1.0 if k < 40 else -0.5, 300, 0.01, [0.0, 0.0])
    assert np.abs(speed).max() <= 2.0 + 1e-12
    assert np.abs(change).max() <= 10.0 + 1e-9
    assert value.min() >= -0.5 - 1e-12
    assert value[-1] == pytest.approx(-0.5, abs=1e-12)


def test_sampled_reference_stays_its_braking_distance_behind_a_ramp():
    """It could stop at once: 0.4, 0.3, 0.2 and 0.1 /s for one sample each."""
    law = RateAndAccelerationLimit(rate=2.0, acceleration=10.0)
    value, speed, _ = sampled(law, lambda k: 0.005 * k, 400, 0.01, [0.0, 0.0])
    assert 0.005 * np.arange(350, 400) - value[350:] == pytest.approx(np.full(50, 0.01))
    assert speed[350:] == pytest.approx(np.full(50, 0.5))


@settings(deadline=None, max_examples=10)
@given(target=targets, rate=numbers(0.2, 20), acceleration=numbers(1, 200))
def test_continuous_reference_stops_on_the_input_within_its_limits(target, rate, acceleration):
    law = RateAndAccelerationLimit(rate=rate, acceleration=acceleration, time=0.01)
    distance = abs(target)
    fastest = min(rate, math.sqrt(acceleration * distance))
    optimum = distance / fastest + fastest / acceleration
    value, speed = continuous(law, target, np.linspace(0, optimum + 0.5, 400), [0.0, 0.0])
    assert np.abs(speed).max() <= rate * (1 + 1e-6)
    assert (value / target).max() <= 1 + 1e-6
    assert value[-1] == pytest.approx(target, rel=1e-4)
    for y, v in zip(value, speed, strict=True):
        assert abs(law.motion([y, v], target).acceleration) <= acceleration * (1 + 1e-12)


def test_near_the_input_the_continuous_reference_has_both_poles_at_its_lag():
    law = RateAndAccelerationLimit(rate=1.0, acceleration=10.0, time=0.1)
    matrix = np.array([law.rates([1e-6 * a, 1e-6 * b], 0.0) for a, b in np.eye(2)]).T / 1e-6
    assert np.poly(matrix) == pytest.approx(np.poly([-10.0, -10.0]))


@pytest.mark.parametrize("law", [RateLimit(rate=2.0), RateAndAccelerationLimit(rate=2.0, acceleration=10.0)], ids=str)
@pytest.mark.parametrize("signal", [0.3, 0.3001, -4.0, 0.29])
def test_references_are_the_same_in_numbers_and_in_symbols(law, signal):
    memory = [0.3, -0.2][: len(law.memory("rad"))]

    def split(method):
        return lambda *values: method(list(values[: len(memory)]), *values[len(memory) :])

    for method, values in ((law.motion, (signal,)), (law.motion, (signal, 0.01)), (law.rates, (signal,)),
                           (law.advance, (signal, 0.01))):  # fmt: skip
        assert in_symbols(split(method), *memory, *values) == pytest.approx(split(method)(*memory, *values), abs=1e-12)


def test_memory_takes_the_unit_of_the_signal():
    assert [m.unit for m in RateAndAccelerationLimit(rate=2.0, acceleration=1.0).memory("rad")] == ["rad", "rad/s"]
    assert [m.unit for m in RateLimit(rate=2.0).memory("N m", 3.0)] == ["N m"]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: RateLimit(rate=0.0), "RateLimit.rate must be > 0 signal/s, got 0 signal/s"),
        (
            lambda: RateAndAccelerationLimit(rate=1.0, acceleration=-1.0),
            r"RateAndAccelerationLimit.acceleration must be > 0 signal/s\^2, got -1 signal/s\^2",
        ),
        (lambda: RateLimit(rate=1.0, time=0.0), "RateLimit.time must be > 0 s, got 0 s"),
    ],
)
def test_limits_without_meaning_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
