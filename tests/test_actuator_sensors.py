"""Sensors and their noise against the published check of the generator, distributions, numpy, and counts by hand."""

import math

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import in_symbols, numbers
from scipy import stats

from actuator.parts.noise import MODULUS, WhiteNoise, following
from actuator.parts.sensors import AngleSensor, CurrentSensor, quantize
from actuator.system.parameters import parameterize

STEP = 2 * math.pi / 4096


def initial(sensor, *at):
    return [memory.initial for memory in sensor.memory(*at)]


def readings(sensor, values, *at):
    """What a sensor says to a row of true values, tick by tick."""
    memory, found = initial(sensor, *at), []
    for value in values:
        found.append(sensor.read(memory, value))
        memory = sensor.advance(memory, value)
    return np.array(found)


def draws(noise, count):
    state, found = noise.memory().initial, []
    for _ in range(count):
        found.append(noise.value(state))
        state = noise.advance(state)
    return np.array(found)


# -- noise --------------------------------------------------------------------------------------------


def test_generator_passes_the_check_of_its_publication():
    """Park & Miller: from a seed of 1, number 10 000 is 1043618065."""
    state = 1.0
    for _ in range(10_000):
        state = following(state)
    assert state == 1043618065


@settings(deadline=None, max_examples=100)
@given(state=st.integers(1, MODULUS - 1), rounding=numbers(-0.4, 0.4))
def test_generator_is_exact_in_double_precision_and_stands_rounding(state, rounding):
    assert following(float(state)) == 16807 * state % MODULUS
    assert following(state + rounding) == 16807 * state % MODULUS
    assert in_symbols(following, float(state)) == 16807 * state % MODULUS


@pytest.mark.parametrize(
    ("noise", "law"),
    [
        (WhiteNoise(distribution="uniform", seed=1), stats.uniform(-1, 2)),
        (WhiteNoise(distribution="normal", seed=1), stats.norm()),
        (WhiteNoise(distribution="normal", seed=7), stats.norm()),
    ],
    ids=("uniform", "normal", "normal, another seed"),
)
def test_noise_has_its_distribution_and_is_white(noise, law):
    sample = draws(noise, 10_000)
    assert stats.kstest(sample, law.cdf).pvalue > 0.01
    for lag in (1, 2, 3):
        assert abs(np.corrcoef(sample[lag:], sample[:-lag])[0, 1]) < 4 / math.sqrt(len(sample))


@pytest.mark.parametrize("distribution", ["uniform", "normal"])
def test_noises_of_neighboring_seeds_have_nothing_in_common(distribution):
    """States 1 and 2 would stay in the ratio 2 for ever, correlated by a half."""
    samples = [draws(WhiteNoise(distribution=distribution, seed=seed), 4000) for seed in range(4)]
    apart = np.corrcoef(samples)[np.triu_indices(4, 1)]
    assert np.abs(apart).max() < 4 / math.sqrt(4000)
    assert len(np.unique(samples)) == np.size(samples)  # nor is one the other, late


def test_normal_noise_takes_two_numbers_a_tick():
    noise = WhiteNoise(distribution="normal", seed=2)
    state, u = noise.memory().initial, []
    for _ in range(20):
        state = 16807 * state % MODULUS
        u.append(state / MODULUS)
    assert draws(noise, 10) == pytest.approx(np.sqrt(-2 * np.log(u[::2])) * np.cos(2 * np.pi * np.array(u[1::2])))


def test_the_same_seed_makes_the_same_noise_and_another_another():
    first, again, other = (draws(WhiteNoise(seed=seed), 50) for seed in (3, 3, 4))
    assert (first == again).all()
    assert (first != other).all()


@pytest.mark.parametrize("distribution", ["uniform", "normal"])
def test_noise_is_the_same_in_numbers_and_in_symbols(distribution):
    noise, state = WhiteNoise(distribution=distribution, seed=2), 123456789.0
    assert in_symbols(noise.value, state) == pytest.approx(noise.value(state), rel=1e-14)
    assert in_symbols(noise.advance, state) == noise.advance(state)


# -- angle --------------------------------------------------------------------------------------------

angles = numbers(-20, 20)


def test_ideal_sensors_say_the_truth_and_remember_nothing():
    for sensor in (AngleSensor(), CurrentSensor()):
        assert sensor.memory() == ()
        assert sensor.read([], 1.234) == 1.234
        assert sensor.advance([], 1.234) == []


@settings(deadline=None, max_examples=100)
@given(angle=angles)
def test_an_encoder_says_the_nearest_count(angle):
    measured = AngleSensor.of_counts(4096).read([], angle)
    assert abs(measured - angle) <= STEP / 2 * (1 + 1e-9)
    assert measured / STEP == pytest.approx(round(measured / STEP), abs=1e-9)
    assert quantize(angle, None) == angle


@settings(deadline=None, max_examples=50)
@given(angle=angles)
def test_offset_and_eccentricity_add_up_and_come_back_every_turn(angle):
    sensor = AngleSensor(offset=0.02, eccentricity=1e-3, eccentricity_phase=0.5)
    assert sensor.read([], angle) == pytest.approx(angle + 0.02 + 1e-3 * math.sin(angle + 0.5), abs=1e-14)
    assert sensor.read([], angle + 2 * math.pi) - sensor.read([], angle) == pytest.approx(2 * math.pi)


