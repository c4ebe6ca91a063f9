"""Loops opened at a named signal, in one contact mode, in continuous or in discrete time."""

from collections.abc import Sequence
from typing import Any

import control
import numpy as np

from actuator.linear.model import build_model, linearize, require_still, select
from actuator.linear.operating_point import OperatingPoint
from actuator.linear.sampled import lift
from actuator.system.hybrid import HybridSystem
from controllers.loop import PREFIX
from gear.quantities import require_known
from gear.quantities.roles import LoopSignal

CANCELED = 8 * np.finfo(float).eps  # part that is left by rounding of what the opened loop had fed back


def loop_transfer(
    point: OperatingPoint, at: str, *, drifting: Sequence[str] = (), minimal: bool = False
) -> control.StateSpace:
    """Loop transfer with the loop opened at a named signal, all other loops closed.

    The signal is cut: what goes on is the input u, what comes back is the signal as computed, y. Then

        L = -y/u,    sensitivity = 1/(1 + L)

    so the usual rules for negative feedback hold (stable by the Nyquist criterion about -1).

    In sampled control the signals are held, and L is exact in discrete time with the period of the slowest clock. A
    signal that is renewed N times in that period is cut N times in it: L has N inputs and outputs.

    It is a model that python-control's tools take; those that make polynomials of it, for root loci, need that of
    `reduce_order`.

    Parameters
    ----------
    point : OperatingPoint
        Where and in which contact mode.
    at : str
        A signal with an injection input: position, speed_reference, torque_reference or voltage.
    drifting, minimal
        As for `linearize`.

    Raises
    ------
    ValueError
        For the voltage of a sampled motor with two axes: it turns with the rotor between the ticks.
    """
    system = point.system
    require_loop(system, at)
    if not system.clocks:
        closed = linearize(point, [PREFIX + at], [at], drifting=drifting, minimal=minimal)
        matrices, step = (closed.A, closed.B, closed.C, closed.D), 0.0
        return _cut(matrices, closed.state_labels, [at], step)
    require_still(point, drifting)
    every = ticks_between(system, at)
    selected = select(system, [PREFIX + at], [at])
    matrices = lift(point, selected.columns, selected.rows, every)
    parts = system.hyperperiod // every
    channels = [at] if parts == 1 else [f"{at}_{k}" for k in range(parts)]
    step = system.hyperperiod * system.tick_period(point.p)
    closed = build_model(point, matrices, channels, channels, step, minimal=minimal)
    return _cut((closed.A, closed.B, closed.C, closed.D), closed.state_labels, channels, step)


def require_loop(system: HybridSystem, at: str) -> None:
    """Raise KeyError where a system has no loop signal of that name."""
    require_known([at], [role.signal for q in system.inputs if (role := q.role(LoopSignal))], "loop signal")


def _cut(closed: tuple[Any, ...], states: Sequence[str], channels: Sequence[str], step: float) -> control.StateSpace:
    """The loop of a closed one: used = computed + d. Cut, d = used - computed, so d = (1 + D)^-1 (used - C x)."""
    a, b, c, d = closed
    through = np.linalg.inv(np.eye(len(d)) + d)
    back = b @ through @ c
    opened = a - back
    opened[abs(opened) <= CANCELED * (abs(a) + abs(back))] = 0  # an integrator is one, not a pole at 1e-9 1/s
    return control.StateSpace(
        opened,
        b @ through,
        -through @ c,
        -through @ d,
        step,
        states=states,
        inputs=list(channels),
        outputs=[f"{name}_returned" for name in channels],
        remove_useless_states=False,
    )


def ticks_between(system: HybridSystem, at: str) -> int:
    """Ticks between two values of a held signal."""
    assert system.tick is not None
    held = [k for k, state in enumerate(system.states) if (role := state.role(LoopSignal)) and role.signal == at]
    if not held:
        raise ValueError(
            f"{system.name}: {at} is not held between ticks, it turns with the rotor; open the loop at another signal"
        )
    by_due = system.tick.jac_sparsity(0, 0)
    return min(system.clocks[k].every for i, k in zip(by_due.row(), by_due.get_col(), strict=True) if i == held[0])
