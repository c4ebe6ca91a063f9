"""The DC link: a source behind a resistance, a capacitor, and a resistor for what the motor gives back."""

from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import casadi as ca

from actuator.parts.electrical import Capacitance, Resistance, Voltage
from gear.quantities import Scalar, check, show

SourceKind = Literal["battery", "rectifier"]


class LinkPowers(NamedTuple):
    """Where the power of the link goes [W]."""

    source: Scalar  # from the ideal source
    source_loss: Scalar  # heat in its resistance
    chopper_loss: Scalar  # heat in the braking resistor


@dataclass(frozen=True, kw_only=True)
class BrakingChopper:
    """Resistor across the link, switched so that it carries more the higher the voltage.

        i = duty u/resistance,     duty = (u - start)/(full - start) within 0..1

    Parameters
    ----------
    resistance : float
        [ohm].
    start, full : float
        Link voltages at which it begins to switch and from which on it conducts all the time [V].
    """

    resistance: Resistance
    start: Voltage
    full: Voltage

    def __post_init__(self) -> None:
        check(self)
        if self.full <= self.start:
            raise ValueError(
                f"BrakingChopper.full must be > {show(self.start, 'V')}, `start`, got {show(self.full, 'V')}"
            )

    def current(self, voltage: Scalar) -> Scalar:
        """Taken from the link [A]."""
        duty = ca.fmax(0, ca.fmin(1, (voltage - self.start) / (self.full - self.start)))
        return duty * voltage / self.resistance


@dataclass(frozen=True, kw_only=True)
class DCLink:
    """Voltage u of the capacitor between source and inverter.

        capacitance u' = (source_voltage - u)/source_resistance - chopper current - drawn current

    Parameters
    ----------
    source_voltage : float
        Of the source without load [V].
    source_resistance : float
        Of the source and its cable [ohm].
    capacitance : float
        [F].
    source : "battery" or "rectifier"
        Whether the source takes current back.
    chopper : BrakingChopper or None
        A braking resistor.
    """

    source_voltage: Voltage
    source_resistance: Resistance
    capacitance: Capacitance
    source: SourceKind = "battery"
    chopper: BrakingChopper | None = None

    def __post_init__(self) -> None:
        check(self)
        if self.source not in get_args(SourceKind):
            raise ValueError(f"DCLink.source must be one of battery, rectifier, got {self.source!r}")
        if self.chopper is not None and self.chopper.start <= self.source_voltage:
            raise ValueError(
                f"DCLink.chopper.start must be > {show(self.source_voltage, 'V')}, the source's voltage, or it never "
                f"rests; got {show(self.chopper.start, 'V')}"
            )

    def source_current(self, voltage: Scalar) -> Scalar:
        """From the source [A] at a link voltage [V]."""
        current = (self.source_voltage - voltage) / self.source_resistance
        return ca.fmax(0, current) if self.source == "rectifier" else current

    def rate(self, voltage: Scalar, drawn: Scalar) -> Scalar:
        """Time derivative of the link voltage [V/s]; the inverter draws (motor power + its losses)/voltage [A]."""
        chopper = 0.0 if self.chopper is None else self.chopper.current(voltage)
        return (self.source_current(voltage) - chopper - drawn) / self.capacitance

    def energy(self, voltage: Scalar) -> Scalar:
        """In the capacitor [J]."""
        return self.capacitance * voltage**2 / 2

    def powers(self, voltage: Scalar) -> LinkPowers:
        """Of the source and of both resistances [W]."""
        current = self.source_current(voltage)
        chopper = 0.0 if self.chopper is None else self.chopper.current(voltage) * voltage
        return LinkPowers(self.source_voltage * current, self.source_resistance * current**2, chopper)
