"""Observers: poles and transfer from their own methods, sampled against a plant integrated exactly over held inputs."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from oracles import in_symbols, numbers

from controllers import DisturbanceObserver, FilteredDerivative, PositionObserver

bandwidths, periods = numbers(1.0, 2000.0), numbers(1e-5, 1e-2)


def run(law, count, period, signals):
    memory, found = [0.0] * len(law.memory()), []
    for k in range(count):
        inputs = signals(k)
        found.append(law.output(memory, *inputs, period=period))
        memory = law.advance(memory, *inputs, period=period)
    return np.array(found, dtype=float)


# -- disturbance --------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=30)
@given(bandwidth=bandwidths, inertia=numbers(1e-5, 1e2), frequency=numbers(1.0, 1e4))
def test_the_estimate_is_the_disturbance_behind_one_lag_whatever_the_torque(bandwidth, inertia, frequency):
    """State w, z with inputs torque and d: d_hat/d = g/(s + g), d_hat/torque = 0."""
    law, s = DisturbanceObserver(inertia=inertia, bandwidth=bandwidth), 1j * frequency
    for torque, disturbance, expected in ((0.0, 1.0, bandwidth / (s + bandwidth)), (1.0, 0.0, 0.0)):
        speed = (torque + disturbance) / (inertia * s)
        by_memory = law.rates([1.0], 0.0, 0.0)[0]
        by_speed, by_torque = law.rates([0.0], 0.0, 1.0)[0], law.rates([0.0], 1.0, 0.0)[0]
        z = (by_speed * speed + by_torque * torque) / (s - by_memory)
        assert z + law.output([0.0], 0.0, 1.0) * speed == pytest.approx(expected, abs=1e-9)


@settings(deadline=None, max_examples=30)
@given(bandwidth=bandwidths, inertia=numbers(1e-3, 10), period=periods, level=numbers(-5, 5), seed=numbers(0, 100))
def test_sampled_estimate_of_a_step_is_the_exponential_of_the_continuous_one(bandwidth, inertia, period, level, seed):
    torque = np.random.default_rng(int(seed)).normal(size=40)
    speed = np.concatenate(([0.0], np.cumsum(period * (torque + level) / inertia)))
    law = DisturbanceObserver(inertia=inertia, bandwidth=bandwidth)
    found = run(law, 40, period, lambda k: (torque[k], speed[k]))
    assert found == pytest.approx(level * (1 - np.exp(-bandwidth * period * np.arange(40))), abs=1e-8)


# -- speed from position ------------------------------------------------------------------------------


@settings(deadline=None, max_examples=20)
@given(time=numbers(1e-4, 1.0), frequency=numbers(0.1, 1e4))
def test_filtered_derivative_is_a_derivative_with_one_lag(time, frequency):
    law, s = FilteredDerivative(time=time), 1j * frequency
    x = law.rates([0.0], 1.0)[0] / (s - law.rates([1.0], 0.0)[0])
    assert law.output([0.0], 1.0) + law.output([1.0], 0.0) * x == pytest.approx(s / (time * s + 1), rel=1e-9)


@settings(deadline=None, max_examples=20)
@given(time=numbers(1e-4, 1e-2), period=periods, speed=numbers(-10, 10))
def test_sampled_derivative_of_a_ramp_closes_on_its_slope_exponentially(time, period, speed):
    found = run(FilteredDerivative(time=time), 30, period, lambda k: (speed * period * k,))
    assert found == pytest.approx(speed * (1 - np.exp(-period / time * np.arange(30))), abs=1e-9)


@settings(deadline=None, max_examples=20)
@given(bandwidth=bandwidths)
def test_position_observer_has_both_poles_at_its_bandwidth(bandwidth):
    law = PositionObserver(bandwidth=bandwidth)
    matrix = np.array([law.rates(list(unit), 0.0) for unit in np.eye(2)]).T
    assert np.poly(matrix) == pytest.approx(np.poly([-bandwidth, -bandwidth]))


@settings(deadline=None, max_examples=20)
@given(bandwidth=bandwidths, period=periods)
def test_sampled_position_observer_has_both_poles_where_sampling_puts_them(bandwidth, period):
    law, pole = PositionObserver(bandwidth=bandwidth), math.exp(-bandwidth * period)
    matrix = np.array([law.advance(list(unit), 0.0, period=period) for unit in np.eye(2)], dtype=float).T
    assert np.poly(matrix) == pytest.approx(np.poly([pole, pole]), abs=1e-12)


def test_position_observer_has_no_lag_at_constant_speed():
    found = run(PositionObserver(bandwidth=300.0), 400, 1e-3, lambda k: (0.7 + 5e-3 * k,))
    assert found[-1] == pytest.approx(5.0, rel=1e-9)


@pytest.mark.parametrize(
    ("law", "inputs"),
    [
        (DisturbanceObserver(inertia=0.1, bandwidth=50.0), (0.4, 3.0)),
        (FilteredDerivative(time=1e-3), (0.4,)),
        (PositionObserver(bandwidth=100.0), (0.4,)),
    ],
    ids=str,
)
def test_observers_are_the_same_in_numbers_and_in_symbols(law, inputs):
    memory = [0.3, -0.2][: len(law.memory())]

    def split(method):
        return lambda *values: method(list(values[: len(memory)]), *values[len(memory) :])

    for method, values in ((law.output, inputs), (law.output, (*inputs, 1e-3)), (law.rates, inputs),
                           (law.advance, (*inputs, 1e-3))):  # fmt: skip
        assert in_symbols(split(method), *memory, *values) == pytest.approx(split(method)(*memory, *values))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: DisturbanceObserver(inertia=0.0, bandwidth=1.0), r"inertia must be > 0 kg m\^2, got 0 kg m\^2"),
        (lambda: FilteredDerivative(time=0.0), "FilteredDerivative.time must be > 0 s, got 0 s"),
        (lambda: PositionObserver(bandwidth=-1.0), "PositionObserver.bandwidth must be > 0 rad/s, got -1 rad/s"),
    ],
)
def test_observers_without_meaning_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
