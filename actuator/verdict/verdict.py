"""Does it hunt? The verdict on a run or a measured log, and simulation until there is one."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from actuator.actuator import Actuator
from actuator.simulation.run import Run
from actuator.simulation.signals import Signal
from actuator.simulation.simulate import simulate
from actuator.system.hybrid import HybridSystem
from actuator.verdict.duty import Duty, measure_duty
from actuator.verdict.motion_record import GROWTH, STILL, MotionRecord, measure_swings, record_motion
from actuator.verdict.peaks import (
    DECAYED,
    Pattern,
    extrapolate_limit,
    find_pattern,
    find_trend,
    find_turning_points,
    measure_period,
    time_swings,
)


class Verdict(StrEnum):
    """What comes of a run or a measured log; its value is what is printed and kept in files."""

    REST = "rest"
    HUNTING = "hunting"  # a cycle with all contacts stuck for part of it
    LIMIT_CYCLE = "limit cycle without sticking"
    QUANTIZER = "quantizer hunting"  # a cycle of a sampled drive no larger than a few counts of its sensor
    DIVERGING = "diverging"
    IRREGULAR = "irregular"  # many swings that neither repeat nor settle
    FAILED = "failed"  # the simulation could not be completed
    UNDECIDED = "undecided"  # too short for a verdict


REST, HUNTING, LIMIT_CYCLE, QUANTIZER, DIVERGING, IRREGULAR, FAILED, UNDECIDED = Verdict
CYCLES = (HUNTING, LIMIT_CYCLE, QUANTIZER)
OPEN = (IRREGULAR, UNDECIDED)  # of which a longer run may tell more

TURN_SHARE = 0.1  # part of the largest late swing that counts as a turn
LATE_PARTS = (0.5, 0.25, 0.125)  # of the time that are "late": what a long transient hides, the last of them shows
LAST_TURN_PERIODS = 1.25  # within which the last turn must lie, or the cycle has ended
EIGHTH_GROWTH = 1.25  # from each eighth of the time to the next; the start of a step response grows by less
SETTLED = 1e-3  # part of all motion that is left in the last eighth of a settling load
STUCK_SHARE = 1e-3  # part of a period at standstill from which a cycle is called hunting
QUANTIZER_COUNTS = 3.0  # of the sensor, peak to peak, up to which a sampled drive hunts for its quantizer
STANDSTILL_LASTS = 1e3  # times the observed time that a standstill must last to be called rest in spite of a drift
FEWEST_POINTS = 20  # output points
FEWEST_SWINGS = 6  # from which a trend can be seen, and a cycle
LONGEST = 4.0  # times the first duration that is simulated in all, until there is a verdict


@dataclass(frozen=True, kw_only=True)
class Hunting:
    """What a run does once its inputs have stopped changing.

    Attributes
    ----------
    verdict : Verdict
        What comes of it.
    reason : str
        A sentence with the numbers that the verdict is based on.
    period_s, amplitude_rad, stick_fraction : float
        Of the cycle: period, half of peak to peak at the load, part of the period in which every contact
        is stuck; nan without a cycle.
    motor_amplitude_rad : float
        Half of peak to peak at the motor; nan without a cycle.
    standing_error_rad : float
        Reference less load, at the end of a run that rests and in the mean of a cycle; nan without a reference.
    longer_s : float
        How much longer to look [s] where the run is too short or irregular; nan where there is a verdict.
    breakaway_s : float
        When a contact breaks away that a drifting controller loads, after the end [s]; nan where none is known to.
    duty : Duty
        Reversals, travel, current and heat, over the period of a cycle or else the second half.
    """

    verdict: Verdict
    reason: str
    period_s: float = float("nan")
    amplitude_rad: float = float("nan")
    stick_fraction: float = float("nan")
    motor_amplitude_rad: float = float("nan")
    standing_error_rad: float = float("nan")
    longer_s: float = float("nan")
    breakaway_s: float = float("nan")
    duty: Duty = field(default_factory=Duty)

    @property
    def cycles(self) -> bool:
        """Whether it keeps moving periodically."""
        return self.verdict in CYCLES

    @property
    def decided(self) -> bool:
        """Whether it is clear what comes of it; a longer run may tell where it is not."""
        return self.verdict not in OPEN


def classify(run: Run, *, since: float | None = None) -> Hunting:
    """Judge a run for hunting.

    Turning points of the load position are what is looked at: swings that repeat, in size and in time, are
    a cycle; swings that shrink are on the way to rest; growing ones diverge. Several stops per period and
    asymmetric cycles repeat after more than two swings and are found as such.

    Parameters
    ----------
    run : Run
        At constant inputs for its larger part.
    since : float or None
        Time [s] from which on to look; None for the time of the last change of an input.

    Returns
    -------
    Hunting
        Where the run is too short or irregular, with how much longer it should be.
    """
    return judge_motion(record_motion(run, since))


def judge_motion(record: MotionRecord, *, again: str = "simulate longer") -> Hunting:
    """The verdict on a record; `again` is what to do where it does not decide."""
    time, load = record.time, record.load
    if len(time) < FEWEST_POINTS:
        why = f"only {len(time)} output points after the last change of an input; {again}"
        return Hunting(verdict=UNDECIDED, reason=why)
    half = (time[0] + time[-1]) / 2
    if np.ptp(load[time >= half]) <= record.still:
        return _standing(record, half, again)
    turns, times, found = _cycle(record)
    if found is None:
        return _without_cycle(record, turns, again)
    factor = find_trend(found.sizes)
    if factor != 1.0:
        return _of_trend(record, factor, len(found.sizes))
    end = float(times[-1])
    return _of_cycle(record, found, end - measure_period(time, load, float(times[-1 - found.swings]), end), end)


def _cycle(record: MotionRecord) -> tuple[list[int], np.ndarray, Pattern | None]:
    """Turning points, when its swings happen, and the pattern in which they repeat up to the end."""
    time, load, first = record.time, record.load, None
    step = float(np.diff(time).max())
    for part in LATE_PARTS:
        late = load[time >= time[-1] - part * (time[-1] - time[0])]
        turns = find_turning_points(load, max(TURN_SHARE * float(np.ptp(late)), record.still))
        first = turns if first is None else first
        times = time_swings(time, load, turns)
        found = find_pattern(np.abs(np.diff(load[turns])), np.diff(times), step, record.same)
        if found and time[-1] - times[-1] < LAST_TURN_PERIODS * (times[-1] - times[-1 - found.swings]) + step:
            return turns, times, found
    return first or [], np.zeros(0), None


def _of_cycle(record: MotionRecord, found: Pattern, start: float, end: float) -> Hunting:
    cycle = (record.time >= start) & (record.time <= end)
    swing, stuck = float(np.ptp(record.load[cycle])), record.stuck_share(start, end)
    verdict = HUNTING if stuck > STUCK_SHARE else LIMIT_CYCLE
    reason = f"swings of the load repeat after {found.swings} turns, stuck for {stuck:.1%} of the period"
    if 0 < swing <= QUANTIZER_COUNTS * record.resolution:
        verdict = QUANTIZER
        reason += f"; they are {swing / record.resolution:.2g} counts of the sensor, of {record.resolution:.3g} rad"
    return Hunting(
        verdict=verdict,
        reason=f"{reason}; {record.note}" if record.note else reason,
        period_s=end - start,
        amplitude_rad=swing / 2,
        stick_fraction=stuck,
        motor_amplitude_rad=math.nan if record.motor is None else float(np.ptp(record.motor[cycle]) / 2),
        standing_error_rad=_error(record, start, end),
        duty=measure_duty(record, start, end),
    )


def _error(record: MotionRecord, start: float, end: float) -> float:
    """Mean of reference less load; a single instant where both times are the same."""
    if record.reference is None:
        return math.nan
    window = (record.time >= start) & (record.time <= end)
    time, error = record.time[window], (record.reference - record.load)[window]
    return float(np.trapezoid(error, time) / (time[-1] - time[0])) if len(time) > 1 else float(error[-1])


def _standing(record: MotionRecord, half: float, again: str) -> Hunting:
    """A load that does not move."""
    time = record.time
    why = f"the load moves less than {record.still:g} rad in the second half"
    if record.drift and record.breakaway > STANDSTILL_LASTS * (time[-1] - time[0]):
        why += f"; {record.drift}, at which rate breakaway occurs after {record.breakaway:.2g} s"
    elif record.drift:
        why = f"the load stands still but {record.drift}"
        return _look_longer(record, UNDECIDED, why, again, (time[-1] - half) + _known(record.breakaway))
    return _at_rest(record, why)


def _at_rest(record: MotionRecord, reason: str, *, settled: bool = True) -> Hunting:
    """At rest, or on the way there; with the error that is left, and what holding costs."""
    time = record.time
    error = _error(record, float(time[-1]), float(time[-1])) if settled else math.nan
    if abs(error) > record.still:
        reason += f", {error:.3g} rad from its reference"
    return Hunting(
        verdict=REST,
        reason=f"{reason}; {record.note}" if record.note else reason,
        standing_error_rad=error,
        breakaway_s=record.breakaway,
        duty=measure_duty(record, float((time[0] + time[-1]) / 2), float(time[-1])),
    )


def _known(value: float) -> float:
    return value if math.isfinite(value) else 0.0


def _look_longer(record: MotionRecord, verdict: Verdict, why: str, again: str, swing: float) -> Hunting:
    """Undecided or irregular; `swing` is how long one more swing may take [s]."""
    observed = float(record.time[-1] - record.time[0])
    longer = max(observed, FEWEST_SWINGS * swing)
    reason = f"{why}; {again}, by about {longer:.2g} s"
    if math.isfinite(record.breakaway):
        reason += f" (at the present rate breakaway occurs after {record.breakaway:.3g} s)"
    return Hunting(verdict=verdict, reason=reason, longer_s=longer, breakaway_s=record.breakaway)


def _of_trend(record: MotionRecord, factor: float, periods: int) -> Hunting:
    if factor > 1:
        why = f"the motion of the load grows, by a factor {factor:.3g} in each of {periods} periods"
        return Hunting(verdict=DIVERGING, reason=why)
    why = f"the swings of the load shrink, by a factor {factor:.3g} in each of {periods} periods"
    return _at_rest(record, why, settled=False)


def _moves_away(record: MotionRecord) -> bool:
    """Whether the load is farther from its reference in the last quarter than in the first; true without one."""
    if record.reference is None:
        return True
    error = np.abs(record.reference - record.load)
    quarter = max(len(error) // 4, 1)
    return bool(error[-quarter:].max() > error[:quarter].max())


def _without_cycle(record: MotionRecord, turns: list[int], again: str) -> Hunting:
    load, still = record.load, max(STILL, record.still)
    observed = float(record.time[-1] - record.time[0])
    swings, turned = np.abs(np.diff(load[turns])), record.time[turns]
    *_, e5, e6, e7, e8 = measure_swings(load, 8)
    growth = min(e6 / max(e5, still), e7 / max(e6, still), e8 / max(e7, still))
    if growth > EIGHTH_GROWTH and e5 > still and _moves_away(record):
        factor = e8 / e5
        return Hunting(
            verdict=DIVERGING, reason=f"the motion of the load grows, by a factor {factor:.3g} in {observed / 2:.3g} s"
        )
    if e8 < max(SETTLED * np.ptp(load), record.still) and e8 <= max(e7 / GROWTH, record.still) and not record.drift:
        return _at_rest(record, f"the load settles, to within {e8:.3g} rad in the last eighth")
    if len(swings) < FEWEST_SWINGS:
        why = f"but {record.drift}" if record.drift else "and does not settle"
        last = turned[-1] if turns else record.time[0]
        waits = [*np.diff(turned), record.time[-1] - last + _known(record.breakaway)]
        why = f"the load turns only {len(swings) + 1} times in {observed:g} s {why}"
        return _look_longer(record, UNDECIDED, why, again, float(max(waits)))
    ratios = swings[1:] / swings[:-1]
    shrinks = (ratios[1 - FEWEST_SWINGS :] < 1 - 2 * record.same).all()
    if shrinks and extrapolate_limit(swings[-5::2]) < DECAYED * swings[-1]:
        total = swings[-1] / swings[-FEWEST_SWINGS]
        why = f"each swing of the load is smaller than the one before, the last {FEWEST_SWINGS} by {total:.3g}"
        return _at_rest(record, why, settled=False)
    why = f"{len(swings)} swings of the load in {observed:g} s neither repeat nor settle"
    return _look_longer(record, IRREGULAR, why, again, float(np.diff(turned).max()))


class Decision(NamedTuple):
    """The last run, and the verdict on it."""

    run: Run
    hunting: Hunting


def decide(
    plant: Actuator | HybridSystem,
    duration: float,
    *,
    inputs: Mapping[str, Signal | float] | None = None,
    longest: float = LONGEST,
    **options: Any,
) -> Decision:
    """Simulate, and where that does not decide, go on from there for as long as the verdict asks for.

    Parameters
    ----------
    plant, duration, inputs
        As for `simulate`.
    longest : float
        Times the duration that may be simulated in all; what is irregular or undecided then stays so.
    **options
        Of `simulate`.
    """
    run = simulate(plant, duration, inputs=inputs, **options)
    hunting, left = classify(run), (longest - 1) * duration
    while not hunting.decided and left > 0:
        more = min(hunting.longer_s, left)
        left -= more
        held = {quantity.name: float(run[quantity.name][-1]) for quantity in run.system.inputs}
        again: dict[str, Any] = options | {"start": run.state()}
        run = simulate(plant, more, inputs=held, **again)
        hunting = classify(run)
    return Decision(run, hunting)
