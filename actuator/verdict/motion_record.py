"""What is looked at to say whether something hunts: the motion of a run or of a measured log, in the same form."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from actuator.simulation.run import Run
from gear.quantities.roles import ControllerMemory, Heat, Resolution, SensorOf

STILL = 1e-9  # rad; less motion than this is none
SAME = 0.02  # relative difference up to which two swings or two periods of a run are the same
GROWTH = 2.0  # factor over the observed time that is growth, and its inverse decay
QUARTERS = 4  # of the time: a drift is a motion in the last that is no smaller than in the one before


@dataclass(frozen=True, kw_only=True)
class MotionRecord:
    """Motion since the inputs stopped changing.

    Attributes
    ----------
    time, load : ndarray, (n,)
        [s], [rad].
    motor, reference, current, loss : ndarray, (n,), or None
        [rad], [rad], [A], [W]; None where they are not known.
    stuck_share : callable
        Part of the time from start to end [s] in which nothing moves.
    still : float
        Motion [rad] that is none.
    same : float
        Relative difference up to which two swings or two periods are the same.
    resolution : float
        Of a sampled position [rad at the load]; zero where it is not.
    drift : str
        What still drifts behind a load at rest, in words; empty where nothing does.
    breakaway : float
        Time [s] after which a contact breaks away at the present rate; nan where none does.
    note : str
        How standing still was told from moving; empty where it is known.
    """

    time: np.ndarray
    load: np.ndarray
    motor: np.ndarray | None
    reference: np.ndarray | None
    current: np.ndarray | None
    loss: np.ndarray | None
    stuck_share: Callable[[float, float], float]
    still: float = STILL
    same: float = SAME
    resolution: float = 0.0
    drift: str = ""
    breakaway: float = float("nan")
    note: str = ""


def record_motion(run: Run, since: float | None = None) -> MotionRecord:
    """The record of a run from a time [s] on; None for the time of the last change of an input."""
    keep = run.t >= (_inputs_settled(run) if since is None else since)
    losses = [run[quantity.name][keep] for quantity in run.system.signals_having(Heat)]

    def part(name: str) -> np.ndarray | None:
        return run[name][keep] if name in run.signals else None

    drift, breakaway = _drift(run, keep)
    return MotionRecord(
        time=run.t[keep],
        load=run["load_angle"][keep],
        motor=part("motor_angle"),
        reference=part("reference"),
        current=part("current"),
        loss=np.sum(losses, axis=0) if losses else None,
        stuck_share=run.stuck_share,
        resolution=_resolution(run),
        drift=drift,
        breakaway=breakaway,
    )


def measure_swings(signal: np.ndarray, count: int) -> list[float]:
    """Peak to peak in each of `count` equal pieces."""
    return [float(np.ptp(piece)) for piece in np.array_split(signal, count)]


def find_last_change(time: np.ndarray, values: np.ndarray) -> float:
    """Time from which on a signal has its last value."""
    changes = np.flatnonzero(values != values[-1])
    return float(time[min(changes[-1] + 1, len(values) - 1)]) if changes.size else 0.0


def _inputs_settled(run: Run) -> float:
    """Time of the last change of an input."""
    return max((find_last_change(run.t, run[quantity.name]) for quantity in run.system.inputs), default=0.0)


def _resolution(run: Run) -> float:
    """Of the position that a sampled controller sees [rad at the load]."""
    found = {"load": 0.0, "motor": 0.0}
    for parameter, value in zip(run.system.parameters, run.parameters, strict=True):
        sensor = parameter.role(SensorOf)
        if parameter.role(Resolution) is not None and sensor is not None and sensor.reads in found:
            found[sensor.reads] = float(value)
    if not run.system.clocks or not any(found.values()) or "motor_angle_at_load" not in run.signals:
        return 0.0
    far = int(np.argmax(abs(run["motor_angle_at_load"])))
    turns = abs(run["motor_angle"][far] / run["motor_angle_at_load"][far]) if run["motor_angle_at_load"][far] else 1.0
    return max(found["load"], found["motor"] / turns)


def _drift(run: Run, keep: np.ndarray) -> tuple[str, float]:
    """The controller state that still drifts behind a load at rest, in words, and the time to breakaway [s]."""
    if keep.sum() < QUARTERS:
        return "", float("nan")
    for quantity in run.system.states:
        if quantity.role(ControllerMemory) is not None:
            before, after = measure_swings(run[quantity.name][keep], QUARTERS)[2:]
            if after > max(STILL * quantity.nominal, before / GROWTH):
                drifts = f"{quantity.name} still drifts: it changed by {after:.3g} {quantity.unit} in the last quarter"
                return drifts, _time_to_breakaway(run, keep)
    return "", float("nan")


def _time_to_breakaway(run: Run, keep: np.ndarray) -> float:
    """When the first margin of the present modes reaches zero at its rate in the last quarter [s]; nan for never."""
    if not run.margins.size:
        return float("nan")
    time, margins = run.t[keep], run.margins[:, keep]
    since = max([time[-1] - (time[-1] - time[0]) / QUARTERS, *(change.time for change in run.changes[-1:])])
    late = time > since
    if late.sum() < 2:  # noqa: PLR2004 - a rate needs two points
        return float("nan")
    rates = (margins[:, -1] - margins[:, late][:, 0]) / (time[-1] - time[late][0])
    waits = [-margin / rate for margin, rate in zip(margins[:, -1], rates, strict=True) if rate < 0]
    return float(min(waits, default=float("nan")))
