"""Feed-forward and remedies: closed forms at points, a mass that knocking frees, pulses counted by samples."""

import math

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from oracles import in_symbols, numbers

from controllers import Dither, FeedForward, FrictionCompensation, Knocker, dead_zone, direction, saturate

FEED_FORWARD = FeedForward(inertia=2.0, viscous=0.5, coulomb=3.0, speed_share=0.8, dead_band=0.1, width=0.4)
COMPENSATION = FrictionCompensation(coulomb=2.0, breakaway=3.0, standstill=0.1, width=0.01, dead_band=0.02)


# -- shapes -------------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=50)
@given(value=numbers(-10, 10), limit=numbers(1e-3, 5))
def test_limit_and_dead_zone_share_the_value(value, limit):
    assert saturate(value, limit) == np.clip(value, -limit, limit)
    assert dead_zone(value, limit) + saturate(value, limit) == pytest.approx(value, abs=1e-12)
    assert dead_zone(value, limit) * (abs(value) <= limit) == 0
    assert saturate(value, None) == value


@pytest.mark.parametrize(
    ("value", "expected"), [(0.05, 0), (0.1, 0), (0.3, 0.5), (0.5, 1), (9.0, 1), (-0.3, -0.5), (-9, -1)]
)
def test_direction_is_a_sign_with_slopes_behind_its_dead_band(value, expected):
    assert direction(value, 0.1, 0.4) == pytest.approx(expected)
    assert in_symbols(direction, value, 0.1, 0.4) == pytest.approx(expected)


@pytest.mark.parametrize(("band", "slope"), [(0.0, 1.0), (0.1, 0.0)])
def test_at_rest_a_dead_zone_has_the_slope_of_its_middle(band, slope):
    # at a band of zero both of its edges are there, where a slope may be anything in between
    value = ca.SX.sym("value")
    found = ca.Function("slope", [value], [ca.jacobian(dead_zone(value, band), value)])
    assert float(found(0.0)) == slope


# -- feed-forward -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("speed", "acceleration", "torque"),
    [(0.0, 0.0, 0.0), (0.05, 0.0, 0.025), (2.0, 0.0, 4.0), (-2.0, 0.0, -4.0), (2.0, 1.5, 7.0), (0.3, 0.0, 1.65)],
)
def test_feed_forward_is_inertia_viscous_and_dry_friction(speed, acceleration, torque):
    assert FEED_FORWARD.torque(speed, acceleration) == pytest.approx(torque)
    assert in_symbols(FEED_FORWARD.torque, speed, acceleration) == pytest.approx(torque)
    assert FEED_FORWARD.speed(speed) == pytest.approx(0.8 * speed)


def test_feed_forward_of_nothing_is_nothing():
    assert FeedForward().torque(3.0, 4.0) == 0
    assert FeedForward().speed(3.0) == 3.0


# -- friction compensation ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("speed", "error", "output"),
    [
        (0.0, 0.0, 0.0),
        (0.0, 0.02, 0.0),  # inside the dead band of the error
        (0.0, 0.025, 1.5),
        (0.0, 1.0, 3.0),
        (0.0, -1.0, -3.0),
        (5.0, -1.0, 2.0),  # moving: friction opposes the motion, whatever the error
        (-5.0, 1.0, -2.0),
        (0.05, 1.0, 2.5),
    ],
)
def test_compensation_boosts_at_standstill_and_follows_the_motion(speed, error, output):
    assert COMPENSATION.output(speed, error) == pytest.approx(output)
    assert in_symbols(COMPENSATION.output, speed, error) == pytest.approx(output)


# -- dither -------------------------------------------------------------------------------------------


def samples(law, count, period, *inputs):
    memory, found = [m.initial for m in law.memory()], []
    for _ in range(count):
        found.append(law.output(memory, *inputs, period=period))
        memory = law.advance(memory, *inputs, period=period)
    return np.array(found, dtype=float)


def test_sampled_sine_is_the_sine_also_after_many_cycles():
    law = Dither(amplitude=0.3, frequency=2 * math.pi * 80)
    found = samples(law, 20000, 1e-3)
    assert found == pytest.approx(0.3 * np.sin(2 * math.pi * 80 * 1e-3 * np.arange(20000)), abs=1e-9)


def test_sampled_square_spends_half_of_its_samples_on_each_side():
    found = samples(Dither(amplitude=0.3, frequency=2 * math.pi * 100, shape="square"), 20000, 1e-3)
    assert (found.reshape(-1, 10) == [0.3] * 5 + [-0.3] * 5).all()


def test_continuous_phase_runs_at_the_frequency():
    law = Dither(amplitude=0.3, frequency=7.0)
    assert law.rates([0.2]) == pytest.approx([7.0 / (2 * math.pi)])
    for time in (0.1, 1.0, 5.0):
        phase = time * law.rates([0.0])[0]
        assert law.output([phase]) == pytest.approx(0.3 * math.sin(7.0 * time))
        square = Dither(amplitude=0.3, frequency=7.0, shape="square")
        assert square.output([phase]) == math.copysign(0.3, math.sin(7.0 * time))


