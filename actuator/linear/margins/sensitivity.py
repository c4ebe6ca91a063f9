"""Responses with the loop closed: sensitivity, its complement, and compliance."""

from collections.abc import Sequence

import control
import numpy as np

from actuator.linear.model import linearize, loop_transfer
from actuator.linear.operating_point import OperatingPoint


def sensitivity(point: OperatingPoint, at: str, *, drifting: Sequence[str] = ()) -> control.StateSpace:
    """S = 1/(1 + L) of the loop at a named signal: the signal as used over what is added to it.

    Parameters as for `loop_transfer`, and as many inputs and outputs.
    """
    loop = loop_transfer(point, at, drifting=drifting)
    return _feedback(loop, np.eye(loop.ninputs), 1.0, "used")


def complementary_sensitivity(point: OperatingPoint, at: str, *, drifting: Sequence[str] = ()) -> control.StateSpace:
    """T = L/(1 + L) = 1 - S of the loop at a named signal.

    Parameters as for `loop_transfer`.
    """
    loop = loop_transfer(point, at, drifting=drifting)
    return _feedback(loop, np.zeros((loop.ninputs,) * 2), -1.0, "complementary")


def _feedback(loop: control.StateSpace, direct: np.ndarray, sign: float, word: str) -> control.StateSpace:
    """`direct` - `sign` L/(1 + L)."""
    a, b, c, d = loop.A, loop.B, loop.C, loop.D
    through = np.linalg.inv(np.eye(len(d)) + d)
    return control.StateSpace(
        a - b @ through @ c,
        b @ through,
        -sign * through @ c,
        direct - sign * through @ d,
        loop.dt,
        states=loop.state_labels,
        inputs=loop.input_labels,
        outputs=[f"{name}_{word}" for name in loop.input_labels],
        remove_useless_states=False,
    )


def load_response(
    point: OperatingPoint, outputs: Sequence[str] = ("load_angle",), *, drifting: Sequence[str] = ()
) -> control.StateSpace:
    """Response of outputs to a torque on the output shaft, all loops closed: for the load angle, the compliance.

    Parameters as for `linearize`; in sampled control the torque is constant over a period, and `harmonic_response` has
    the one to sines.
    """
    return linearize(point, ["load_torque"], outputs, drifting=drifting)