@pytest.mark.parametrize("delay", [1, 2, 5])
def test_a_delay_shifts_the_row_of_readings(delay):
    true = np.linspace(0.3, 4.0, 12)
    late = AngleSensor.of_counts(4096, offset=0.1, delay=delay)
    prompt = AngleSensor.of_counts(4096, offset=0.1)
    found = readings(late, true, 0.3)
    assert (found[delay:] == readings(prompt, true)[:-delay]).all()
    assert (found[:delay] == prompt.read([], 0.3)).all()
    assert [memory.name for memory in late.memory()] == [f"reading_{k}" for k in range(delay)]


def test_noise_is_added_before_the_count_and_delayed_with_it():
    white = WhiteNoise(distribution="uniform", seed=5)
    true = np.linspace(0.0, 1.0, 40)
    sensor = AngleSensor.of_counts(100, noise=0.05, white_noise=white, delay=2)
    step = 2 * math.pi / 100
    expected = step * np.floor((true + 0.05 * draws(white, 40)) / step + 0.5)
    assert readings(sensor, true)[2:] == pytest.approx(expected[:-2], abs=1e-12)
    assert [memory.name for memory in sensor.memory()] == ["noise", "reading_0", "reading_1"]


@pytest.mark.parametrize(("distribution", "rms"), [("uniform", 0.01 / math.sqrt(3)), ("normal", 0.01)])
def test_size_of_the_noise_is_its_bound_or_its_standard_deviation(distribution, rms):
    found = readings(AngleSensor(noise=0.01, white_noise=WhiteNoise(distribution=distribution)), np.zeros(10_000))
    assert found.std() == pytest.approx(rms, rel=0.02)
    assert abs(found.mean()) < 4 * rms / 100


def test_quantization_of_a_moving_angle_is_uniform_noise_of_its_step():
    """Resolution/sqrt(12), Widrow."""
    true = np.linspace(0, 10, 20_000)
    error = readings(AngleSensor(resolution=STEP), true) - true
    assert error.std() == pytest.approx(STEP / math.sqrt(12), rel=0.01)


# -- current ------------------------------------------------------------------------------------------


def test_current_sensor_has_gain_offset_and_steps():
    assert CurrentSensor(gain_error=0.01, offset=-0.2).read([], 10.0) == pytest.approx(9.9)
    assert CurrentSensor(resolution=0.25).read([], 1.1) == 1.0
    noisy = CurrentSensor(noise=0.3, white_noise=WhiteNoise(seed=9))
    assert readings(noisy, np.ones(20)) == pytest.approx(1 + 0.3 * draws(WhiteNoise(seed=9), 20))


# -- symbols and errors -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "sensor",
    [
        AngleSensor(resolution=1e-3, offset=0.1, eccentricity=0.01, delay=2, noise=0.02),
        CurrentSensor(gain_error=0.02, offset=0.1, resolution=1e-2, noise=0.1),
    ],
    ids=("angle", "current"),
)
def test_sensors_are_the_same_in_numbers_and_in_symbols(sensor):
    def tick(part, *memory):
        return [part.read(list(memory), 0.777), *part.advance(list(memory), 0.777)]

    at = initial(sensor)
    assert in_symbols(lambda *memory: tick(sensor, *memory), *at) == pytest.approx(tick(sensor, *at), rel=1e-14)
    copy, found = parameterize(sensor, "sensor")
    value = ca.Function("value", [p.symbol for p in found], [ca.vertcat(*tick(copy, *at))])(*(p.default for p in found))
    assert np.array(value).ravel() == pytest.approx(tick(sensor, *at), rel=1e-14)
    assert ("sensor.noise", "rad" if isinstance(sensor, AngleSensor) else "A") in [(p.name, p.unit) for p in found]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: AngleSensor(resolution=-1e-3), "AngleSensor.resolution must be > 0 rad, got -0.001 rad"),
        (lambda: AngleSensor(resolution=0.0), "AngleSensor.resolution must be > 0 rad, got 0 rad"),
        (lambda: AngleSensor(noise=-1.0), "AngleSensor.noise must be >= 0 rad, got -1 rad"),
        (lambda: AngleSensor(delay=-1), "AngleSensor.delay must be a whole number >= 0, got -1"),
        (lambda: AngleSensor(delay=0.5), "AngleSensor.delay must be a whole number >= 0, got 0.5"),
        (lambda: AngleSensor.of_counts(0), "AngleSensor: counts_per_turn must be a whole number >= 1, got 0"),
        (lambda: CurrentSensor(gain_error=-1.0), "CurrentSensor.gain_error must be > -1, got -1"),
        (lambda: CurrentSensor(resolution=-0.1), "CurrentSensor.resolution must be > 0 A, got -0.1 A"),
        (lambda: WhiteNoise(seed=-1), "WhiteNoise.seed must be a whole number >= 0, got -1"),
        (lambda: WhiteNoise(distribution="pink"), "WhiteNoise.distribution must be one of uniform, normal, got 'pink'"),
    ],
)
def test_sensors_without_meaning_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
