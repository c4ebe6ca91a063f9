"""The thresholds of the verdict: a signal just below and just above each.

Oracle: the threshold itself, written here as a number, on motions made so that nothing else decides.
"""

import math

import numpy as np
import pytest

from actuator.verdict.duty import measure_duty
from actuator.verdict.motion_record import MotionRecord
from actuator.verdict.peaks import find_pattern, find_trend, find_turning_points, measure_period
from actuator.verdict.verdict import judge_motion

SPAN = 8.0  # s of the motions in eighths


def record(load, span=SPAN, stuck=0.0, **more):
    """A motion of the load alone over `span` seconds, with everything stuck for a share of it."""
    unknown = dict.fromkeys(("motor", "reference", "current", "loss"))
    time = np.linspace(0, span, len(load))
    return MotionRecord(
        time=time, load=np.asarray(load, float), stuck_share=lambda start, end: stuck, **unknown, **more
    )


def sine(cycles=20, points=100):
    return np.sin(2 * np.pi * np.arange(cycles * points + 1) / points)


def corners(values, points=40):
    """Straight lines through the values, each `points` long."""
    at = np.arange(len(values)) * points
    return np.interp(np.arange(at[-1] + 1), at, values)


def eighths(*ways):
    """A motion that goes these ways in the eight parts of its time."""
    return corners(np.concatenate([[0.0], np.cumsum(ways)]), points=50)


def ended(after):
    """A cycle of 1 s whose last whole swing happens at 9.25 s, and which is looked at until so long after it."""
    time = np.linspace(0, 9.25 + after, 4001)
    return record(np.cos(2 * np.pi * np.minimum(time, 10.0)), span=time[-1])


def rippled(dip):
    """A triangle of peak to peak 1 with a dip on its way up."""
    return corners(np.concatenate([*([0, 0.5, 0.5 - dip, 1.0] for _ in range(15)), [0]]))


UNEVEN = (0, 1, -0.6, 0.9, -0.8, 0.5, -1.0, 0.7)
DRIFT = {"drift": "controller.integral still drifts"}
STANDS = np.zeros(201)

VERDICTS = {  # below and above: the motion, and the verdict on it
    "stuck for 0.1 % of the period": (
        (record(sine(), stuck=0.9e-3), "limit cycle without sticking"),
        (record(sine(), stuck=1.1e-3), "hunting"),
    ),
    "3 counts of the sensor": (
        (record(sine(), resolution=2 / 2.9), "quantizer hunting"),
        (record(sine(), resolution=2 / 3.1), "limit cycle without sticking"),
    ),
    "a standstill that lasts 1000 times as long": (
        (record(STANDS, breakaway=0.95e3 * SPAN, **DRIFT), "undecided"),
        (record(STANDS, breakaway=1.05e3 * SPAN, **DRIFT), "rest"),
    ),
    "20 output points": ((record(np.zeros(19)), "undecided"), (record(np.zeros(20)), "rest")),
    "6 swings": ((record(corners(UNEVEN[:-1])), "undecided"), (record(corners(UNEVEN)), "irregular")),
    "settled to 0.1 % of all motion": (
        (record(eighths(1, 0, 0, 0, 0.1, 0.01, 2.5e-3, 1.05e-3)), "rest"),
        (record(eighths(1, 0, 0, 0, 0.1, 0.01, 2.5e-3, 1.2e-3)), "undecided"),
    ),
    "half as much from eighth to eighth": (
        (record(eighths(1, 0, 0, 0, 0.1, 0.01, 0.95e-3, 0.5e-3)), "undecided"),
        (record(eighths(1, 0, 0, 0, 0.1, 0.01, 1.05e-3, 0.5e-3)), "rest"),
    ),
    "growth by a quarter from eighth to eighth": (
        (record(eighths(*(1.23 ** np.arange(8)))), "undecided"),
        (record(eighths(*(1.27 ** np.arange(8)))), "diverging"),
    ),
    "1 nrad": (
        (record(eighths(1, 0, 0, 0, 0, 0, 0, 0.9e-9)), "rest"),
        (record(eighths(1, 0, 0, 0, 0, 0, 0, 1.2e-9)), "undecided"),
    ),
    "a last turn 1.25 periods ago": ((ended(1.2), "limit cycle without sticking"), (ended(1.3), "irregular")),
}


@pytest.mark.parametrize("side", [0, 1], ids=["below", "above"])
@pytest.mark.parametrize("name", VERDICTS)
def test_a_verdict_changes_at_its_threshold(name, side):
    motion, verdict = VERDICTS[name][side]
    found = judge_motion(motion)
    assert found.verdict == verdict, found.reason


@pytest.mark.parametrize(("dip", "turns", "reversals"), [(0.092, 2, 2), (0.108, 4, 4)])
def test_a_dip_of_a_tenth_is_a_turn_and_a_reversal(dip, turns, reversals):
    motion = record(rippled(dip), span=15.0)  # 15 cycles in 15 s
    assert f"repeat after {turns} turns" in judge_motion(motion).reason
    assert measure_duty(motion, 5.0, 10.0).load_reversals_per_h == pytest.approx(reversals * 3600, rel=1e-9)


@pytest.mark.parametrize(("rise", "first"), [(0.9e-2, 1), (1.1e-2, 2)])
def test_a_plateau_is_level_within_a_hundredth_of_the_least_swing(rise, first):
    assert find_turning_points(np.array([0.0, 1.0, 1.0 + 0.5 * rise, 0.0]), 0.5)[1] == first


@pytest.mark.parametrize(("period", "found"), [(1.018, 1.0), (1.024, 1.024)])
def test_passages_correct_a_period_by_up_to_two_percent(period, found):
    time = np.linspace(0, 1.1, 11_001)
    assert measure_period(time, np.sin(2 * np.pi * (time - 0.005)), 0.0, period) == pytest.approx(found, abs=2e-3)


@pytest.mark.parametrize(("count", "repeats"), [(6, True), (8, False)])
def test_a_pattern_has_up_to_six_swings(count, repeats):
    swings = np.tile(np.arange(1.0, 1.0 + count), 3)
    found = find_pattern(swings, np.ones(len(swings)), 0.01, 0.02)
    assert (found is not None) == repeats
    assert found is None or found.swings == count


@pytest.mark.parametrize(
    ("sizes", "goes_on"),
    [
        (0.5 ** np.arange(4), False),  # four periods show no trend
        (0.5 ** np.arange(5), True),
        (math.exp(-0.9e-3) ** np.arange(5), False),  # too slow to speak of
        (math.exp(-1.1e-3) ** np.arange(5), True),
    ],
)
def test_a_trend_needs_periods_and_a_rate(sizes, goes_on):
    assert (find_trend(sizes) != 1.0) == goes_on


@pytest.mark.parametrize(("left", "vanishes"), [(0.32, False), (0.28, True)])
def test_swings_vanish_where_less_than_three_tenths_are_left_in_the_end(left, vanishes):
    late, end = -0.5, math.log(left)  # logarithms of what the second half changes, and of all that is to come
    early = late * (1 + late / end)
    logarithms = np.array([-early, -early / 2, 0.0, late / 2, late])
    assert (find_trend(np.exp(logarithms)) != 1.0) == vanishes
