"""Characteristics without memory: limit, dead zone, direction."""

import casadi as ca

from gear.quantities import Scalar


def saturate(value: Scalar, limit: Scalar | None) -> Scalar:
    """`value` held within +-limit; unchanged for limit None."""
    return value if limit is None else ca.fmax(-limit, ca.fmin(limit, value))


def dead_zone(value: Scalar, band: Scalar) -> Scalar:
    """Zero within +-band, shifted towards zero by `band` outside, so without a jump; of slope 1 at a band of zero."""
    return ca.fmax(value - band, 0) + ca.fmin(value + band, 0)


def direction(value: Scalar, band: Scalar, width: Scalar) -> Scalar:
    """-1, 0 or 1 with slopes between: the sign of `value` without its jump.

           1        ______
                   /
    ______________/            zero within +-band, 1 from band + width on
         -band   band
    """
    return saturate(dead_zone(value, band) / width, 1.0)


def closing_rate(rate: Scalar, period: Scalar | None) -> Scalar:
    """Rate [1/s] at which x' = rate (u - x) closes on its input, as a share of the gap per sample and second.

        continuous: rate,     sampled: (1 - exp(-rate period)) / period

    so that x + period closing_rate (u - x) is the exact solution after a period of constant input.
    """
    return rate if period is None else (1 - ca.exp(-rate * period)) / period
