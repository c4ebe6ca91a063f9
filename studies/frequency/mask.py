"""Limits on gain and phase over frequency, at stated amplitudes, and their check against a measured response."""

import math
from dataclasses import dataclass
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import numpy as np
from annotated_types import Unit

from actuator.linear.bode import phase_of, to_db
from studies.files import read
from studies.structure import structure

Hertz = Annotated[float, Unit("Hz")]
Decibel = Annotated[float, Unit("dB")]
Radian = Annotated[float, Unit("rad")]
LARGEST = 0.5  # of the stroke: from the middle to an end


class Side(NamedTuple):
    """One side of a limit: what it bounds, whether from below (1) or above (-1), and how it is shown."""

    quantity: Literal["gain", "phase"]
    sign: int
    label: str
    scale: float  # from the unit of the limit to the unit shown
    unit: str


SIDES = {  # by the field of Limit
    "gain_low_db": Side("gain", 1, "gain, lower limit", 1.0, "dB"),
    "gain_high_db": Side("gain", -1, "gain, upper limit", 1.0, "dB"),
    "phase_low": Side("phase", 1, "phase, lower limit", 180 / math.pi, "deg"),
    "phase_high": Side("phase", -1, "phase, upper limit", 180 / math.pi, "deg"),
}


@dataclass(frozen=True, kw_only=True)
class Limit:
    """Limits at one amplitude, linear between the given points over the logarithm of frequency.

    Parameters
    ----------
    amplitude : float
        Of the reference sine, over the stroke [-].
    frequencies : tuple of float
        Ascending [Hz].
    gain_low_db, gain_high_db : tuple of float
        At each frequency [dB]; empty where there is no such limit.
    phase_low, phase_high : tuple of float
        At each frequency [rad]; empty where there is no such limit.
    """

    amplitude: float
    frequencies: tuple[Hertz, ...]
    gain_low_db: tuple[Decibel, ...] = ()
    gain_high_db: tuple[Decibel, ...] = ()
    phase_low: tuple[Radian, ...] = ()
    phase_high: tuple[Radian, ...] = ()

    def __post_init__(self) -> None:
        if not 0 < self.amplitude <= LARGEST:
            raise ValueError(
                f"Limit.amplitude must be > 0 and <= {LARGEST:g}, parts of the stroke, got {self.amplitude:g}"
            )
        ascend = all(low < high for low, high in pairwise(self.frequencies))
        if not self.frequencies or self.frequencies[0] <= 0 or not ascend:
            raise ValueError(f"Limit.frequencies must be > 0 Hz and ascend, got {list(self.frequencies)}")
        given = {each: getattr(self, each) for each in SIDES if getattr(self, each)}
        if not given:
            raise ValueError(f"Limit needs at least one of {', '.join(SIDES)}")
        for name, values in given.items():
            if len(values) != len(self.frequencies):
                raise ValueError(
                    f"Limit.{name} must have a value at each of the {len(self.frequencies)} frequencies, "
                    f"got {len(values)}"
                )

    def at(self, side: str, frequencies: np.ndarray) -> np.ndarray:
        """A limit by the name of its field, at other frequencies [Hz] within its own."""
        return np.interp(np.log(frequencies), np.log(self.frequencies), getattr(self, side))


@dataclass(frozen=True, kw_only=True)
class Mask:
    """Limits at several amplitudes.

    Parameters
    ----------
    title : str
        One line for reports.
    limits : tuple of Limit
        All have to be kept.
    """

    title: str
    limits: tuple[Limit, ...]

    def __post_init__(self) -> None:
        if not self.limits:
            raise ValueError("Mask needs at least one limit")


class LimitCheck(NamedTuple):
    """One side of a limit compared with a measured response."""

    amplitude: float  # over the stroke
    side: str  # name of the field of Limit
    slack: (
        float  # smallest distance [dB] or [rad], negative where the limit is missed; minus infinity without a response
    )
    frequency: float  # where that is [Hz]
    points: int  # measured within the frequencies of the limit
    failed: int  # of them, with a failed simulation

    @property
    def met(self) -> bool:
        """Whether it is kept at every point."""
        return self.slack >= 0

    @property
    def nothing(self) -> str:
        """Why there is no response to compare with the limit; empty where there is one."""
        if math.isfinite(self.slack):
            return ""
        return f"{self.failed} of {self.points} simulations failed" if self.failed else "nothing moves"


def load_mask(path: Path | None = None) -> Mask:
    """Read a mask from a file, or the built-in one.

    Raises
    ------
    CaseError
        For anything wrong with the file; one line with the key, the value and what is allowed.
    """
    built_in = resources.files("studies") / "data" / "masks" / "position.toml"
    return structure(read(built_in if path is None else path.resolve()), (), Mask)


def check_limit(limit: Limit, frequencies: np.ndarray, response: np.ndarray, moves: np.ndarray) -> list[LimitCheck]:
    """Compare every side of a limit with a response at its amplitude.

    Parameters
    ----------
    limit : Limit
        The limit.
    frequencies : ndarray, (n,)
        Ascending [Hz].
    response : ndarray of complex, (n,)
        Load angle over reference.
    moves : ndarray of bool, (n,)
        Where the load moves, or the simulation failed; then `response` is not finite.
    """
    inside = (frequencies >= limit.frequencies[0]) & (frequencies <= limit.frequencies[-1])
    phase = phase_of(response, moves)
    gain = np.full(len(response), -np.inf)
    gain[moves] = to_db(abs(response[moves]))
    found = []
    for name, side in SIDES.items():
        if not getattr(limit, name):
            continue
        seen = gain if side.quantity == "gain" else phase
        slack = side.sign * (seen[inside] - limit.at(name, frequencies[inside]))
        # a load that does not move has no phase, a failed simulation no response: both miss the limit
        slack = np.where(np.isnan(slack), -np.inf, slack)
        worst = int(slack.argmin())
        at = float(frequencies[inside][worst])
        failed = int((~np.isfinite(response[inside])).sum())
        found.append(LimitCheck(limit.amplitude, name, float(slack[worst]), at, int(inside.sum()), failed))
    return found
