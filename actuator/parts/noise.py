"""White noise that repeats: Lehmer's generator, its state held outside, exact in double precision.

    next state = 16807 state mod (2^31 - 1),     u = state/(2^31 - 1)

References
----------
S. K. Park, K. W. Miller, "Random Number Generators: Good Ones Are Hard to Find", Communications of the ACM 31
(1988), 1192-1201.
G. E. P. Box, M. E. Muller, "A Note on the Generation of Random Normal Deviates", Annals of Mathematical Statistics
29 (1958), 610-611.
"""

import math
from dataclasses import dataclass
from typing import Literal, get_args

import casadi as ca

from controllers.memory import Memory
from gear.quantities import Scalar, check_count

MULTIPLIER, MODULUS = 16807, 2**31 - 1
# Seeds start this many numbers apart: states that differ by a small factor would stay correlated for ever
APART = 1_000_003

Distribution = Literal["uniform", "normal"]


@dataclass(frozen=True, kw_only=True)
class WhiteNoise:
    """A new number each tick, independent of the others.

        uniform:   2 u - 1, within +-1
        normal:    sqrt(-2 ln u1) cos(2 pi u2), of variance 1

    Parameters
    ----------
    distribution : "uniform" or "normal"
        Every value within +-1 as likely as another, or the bell curve with a standard deviation of 1.
    seed : int
        The same seed makes the same numbers; another one makes others.
    """

    distribution: Distribution = "normal"
    seed: int = 0

    def __post_init__(self) -> None:
        check_count(self, "seed", least=0)
        if self.distribution not in get_args(Distribution):
            raise ValueError(f"WhiteNoise.distribution must be one of uniform, normal, got {self.distribution!r}")

    def memory(self) -> Memory:
        """State of the generator; every seed starts a stretch of the sequence of its own."""
        return Memory("noise", "-", MODULUS, float(pow(MULTIPLIER, APART * (self.seed + 1), MODULUS)))

    def value(self, state: Scalar) -> Scalar:
        """Number of this tick [-]."""
        first = following(state)
        if self.distribution == "uniform":
            return 2 * first / MODULUS - 1
        second = following(first)
        return ca.sqrt(-2 * ca.log(first / MODULUS)) * ca.cos(2 * math.pi * second / MODULUS)

    def advance(self, state: Scalar) -> Scalar:
        """State for the next tick."""
        first = following(state)
        return first if self.distribution == "uniform" else following(first)


def following(state: Scalar) -> Scalar:
    """Next state of the generator; the product stays below 2^53, so no digit is lost."""
    # a state carried by an integrator may pick up rounding
    return ca.fmod(MULTIPLIER * ca.floor(state + 0.5), MODULUS)
