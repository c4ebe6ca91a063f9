"""What a mesh asks of its friction, and the laws that answer."""

from typing import Any, Protocol

from gear.friction.coulomb import Coulomb
from gear.friction.periodic import PeriodicFriction, UniformFriction
from gear.motion import Sliding
from gear.quantities import Scalar
from gear.teeth.geometry import Pair

__all__ = ["Coulomb", "FrictionLaw", "FrictionLaws", "require_suited"]


class FrictionLaw(Protocol):
    """What a mesh asks of its friction law; the direction of motion is the mesh's business, not the law's.

    A law is one expression for floats and symbols, finite and with finite slopes also at zero speed and force.
    The sliding coefficient just off standstill is not above the breakaway coefficient. What it must know of the
    teeth it finds in `Sliding.pair`; a law that does not suit all teeth has a `require_pair`, see below.
    """

    def coefficient(self, sliding: Sliding) -> Scalar:
        """Sliding coefficient [-]."""
        ...

    def breakaway(self, sliding: Sliding) -> Scalar:
        """Largest coefficient [-] that holds the mesh at rest, at this force, position and driving side."""
        ...


# every law by its type, for files: its members are told apart by their names
FrictionLaws = UniformFriction | PeriodicFriction


def require_suited(law: Any, pair: Pair) -> None:
    """Raise ValueError where a law, or one that it wraps, has no meaning for the teeth of a pair."""
    while law is not None:
        if hasattr(law, "require_pair"):
            law.require_pair(pair)
        law = getattr(law, "law", None)
