"""Does it hunt? A verdict from a run, with the cycle's period, amplitude and stick fraction."""

from dataclasses import dataclass

import numpy as np

from actuator.run import FREE, STUCK, Run

REST, HUNTING, LIMIT_CYCLE = "rest", "hunting", "limit cycle without sticking"
DIVERGING, IRREGULAR = "diverging", "irregular"

STILL = 1e-9  # rad; less motion than this is none
SAME = 0.02  # relative difference up to which two swings or two periods are the same
SWING = 0.1  # part of the largest late swing that counts as a turn
GROWS = 1.25  # from each eighth of the time to the next; the start of a step response grows by less
SETTLED = 1e-3  # part of all motion that is left in the last eighth of a settling load
DECAYED = 0.3  # part of the last swing that may be left for ever on the way to rest
FLAT = 0.01  # part of the least swing within which a plateau is level
GROWTH = 2.0  # factor over the observed time that is growth, and its inverse decay
STICKS = 1e-3  # part of a period at standstill from which a cycle is called hunting
SHORTEST = 20  # output points
FEWEST = 6  # swings from which a trend can be seen
LONGEST_PATTERN = 6  # swings after which a cycle must repeat


@dataclass(frozen=True, kw_only=True)
class Hunting:
    """What a run does once its inputs have stopped changing.

    Attributes
    ----------
    verdict : str
        "rest", "hunting" (a cycle with all contacts stuck for part of it), "limit cycle without sticking",
        "diverging" or "irregular".
    reason : str
        In a sentence, with the numbers it rests on.
    period_s, amplitude_rad, stick_fraction : float
        Of the cycle: period, half of peak to peak at the load, part of the period in which every contact
        is stuck; nan without a cycle.
    motor_amplitude_rad : float
        Half of peak to peak at the motor; nan without a cycle.
    """

    verdict: str
    reason: str
    period_s: float = float("nan")
    amplitude_rad: float = float("nan")
    stick_fraction: float = float("nan")
    motor_amplitude_rad: float = float("nan")

    @property
    def cycles(self) -> bool:
        """Whether it keeps moving periodically."""
        return self.verdict in (HUNTING, LIMIT_CYCLE)


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
        With `verdict` "irregular" where the run does not decide, and why.
    """
    start = _inputs_settled(run) if since is None else since
    keep = run.t >= start
    time, load = run.t[keep], run["load_angle"][keep]
    if len(time) < SHORTEST:
        return Hunting(
            verdict=IRREGULAR,
            reason=f"only {len(time)} output points after the last change of an input; simulate longer",
        )
    late = load[time >= (time[0] + time[-1]) / 2]
    if np.ptp(late) <= STILL:
        drifts = _drift(run, keep)
        if drifts:
            return Hunting(verdict=IRREGULAR, reason=f"the load stands still but {drifts}; simulate longer")
        return Hunting(verdict=REST, reason=f"the load moves less than {STILL:g} rad in the second half")
    turns = turning_points(load, SWING * np.ptp(late))
    swings, moments = np.abs(np.diff(load[turns])), time[turns]
    pattern = _pattern(swings, np.diff(moments), float(np.diff(time).max()))
    if pattern is None:
        away = _moves_away(run, keep)
        return _without_cycle(swings, load, time[-1] - time[0], _drift(run, keep), away)
    period, window = _period(run, time, load, moments[-1 - pattern], moments[-1])
    stuck = stuck_fraction(run, window[1] - period, window[1])
    cycle = (run.t >= window[1] - period) & (run.t <= window[1])
    return Hunting(
        verdict=HUNTING if stuck > STICKS else LIMIT_CYCLE,
        reason=f"swings of the load repeat after {pattern} turns, stuck for {stuck:.1%} of the period",
        period_s=period,
        amplitude_rad=float(np.ptp(run["load_angle"][cycle]) / 2),
        stick_fraction=stuck,
        motor_amplitude_rad=float(np.ptp(run["motor_angle"][cycle]) / 2),
    )


def turning_points(signal: np.ndarray, least: float) -> list[int]:
    """Indices at which the signal turns, each swing at least `least`; a plateau counts at its first point."""
    found, low, high, rising = [], 0, 0, None
    flat = FLAT * least
    for k in range(1, len(signal)):
        if signal[k] > signal[high] + flat:
            high = k
        if signal[k] < signal[low] - flat:
            low = k
        if rising is not False and signal[k] < signal[high] - least:
            found.append(high)
            low, rising = k, False
        elif rising is not True and signal[k] > signal[low] + least:
            found.append(low)
            high, rising = k, True
        if rising is True:
            low = k
        elif rising is False:
            high = k
    return found


def stuck_fraction(run: Run, start: float, end: float) -> float:
    """Part of the time from start to end in which every contact is stuck, from the times of the mode changes."""
    modes = {name: str(row[0]) for name, row in run.modes.items()}
    modes |= {change.contact: change.before for change in reversed(run.changes)}
    # a contact that never sticks (no friction, or in its gap) does not tell whether the others stand
    modes = {name: mode for name, mode in modes.items() if (run.modes[name] == STUCK).any()}
    if not modes:
        return 0.0
    stuck, at = 0.0, float(start)
    for change in run.changes:
        if change.time > end:
            break
        if change.time > at:
            stuck += (change.time - at) * all(mode in (STUCK, FREE) for mode in modes.values())
            at = change.time
        if change.contact in modes:
            modes[change.contact] = change.after
    stuck += (end - at) * all(mode in (STUCK, FREE) for mode in modes.values())
    return float(stuck / (end - start))


def _inputs_settled(run: Run) -> float:
    """Time of the last change of an input."""
    last = 0.0
    for quantity in run.system.inputs:
        values = run[quantity.name]
        changes = np.flatnonzero(values != values[-1])
        if changes.size:
            last = max(last, float(run.t[min(changes[-1] + 1, len(values) - 1)]))
    return last


def _pattern(swings: np.ndarray, times: np.ndarray, step: float) -> int | None:
    """Smallest even number of swings after which sizes and times repeat, twice over; None where they do not.

    Times are known to `step`, the distance of the output points.
    """
    for count in range(2, LONGEST_PATTERN + 1, 2):
        if len(swings) < 2 * count + 1:
            return None
        pairs = [(row[-count:], row[-2 * count : -count]) for row in (swings, times)]
        whole = times[-count:].sum()
        sizes_repeat = np.allclose(*pairs[0], rtol=SAME, atol=SAME * swings[-count:].max())
        times_repeat = np.allclose(*pairs[1], rtol=SAME, atol=SAME * whole + 2 * step)
        if sizes_repeat and times_repeat:
            return count
    return None


def _period(
    run: Run, time: np.ndarray, load: np.ndarray, start: float, end: float
) -> tuple[float, tuple[float, float]]:
    """Period and the window it was measured in, from upward passages of mid-swing before `end`."""
    rough = end - start
    window = (time >= end - 1.05 * rough) & (time <= end)
    middle = (load[window].max() + load[window].min()) / 2
    above = load > middle
    rises = np.flatnonzero(above[1:] & ~above[:-1])
    passages = time[rises] + (middle - load[rises]) / (load[rises + 1] - load[rises]) * (time[rises + 1] - time[rises])
    back = [last - passage for last in passages[-1:] for passage in passages[:-1]]
    near = min(back, key=lambda length: abs(length - rough), default=rough)
    return float(near), (float(end - near), float(end))


def _drift(run: Run, keep: np.ndarray) -> str:
    """The controller state that still moves behind a standing load, in words; empty where none does."""
    for quantity in run.system.states:
        if quantity.name.startswith("controller."):
            before, after = _pieces(run[quantity.name][keep], 4)[2:]
            if after > max(STILL * quantity.nominal, before / GROWTH):
                return f"{quantity.name} still moves, by {after:.3g} {quantity.unit} in the last quarter"
    return ""


def _moves_away(run: Run, keep: np.ndarray) -> bool:
    """Whether the load is farther from its reference in the last quarter than in the first; true without one."""
    if "reference" not in run.signals:
        return True
    error = np.abs(run["reference"] - run["load_angle"])[keep]
    quarter = max(len(error) // 4, 1)
    return bool(error[-quarter:].max() > error[:quarter].max())


def _pieces(signal: np.ndarray, count: int) -> list[float]:
    """Peak to peak in each of `count` equal pieces."""
    return [float(np.ptp(piece)) for piece in np.array_split(signal, count)]


def _without_cycle(swings: np.ndarray, load: np.ndarray, observed: float, drifts: str, away: bool) -> Hunting:
    *_, e5, e6, e7, e8 = _pieces(load, 8)
    if min(e6 / max(e5, STILL), e7 / max(e6, STILL), e8 / max(e7, STILL)) > GROWS and e5 > STILL and away:
        factor = e8 / e5
        return Hunting(
            verdict=DIVERGING, reason=f"the motion of the load grows, by a factor {factor:.3g} in {observed / 2:.3g} s"
        )
    if e8 < SETTLED * np.ptp(load) and e8 < e7 / GROWTH and not drifts:
        return Hunting(verdict=REST, reason=f"the load settles, to within {e8:.3g} rad in the last eighth")
    if len(swings) < FEWEST:
        why = f"but {drifts}" if drifts else "and does not settle"
        return Hunting(
            verdict=IRREGULAR,
            reason=f"the load turns only {len(swings) + 1} times in {observed:g} s {why}; simulate longer",
        )
    ratios = swings[1:] / swings[:-1]
    if (ratios[1 - FEWEST :] < 1 - 2 * SAME).all() and _limit(swings) < DECAYED * swings[-1]:
        total = swings[-1] / swings[-FEWEST]
        return Hunting(
            verdict=REST,
            reason=f"each swing of the load is smaller than the one before, the last {FEWEST} by {total:.3g}",
        )
    return Hunting(
        verdict=IRREGULAR,
        reason=f"{len(swings)} swings of the load in {observed:g} s neither repeat nor settle; simulate longer",
    )


def _limit(swings: np.ndarray) -> float:
    """Where shrinking swings are going, by Aitken's rule on every other one; a transient into a cycle shrinks, too."""
    early, late = swings[-3] - swings[-5], swings[-1] - swings[-3]
    return float(abs(swings[-1] - late**2 / (late - early))) if late != early else float("inf")
