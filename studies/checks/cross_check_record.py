"""The published run of a 2.2 kW PMSM drive in motulator, complete or as the excerpts of this package."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from studies.files import StudyError

DATA = Path(__file__).parent.parent / "data" / "cross_check_drive.json"
PERIOD = 125e-6  # s
SPEED, SPEED_TIME = 50 * np.pi, 0.2  # rad/s of the rotor, at 75 Hz with 3 pole pairs; s
LOAD, LOAD_TIME = 14.0, 0.6  # N m, s
SIGNALS = {"current_d": "A", "current_q": "A", "torque": "N m", "speed": "rad/s"}


class WrongRecord(StudyError):
    """A published result that is missing, or is not in the expected form."""


class Excerpt(NamedTuple):
    """Part of the recorded run, at which the machine is held against it."""

    start: np.ndarray  # (4,) direct and quadrature current [A], speed [rad/s] and angle [rad] of the rotor
    duties: np.ndarray  # (3, n) that act from each of n samples to the next
    load: np.ndarray  # (n,) load torque [N m] then
    samples: np.ndarray  # (m,) numbers of the samples that are known, the start's being 0
    signals: dict[str, np.ndarray]  # by the names of SIGNALS, (m,)
    begin: float  # s


class Recorded(NamedTuple):
    """The published run."""

    excerpts: list[Excerpt]
    peaks: dict[str, float]  # of the whole run, by the names of SIGNALS
    key_figures: dict[str, float]
    time: np.ndarray  # (n,) of the curves [s]
    curves: dict[str, np.ndarray]


def key_figures(time: np.ndarray, signals: dict[str, np.ndarray]) -> dict[str, float]:
    """Key figures of a drive: peak current, speed dip after the load step, settled currents."""
    size = np.hypot(signals["current_d"], signals["current_q"])
    return {
        "peak current": float(size.max()),
        "speed dip": SPEED - float(signals["speed"][time > LOAD_TIME].min()),
        "settled current_d": float(signals["current_d"][-1]),
        "settled current_q": float(signals["current_q"][-1]),
    }


def recorded(npz: Path | None = None) -> Recorded:
    """Read a complete record, one sample a period; by default the excerpts of this package."""
    if npz is None:
        stored = json.loads(DATA.read_text(encoding="utf-8"))
        excerpts = [_stored(one) for one in stored["stretches"]]
        time, *curves = (np.array(row) for row in stored["curves"])
        return Recorded(excerpts, stored["peaks"], stored["marks"], time, dict(zip(SIGNALS, curves, strict=True)))
    with np.load(npz) as record:
        require_columns(npz, ("t", "i_d", "i_q", "tau_M", "w_M", "tau_L", "d_a", "d_b", "d_c"), record.files)
        time = record["t"]
        signals = {name: record[key] for name, key in zip(SIGNALS, ("i_d", "i_q", "tau_M", "w_M"), strict=True)}
        duties = np.array([record[f"d_{phase}"] for phase in "abc"])[:, :-2]
        whole = Excerpt(
            start=np.zeros(4),
            duties=np.column_stack([np.full(3, 0.5), duties]),
            load=record["tau_L"][1:],
            samples=np.arange(len(time)),
            signals=signals,
            begin=0.0,
        )
    peaks = {name: float(np.abs(values).max()) for name, values in signals.items()}
    return Recorded([whole], peaks, key_figures(time, signals), time, signals)


def require_columns(path: Path, needed: Sequence[str], there: Sequence[str]) -> None:
    """Raise WrongRecord for the first column that a file lacks."""
    for name in needed:
        if name not in there:
            raise WrongRecord(f"{path} has no column {name!r}, only {', '.join(there)}; is it the published result?")


def _stored(one: dict[str, Any]) -> Excerpt:
    duties = np.array(one["duties"])
    count = duties.shape[1]
    samples = np.arange(0, count + 1, one["every"])
    signals = dict(zip(SIGNALS, (np.array(row) for row in one["signals"]), strict=True))
    return Excerpt(np.array(one["start"]), duties, np.full(count, one["load"]), samples, signals, one["begin"])
