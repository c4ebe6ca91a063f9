"""The numbers of Bode plots: gain in dB, phase without jumps, and between which values the contact modes lie."""

import math
from collections.abc import Mapping
from typing import NamedTuple, TypeVar

import control
import numpy as np

FREQUENCIES = 2 * np.pi * np.logspace(-2, 4, 1500)  # rad/s
CUT, SLOW = 1e-6, 1e-2  # a response whose gain is below CUT above SLOW rad/s lets nothing pass
HIGHEST_PHASE = 0.5 * np.pi  # at which a response may start; the lowest is a turn below
Gain = TypeVar("Gain", float, np.ndarray)


class Envelope(NamedTuple):
    """Between which gains [-] and phases [rad] all modes in which anything passes lie, over frequency [rad/s]."""

    frequencies: np.ndarray
    gain_low: np.ndarray
    gain_high: np.ndarray
    phase_low: np.ndarray
    phase_high: np.ndarray


def to_db(gain: Gain) -> Gain:
    """20 log10 of a gain [-]; minus infinity for zero."""
    if not isinstance(gain, np.ndarray):
        return 20 * math.log10(gain) if gain > 0 else -math.inf
    with np.errstate(divide="ignore"):
        return 20 * np.log10(gain)


def phase_of(response: np.ndarray, known: np.ndarray | None = None) -> np.ndarray:
    """Phase [rad] of a complex response over frequency, without jumps.

    The first known value lies above -270 and at most at +90 deg, as for a loop or a closed loop that begins with a
    gain, a lag or up to three integrators; a response without such a meaning (a stiffness) follows the same rule.

    Parameters
    ----------
    response : ndarray of complex, (n,)
    known : ndarray of bool, (n,), or None
        Where there is a response; the phase is nan elsewhere, and where the response is not finite.
    """
    known = np.isfinite(response) if known is None else known & np.isfinite(response)
    phase = np.full(len(response), np.nan)
    if known.any():
        phase[known] = np.unwrap(np.angle(response[known]))
        phase -= 2 * np.pi * np.ceil((phase[known][0] - HIGHEST_PHASE) / (2 * np.pi))
    return phase


def bode_of(model: control.StateSpace, frequencies: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gain [-] and phase [rad] of a model at frequencies [rad/s], the phase as of `phase_of`."""
    values = np.asarray(model(np.exp(1j * frequencies * model.dt) if model.dt else 1j * frequencies))
    return abs(values), phase_of(values)


def passes(model: control.StateSpace) -> bool:
    """Whether anything passes a model: a stuck gear passes nothing on, but for rounding."""
    end = np.pi / model.dt if model.dt else np.inf
    grid = FREQUENCIES[(FREQUENCIES > SLOW) & (end > FREQUENCIES)]
    return bool(bode_of(model, grid)[0].max() > CUT)


def envelope(models: Mapping[str, control.StateSpace], frequencies: np.ndarray = FREQUENCIES) -> Envelope:
    """Between which gains and phases the models lie in which anything passes.

    Raises
    ------
    ValueError
        Where nothing passes in any of them.
    """
    seen = [bode_of(model, frequencies) for model in models.values() if passes(model)]
    if not seen:
        raise ValueError(f"nothing passes in any of the modes {', '.join(models)}: there is no envelope")
    gains, phases = (np.array(rows) for rows in zip(*seen, strict=True))
    return Envelope(frequencies, gains.min(axis=0), gains.max(axis=0), phases.min(axis=0), phases.max(axis=0))
