"""What a mesh asks of its friction, and the laws that answer."""

from typing import Protocol

from gear.coulomb import Coulomb
from gear.motion import Sliding
from gear.periodic_friction import PeriodicFriction, UniformFriction
from gear.quantities import Scalar

__all__ = ["Coulomb", "FrictionLaw", "FrictionLaws"]


class FrictionLaw(Protocol):
    """What a mesh asks of its friction law; the direction of motion is the mesh's business, not the law's.

    A law is one expression for floats and symbols, finite and with finite slopes also at zero speed and force.
    The sliding coefficient just off standstill is not above the breakaway coefficient.
    """

    def coefficient(self, sliding: Sliding) -> Scalar:
        """Sliding coefficient [-]."""
        ...

    def breakaway(self, sliding: Sliding) -> Scalar:
        """Largest coefficient [-] that holds the mesh at rest, at this force, position and driving side."""
        ...


# every law by its type, for files: its members are told apart by their names
FrictionLaws = UniformFriction | PeriodicFriction
