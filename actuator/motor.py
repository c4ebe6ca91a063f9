"""Motors: torque from current, current from voltage."""

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Gt, Unit

from gear.quantities import Scalar, check

Resistance = Annotated[float, Unit("ohm"), Gt(0)]
Inductance = Annotated[float, Unit("H"), Gt(0)]
TorqueConstant = Annotated[float, Unit("N m/A"), Gt(0)]
FluxLinkage = Annotated[float, Unit("V s"), Gt(0)]
RotorInertia = Annotated[float, Unit("kg m^2"), Gt(0)]
TorqueLimit = Annotated[float, Unit("N m"), Gt(0)]


@dataclass(frozen=True, kw_only=True)
class TorqueSource:
    """An ideal motor: the torque it is asked for, at once, within a limit.

    Parameters
    ----------
    torque_limit : float or None
        Of the magnitude [N m]; None for none.
    """

    torque_limit: TorqueLimit | None = None

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True, kw_only=True)
class DCMotor:
    """Brushed permanent-magnet DC motor.

        inductance i' = v - resistance i - torque_constant w,     torque = torque_constant i

    Parameters
    ----------
    resistance, inductance : float
        Of the armature, terminal to terminal [ohm], [H].
    torque_constant : float
        [N m/A], the same number as the voltage constant [V s/rad].
    inertia : float
        Of the rotor [kg m^2].
    """

    resistance: Resistance
    inductance: Inductance
    torque_constant: TorqueConstant
    inertia: RotorInertia

    axes = ("current",)

    def __post_init__(self) -> None:
        check(self)

    def torque(self, currents: list[Scalar]) -> Scalar:
        """Electromagnetic torque [N m]."""
        return self.torque_constant * currents[0]

    def current_for(self, torque: Scalar) -> Scalar:
        """Current [A] for a torque [N m]."""
        return torque / self.torque_constant

    def references(self, current: Scalar) -> list[Scalar]:
        """Current reference of each axis [A] from the torque-producing one."""
        return [current]

    def coupling_voltages(self, currents: list[Scalar], speed: Scalar) -> list[Scalar]:
        """Voltages [V] from motion."""
        return [self.torque_constant * speed]

    def derivatives(self, currents: list[Scalar], voltages: list[Scalar], speed: Scalar) -> list[Scalar]:
        """Time derivatives of the currents [A/s]."""
        motion = self.coupling_voltages(currents, speed)[0]
        return [(voltages[0] - self.resistance * currents[0] - motion) / self.inductance]


@dataclass(frozen=True, kw_only=True)
class PMSM:
    """Permanent-magnet synchronous motor in rotor coordinates, peak-value (amplitude-invariant) dq quantities.

        Ld id' = vd - R id + we Lq iq
        Lq iq' = vq - R iq - we (Ld id + psi)             we = pole_pairs w
        torque = 3/2 pole_pairs (psi + (Ld - Lq) id) iq

    Parameters
    ----------
    pole_pairs : int
        Number of pole pairs.
    resistance : float
        Of one phase [ohm].
    inductance_d, inductance_q : float
        Synchronous inductances [H].
    flux : float
        Peak flux linkage of the magnets in one phase, psi [V s].
    inertia : float
        Of the rotor [kg m^2].

    References
    ----------
    P. C. Krause, O. Wasynczuk, S. D. Sudhoff, "Analysis of Electric Machinery and Drive Systems" (2002), ch. 11.
    """

    pole_pairs: int
    resistance: Resistance
    inductance_d: Inductance
    inductance_q: Inductance
    flux: FluxLinkage
    inertia: RotorInertia

    axes = ("current_d", "current_q")

    def __post_init__(self) -> None:
        check(self)
        if isinstance(self.pole_pairs, bool) or not isinstance(self.pole_pairs, int) or self.pole_pairs < 1:
            raise ValueError(f"PMSM.pole_pairs must be a whole number >= 1, got {self.pole_pairs!r}")

    def torque(self, currents: list[Scalar]) -> Scalar:
        """Electromagnetic torque [N m]."""
        direct, quadrature = currents
        return 1.5 * self.pole_pairs * (self.flux + (self.inductance_d - self.inductance_q) * direct) * quadrature

    def current_for(self, torque: Scalar) -> Scalar:
        """Quadrature current [A peak] for a torque [N m] at zero direct current."""
        return torque / (1.5 * self.pole_pairs * self.flux)

    def references(self, current: Scalar) -> list[Scalar]:
        """Current reference of each axis [A] from the torque-producing one."""
        return [0.0, current]

    def coupling_voltages(self, currents: list[Scalar], speed: Scalar) -> list[Scalar]:
        """Voltages [V] from motion: back-emf and the coupling of the axes."""
        electrical = self.pole_pairs * speed
        direct, quadrature = currents
        return [
            -electrical * self.inductance_q * quadrature,
            electrical * (self.inductance_d * direct + self.flux),
        ]

    def derivatives(self, currents: list[Scalar], voltages: list[Scalar], speed: Scalar) -> list[Scalar]:
        """Time derivatives of the currents [A/s]."""
        motion = self.coupling_voltages(currents, speed)
        inductances = (self.inductance_d, self.inductance_q)
        return [
            (voltage - self.resistance * current - emf) / inductance
            for voltage, current, emf, inductance in zip(voltages, currents, motion, inductances, strict=True)
        ]
