"""A factor that repeats with every tooth, by its harmonics."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from gear.quantities import Number, Scalar, check
from gear.teeth.pair import Pair

SAMPLES = 1000  # of a period, per harmonic; between them the factor is off by less than 5e-6 of its amplitudes


@dataclass(frozen=True, kw_only=True)
class Harmonic:
    """Amplitudes of one harmonic.

    Parameters
    ----------
    cosine, sine : float
        [-], of the mean.
    """

    cosine: Number = 0.0
    sine: Number = 0.0

    def __post_init__(self) -> None:
        check(self)


def tooth_factor(harmonics: Sequence[Harmonic], teeth: Scalar) -> Scalar:
    """1 + sum_k (cosine_k cos(2 pi k x) + sine_k sin(2 pi k x)) at a feed of x teeth [-]."""
    result = 1.0
    for k, harmonic in enumerate(harmonics, start=1):
        angle = 2 * math.pi * k * teeth
        result = result + harmonic.cosine * ca.cos(angle) + harmonic.sine * ca.sin(angle)
    return result


def lowest_factor(harmonics: Sequence[Harmonic]) -> tuple[float, float]:
    """The lowest of samples over a tooth, and how far the factor may fall below it between them."""
    count = max(SAMPLES * len(harmonics), 1)
    lowest = min(tooth_factor(harmonics, k / count) for k in range(count))
    # a minimum between two samples lies below both by less than h^2/8 times the largest second derivative
    bend = sum(
        (2 * math.pi * k / count) ** 2 * math.hypot(harmonic.cosine, harmonic.sine)
        for k, harmonic in enumerate(harmonics, start=1)
    )
    return lowest, bend / 8


def pitch_of(law: Any, pair: Pair | None) -> Scalar:
    """Feed per tooth [m] of a law with a `pitch`: its own, or that of the pair."""
    pitch = law.pitch if law.pitch is not None or pair is None else pair.tooth_pitch
    if pitch is None:
        raise ValueError(
            f"{type(law).__name__}.pitch is needed, in m: there is no pair that knows its teeth to take it from"
        )
    return pitch
