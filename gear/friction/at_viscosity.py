"""Friction measured with one lubricant, used with another or at another temperature."""

from dataclasses import dataclass

from gear.friction.law import FrictionLaw, SpeedLaw
from gear.friction.over_speed import Stribeck
from gear.lubrication.law import Lubricant
from gear.lubrication.lubricant import GivenViscosity
from gear.motion import Sliding
from gear.quantities import Scalar
from gear.quantities.registry import part
from gear.teeth.pair import Pair


@part(FrictionLaw)
@dataclass(frozen=True, kw_only=True)
class AtViscosity(FrictionLaw):
    """A law over speed, at the viscosity of a lubricant that is not the one it was measured with.

        mu(v) = law(v eta / eta_measured)

    The film between the flanks depends on speed times viscosity (the Hersey number eta v / load), so oil that is
    twice as thick does at half the speed what the other did. Friction at standstill, where there is no film, is
    unchanged.

    Parameters
    ----------
    law : SpeedLaw
        As measured.
    lubricant : Lubricant
        In the mesh.
    measured_with : Lubricant
        During the measurement.

    References
    ----------
    M. D. Hersey, "The laws of lubrication of horizontal journal bearings", J. Washington Acad. Sci. 4 (1914), 542-552.
    """

    law: SpeedLaw
    lubricant: Lubricant
    measured_with: Lubricant

    @classmethod
    def examples(cls) -> "tuple[AtViscosity, ...]":
        """Oil twice as thick as that of the measurement."""
        return tuple(
            cls(
                law=law,
                lubricant=GivenViscosity(viscosity=0.2),
                measured_with=GivenViscosity(viscosity=0.1),
            )
            for law in Stribeck.examples()
        )

    def require_pair(self, pair: Pair) -> None:
        """Raise ValueError where the law has no meaning for the teeth of a pair."""
        self.law.require_pair(pair)

    def _measured(self, sliding: Sliding) -> Sliding:
        """The state of the measurement with the same film."""
        thicker = self.lubricant.dynamic_viscosity() / self.measured_with.dynamic_viscosity()
        return sliding._replace(speed=sliding.speed * thicker)

    def coefficient(self, sliding: Sliding) -> Scalar:
        """Sliding coefficient [-]."""
        return self.law.coefficient(self._measured(sliding))

    def breakaway(self, sliding: Sliding) -> Scalar:
        """Coefficient [-] that holds the mesh at rest."""
        return self.law.breakaway(sliding)
