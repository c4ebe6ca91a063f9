"""Derating: less current where the supply sags or something is too hot."""

from dataclasses import dataclass

import casadi as ca

from actuator.parts.electrical import Voltage
from gear.quantities import Scalar, Temperature, check, show


def _share(value: Scalar, none: Scalar, full: Scalar) -> Scalar:
    """0 at and beyond `none`, 1 at and beyond `full`, straight between."""
    return ca.fmax(0, ca.fmin(1, (value - none) / (full - none)))


@dataclass(frozen=True, kw_only=True)
class UndervoltageDerating:
    """Current limit that falls with the voltage of the DC link.

    Parameters
    ----------
    full, none : float
        Link voltages [V] down to which the limit is whole, and at which no current is left; none < full.
    """

    full: Voltage
    none: Voltage

    def __post_init__(self) -> None:
        check(self)
        if self.none >= self.full:
            raise ValueError(
                f"UndervoltageDerating.none must be < {show(self.full, 'V')}, `full`, got {show(self.none, 'V')}"
            )

    def share(self, dc_voltage: Scalar) -> Scalar:
        """Of the current limit [-], from 0 to 1."""
        return _share(dc_voltage, self.none, self.full)


@dataclass(frozen=True, kw_only=True)
class OverheatDerating:
    """Current limit that falls with a temperature, usually that of the winding.

    Parameters
    ----------
    full, none : float
        Temperatures [K] up to which the limit is whole, and at which no current is left; full < none.
    """

    full: Temperature
    none: Temperature

    def __post_init__(self) -> None:
        check(self)
        if self.none <= self.full:
            raise ValueError(
                f"OverheatDerating.none must be > {show(self.full, 'K')}, `full`, got {show(self.none, 'K')}"
            )

    def share(self, temperature: Scalar) -> Scalar:
        """Of the current limit [-], from 0 to 1."""
        return _share(temperature, self.none, self.full)
