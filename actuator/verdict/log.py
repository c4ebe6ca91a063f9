"""The verdict on a measured log: the same as on a run, with standing still told from moving by the log's own noise."""

import csv
import math
from collections.abc import Mapping
from os import PathLike
from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_dilation, maximum_filter1d, minimum_filter1d

from actuator.verdict.motion_record import MotionRecord, find_last_change
from actuator.verdict.peaks import follow_behind_play
from actuator.verdict.verdict import Hunting, judge_motion

COLUMNS = ("time", "position", "reference", "motor position", "current")
NEEDED = COLUMNS[:2]
SAME = 0.1  # relative difference up to which two measured swings are the same
SIGMAS = 6.0  # of the noise that is not motion
SMALLEST = 1e-5  # part of all motion that is none, however clean the log
UPPER_QUARTER, OF_DIFFERENCES = 1.1503, math.sqrt(70)  # of |normal noise|; sigma of its fourth difference
ON_LATTICE = 1e-3  # part of a count by which values may lie beside it
WINDOW, FEWEST = 0.02, 5  # part of the period, and samples, for which a standing position stands
LEFT = 0.25  # part of the play by which noise may still push what follows behind it
DOUBT = 3.0  # times the standing of a smooth cycle that is called sticking
UNEVEN = 1e-6  # relative difference of two steps above which a log is laid on even ones


class Noise(NamedTuple):
    """What is no motion in a measured position."""

    sigma: float  # rad
    resolution: float  # rad, zero for none
    band: float  # rad, peak to peak of what is no motion


def classify_log(log: str | PathLike | Mapping[str, np.ndarray], *, since: float | None = None) -> Hunting:
    """Judge a measured log for hunting.

    The position is followed behind a play as wide as its noise and resolution, so what is smaller is no motion. It
    stands where that does not move for a fiftieth of the period; the speed below which this is so is said in the
    verdict's `reason`.

    Parameters
    ----------
    log : path or mapping of str to ndarray
        CSV with a header, or arrays: time [s] and position [rad] of the load, and where they are known reference
        [rad], motor position [rad] and current [A].
    since : float or None
        Time [s] from which on to look; None for the time of the last change of the reference.

    Returns
    -------
    Hunting
        As of `classify`; the loss is not known.

    Raises
    ------
    ValueError
        A column that is missing, not a number or of another length, or times that do not increase.
    """
    signals = _checked(_read(log)) if isinstance(log, str | PathLike) else _checked(dict(log))
    time, position = signals["time"], signals["position"]
    noise = estimate_noise(position)
    load = follow_behind_play(position, noise.band)
    motor, reference = signals.get("motor position"), signals.get("reference")
    if motor is not None:
        motor = follow_behind_play(motor, estimate_noise(motor).band)
    start = 0.0 if since is None else since
    if since is None and reference is not None:
        start = find_last_change(time, follow_behind_play(reference, SIGMAS * estimate_noise(reference).sigma))
    keep = time >= start
    record = MotionRecord(
        time=time[keep],
        load=load[keep],
        motor=None if motor is None else motor[keep],
        reference=None if reference is None else reference[keep],
        current=signals["current"][keep] if "current" in signals else None,
        loss=None,
        stuck_share=lambda begin, end: _standing(time, load, noise, begin, end),
        still=noise.band,
        same=SAME,
        resolution=noise.resolution,
        note=f"what moves by less than {noise.band:.3g} rad stands, by the log's noise ({noise.sigma:.3g} rad) and "
        f"resolution ({noise.resolution:.3g} rad)",
    )
    return judge_motion(record, again="log longer")


def estimate_noise(signal: np.ndarray) -> Noise:
    """Noise and resolution of a measured signal: what its fourth differences and the smallest of its steps say."""
    steps = np.abs(np.diff(signal))
    least = float(steps[steps > 0].min()) if (steps > 0).any() else 0.0
    counts = steps / least if least else steps
    whole = bool((np.abs(counts - np.round(counts)) <= ON_LATTICE).all()) and counts.max(initial=0) < 1 / ON_LATTICE
    rough = np.abs(np.diff(signal, 4))
    sigma = float(np.quantile(rough, 0.75)) / (UPPER_QUARTER * OF_DIFFERENCES) if rough.size else 0.0
    resolution = least if whole else 0.0
    return Noise(sigma, resolution, max(SIGMAS * sigma + resolution, SMALLEST * float(np.ptp(signal))))


def _standing(time: np.ndarray, load: np.ndarray, noise: Noise, start: float, end: float) -> float:
    """Part of the time in which the load stands; zero where a smooth cycle would seem to stand as long."""
    cycle = (time >= start) & (time <= end)
    seen, swing = load[cycle], float(np.ptp(load[cycle]))
    if swing <= noise.band:
        return 0.0
    width = max(FEWEST, round(WINDOW * len(seen)))
    spread = maximum_filter1d(seen, width) - minimum_filter1d(seen, width)
    stands = binary_dilation(spread <= LEFT * noise.band, np.ones(width))
    share = float(stands.mean())
    # a sine behind the same play stands from each turn until it has come back through the play
    smooth = math.acos(1 - min(2 * noise.band / swing, 2.0)) / math.pi + 2 * width / len(seen)
    return share if share > DOUBT * smooth else 0.0


def _read(path: str | PathLike) -> dict[str, np.ndarray]:
    with open(path, newline="", encoding="utf-8-sig") as file:
        rows = list(csv.reader(file))
    if not rows:
        raise ValueError(f"{path}: empty; a log begins with the names of its columns: {', '.join(COLUMNS)}")
    names = [" ".join(name.replace("_", " ").lower().split()) for name in rows[0]]
    found: dict[str, list[float]] = {name: [] for name in names}
    for number, row in enumerate(rows[1:], start=2):
        if not row:
            continue
        try:
            for name, value in zip(names, row, strict=True):
                found[name].append(float(value))
        except ValueError:
            raise ValueError(
                f"{path}: line {number} must be {len(names)} numbers, got {','.join(row)[:60]!r}"
            ) from None
    return {name: np.array(values) for name, values in found.items()}


def _checked(signals: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The columns that are known, on even steps of time."""
    missing = [name for name in NEEDED if name not in signals]
    if missing:
        raise ValueError(f"a log needs {' and '.join(NEEDED)}; {', '.join(missing)} is not among {', '.join(signals)}")
    known = {name: np.asarray(signals[name], float) for name in COLUMNS if name in signals}
    time = known["time"]
    for name, values in known.items():
        if values.shape != time.shape or values.ndim != 1:
            raise ValueError(f"log: {name} must have one value for each of {time.size} times, got {values.shape}")
        if not np.isfinite(values).all():
            at = int(np.flatnonzero(~np.isfinite(values))[0])
            raise ValueError(f"log: {name} must be finite, got {values[at]} in row {at + 1}")
    if len(time) > 1 and not (np.diff(time) > 0).all():
        at = int(np.flatnonzero(np.diff(time) <= 0)[0])
        raise ValueError(f"log: time must increase, got {time[at]:g} s and then {time[at + 1]:g} s in row {at + 2}")
    steps = np.diff(time)
    if len(time) < FEWEST or np.ptp(steps) <= UNEVEN * steps.mean():
        return known
    even = np.linspace(time[0], time[-1], round((time[-1] - time[0]) / float(np.median(steps))) + 1)
    return {name: even if name == "time" else np.interp(even, time, values) for name, values in known.items()}
