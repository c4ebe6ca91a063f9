"""Linear models: one per contact mode, exact, in deviations from an operating point."""

from collections.abc import Sequence
from typing import NamedTuple

import control
import numpy as np

from actuator.linear.jacobians import jacobians, remove_stuck, require_smooth, rounding
from actuator.linear.operating_point import NoEquilibrium, OperatingPoint
from actuator.linear.sampled import lift
from actuator.system.hybrid import HybridSystem
from gear.quantities import require_known

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
    require_still(point, drifting)
    selected = select(point.system, inputs, outputs)
    matrices, step = _matrices(point, selected)
    return build_model(point, matrices, selected.inputs, selected.outputs, step, minimal=minimal)


def least_dynamics(point: OperatingPoint, *, drifting: Sequence[str] = ()) -> tuple[np.ndarray, list[str], float]:
    """A of `linearize` without what stuck contacts lock, the names of its states, and its period (0: continuous).

    python-control has no model with one state and no input.
    """
    require_still(point, drifting)
    matrices, step = _matrices(point, select(point.system, [], []))
    (a, *_), kept = remove_stuck(point, matrices)
    return a, [point.system.states[k].name for k in kept], step


def _matrices(point: OperatingPoint, selected: _Selected) -> tuple[tuple[np.ndarray, ...], float]:
    """A, B, C, D, and their period (0: continuous)."""
    system = point.system
    if system.clocks:
        every = system.hyperperiod
        return lift(point, selected.columns, selected.rows, every), every * system.tick_period(point.p)
    a, b, c, d = jacobians(point)
    return (a, b[:, selected.columns], c[selected.rows], d[np.ix_(selected.rows, selected.columns)]), 0.0


def require_still(point: OperatingPoint, drifting: Sequence[str]) -> None:
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


def select(system: HybridSystem, inputs: Sequence[str], outputs: Sequence[str]) -> _Selected:
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


def build_model(  # noqa: PLR0913 - a model and all its names
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
        matrices, kept = remove_stuck(point, matrices)
        names = [names[k] for k in kept]
    return control.StateSpace(
        *matrices, step, states=names, inputs=inputs, outputs=outputs, remove_useless_states=False
    )


def _signal(name: str) -> str:
    """python-control keeps dots for the names of subsystems."""
    return name.replace(".", "_")
