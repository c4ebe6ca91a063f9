"""Linear models: one per contact mode, exact, in deviations from an operating point; and their loops."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import control
import numpy as np

from actuator.linear.balance import rounding
from actuator.linear.jacobians import jacobians, require_smooth
from actuator.linear.locked import unlocked
from actuator.linear.operating_point import NoEquilibrium, OperatingPoint
from actuator.linear.sampled import lifted
from actuator.system.builder import PREFIX
from actuator.system.hybrid import HybridSystem
from gear.quantities import require_known

CANCELED = 8 * np.finfo(float).eps  # part that is left by rounding of what the opened loop had fed back
RESIDUAL = 1e-5  # rate of a state over its nominal size [1/s]


class _Selected(NamedTuple):
    """Columns and rows that were asked for, and what python-control is to call them."""

    columns: list[int]
    rows: list[int]
    inputs: list[str]
    outputs: list[str]


def linearize(
    point: OperatingPoint,
    inputs: Sequence[str],
    outputs: Sequence[str],
    *,
    drifting: Sequence[str] = (),
    minimal: bool = False,
) -> control.StateSpace:
    """Linear model of the point's contact mode, in deviations from the point.

    Stuck contacts stay stuck and sliding ones keep their direction, so a stuck contact leaves two poles at
    zero that no input reaches: its locked position and its speed.

    With a sampled controller the model is in discrete time, exact, with the period of the slowest clock: inputs are
    constant over it, outputs are those just after the ticks at its beginning, states those just before them.

    Parameters
    ----------
    point : OperatingPoint
        From `trim`; it carries the mode.
    inputs, outputs : sequence of str
        Names; an output may also be a state.
    drifting : sequence of str
        States that move steadily at the point, with the reason on the caller's side.
    minimal : bool
        Whether what stuck contacts lock is taken out of the states. Outputs stay those of the whole model.

    Returns
    -------
    control.StateSpace
        With named states, inputs and outputs.

    Raises
    ------
    NoEquilibrium
        Where another state moves, with its rate.
    ValueError
        For sensors that count or are noisy: their steps have no derivative.
    """
    _require_still(point, drifting)
    selected = _select(point.system, inputs, outputs)
    matrices, step = _matrices(point, selected)
    return _model(point, matrices, selected.inputs, selected.outputs, step, minimal=minimal)


def least_dynamics(point: OperatingPoint, *, drifting: Sequence[str] = ()) -> tuple[np.ndarray, list[str], float]:
    """A of `linearize` without what stuck contacts lock, the names of its states, and its period (0: continuous).

    python-control has no model with one state and no input.
    """
    _require_still(point, drifting)
    matrices, step = _matrices(point, _select(point.system, [], []))
    (a, *_), kept = unlocked(point, matrices)
    return a, [point.system.states[k].name for k in kept], step


def _matrices(point: OperatingPoint, selected: _Selected) -> tuple[tuple[np.ndarray, ...], float]:
    """A, B, C, D, and their period (0: continuous)."""
    system = point.system
    if system.clocks:
        every = system.hyperperiod
        return lifted(point, selected.columns, selected.rows, every), every * system.tick_period(point.p)
    a, b, c, d = jacobians(point)
    return (a, b[:, selected.columns], c[selected.rows], d[np.ix_(selected.rows, selected.columns)]), 0.0


def _require_still(point: OperatingPoint, drifting: Sequence[str]) -> None:
    """Raise where a state moves that is not said to, or where there is no derivative."""
    system = point.system
    require_known(drifting, [quantity.name for quantity in system.states], "state")
    require_smooth(system)
    floor = rounding(system, point.x, point.m, point.u, point.p)
    moving = {
        quantity.name: rate
        for quantity, rate, least in zip(system.states, point.rates, floor, strict=True)
        if abs(rate) > max(RESIDUAL, least) * quantity.nominal and quantity.name not in drifting
    }
    if moving:
        text = ", ".join(f"d({name})/dt = {rate:.4g}" for name, rate in moving.items())
        raise NoEquilibrium(f"{system.name}: cannot linearize where states still move: {text}; trim first", moving)


def _select(system: HybridSystem, inputs: Sequence[str], outputs: Sequence[str]) -> _Selected:
    """Where the named signals stand; outputs first, then states."""
    input_names = [quantity.name for quantity in system.inputs]
    output_names = [quantity.name for quantity in system.outputs]
    rows = [*output_names, *(quantity.name for quantity in system.states)]
    require_known(inputs, input_names, "input")
    require_known(outputs, rows, "output")
    return _Selected(
        columns=[input_names.index(name) for name in inputs],
        rows=[rows.index(name) for name in outputs],
        inputs=[_signal(name) for name in inputs],
        # a state may have the name of an output but for the dot
        outputs=[
            _signal(name) + "_state" * (_signal(name) != name and _signal(name) in output_names) for name in outputs
        ],
    )


def _model(  # noqa: PLR0913 - a model and all its names
    point: OperatingPoint,
    matrices: tuple[np.ndarray, ...],
    inputs: list[str],
    outputs: list[str],
    step: float,
    *,
    minimal: bool,
) -> control.StateSpace:
    """A named model from its matrices, with or without what is locked."""
    names = [_signal(quantity.name) for quantity in point.system.states]
    if minimal:
        matrices, kept = unlocked(point, matrices)
        names = [names[k] for k in kept]
    return control.StateSpace(
        *matrices, step, states=names, inputs=inputs, outputs=outputs, remove_useless_states=False
    )


def _signal(name: str) -> str:
    """python-control keeps dots for the names of subsystems."""
    return name.replace(".", "_")


def loop_transfer(
    point: OperatingPoint, at: str, *, drifting: Sequence[str] = (), minimal: bool = False
) -> control.StateSpace:
    """Loop transfer with the loop opened at a named signal, all other loops closed.

    The signal is cut: what goes on is the input u, what comes back is the signal as computed, y. Then

        L = -y/u,    sensitivity = 1/(1 + L)

    so the usual rules for negative feedback hold (stable by the Nyquist criterion about -1).

    In sampled control the signals are held, and L is exact in discrete time with the period of the slowest clock. A
    signal that is renewed N times in that period is cut N times in it: L has N inputs and outputs.

    It is a model that python-control's tools take. Those that make polynomials of it, for root loci, need `reduced`.

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
    _require_still(point, drifting)
    every = ticks_between(system, at)
    selected = _select(system, [PREFIX + at], [at])
    matrices = lifted(point, selected.columns, selected.rows, every)
    parts = system.hyperperiod // every
    channels = [at] if parts == 1 else [f"{at}_{k}" for k in range(parts)]
    step = system.hyperperiod * system.tick_period(point.p)
    closed = _model(point, matrices, channels, channels, step, minimal=minimal)
    return _cut((closed.A, closed.B, closed.C, closed.D), closed.state_labels, channels, step)


def require_loop(system: HybridSystem, at: str) -> None:
    """Raise KeyError where a system has no loop signal of that name."""
    points = [q.name.removeprefix(PREFIX) for q in system.inputs if q.name.startswith(PREFIX)]
    require_known([at], points, "loop signal")


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
    names = [quantity.name for quantity in system.states]
    if f"controller.{at}" not in names:
        raise ValueError(
            f"{system.name}: {at} is not held between ticks, it turns with the rotor; open the loop at another signal"
        )
    by_due = system.tick.jac_sparsity(0, 0)
    row = names.index(f"controller.{at}")
    return min(system.clocks[k].every for i, k in zip(by_due.row(), by_due.get_col(), strict=True) if i == row)
