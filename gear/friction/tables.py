"""Tables over one quantity, as expressions: straight lines between the entries."""

from collections.abc import Sequence

import casadi as ca

from gear.quantities import Scalar


def piecewise_linear(x: Scalar, axis: Sequence[Scalar], values: Sequence[Scalar]) -> Scalar:
    """Value of a table at x, for floats and expressions.

    Straight lines between the entries, constant beyond the first and the last. On an entry the slope is the
    mean of those on both sides.

    Parameters
    ----------
    x : float or SX
        Where.
    axis, values : sequence
        Of the same length >= 1; the axis increases.
    """
    result = values[0]
    for k in range(len(axis) - 1):
        width = axis[k + 1] - axis[k]
        passed = ca.fmin(ca.fmax(x - axis[k], 0), width)
        result = result + (values[k + 1] - values[k]) * passed / width
    return result
