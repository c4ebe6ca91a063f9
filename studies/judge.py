"""Judge one case: simulate it, say whether it hunts, and linearize it in every contact mode."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field

import control

from actuator import (
    Actuator,
    Hunting,
    Margins,
    NoEquilibrium,
    NoOrbit,
    OperatingPoint,
    Orbit,
    Run,
    SimulationError,
    classify,
    find_orbit,
    loop_transfer,
    margins,
    simulate,
    trim,
    without_counts,
)
from actuator.hunting.causes import Causes, find_causes
from actuator.hunting.margins import ENDINGS, HuntingMargin, hunting_margin
from actuator.hunting.remedies import RemedySearch, RemedyTable
from actuator.hunting.sampled_orbit import SampledOrbit, find_sampled_orbit
from actuator.hunting.verdict import DIVERGING
from actuator.ledger import PREFIX
from actuator.simulation.signals import piece_at
from studies.cases import Case
from studies.processes import processes

MODES = ("stuck", "forward", "backward")
RESOLUTION = 2e-3  # s
PATIENCE = 3.0  # s that a run may take where a hundred of them follow
SIMULATED, MODELED = 0.05, 0.1  # shares of the work when the run and the linear models are done
ORBIT, MARGINS, CAUSES = 0.3, 0.6, 0.8  # of what follows, when these are done


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
class Insight:
    """What is known of the hunting of a case, beyond the run.

    Attributes
    ----------
    orbit : Orbit, SampledOrbit or None
        The exact cycle; None where there is none, or `missing["orbit"]` says why it was not found.
    margins : dict of str to HuntingMargin
        Factors on stiction, backlash and integral gain up to which it does not hunt.
    causes : Causes or None
        None without a cycle.
    remedies : RemedyTable or None
        None without a cycle.
    missing : dict of str to str
        Why a part is not there.
    """

    orbit: Orbit | SampledOrbit | None = None
    margins: dict[str, HuntingMargin] = field(default_factory=dict)
    causes: Causes | None = None
    remedies: RemedyTable | None = None
    missing: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Judgment:
    """All that is known of one case."""

    case: Case
    run: Run
    hunting: Hunting
    models: tuple[LinearModel, ...]
    insight: Insight


def judge(case: Case, progress: Callable[[float], None] | None = None, *, thorough: bool = False) -> Judgment:
    """Simulate, classify and linearize a case; where it hunts, say why, how far it is from rest, and what helps.

    `progress` is called with the share of the work that is done, 0 to 1. Where a run takes long, what needs many of
    them is left out unless `thorough`.
    """
    tell = progress or (lambda share: None)
    run = simulate(
        case.actuator,
        case.duration,
        inputs=case.inputs,
        resolution=RESOLUTION,
        progress=lambda time: tell(SIMULATED * time / case.duration),
    )
    hunting, models = classify(run), []
    final = {name: piece_at(signal, case.duration)(0.0) for name, signal in case.inputs.items()}
    for k, mode in enumerate(MODES):
        models.append(_model(case, mode, final))
        tell(SIMULATED + (MODELED - SIMULATED) * (k + 1) / len(MODES))
    insight = _insight(case, run, hunting, final, lambda share: tell(MODELED + (1 - MODELED) * share), thorough)
    tell(1.0)
    return Judgment(case=case, run=run, hunting=hunting, models=tuple(models), insight=insight)


def _insight(  # noqa: PLR0913, PLR0917 - what it is of, and how
    case: Case,
    run: Run,
    hunting: Hunting,
    final: dict[str, float],
    tell: Callable[[float], None],
    thorough: bool,
) -> Insight:
    actuator = case.actuator
    if actuator.controller is None or not hunting.decided or hunting.verdict == DIVERGING:
        return Insight()
    wall = run.statistics.wall_s
    if wall > PATIENCE and not thorough:
        return Insight(
            missing={"all": f"a run takes {wall:.2g} s, and this takes a hundred; ask for it with --thorough"}
        )
    with contextlib.ExitStack() as stack:
        search = None
        if hunting.cycles:
            pool = stack.enter_context(processes(1))
            search = RemedySearch(actuator, run, inputs=case.inputs, resolution=RESOLUTION, executor=pool)
        missing: dict[str, str] = {}
        orbit = _orbit(actuator, run, missing) if hunting.cycles else None
        tell(ORBIT)
        margins = _margins(case, final, missing)
        tell(MARGINS)
        causes = find_causes(actuator, run, inputs=case.inputs, resolution=RESOLUTION) if hunting.cycles else None
        tell(CAUSES)
        remedies = search.finish(lambda share: tell(CAUSES + (1 - CAUSES) * share)) if search else None
    return Insight(orbit=orbit, margins=margins, causes=causes, remedies=remedies, missing=missing)


def _orbit(actuator: Actuator, run: Run, missing: dict[str, str]) -> Orbit | SampledOrbit | None:
    try:
        return find_orbit(actuator, run) if actuator.sampling is None else find_sampled_orbit(actuator, run)
    except NoOrbit as error:
        missing["orbit"] = str(error)
        return None


def _margins(case: Case, final: dict[str, float], missing: dict[str, str]) -> dict[str, HuntingMargin]:
    found = {}
    names = [parameter.name for parameter in case.actuator.system().parameters]
    for kind, endings in ENDINGS.items():
        if any(name.endswith(endings) for name in names):
            try:
                found[kind] = hunting_margin(case.actuator, kind, inputs=final, duration=case.duration)
            except (NoOrbit, SimulationError, ValueError) as error:
                missing[f"{kind} margin"] = str(error)
    return found


def _model(case: Case, mode: str, inputs: dict[str, float]) -> LinearModel:
    system = without_counts(case.actuator).system()
    signals = [quantity.name.removeprefix(PREFIX) for quantity in system.inputs if quantity.name.startswith(PREFIX)]
    if system.clocks:
        # those of the slowest clock have margins of their own; the others are renewed several times in its period
        signals = [name for name in signals if name in ("position", "speed_reference")]
    try:
        point = trim(system, mode, inputs=inputs)
        loops = {name: loop_transfer(point, name) for name in signals}
    except NoEquilibrium as nothing:
        return LinearModel(mode=mode, reason=str(nothing))
    return LinearModel(
        mode=mode, point=point, loops=loops, margins={name: margins(loop) for name, loop in loops.items()}
    )
