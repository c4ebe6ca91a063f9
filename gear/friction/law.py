"""What a mesh asks of its friction. A new law is a new file in this folder."""

from abc import abstractmethod
from collections.abc import Sequence
from typing import ClassVar, Protocol

from gear.motion import Sliding
from gear.quantities import Memory, Scalar, show
from gear.teeth.pair import Pair


class FrictionLaw(Protocol):
    """What a mesh asks of its friction law.

    A law is one expression for floats and symbols, finite and with finite slopes also at zero speed and force. What it
    must know of the teeth it finds in `Sliding.pair`.

    A law that sticks says the size of the friction, and the direction of motion is the mesh's business: its contact
    holds or slides, which is decided together with all others. The sliding coefficient just off standstill is not above
    the breakaway coefficient.

    A law that does not stick has an internal state instead, `memory`, and says the friction and the rates of the state
    at a signed speed. What it says of `coefficient` and `breakaway` is then for steady motion: the friction to which
    it settles at a speed, and the largest that it reaches from rest when loaded slowly.
    """

    sticks: ClassVar[bool] = True  # a wrapper answers for the law that it wraps, by a property

    @abstractmethod
    def coefficient(self, sliding: Sliding) -> Scalar:
        """Sliding coefficient [-]."""

    @abstractmethod
    def breakaway(self, sliding: Sliding) -> Scalar:
        """Largest coefficient [-] that holds the mesh at rest, at this force, position and driving side."""

    def require_pair(self, pair: Pair) -> None:
        """Raise ValueError where the law has no meaning for the teeth of a pair."""

    def memory(self) -> tuple[Memory, ...]:
        """Declare the internal state, of a law that does not stick."""
        return ()

    def friction(self, memory: Sequence[Scalar], sliding: Sliding) -> Scalar:
        """Friction over normal force [-], with the sign of the motion that it opposes; of a law that does not stick."""
        raise TypeError(f"{type(self).__name__}.friction: a law that sticks has no friction without a mode")

    def rates(self, memory: Sequence[Scalar], sliding: Sliding) -> list[Scalar]:
        """Time derivative of the internal state."""
        return []


class SpeedLaw(FrictionLaw, Protocol):
    """A law over speed alone: oil of another viscosity has the same film, and friction, at another speed."""


def require_breakaway_above(owner: str, sliding: tuple[str, float], static: tuple[str, float], unit: str = "-") -> None:
    """Raise ValueError where a breakaway friction is below the sliding one; each by the name of its field."""
    if static[1] < sliding[1]:
        raise ValueError(
            f"{owner} needs {sliding[0]} <= {static[0]}, got {sliding[0]}={show(sliding[1], unit)} and "
            f"{static[0]}={show(static[1], unit)}; a breakaway {'coefficient' if unit == '-' else 'torque'} below the "
            "sliding one has no consistent motion at standstill"
        )
