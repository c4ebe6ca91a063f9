"""The duty of an actuator: reversals and travel, current and heat."""

import math
from dataclasses import dataclass

import numpy as np

from actuator.verdict.motion_record import MotionRecord
from actuator.verdict.peaks import find_turning_points

HOUR = 3600.0  # s
REVERSAL_SHARE = 0.1  # part of peak to peak that counts as a reversal
REPEATED = 3  # times a window is laid end to end: the first has no turn at its start
UNKNOWN = float("nan")


@dataclass(frozen=True, kw_only=True)
class Duty:
    """What a motion costs over a window of time; nan where a signal is not known.

    Attributes
    ----------
    load_reversals_per_h, motor_reversals_per_h : float
        [1/h].
    load_travel_per_h, motor_travel_per_h : float
        Way gone, forward and backward [rad/h].
    current_rms : float
        [A].
    mean_loss : float
        All heat of motor, inverter and gear [W].
    """

    load_reversals_per_h: float = UNKNOWN
    load_travel_per_h: float = UNKNOWN
    motor_reversals_per_h: float = UNKNOWN
    motor_travel_per_h: float = UNKNOWN
    current_rms: float = UNKNOWN
    mean_loss: float = UNKNOWN


def measure_duty(record: MotionRecord, start: float, end: float) -> Duty:
    """Duty from start to end [s]; of a cycle, over whole periods."""
    inside = record.time[(record.time > start) & (record.time < end)]
    if not inside.size:
        return Duty()
    time = np.array([start, *inside, end])

    def seen(signal: np.ndarray | None) -> np.ndarray | None:
        return None if signal is None else np.interp(time, record.time, signal)

    load, motor = (_motion(time, seen(signal), record.still) for signal in (record.load, record.motor))
    current, loss = seen(record.current), seen(record.loss)
    return Duty(
        load_reversals_per_h=load[0],
        load_travel_per_h=load[1],
        motor_reversals_per_h=motor[0],
        motor_travel_per_h=motor[1],
        current_rms=UNKNOWN if current is None else math.sqrt(_mean(time, current**2)),
        mean_loss=UNKNOWN if loss is None else _mean(time, loss),
    )


def _motion(time: np.ndarray, seen: np.ndarray | None, still: float) -> tuple[float, float]:
    """Reversals and travel per hour, of a window as if it were repeated: what turns at its ends turns once."""
    if seen is None:
        return UNKNOWN, UNKNOWN
    per_hour = HOUR / (time[-1] - time[0])
    if np.ptp(seen) <= still:
        return 0.0, 0.0
    rows = [seen[1:] + k * (seen[-1] - seen[0]) for k in range(REPEATED)]
    least = max(REVERSAL_SHARE * float(np.ptp(seen)), still)
    turns = [len(find_turning_points(np.concatenate(rows[:count]), least)) for count in (1, REPEATED)]
    travel = float(np.abs(np.diff(seen)).sum())
    return (turns[1] - turns[0]) / (REPEATED - 1) * float(per_hour), travel * float(per_hour)


def _mean(time: np.ndarray, signal: np.ndarray) -> float:
    return float(np.trapezoid(signal, time) / (time[-1] - time[0]))
