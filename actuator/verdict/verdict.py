"""Does it hunt? A verdict from a run or a measured log, with the cycle's period, amplitude, stick fraction and wear."""

import math
from dataclasses import dataclass, field

import numpy as np

from actuator.simulation.run import Run
from actuator.verdict.duty import Wear, wear
from actuator.verdict.motion_record import GROWTH, STILL, Trace, pieces, trace_of
from actuator.verdict.peaks import DECAYED, Pattern, limit_of, moments, pattern, period_of, trend, turning_points

REST, HUNTING, LIMIT_CYCLE = "rest", "hunting", "limit cycle without sticking"
QUANTIZER, DIVERGING, IRREGULAR = "quantizer hunting", "diverging", "irregular"
VERDICTS = (REST, HUNTING, LIMIT_CYCLE, QUANTIZER, DIVERGING, IRREGULAR)

SWING = 0.1  # part of the largest late swing that counts as a turn
PARTS = (0.5, 0.25, 0.125)  # of the time that are "late": what a long transient hides, the last of them shows
PRESENT = 1.25  # periods within which the last turn must lie, or the cycle has ended
GROWS = 1.25  # from each eighth of the time to the next; the start of a step response grows by less
SETTLED = 1e-3  # part of all motion that is left in the last eighth of a settling load
STICKS = 1e-3  # part of a period at standstill from which a cycle is called hunting
QUANTA = 3.0  # counts of the sensor, peak to peak, up to which a sampled drive hunts for its quantizer
LASTS = 1e3  # times the observed time that a standstill must last to be called rest in spite of a drift
SHORTEST = 20  # output points
FEWEST = 6  # swings from which a trend can be seen, and a cycle


