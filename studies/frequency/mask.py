"""Limits on gain and phase over frequency, at stated amplitudes, and whether a measured response keeps to them."""

import math
from dataclasses import dataclass
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
from annotated_types import Unit

from actuator.linear.bode import phase_of, to_db
from studies.files import read
from studies.structure import structure

Hertz = Annotated[float, Unit("Hz")]
Decibel = Annotated[float, Unit("dB")]
Radian = Annotated[float, Unit("rad")]
LARGEST = 0.5  # of the stroke: from the middle to an end


@dataclass(frozen=True, kw_only=True)
class Limit:
    """Limits at one amplitude, straight between the given points over the logarithm of frequency.

    Parameters
    ----------
    amplitude : float
        Of the sine of the reference, over the stroke [-].
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


SIDES = {"gain_low_db": 1, "gain_high_db": -1, "phase_low": 1, "phase_high": -1}  # the sign of what is well


@dataclass(frozen=True, kw_only=True)
class Mask:
    """Limits at several amplitudes.

    Parameters
    ----------
    title : str
        One line for reports.
    limits : tuple of Limit
        All have to hold.
    """

    title: str
    limits: tuple[Limit, ...]

    def __post_init__(self) -> None:
        if not self.limits:
            raise ValueError("Mask needs at least one limit")


class LimitCheck(NamedTuple):
    """One side of a limit against what was measured."""

    amplitude: float  # over the stroke
    side: str  # name of the field of Limit
    slack: float  # smallest [dB] or [rad], negative where it is not kept; minus infinity where there is nothing to hold
    frequency: float  # where that is [Hz]
    points: int  # that were measured within the frequencies of the limit
    failed: int  # of them, whose simulation did

    @property
    def met(self) -> bool:
        """Whether it is kept at every point."""
        return self.slack >= 0

    @property
    def nothing(self) -> str:
        """Why there is nothing to hold against the limit; empty where there is something."""
        if math.isfinite(self.slack):
            return ""
        return f"{self.failed} of {self.points} simulations failed" if self.failed else "nothing moves"


def load_mask(path: Path | None = None) -> Mask:
    """A mask from a file, or the built-in one.

    Raises
    ------
    CaseError
        For anything wrong with the file; one line with the key, the value and what is allowed.
    """
    built_in = resources.files("studies") / "data" / "masks" / "position.toml"
    return structure(read(built_in if path is None else path.resolve()), (), Mask)


def checked(limit: Limit, frequencies: np.ndarray, response: np.ndarray, moves: np.ndarray) -> list[LimitCheck]:
    """Every side of a limit against a response at its amplitude.

    Parameters
    ----------
    limit : Limit
        What has to hold.
    frequencies : ndarray, (n,)
        Ascending [Hz].
    response : ndarray of complex, (n,)
        Load angle over reference.
    moves : ndarray of bool, (n,)
        Where there is a response at all, or a simulation that failed; that has none in `response`.
    """
    inside = (frequencies >= limit.frequencies[0]) & (frequencies <= limit.frequencies[-1])
    phase = phase_of(response, moves)
    gain = np.full(len(response), -np.inf)
    gain[moves] = to_db(abs(response[moves]))
    found = []
    for side, sign in SIDES.items():
        if not getattr(limit, side):
            continue
        seen = gain if side.startswith("gain") else phase
        slack = sign * (seen[inside] - limit.at(side, frequencies[inside]))
        # what does not move has no phase, and a simulation that failed has nothing: neither keeps to a limit
        slack = np.where(np.isnan(slack), -np.inf, slack)
        worst = int(slack.argmin())
        at = float(frequencies[inside][worst])
        failed = int((~np.isfinite(response[inside])).sum())
        found.append(LimitCheck(limit.amplitude, side, float(slack[worst]), at, int(inside.sum()), failed))
    return found
