"""A family of periodic orbits over one parameter, and the kinds of its end."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from actuator.orbits.orbit import Orbit
from actuator.orbits.sampled import SampledOrbit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOLD, BOUND = "fold", "bound"
PERIOD_DOUBLING, TORUS = "period doubling", "Neimark-Sacker"
LOSS_OF_STICK, COLLISION, GRAZING, VANISHES, ENDLESS, LOST = (
    "loss of stick",
    "border collision",
    "grazing",
    "amplitude zero",
    "period infinite",
    "lost",
)


class End(NamedTuple):
    """Where a family of orbits ends."""

    kind: str  # "fold", "period doubling", "Neimark-Sacker", "loss of stick", "border collision", ...
    value: float  # of the parameter
    reason: str  # in a sentence, with numbers


@dataclass(frozen=True, kw_only=True, eq=False)
class Branch:
    """A family of orbits over one parameter.

    Attributes
    ----------
    parameter : str
        Its name.
    values : ndarray, (n,)
        Of the parameter.
    orbits : tuple of Orbit, or of SampledOrbit
        In the order of the family.
    end : End
        Where and how it ends.
    """

    parameter: str
    values: np.ndarray
    orbits: tuple[Orbit, ...] | tuple[SampledOrbit, ...] = field(repr=False)
    end: End

    @property
    def stable(self) -> np.ndarray:
        """Whether each orbit is, (n,)."""
        return np.array([orbit.stable for orbit in self.orbits])

    def plot(self) -> "Figure":
        """Amplitude, period and the largest multiplier over the parameter."""
        from actuator.plots.orbits import plot_branch

        return plot_branch(self)
