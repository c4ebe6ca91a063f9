"""Saturation of a synchronous motor's iron: flux linkage that grows less than the current."""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import casadi as ca
from annotated_types import Ge, Unit

from actuator.parts.electrical import Current, Inductance
from gear.quantities import Scalar, check


class Inductances(NamedTuple):
    """Incremental inductances [H], a symmetric matrix."""

    d: Scalar
    q: Scalar
    mutual: Scalar


@dataclass(frozen=True, kw_only=True)
class Saturation:
    """Flux linkage lost to saturation, both axes by one magnetization, with the cross-saturation that follows.

        u = sqrt(1 + ((id + magnet_current)/current_d)^2 + (iq/current_q)^2),   u0 = u at zero current
        lost psi_d = lost_d (id - (id + magnet_current)/u + magnet_current/u0)
        lost psi_q = lost_q (iq - iq/u),     lost_d = lost_q (current_q/current_d)^2

    Both are slopes of one coenergy, so the inductance matrix is symmetric and no cycle of currents makes
    energy. At zero current nothing is lost, at large currents the inductances are smaller by lost_d, lost_q.

    Parameters
    ----------
    lost_q : float
        Inductance lost in the q axis at large current [H]; less than the motor's own, as lost_d is.
    current_d, current_q : float
        Currents at which saturation sets in [A peak].
    magnet_current : float
        Direct current that would magnetize as the magnets do [A peak].
    """

    lost_q: Inductance
    current_d: Current
    current_q: Current
    magnet_current: Annotated[float, Unit("A"), Ge(0)] = 0.0

    def __post_init__(self) -> None:
        check(self)

    @property
    def lost_d(self) -> Scalar:
        """Inductance lost in the d axis at large current [H]."""
        return self.lost_q * (self.current_q / self.current_d) ** 2

    def _magnetization(self, direct: Scalar, quadrature: Scalar) -> Scalar:
        return ca.sqrt(1 + ((direct + self.magnet_current) / self.current_d) ** 2 + (quadrature / self.current_q) ** 2)

    def lost_flux(self, direct: Scalar, quadrature: Scalar) -> tuple[Scalar, Scalar]:
        """Flux linkages [V s] of both axes that the unsaturated motor would have more."""
        u, at_rest = self._magnetization(direct, quadrature), self._magnetization(0.0, 0.0)
        magnetizing = direct + self.magnet_current
        return (
            self.lost_d * (direct - magnetizing / u + self.magnet_current / at_rest),
            self.lost_q * (quadrature - quadrature / u),
        )

    def lost_inductances(self, direct: Scalar, quadrature: Scalar) -> Inductances:
        """Derivatives of the lost flux with respect to the currents [H]."""
        u = self._magnetization(direct, quadrature)
        d, q = (direct + self.magnet_current) / self.current_d, quadrature / self.current_q
        return Inductances(
            d=self.lost_d * (1 - 1 / u + d**2 / u**3),
            q=self.lost_q * (1 - 1 / u + q**2 / u**3),
            mutual=self.lost_q * (self.current_q / self.current_d) * d * q / u**3,
        )

    def lost_coenergy(self, direct: Scalar, quadrature: Scalar) -> Scalar:
        """Integral of the lost flux over the currents [V s A], from zero current."""
        u, at_rest = self._magnetization(direct, quadrature), self._magnetization(0.0, 0.0)
        linear_d = self.lost_d * (direct**2 / 2 + direct * self.magnet_current / at_rest)
        linear_q = self.lost_q * quadrature**2 / 2
        return linear_d + linear_q - self.lost_q * self.current_q**2 * (u - at_rest)
