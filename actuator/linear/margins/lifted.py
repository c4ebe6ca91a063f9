"""Margins of a sampled loop whose signal is renewed several times in the period of the slowest clock."""

import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any, ClassVar

import control
import numpy as np
from scipy.optimize import brentq

from actuator.linear.bode import to_db
from actuator.linear.poles import rounding_bound

GAINS = np.logspace(-4, 4, 1601)  # factors on the loop gain that are tried
PHASES = np.linspace(0, math.pi, 721)  # rad
FREQUENCIES = 2000  # at which the sensitivity is looked at


@dataclass(frozen=True, kw_only=True)
class LiftedMargins:
    """By how much all values of a signal in one period may change together before the closed loop loses its stability.

    Attributes
    ----------
    stable : bool
        Whether the closed loop is; where it is not, the margins are one and zero.
    lower_gain, upper_gain : float
        Factors on the loop gain between which it stays stable [-]; zero and infinity where there is no limit in
        between 1e-4 and 1e4.
    phase_rad : float
        Lag, or lead, of all values at once; infinite where none matters.
    peak_sensitivity : float
        Largest gain of 1/(1 + L), from any sequence of values in a period to any other [-].
    """

    stable: bool
    lower_gain: float
    upper_gain: float
    phase_rad: float
    peak_sensitivity: float

    # asked as `Margins` is, of which these have no counterpart
    delay_s: ClassVar[None] = None
    disk: ClassVar[None] = None
    gain_crossings: ClassVar[None] = None
    phase_crossings: ClassVar[None] = None

    @property
    def phase_deg(self) -> float:
        """Phase margin [deg]."""
        return math.degrees(self.phase_rad)

    @property
    def range_db(self) -> tuple[float, ...]:
        """Gain margins that belong together [dB]: the lower and the upper one."""
        return to_db(self.lower_gain), to_db(self.upper_gain)

    def rows(self) -> Iterator[tuple[str, float | None, float, str]]:
        """As of `Margins`; none has a frequency of its own."""
        yield "lower gain", None, self.lower_gain, "-"
        yield "upper gain", None, self.upper_gain, "-"
        yield "phase", None, self.phase_deg, "deg"

    def numbers(self) -> dict[str, Any]:
        """All of it for machines."""
        return asdict(self)


def lifted_margins(loop: control.StateSpace) -> LiftedMargins:
    """Margins from the poles of the closed loop over factors and phases: exact, whatever the order of the clocks.

    Raises
    ------
    ValueError
        For a loop in continuous time, or with other inputs than outputs.
    """
    a, b, c, d = (np.asarray(part) for part in (loop.A, loop.B, loop.C, loop.D))
    if not loop.dt or d.shape[0] != d.shape[1]:
        raise ValueError(
            f"lifted_margins needs a loop in discrete time with as many outputs as inputs, got dt={loop.dt}, "
            f"{d.shape[0]} outputs and {d.shape[1]} inputs; `margins` is for one of each"
        )
    one = np.eye(len(d))

    def spare(factor: complex) -> float:
        """How far inside the unit circle the slowest closed pole is."""
        return rounding_bound(a - factor * b @ np.linalg.solve(one + factor * d, c), discrete=True)

    step = np.exp(1j * np.linspace(0, math.pi, FREQUENCIES + 1)[1:])
    loops = np.asarray(loop(step)).reshape(*d.shape, -1)
    peak = max(float(np.linalg.norm(np.linalg.inv(one + value), 2)) for value in np.moveaxis(loops, -1, 0))
    if spare(1.0) < 0:
        return LiftedMargins(stable=False, lower_gain=1.0, upper_gain=1.0, phase_rad=0.0, peak_sensitivity=peak)
    return LiftedMargins(
        stable=True,
        lower_gain=_edge(spare, GAINS[GAINS < 1][::-1], 0.0),
        upper_gain=_edge(spare, GAINS[GAINS > 1], math.inf),
        phase_rad=_edge(lambda phase: spare(np.exp(-1j * phase)), PHASES[1:], math.inf),
        peak_sensitivity=peak,
    )


def _edge(spare: Callable[[float], float], grid: np.ndarray, nothing: float) -> float:
    """Where the room is used up, on the way along the grid; `nothing` where it never is."""
    before = None
    for value in grid:
        if spare(value) < 0:
            return float(value) if before is None else float(brentq(spare, before, value, full_output=True)[1].root)
        before = value
    return nothing