# -- knocker ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("error", "sign"), [(1.0, 1), (-1.0, -1), (0.1, 0), (-0.05, 0)])
def test_pulses_have_their_width_and_interval_and_the_direction_of_the_error(error, sign):
    law = Knocker(amplitude=0.5, width=3e-3, interval=0.02, dead_band=0.1)
    found = samples(law, 5000, 1e-3, error)
    assert (found.reshape(-1, 20) == [0.5 * sign] * 3 + [0.0] * 17).all()


def test_pulses_keep_their_width_where_their_samples_sum_up_with_rounding():
    """0.1 summed up eight times is just below 0.8."""
    found = samples(Knocker(amplitude=0.5, width=8e-3, interval=0.01), 5000, 1e-3, 1.0)
    assert (found.reshape(-1, 10) == [0.5] * 8 + [0.0] * 2).all()


def test_knocking_frees_a_mass_that_its_controller_does_not():
    """A mass that breaks away at 1.5 and slides at 1, pushed with 1.2."""

    def travel(law):
        position, speed, memory, period = 0.0, 0.0, [0.0], 1e-3
        for _ in range(1000):
            force = 1.2 + (0.0 if law is None else law.output(memory, 1.0, period=period))
            memory = [0.0] if law is None else law.advance(memory, 1.0, period=period)
            if speed > 0 or force > 1.5:
                speed = max(speed + period * (force - 1.0), 0.0)
            position += period * speed
        return position

    assert travel(None) == 0
    assert travel(Knocker(amplitude=0.2, width=2e-3, interval=0.1)) == 0
    assert travel(Knocker(amplitude=0.5, width=2e-3, interval=0.1)) > 0.05


@pytest.mark.parametrize("phase", [0.0, 0.1, 0.3, 0.5, 0.75, 0.9999999999])
def test_remedies_are_the_same_in_numbers_and_in_symbols(phase):
    sine = Dither(amplitude=0.3, frequency=7.0)
    square = Dither(amplitude=0.3, frequency=7.0, shape="square")
    knocker = Knocker(amplitude=0.5, width=3e-3, interval=0.02)
    for law in (sine, square):
        assert in_symbols(lambda x, law=law: law.output([x]), phase) == pytest.approx(law.output([phase]))
        assert in_symbols(lambda x, law=law: law.advance([x], period=0.1), phase) == pytest.approx(
            law.advance([phase], period=0.1)
        )
    assert in_symbols(lambda x, e: knocker.output([x], e), phase, -1.0) == pytest.approx(knocker.output([phase], -1.0))
    assert in_symbols(lambda x: knocker.advance([x], 1.0, period=1e-3), phase) == pytest.approx(
        knocker.advance([phase], 1.0, period=1e-3), abs=1e-12
    )


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: FeedForward(width=0.0), "FeedForward.width must be > 0 rad/s, got 0 rad/s"),
        (lambda: FeedForward(speed_share=1.1), "FeedForward.speed_share must be <= 1, got 1.1"),
        (
            lambda: FrictionCompensation(coulomb=-1.0, breakaway=1.0, standstill=0.1, width=1.0),
            "FrictionCompensation.coulomb must be >= 0 output, got -1 output",
        ),
        (lambda: Dither(amplitude=1.0, frequency=0.0), "Dither.frequency must be > 0 rad/s, got 0 rad/s"),
        (lambda: Dither(amplitude=1.0, frequency=1.0, shape="round"), 'Dither.shape must be "sine" or "square"'),
        (
            lambda: Dither(amplitude=1.0, frequency=4000.0).check_period(1e-3),
            "Dither of 4000 rad/s needs two samples a cycle, a period of at most 0.000785398 s, got 0.001 s",
        ),
        (
            lambda: Knocker(amplitude=1.0, width=0.1, interval=0.1),
            "Knocker needs width < interval, got width=0.1 s and interval=0.1 s",
        ),
        (
            lambda: Knocker(amplitude=1.0, width=1e-4, interval=0.1).check_period(1e-3),
            "Knocker: a pulse of 0.0001 s needs a period of at most that, got 0.001 s",
        ),
        (
            lambda: Knocker(amplitude=1.0, width=1e-4, interval=0.1).rates([0.0], 1.0),
            "Knocker needs a sampled controller",
        ),
    ],
)
def test_remedies_without_meaning_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_periods_that_are_fast_enough_are_taken():
    Dither(amplitude=1.0, frequency=3000.0).check_period(1e-3)
    Knocker(amplitude=1.0, width=1e-3, interval=0.1).check_period(1e-3)
