"""Currents for a torque: maximum torque per ampere, and field weakening within a voltage."""

import math
from dataclasses import dataclass

import casadi as ca

from controllers.shapes import saturate
from controllers.units import FluxLinkage, Inductance
from gear.quantities import Scalar, check

TINY = 1e-12  # of the normalized torque: its square is below rounding, its inverse is finite
FAR_INSIDE = 100.0  # flux limits beyond this times the largest flux do not limit, and stay finite at standstill
LEAST_VOLTAGE = 1e-3  # V; a limit of zero has no ellipse
HALVINGS = 8  # of the bracket of the angle, until the torque over it is as good as straight
NEWTON_STEPS = 8  # behind them; to rounding, but at the pull-out torque, where each takes a quarter of the rest
BELOW_ONE = 1 - 1e-12  # largest cosine, as the arc cosine has no slope at 1


@dataclass(frozen=True, kw_only=True)
class CurrentReference:
    """Direct and quadrature current of a salient PMSM for a torque, peak-value dq quantities.

        torque = 3/2 pole_pairs (flux + (Ld - Lq) id) iq

    1.  Least current for the torque (MTPA). With D = Lq - Ld:
            id = -2 D iq^2 / (flux + sqrt(flux^2 + 4 D^2 iq^2))
    2.  The torque is limited to what the current limit gives there.
    3.  Where the voltage limit U is too low at the electrical speed we, |we| sqrt(psi_d^2 + psi_q^2) > U, the
        point moves along the voltage ellipse, psi_d = L cos(a) = flux + Ld id, psi_q = L sin(a) = Lq iq with
        L = U/|we|, to the angle a that gives the torque.
    4.  On it the angle ends where the current limit is met, or where the torque is largest (MTPV); the torque
        that is left is the one of that end.

    The resistance is neglected: a voltage limit less R times the current limit is on the safe side. Where the
    current limit cannot weaken the flux enough, no point keeps both; the current limit is kept then, with all
    current against the flux. Where the resistance leaves nothing of a sagging voltage, the current cancels the flux at
    any speed but zero.

    Parameters
    ----------
    pole_pairs : int
        Number of pole pairs.
    flux : float
        Peak flux linkage of the magnets [V s].
    inductance_d, inductance_q : float
        [H].

    References
    ----------
    S. Morimoto, Y. Takeda, T. Hirasa, K. Taniguchi, "Expansion of operating limits for permanent magnet motor by
    current vector control considering inverter capacity", IEEE Transactions on Industry Applications 26 (1990)
    866-871.
    """

    pole_pairs: int
    flux: FluxLinkage
    inductance_d: Inductance
    inductance_q: Inductance

    def __post_init__(self) -> None:
        check(self)
        if isinstance(self.pole_pairs, bool) or not isinstance(self.pole_pairs, int) or self.pole_pairs < 1:
            raise ValueError(f"CurrentReference.pole_pairs must be a whole number >= 1, got {self.pole_pairs!r}")

    def torque(self, direct: Scalar, quadrature: Scalar) -> Scalar:
        """Torque [N m] of two currents [A]."""
        return 1.5 * self.pole_pairs * (self.flux - self._saliency() * direct) * quadrature

    def direct_for(self, quadrature: Scalar) -> Scalar:
        """Direct current [A] of least total current for a quadrature one [A]."""
        square = 2 * self._saliency() * quadrature**2
        return -square / (self.flux + ca.sqrt(self.flux**2 + 2 * self._saliency() * square))

    def largest(self, current_limit: Scalar) -> list[Scalar]:
        """Currents [A] of the largest torque that a current limit [A] allows."""
        square = 2 * self._saliency() * current_limit**2
        direct = -square / (self.flux + ca.sqrt(self.flux**2 + 4 * self._saliency() * square))
        return [direct, ca.sqrt(current_limit**2 - direct**2)]

    def least(self, torque: Scalar) -> list[Scalar]:
        """Currents [A] of least magnitude for a torque [N m].

        With x = iq D/flux and t = torque D/(3/2 pole_pairs flux^2), x (1 + sqrt(1 + 4 x^2)) = 2 t. Squared it is
        x^4 + t x - t^2 = 0, solved after Ferrari; the forms below are those without cancellation.
        """
        without = torque / (1.5 * self.pole_pairs * self.flux)  # the quadrature current without saliency
        t = ca.sqrt((without * self._saliency() / self.flux) ** 2 + TINY**2)
        # m > 0 of m^3 + t^2 m = t^2/8, and s = sqrt(2 m) splits the quartic into two quadratics
        m = 2 * t / math.sqrt(3) * ca.sinh(ca.asinh(3 * math.sqrt(3) / (16 * t)) / 3)
        s = ca.sqrt(2 * m)
        part = 4 * t * s / (t + s**3)
        quadrature = without * part / (ca.sqrt(s**2 + 2 * t * part) + s)
        return [self.direct_for(quadrature), quadrature]

    def weakened(self, quadrature: Scalar, flux_limit: Scalar) -> Scalar:
        """Direct current [A] on the voltage ellipse for a quadrature one [A]; `flux_limit` = U/|we| [V s].

        id = (sqrt(flux_limit^2 - (Lq iq)^2) - flux)/Ld, with the root zero where iq alone takes the voltage.
        """
        left = ca.fmax(flux_limit**2 - (self.inductance_q * quadrature) ** 2, 0)
        return (ca.sqrt(left) - self.flux) / self.inductance_d

    def references(self, torque: Scalar, speed: Scalar, voltage_limit: Scalar, current_limit: Scalar) -> list[Scalar]:
        """Direct and quadrature current [A].

        Parameters
        ----------
        torque : float or SX
            [N m].
        speed : float or SX
            Of the rotor [rad/s].
        voltage_limit, current_limit : float or SX
            Of the magnitude of the dq vectors [V peak], [A peak]; a voltage of zero or less leaves nothing.
        """
        voltage_limit = ca.fmax(voltage_limit, LEAST_VOLTAGE)
        limit_d, limit_q = self.largest(current_limit)
        torque = saturate(torque, self.torque(limit_d, limit_q))
        direct, quadrature = self.least(torque)
        most = FAR_INSIDE * (self.flux + (self.inductance_d + self.inductance_q) * current_limit)
        flux_limit = voltage_limit / ca.fmax(self.pole_pairs * ca.fabs(speed), voltage_limit / most)
        square = (self.flux + self.inductance_d * direct) ** 2 + (self.inductance_q * quadrature) ** 2
        weak = self._on_ellipse(torque, flux_limit, current_limit)
        short = square > flux_limit**2
        return [direct + short * (weak[0] - direct), quadrature + short * (weak[1] - quadrature)]

    # -- on the voltage ellipse -----------------------------------------------------------------------

    def _saliency(self) -> Scalar:
        return self.inductance_q - self.inductance_d

    def _on_ellipse(self, torque: Scalar, flux_limit: Scalar, current_limit: Scalar) -> list[Scalar]:
        magnet = self.flux / self.inductance_d
        reluctance = flux_limit * (1 / self.inductance_q - 1 / self.inductance_d)
        cosine = ca.fmax(_pull_out(magnet, reluctance), self._at_current_limit(flux_limit, current_limit))
        end = ca.acos(saturate(cosine, BELOW_ONE))
        # the torque is `scale` times f(a) = sin(a) (magnet + reluctance cos(a)), rising through `wanted` up to the end
        scale = 1.5 * self.pole_pairs * flux_limit
        wanted = ca.fmin(ca.fabs(torque) / scale, ca.sin(end) * (magnet + reluctance * ca.cos(end)))
        low, high = 0.0 * end, end
        angle = end / 2
        for step in range(HALVINGS + NEWTON_STEPS):
            sine, cosine = ca.sin(angle), ca.cos(angle)
            excess = sine * (magnet + reluctance * cosine) - wanted
            over = excess > 0
            low, high = low + (1 - over) * (angle - low), high + over * (angle - high)
            if step < HALVINGS:
                angle = (low + high) / 2
                continue
            slope = magnet * cosine + reluctance * (cosine**2 - sine**2)
            angle = ca.fmin(ca.fmax(angle - excess / ca.fmax(slope, TINY * magnet), low), high)
        direct = (flux_limit * ca.cos(angle) - self.flux) / self.inductance_d
        forward = 1 - 2 * (torque < 0)
        return [ca.fmax(direct, -current_limit), forward * flux_limit * ca.sin(angle) / self.inductance_q]

    def _at_current_limit(self, flux_limit: Scalar, current_limit: Scalar) -> Scalar:
        """cos(a) where the ellipse meets the current circle against the flux; beyond +-1 where it does not.

        |i|^2 = ((L c - flux)/Ld)^2 + (L/Lq)^2 (1 - c^2) is quadratic in c: A c^2 - 2 B c + C = current_limit^2.
        """
        a = flux_limit**2 * (1 / self.inductance_d**2 - 1 / self.inductance_q**2)
        b = self.flux * flux_limit / self.inductance_d**2
        c = (self.flux / self.inductance_d) ** 2 + (flux_limit / self.inductance_q) ** 2 - current_limit**2
        return c / (b + ca.sqrt(ca.fmax(b**2 - a * c, TINY * b**2)))


def _pull_out(magnet: Scalar, reluctance: Scalar) -> Scalar:
    """cos(a) of the largest torque for a flux: magnet cos(a) + reluctance cos(2 a) = 0."""
    return 2 * reluctance / (magnet + ca.sqrt(magnet**2 + 8 * reluctance**2))