@dataclass(frozen=True, kw_only=True)
class Hunting:
    """What a run does once its inputs have stopped changing.

    Attributes
    ----------
    verdict : str
        "rest", "hunting" (a cycle with all contacts stuck for part of it), "limit cycle without sticking",
        "quantizer hunting" (a cycle of a sampled drive no larger than a few counts of its sensor), "diverging" or
        "irregular".
    reason : str
        In a sentence, with the numbers it rests on.
    period_s, amplitude_rad, stick_fraction : float
        Of the cycle: period, half of peak to peak at the load, part of the period in which every contact
        is stuck; nan without a cycle.
    motor_amplitude_rad : float
        Half of peak to peak at the motor; nan without a cycle.
    standing_error_rad : float
        Reference less load, at the end of a run that rests and in the mean of a cycle; nan without a reference.
    longer_s : float
        How much longer to look [s] where the run does not decide; nan where it does.
    release_s : float
        When a contact that a drifting controller loads lets go, after the end [s]; nan where none is known to.
    wear : Wear
        Reversals, travel, current and heat, over the period of a cycle or else the second half.
    """

    verdict: str
    reason: str
    period_s: float = float("nan")
    amplitude_rad: float = float("nan")
    stick_fraction: float = float("nan")
    motor_amplitude_rad: float = float("nan")
    standing_error_rad: float = float("nan")
    longer_s: float = float("nan")
    release_s: float = float("nan")
    wear: Wear = field(default_factory=Wear)

    @property
    def cycles(self) -> bool:
        """Whether it keeps moving periodically."""
        return self.verdict in (HUNTING, LIMIT_CYCLE, QUANTIZER)

    @property
    def decided(self) -> bool:
        """Whether the run is long and regular enough for a verdict."""
        return self.verdict != IRREGULAR


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
        With `verdict` "irregular" where the run does not decide, why, and how much longer it should be.
    """
    return judge(trace_of(run, since))


def judge(trace: Trace, *, again: str = "simulate longer") -> Hunting:
    """The verdict on a trace; `again` is what to do where it does not decide."""
    time, load = trace.time, trace.load
    if len(time) < SHORTEST:
        why = f"only {len(time)} output points after the last change of an input; {again}"
        return Hunting(verdict=IRREGULAR, reason=why)
    half = (time[0] + time[-1]) / 2
    if np.ptp(load[time >= half]) <= trace.still:
        return _standing(trace, half, again)
    turns, times, found = _cycle(trace)
    if found is None:
        return _without_cycle(trace, turns, again)
    factor = trend(found.sizes)
    if factor != 1.0:
        return _of_trend(trace, factor, len(found.sizes))
    end = float(times[-1])
    return _of_cycle(trace, found, end - period_of(time, load, float(times[-1 - found.swings]), end), end)


def _cycle(trace: Trace) -> tuple[list[int], np.ndarray, Pattern | None]:
    """Turning points, when its swings happen, and the pattern in which they repeat up to the end."""
    time, load, first = trace.time, trace.load, None
    step = float(np.diff(time).max())
    for part in PARTS:
        late = load[time >= time[-1] - part * (time[-1] - time[0])]
        turns = turning_points(load, max(SWING * float(np.ptp(late)), trace.still))
        first = turns if first is None else first
        times = moments(time, load, turns)
        found = pattern(np.abs(np.diff(load[turns])), np.diff(times), step, trace.same)
        if found and time[-1] - times[-1] < PRESENT * (times[-1] - times[-1 - found.swings]) + step:
            return turns, times, found
    return first or [], np.zeros(0), None


def _of_cycle(trace: Trace, found: Pattern, start: float, end: float) -> Hunting:
    cycle = (trace.time >= start) & (trace.time <= end)
    swing, stuck = float(np.ptp(trace.load[cycle])), trace.standing(start, end)
    verdict = HUNTING if stuck > STICKS else LIMIT_CYCLE
    reason = f"swings of the load repeat after {found.swings} turns, stuck for {stuck:.1%} of the period"
    if 0 < swing <= QUANTA * trace.resolution:
        verdict = QUANTIZER
        reason += f"; they are {swing / trace.resolution:.2g} counts of the sensor, of {trace.resolution:.3g} rad"
    return Hunting(
        verdict=verdict,
        reason=f"{reason}; {trace.note}" if trace.note else reason,
        period_s=end - start,
        amplitude_rad=swing / 2,
        stick_fraction=stuck,
        motor_amplitude_rad=math.nan if trace.motor is None else float(np.ptp(trace.motor[cycle]) / 2),
        standing_error_rad=_error(trace, start, end),
        wear=wear(trace, start, end),
    )


def _error(trace: Trace, start: float, end: float) -> float:
    """Mean of reference less load; a single instant where both times are the same."""
    if trace.reference is None:
        return math.nan
    window = (trace.time >= start) & (trace.time <= end)
    time, error = trace.time[window], (trace.reference - trace.load)[window]
    return float(np.trapezoid(error, time) / (time[-1] - time[0])) if len(time) > 1 else float(error[-1])


def _standing(trace: Trace, half: float, again: str) -> Hunting:
    """A load that does not move."""
    time = trace.time
    why = f"the load moves less than {trace.still:g} rad in the second half"
    if trace.drift and trace.release > LASTS * (time[-1] - time[0]):
        why += f"; {trace.drift}, at which rate a contact lets go after {trace.release:.2g} s"
    elif trace.drift:
        why = f"the load stands still but {trace.drift}"
        return _undecided(trace, why, again, (time[-1] - half) + _known(trace.release))
    return _at_rest(trace, why)


def _at_rest(trace: Trace, reason: str, *, settled: bool = True) -> Hunting:
    """At rest, or on the way there; with the error that is left, and what holding costs."""
    time = trace.time
    error = _error(trace, float(time[-1]), float(time[-1])) if settled else math.nan
    if abs(error) > trace.still:
        reason += f", {error:.3g} rad from its reference"
    return Hunting(
        verdict=REST,
        reason=f"{reason}; {trace.note}" if trace.note else reason,
        standing_error_rad=error,
        release_s=trace.release,
        wear=wear(trace, float((time[0] + time[-1]) / 2), float(time[-1])),
    )


def _known(value: float) -> float:
    return value if math.isfinite(value) else 0.0


def _undecided(trace: Trace, why: str, again: str, swing: float) -> Hunting:
    """Irregular; `swing` is how long one more swing may take [s]."""
    observed = float(trace.time[-1] - trace.time[0])
    longer = max(observed, FEWEST * swing)
    reason = f"{why}; {again}, by about {longer:.2g} s"
    if math.isfinite(trace.release):
        reason += f" (at the present rate a contact lets go after {trace.release:.3g} s)"
    return Hunting(verdict=IRREGULAR, reason=reason, longer_s=longer, release_s=trace.release)


def _of_trend(trace: Trace, factor: float, periods: int) -> Hunting:
    if factor > 1:
        why = f"the motion of the load grows, by a factor {factor:.3g} in each of {periods} periods"
        return Hunting(verdict=DIVERGING, reason=why)
    why = f"the swings of the load shrink, by a factor {factor:.3g} in each of {periods} periods"
    return _at_rest(trace, why, settled=False)


def _moves_away(trace: Trace) -> bool:
    """Whether the load is farther from its reference in the last quarter than in the first; true without one."""
    if trace.reference is None:
        return True
    error = np.abs(trace.reference - trace.load)
    quarter = max(len(error) // 4, 1)
    return bool(error[-quarter:].max() > error[:quarter].max())


def _without_cycle(trace: Trace, turns: list[int], again: str) -> Hunting:
    load, still = trace.load, max(STILL, trace.still)
    observed = float(trace.time[-1] - trace.time[0])
    swings, turned = np.abs(np.diff(load[turns])), trace.time[turns]
    *_, e5, e6, e7, e8 = pieces(load, 8)
    if min(e6 / max(e5, still), e7 / max(e6, still), e8 / max(e7, still)) > GROWS and e5 > still and _moves_away(trace):
        factor = e8 / e5
        return Hunting(
            verdict=DIVERGING, reason=f"the motion of the load grows, by a factor {factor:.3g} in {observed / 2:.3g} s"
        )
    if e8 < max(SETTLED * np.ptp(load), trace.still) and e8 <= max(e7 / GROWTH, trace.still) and not trace.drift:
        return _at_rest(trace, f"the load settles, to within {e8:.3g} rad in the last eighth")
    if len(swings) < FEWEST:
        why = f"but {trace.drift}" if trace.drift else "and does not settle"
        waits = [*np.diff(turned), trace.time[-1] - (turned[-1] if turns else trace.time[0]) + _known(trace.release)]
        why = f"the load turns only {len(swings) + 1} times in {observed:g} s {why}"
        return _undecided(trace, why, again, float(max(waits)))
    ratios = swings[1:] / swings[:-1]
    if (ratios[1 - FEWEST :] < 1 - 2 * trace.same).all() and limit_of(swings[-5::2]) < DECAYED * swings[-1]:
        total = swings[-1] / swings[-FEWEST]
        why = f"each swing of the load is smaller than the one before, the last {FEWEST} by {total:.3g}"
        return _at_rest(trace, why, settled=False)
    why = f"{len(swings)} swings of the load in {observed:g} s neither repeat nor settle"
    return _undecided(trace, why, again, float(np.diff(turned).max()))
