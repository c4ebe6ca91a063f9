"""The permanent-magnet synchronous motor in rotor coordinates."""

import math
from dataclasses import dataclass, field, replace
from typing import Any

from actuator.parts.electrical import FluxLinkage, Inductance, Resistance, RotorInertia
from actuator.parts.inverter import Inverter
from actuator.parts.motor import VoltageDriven
from actuator.parts.rotor import MotorLosses, Rotor
from actuator.parts.saturation import Inductances, Saturation
from actuator.parts.temperature import MotorTemperature, TemperatureDependence
from actuator.parts.voltage_limit import VoltageEllipse
from gear.quantities import Scalar, check, check_count, show
from gear.quantities.registry import part


@part(VoltageDriven)
@dataclass(frozen=True, kw_only=True)
class PMSM(VoltageDriven):
    """Permanent-magnet synchronous motor in rotor coordinates, peak-value (amplitude-invariant) dq quantities.

        psi_d' = vd - R id + we psi_q,     psi_d = psi + Ld id        we = pole_pairs w
        psi_q' = vq - R iq - we psi_d,     psi_q = Lq iq
        torque = 3/2 pole_pairs (psi_d iq - psi_q id)

    Parameters
    ----------
    pole_pairs : int
        Number of pole pairs.
    resistance : float
        Of one phase [ohm].
    inductance_d, inductance_q : float
        Synchronous inductances [H], before saturation.
    flux : float
        Peak flux linkage of the magnets in one phase, psi [V s].
    inertia : float
        Of the rotor [kg m^2].
    rotor : Rotor
        Cogging and drag.
    temperature_dependence : TemperatureDependence or None
        Of resistance and flux; None for none.
    saturation : Saturation or None
        Taken off the flux linkages; None for none.

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
    rotor: Rotor = field(default_factory=Rotor)
    temperature_dependence: TemperatureDependence | None = None
    saturation: Saturation | None = None

    def __post_init__(self) -> None:
        check(self)
        check_count(self, "pole_pairs")
        if self.saturation is not None:
            for axis, own, lost in (
                ("d", self.inductance_d, self.saturation.lost_d),
                ("q", self.inductance_q, self.saturation.lost_q),
            ):
                if lost >= own:
                    raise ValueError(
                        f"PMSM.saturation must leave an inductance: lost_{axis} must be < {show(own, 'H')}, "
                        f"the motor's inductance_{axis}, got {show(lost, 'H')}"
                    )

    @classmethod
    def examples(cls) -> "tuple[PMSM, ...]":
        """Plain and salient, with all that it can have, saturated."""
        plain = cls(pole_pairs=4, resistance=0.3, inductance_d=4e-4, inductance_q=4e-4, flux=0.0125, inertia=2e-5)
        salient = replace(
            plain, inductance_q=8e-4, rotor=Rotor.examples()[-1], temperature_dependence=TemperatureDependence()
        )
        return (plain, salient, replace(salient, saturation=Saturation(lost_q=2e-4, current_d=20.0, current_q=20.0)))

    @property
    def axes(self) -> tuple[str, ...]:
        """Direct and quadrature axis."""
        return ("current_d", "current_q")

    @property
    def frame_turns(self) -> int:
        """The axes turn with the magnets."""
        return self.pole_pairs

    def rotor_inertia(self) -> Scalar:
        """[kg m^2]."""
        return self.inertia

    def has_rotor_torque(self) -> bool:
        """Whether the rotor has cogging or drag."""
        return self.rotor.acts()

    def without_saturation(self) -> "PMSM":
        """The same motor with constant inductances."""
        return replace(self, saturation=None)

    @classmethod
    def from_data_sheet(
        cls,
        *,
        pole_pairs: int,
        resistance_line_to_line: float,
        inductance_line_to_line: float,
        largest_inductance_line_to_line: float | None = None,
        torque_constant_per_A_rms: float | None = None,
        torque_constant_per_A_peak: float | None = None,
        voltage_constant_line_to_line_rms: float | None = None,
        **more: Any,
    ) -> "PMSM":
        """From the numbers of a data sheet, by their conventions.

            flux = torque per A peak / (3/2 pole_pairs) = torque per A rms / (3/2 pole_pairs sqrt(2))
                 = sqrt(2/3) voltage_constant / pole_pairs

        A delta winding is taken as the star with the same values between its terminals.

        Parameters
        ----------
        pole_pairs : int
            Half the number of poles.
        resistance_line_to_line : float
            Between two terminals [ohm].
        inductance_line_to_line : float
            Between two terminals [H]; with saliency the smallest over the rotor angle (d axis).
        largest_inductance_line_to_line : float or None
            The largest over the rotor angle (q axis) [H]; None without saliency.
        torque_constant_per_A_rms, torque_constant_per_A_peak : float or None
            [N m/A], per ampere of a line's sinusoidal current.
        voltage_constant_line_to_line_rms : float or None
            Back-emf between two terminals, rms, over mechanical speed [V s/rad]. One of these three is needed.
        more
            The other fields of PMSM as they are: `inertia`, and what is optional.

        Raises
        ------
        ValueError
            Where not exactly one constant is given.
        """
        constants = {
            "torque_constant_per_A_rms": (torque_constant_per_A_rms, 1 / (1.5 * math.sqrt(2))),
            "torque_constant_per_A_peak": (torque_constant_per_A_peak, 1 / 1.5),
            "voltage_constant_line_to_line_rms": (voltage_constant_line_to_line_rms, math.sqrt(2 / 3)),
        }
        given = {name: value * factor for name, (value, factor) in constants.items() if value is not None}
        if len(given) != 1:
            raise ValueError(
                f"PMSM.from_data_sheet needs one of {', '.join(constants)}; got {', '.join(given) or 'none'}"
            )
        largest = (
            inductance_line_to_line if largest_inductance_line_to_line is None else largest_inductance_line_to_line
        )
        return cls(
            pole_pairs=pole_pairs,
            resistance=resistance_line_to_line / 2,
            inductance_d=inductance_line_to_line / 2,
            inductance_q=(inductance_line_to_line if largest is None else largest) / 2,
            flux=next(iter(given.values())) / pole_pairs,
            **more,
        )

    def resistance_at(self, temperature: MotorTemperature | None = None) -> Scalar:
        """Of one phase [ohm] at a temperature; None for the reference."""
        law = self.temperature_dependence
        return self.resistance if law is None else self.resistance * law.resistance_factor(temperature)

    def flux_at(self, temperature: MotorTemperature | None = None) -> Scalar:
        """Of the magnets [V s] at a temperature; None for the reference."""
        law = self.temperature_dependence
        return self.flux if law is None else self.flux * law.flux_factor(temperature)

    def flux_linkages(self, currents: list[Scalar], temperature: MotorTemperature | None = None) -> list[Scalar]:
        """Of both axes [V s], peak."""
        direct, quadrature = currents
        linkages = [self.inductance_d * direct + self.flux_at(temperature), self.inductance_q * quadrature]
        if self.saturation is None:
            return linkages
        lost = self.saturation.lost_flux(direct, quadrature)
        return [linear - less for linear, less in zip(linkages, lost, strict=True)]

    def inductances(self, currents: list[Scalar]) -> Inductances:
        """Incremental inductances [H]: derivatives of the flux linkages."""
        if self.saturation is None:
            return Inductances(self.inductance_d, self.inductance_q, 0.0)
        lost = self.saturation.lost_inductances(*currents)
        return Inductances(self.inductance_d - lost.d, self.inductance_q - lost.q, -lost.mutual)

    def torque(self, currents: list[Scalar], temperature: MotorTemperature | None = None) -> Scalar:
        """Electromagnetic torque [N m]."""
        direct, quadrature = currents
        if self.saturation is None:
            saliency = (self.inductance_d - self.inductance_q) * direct
            return 1.5 * self.pole_pairs * (self.flux_at(temperature) + saliency) * quadrature
        flux_d, flux_q = self.flux_linkages(currents, temperature)
        return 1.5 * self.pole_pairs * (flux_d * quadrature - flux_q * direct)

    def shaft_torque(
        self, currents: list[Scalar], angle: Scalar, speed: Scalar, temperature: MotorTemperature | None = None
    ) -> Scalar:
        """Torque on the rotor [N m] with cogging and drag, at its mechanical angle and speed."""
        return self.torque(currents, temperature) + self.rotor.torque(angle, speed)

    def current_for(self, torque: Scalar) -> Scalar:
        """Quadrature current [A peak] for a torque [N m] at zero direct current, by the magnets' flux."""
        return torque / (1.5 * self.pole_pairs * self.flux)

    def references(self, current: Scalar) -> list[Scalar]:
        """Current reference of each axis [A] from the torque-producing one."""
        return [0.0, current]

    def constants_for_mtpa(self) -> dict[str, Scalar]:
        """Of a motor without saturation at the reference temperature."""
        return {name: getattr(self, name) for name in ("pole_pairs", "flux", "inductance_d", "inductance_q")}

    def coupling_voltages(
        self, currents: list[Scalar], speed: Scalar, temperature: MotorTemperature | None = None
    ) -> list[Scalar]:
        """Voltages [V] from motion: back-emf and the coupling of the axes."""
        electrical = self.pole_pairs * speed
        flux_d, flux_q = self.flux_linkages(currents, temperature)
        return [-electrical * flux_q, electrical * flux_d]

    def derivatives(
        self,
        currents: list[Scalar],
        voltages: list[Scalar],
        speed: Scalar,
        temperature: MotorTemperature | None = None,
    ) -> list[Scalar]:
        """Time derivatives of the currents [A/s] at constant temperature."""
        motion, resistance = self.coupling_voltages(currents, speed, temperature), self.resistance_at(temperature)
        flux_d, flux_q = (
            voltage - resistance * current - emf
            for voltage, current, emf in zip(voltages, currents, motion, strict=True)
        )
        own = self.inductances(currents)
        if self.saturation is None:
            return [flux_d / own.d, flux_q / own.q]
        determinant = own.d * own.q - own.mutual**2
        return [
            (own.q * flux_d - own.mutual * flux_q) / determinant,
            (own.d * flux_q - own.mutual * flux_d) / determinant,
        ]

    def electrical_power(self, currents: list[Scalar], voltages: list[Scalar]) -> Scalar:
        """Into the three phases [W]."""
        return 1.5 * sum(voltage * current for voltage, current in zip(voltages, currents, strict=True))

    def magnetic_energy(self, currents: list[Scalar]) -> Scalar:
        """Stored by the currents [J], beyond that of the magnets."""
        direct, quadrature = currents
        stored = (self.inductance_d * direct**2 + self.inductance_q * quadrature**2) / 2
        if self.saturation is not None:
            lost_d, lost_q = self.saturation.lost_flux(direct, quadrature)
            stored += self.saturation.lost_coenergy(direct, quadrature) - direct * lost_d - quadrature * lost_q
        return 1.5 * stored

    def stored_energy(self, currents: list[Scalar], angle: Scalar) -> Scalar:
        """Of the currents and of the cogging [J]."""
        return self.magnetic_energy(currents) + self.rotor.energy(angle)

    def drag_torque(self, speed: Scalar) -> Scalar:
        """Of the rotor, cogging averaged out [N m]."""
        return self.rotor.drag_torque(speed)

    def steady_currents(
        self, inverter: Inverter, speed: float, *, field_weakening: bool, temperature: MotorTemperature | None
    ) -> list[float]:
        """Where the voltage ellipse meets the current circle, or with the direct current of the largest torque."""
        if self.saturation is not None:
            raise ValueError(
                "torque_speed_curve is a closed form of constant inductances; give the motor without saturation "
                "(motor.without_saturation())"
            )
        ellipse = VoltageEllipse(self, inverter, speed, temperature)
        return ellipse.weakened() if field_weakening else ellipse.without_weakening()

    def losses(self, currents: list[Scalar], speed: Scalar, temperature: MotorTemperature | None = None) -> MotorLosses:
        """Where the motor makes heat [W]."""
        return MotorLosses(
            copper=1.5 * self.resistance_at(temperature) * sum(current**2 for current in currents),
            iron=self.rotor.iron_loss(speed),
            friction=self.rotor.friction_loss(speed),
        )
