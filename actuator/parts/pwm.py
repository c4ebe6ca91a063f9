r"""Pulse-width modulation with its switching: for short windows in which the ripple is wanted.

Carrier: a symmetric triangle, 1 at the ends of the period and 0 in its middle. A leg is high where its duty
ratio is above the carrier, which centers the pulse in the period.

        carrier   1  \    /
                      \  /
                  0    \/           leg high for (1 - duty)/2 <= t/period <= (1 + duty)/2
"""

from typing import NamedTuple

import casadi as ca

from gear.quantities import Scalar


class Pulse(NamedTuple):
    """Instants at which a leg switches, as parts of the period [-]."""

    rise: Scalar
    fall: Scalar


def duties(phases: list[Scalar], dc_voltage: Scalar) -> list[Scalar]:
    """Duty ratios of three legs for phase voltages [V], space-vector centered.

        duty = 1/2 + (v - (largest + smallest)/2)/dc_voltage

    Within 0..1 for line-to-line voltages up to the link's.

    References
    ----------
    D. G. Holmes, T. A. Lipo, "Pulse Width Modulation for Power Converters" (2003), section 6.
    """
    a, b, c = phases
    middle = (ca.fmax(ca.fmax(a, b), c) + ca.fmin(ca.fmin(a, b), c)) / 2
    return [0.5 + (phase - middle) / dc_voltage for phase in phases]


def bridge_duties(voltage: Scalar, dc_voltage: Scalar) -> list[Scalar]:
    """Duty ratios of the two legs of a DC motor for its voltage [V]."""
    half = voltage / (2 * dc_voltage)
    return [0.5 + half, 0.5 - half]


def carrier(part: Scalar) -> Scalar:
    """The triangle [-] at a part of the period, 0..1."""
    return ca.fabs(2 * part - 1)


def pulse(duty: Scalar) -> Pulse:
    """When a leg of a duty ratio switches, as parts of the period [-]."""
    return Pulse((1 - duty) / 2, (1 + duty) / 2)


def leg_voltages(ratios: list[Scalar], part: Scalar, dc_voltage: Scalar) -> list[Scalar]:
    """Voltages [V] of the legs against the middle of the link at a part of the period."""
    return [((duty > carrier(part)) - 0.5) * dc_voltage for duty in ratios]
