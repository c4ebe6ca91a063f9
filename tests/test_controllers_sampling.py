"""Sampling and scheduling: counts of ticks, numpy's interpolation, and what is said about tables that are none."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import in_symbols, numbers

from controllers import PI, PID, P, Sampling, ScheduledGain
from gear.quantities import Scalar

TABLE = ScheduledGain(over="temperature", points=(220.0, 260.0, 300.0), values=(2.0, 1.5, 1.0))


@settings(deadline=None, max_examples=50)
@given(base=numbers(1e-6, 1e-2), inner=st.integers(1, 50), outer=st.integers(1, 50))
def test_whole_multiples_nest(base, inner, outer):
    sampling = Sampling(current=base, speed=base * inner, position=base * inner * outer)
    assert sampling.base == base
    assert [sampling.every(loop) for loop in ("current", "speed", "position")] == [1, inner, inner * outer]


def test_a_single_loop_has_a_position_period_only():
    sampling = Sampling(position=1e-3, delay=0)
    assert (sampling.base, sampling.every("position"), sampling.delay) == (1e-3, 1, 0)


def test_a_loop_left_out_is_passed_over():
    sampling = Sampling(current=1e-4, position=3e-4)
    assert sampling.every("position") == 3


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: Sampling(current=1e-4, speed=2.5e-4, position=1e-3),
            "Sampling: periods must nest: speed 0.00025 s is 2.5 times current 0.0001 s; make it a whole multiple",
        ),
        (
            lambda: Sampling(current=1e-4, speed=2e-4, position=5e-4),
            "Sampling: periods must nest: position 0.0005 s is 2.5 times speed 0.0002 s; make it a whole multiple",
        ),
        (lambda: Sampling(current=1e-4, speed=0.5e-4), "speed 5e-05 s is 0.5 times current 0.0001 s"),
        (lambda: Sampling(current=1e-4, speed=1e-14), "speed 1e-14 s is 1e-10 times current 0.0001 s"),
        (lambda: Sampling(position=0.0), "Sampling.position must be > 0 s, got 0 s"),
        (Sampling, r"Sampling needs the period of at least one loop \[s\]"),
        (lambda: Sampling(position=1e-3, delay=2), "Sampling.delay must be 0 or 1 periods of the fastest loop, got 2"),
        (lambda: Sampling(position=1e-3, delay=True), "Sampling.delay must be 0 or 1 periods"),
        (lambda: Sampling(position=1e-3).every("current"), "Sampling has no period for 'current', only for position"),
        (
            lambda: ScheduledGain(over="load", points=(1.0, 2.0), values=(1.0,)),
            "ScheduledGain over load needs as many values as points, at least one, got 1 values and 2 points",
        ),
        (lambda: ScheduledGain(over="load", points=(), values=()), "got 0 values and 0 points"),
        (
            lambda: ScheduledGain(over="load", points=(1.0, 1.0), values=(1.0, 2.0)),
            "ScheduledGain over load: points must increase, got 1 before 1",
        ),
        (
            lambda: ScheduledGain(over="load", points=(1.0,), values=(0.0,)),
            "ScheduledGain over load: values must be > 0, got 0",
        ),
        (
            lambda: ScheduledGain(over="load", points=(float("nan"),), values=(1.0,)),
            "ScheduledGain over load: points must be finite numbers, got nan",
        ),
    ],
)
def test_periods_and_tables_without_meaning_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@settings(deadline=None, max_examples=50)
@given(value=numbers(150, 400))
def test_the_factor_is_interpolated_and_held_beyond_the_table(value):
    expected = pytest.approx(np.interp(value, TABLE.points, TABLE.values))
    assert TABLE.factor(value) == expected
    assert in_symbols(TABLE.factor, value) == expected


def test_one_point_is_a_constant():
    assert ScheduledGain(over="load", points=(1.0,), values=(3.0,)).factor(7.0) == 3.0


def test_a_whole_law_is_scheduled():
    assert TABLE.scale(P(gain=3.0), 260.0) == P(gain=4.5)
    assert TABLE.scale(PI(proportional=2.0, integral=8.0, limit=5.0), 220.0) == PI(
        proportional=4.0, integral=16.0, limit=5.0
    )
    assert TABLE.scale(PID(proportional=2.0, integral=8.0, derivative=0.1, filter_time=0.01), 220.0) == PID(
        proportional=4.0, integral=16.0, derivative=0.2, filter_time=0.01
    )


def test_a_scheduled_law_is_the_same_in_symbols():
    def output(temperature: Scalar, error: Scalar) -> Scalar:
        return TABLE.scale(PI(proportional=2.0, integral=8.0), temperature).proposed(0.1, error)

    assert in_symbols(output, 240.0, 0.3) == pytest.approx(output(240.0, 0.3)) == pytest.approx(0.1 + 3.5 * 0.3)
