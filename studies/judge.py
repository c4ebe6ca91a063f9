"""Judge one case: simulate it, say whether it hunts, and linearize it in every contact mode."""

from collections.abc import Callable
from dataclasses import dataclass, field

import control

from actuator import (
    Hunting,
    Margins,
    NoEquilibrium,
    OperatingPoint,
    Run,
    classify,
    loop_transfer,
    margins,
    simulate,
    trim,
)
from actuator.ledger import PREFIX
from actuator.signals import piece_at
from studies.cases import Case

MODES = ("stuck", "forward", "backward")
RESOLUTION = 2e-3  # s


@dataclass(frozen=True, kw_only=True)
class LinearModel:
    """The loops of one contact mode at the operating point the case ends on.

    Attributes
    ----------
    mode : str
        "stuck", or the direction of the output.
    point : OperatingPoint or None
        None where the mode has none; `reason` says why.
    loops : dict of str to StateSpace
        Loop transfer by the signal at which the loop is opened.
    margins : dict of str to Margins
        Of each loop.
    reason : str
        Why there is no operating point; empty where there is one.
    """

    mode: str
    point: OperatingPoint | None = None
    loops: dict[str, control.StateSpace] = field(default_factory=dict)
    margins: dict[str, Margins] = field(default_factory=dict)
    reason: str = ""


@dataclass(frozen=True, kw_only=True)
class Judgment:
    """All that is known of one case."""

    case: Case
    run: Run
    hunting: Hunting
    models: tuple[LinearModel, ...]


def judge(case: Case, progress: Callable[[float], None] | None = None) -> Judgment:
    """Simulate, classify and linearize a case.

    `progress` is called with the share of the work that is done, 0 to 1; most of it is the simulation.
    """
    tell = progress or (lambda share: None)
    run = simulate(
        case.actuator,
        case.duration,
        inputs=case.inputs,
        resolution=RESOLUTION,
        progress=lambda time: tell(0.8 * time / case.duration),
    )
    hunting, models = classify(run), []
    final = {name: piece_at(signal, case.duration)(0.0) for name, signal in case.inputs.items()}
    for k, mode in enumerate(MODES):
        models.append(_model(case, mode, final))
        tell(0.8 + 0.2 * (k + 1) / len(MODES))
    return Judgment(case=case, run=run, hunting=hunting, models=tuple(models))


def _model(case: Case, mode: str, inputs: dict[str, float]) -> LinearModel:
    system = case.actuator.system()
    signals = [quantity.name.removeprefix(PREFIX) for quantity in system.inputs if quantity.name.startswith(PREFIX)]
    try:
        point = trim(system, mode, inputs=inputs)
        loops = {name: loop_transfer(point, name) for name in signals}
    except NoEquilibrium as nothing:
        return LinearModel(mode=mode, reason=str(nothing))
    return LinearModel(
        mode=mode, point=point, loops=loops, margins={name: margins(loop) for name, loop in loops.items()}
    )
