"""What it takes to get a transmission moving, and whether it locks itself."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from gear.balance import NoSteadyState, balance
from gear.friction.law import FrictionLaw
from gear.motion import Sliding
from gear.teeth.pair import Pair
from gear.transmission import Transmission

NO_LOAD = 1e-9  # part of a load that is none
HARDEST = 1e6  # factor on all friction beyond which nothing locks it


@dataclass(frozen=True, kw_only=True)
class Breakout:
    """What it takes to get a transmission moving against a load, from standstill.

    Attributes
    ----------
    input_torque : float
        At the input [N m] to move the output against the load.
    output_torque : float
        At the output [N m] to drive the gear backward with the input free; infinite where it locks itself.
    locking_margin : float
        Factor on all mesh friction at which the gear begins to lock itself at standstill; below one it does.
    """

    input_torque: float
    output_torque: float
    locking_margin: float

    @property
    def self_locking(self) -> bool:
        """Whether no torque at the output moves the input."""
        return self.locking_margin <= 1


def breakout(gear: Transmission, *, torque: float, direction: Literal[1, -1] = 1) -> Breakout:
    """Breakout torques against a load [N m] at the output, moving the output in `direction`."""
    start = balance(gear, output_torque=-direction * torque, output_speed=float(direction), friction="static")

    def resisting(push: float) -> float:
        """Torque with which the input must still hold (> 0) or help (< 0) where the output drives."""
        return _safe(lambda load: _held_at_input(gear, direction, load), push)

    bare = replace(gear, bearings={})

    margin = _last_positive(lambda factor: _held_at_input(scale_friction(bare, factor), direction, 1.0))
    reach = float("inf")
    if margin > 1:
        # linear in the load but for laws that depend on it: bearings offset it, meshes scale it
        top = 1.0
        while resisting(top) <= 0:
            top *= 2
        low = NO_LOAD * top
        reach = _bisected(resisting, low, top) if resisting(low) < 0 else 0.0
    return Breakout(input_torque=abs(start.input_torque), output_torque=reach, locking_margin=margin)


def _held_at_input(gear: Transmission, direction: int, push: float) -> float:
    found = balance(gear, output_torque=direction * push, output_speed=float(direction), friction="static")
    return -found.input_torque * float(np.sign(found.speeds[gear.input]))


def _last_positive(gives: Callable[[float], float]) -> float:
    """Where a function of the friction factor falls to zero, by doubling and bisection."""
    low, high = 0.0, 1.0
    while _safe(gives, high) > 0:
        low, high = high, 2 * high
        if high > HARDEST:
            return float("inf")
    return _bisected(lambda factor: -_safe(gives, factor), low, high)


def _bisected(rises: Callable[[float], float], low: float, high: float) -> float:
    """Where a function turns from negative to positive; it may jump there."""
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (low, middle) if rises(middle) >= 0 else (middle, high)
    return (low + high) / 2


def _safe(gives: Callable[[float], float], scale: float) -> float:
    """A jammed train gives nothing."""
    try:
        return gives(scale)
    except NoSteadyState:
        return -1.0


@dataclass(frozen=True, kw_only=True)
class _Scaled(FrictionLaw):
    """A friction law with all its coefficients multiplied by a factor."""

    law: FrictionLaw
    factor: float

    @property
    def sticks(self) -> bool:
        """Whether the law does."""
        return self.law.sticks

    def require_pair(self, pair: Pair) -> None:
        """Raise ValueError where the law has no meaning for the teeth of a pair."""
        self.law.require_pair(pair)

    def coefficient(self, sliding: Sliding) -> float:
        """Sliding coefficient [-]."""
        return self.factor * self.law.coefficient(sliding)

    def breakaway(self, sliding: Sliding) -> float:
        """Coefficient at breakaway [-]."""
        return self.factor * self.law.breakaway(sliding)


def scale_friction(gear: Transmission, factor: float) -> Transmission:
    """The same transmission with all mesh friction multiplied by a factor."""
    meshes = {
        name: mesh if mesh.friction is None else replace(mesh, friction=_Scaled(law=mesh.friction, factor=factor))
        for name, mesh in gear.meshes.items()
    }
    return replace(gear, meshes=meshes)
