"""Tables over one quantity: straight lines between the entries, as expressions, and the rules of a speed axis."""

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


def require_axis(owner: str, speeds: Sequence[float]) -> None:
    """Raise ValueError where the speeds [m/s] of the `points` of a table do not increase from zero."""
    if not speeds:
        raise ValueError(f"{owner}.points must not be empty")
    if speeds[0] != 0:
        raise ValueError(f"{owner}.points[0].speed must be 0 m/s, where the table begins, got {speeds[0]:g} m/s")
    for k, (last, speed) in enumerate(zip(speeds, speeds[1:], strict=False), start=1):
        if speed <= last:
            raise ValueError(f"{owner}.points[{k}].speed must be > {last:g} m/s, the one before, got {speed:g} m/s")
