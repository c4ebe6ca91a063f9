"""Judge one case: simulate it, classify its motion, linearize it in every contact mode, and explain its hunting."""

import contextlib
import time
from collections.abc import Callable, Iterator, MutableMapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, get_type_hints

import control

from actuator import (
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
    without_quantization,
)
from actuator.diagnosis.causes import Causes, find_causes
from actuator.diagnosis.countermeasures import Remedy, RemedySearch, RemedyTable
from actuator.orbits.flow import flow_map
from actuator.orbits.sampled import PeriodicOrbit, SampledOrbit
from actuator.simulation.many import processes
from actuator.simulation.signals import piece_at
from actuator.stiction.margins import HuntingMargin, MarginKind, find_scaled, hunting_margin
from actuator.system.contact_modes import MOTIONS
from actuator.verdict.verdict import DIVERGING
from gear.quantities.roles import LoopSignal
from studies.cache import CONVERTER, StepError, Steps, fingerprint
from studies.cases import Case

MODES = tuple(MOTIONS)
RESOLUTION = 2e-3  # s
PATIENCE = 1.5  # s of computing that a run may take where a hundred of them follow
SIMULATED, MODELED = 0.05, 0.1  # shares of the work when the run and the linear models are done
ORBIT, MARGINS, CAUSES = 0.3, 0.6, 0.8  # of what follows, when these are done
BUILT = ("system", "map")  # of an orbit; all else of it is numbers
MOST_TICKS = 3000  # of a period through which derivatives are taken, again and again


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

    orbit: PeriodicOrbit | None = None
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


def judge(
    case: Case,
    progress: Callable[[float], None] | None = None,
    *,
    thorough: bool = False,
    cache: MutableMapping[str, dict[str, Any]] | None = None,
) -> Judgment:
    """Simulate, classify and linearize a case; where it hunts, say why, how far it is from rest, and what helps.

    Parameters
    ----------
    case : Case
        What is judged.
    progress : callable or None
        Called with the share of the work that is done, 0 to 1.
    thorough : bool
        Whether what needs many runs is done even where one takes long.
    cache : mutable mapping of str to dict or None
        For orbit, margins, causes and remedies; the run and the linear models are quickly computed again.
    """
    tell = progress or (lambda share: None)
    began = time.process_time()
    run = simulate(
        case.actuator,
        case.duration,
        inputs=case.inputs,
        resolution=RESOLUTION,
        progress=lambda at: tell(SIMULATED * at / case.duration),
    )
    # the first includes what else the machine did meanwhile, the second the building of the model
    spent = min(run.statistics.wall_s, time.process_time() - began)
    hunting, models = classify(run), []
    final = {name: piece_at(signal, case.duration)(0.0) for name, signal in case.inputs.items()}
    for k, mode in enumerate(MODES):
        models.append(_model(case, mode, final))
        tell(SIMULATED + (MODELED - SIMULATED) * (k + 1) / len(MODES))
    if case.actuator.controller is None or not hunting.decided or hunting.verdict == DIVERGING:
        insight = Insight()
    elif spent > PATIENCE and not thorough:
        why = f"one run takes {spent:.2g} s, and this needs about a hundred; request it with --thorough"
        insight = Insight(missing={"all": why})
    else:
        steps = Steps(cache, fingerprint(case.actuator, case.inputs, case.duration))
        insight = _Inquiry(case, run, hunting, final, steps).insight(
            lambda share: tell(MODELED + (1 - MODELED) * share)
        )
    tell(1.0)
    return Judgment(case=case, run=run, hunting=hunting, models=tuple(models), insight=insight)


@dataclass(frozen=True)
class _Inquiry:
    """What the insight into a case is computed from."""

    case: Case
    run: Run
    hunting: Hunting
    final: dict[str, float]
    steps: Steps
    missing: dict[str, str] = field(default_factory=dict)

    def insight(self, tell: Callable[[float], None]) -> Insight:
        """Orbit, margins, causes, and the remedies in a process beside the others."""
        with contextlib.ExitStack() as stack:
            search = None
            if self.hunting.cycles:
                how = {"executor": stack.enter_context(processes(1)), "done": self.steps.results(Remedy)}
                search = RemedySearch(self.case.actuator, self.run, **self._options(), **how)
            orbit = self.orbit() if self.hunting.cycles else None
            tell(ORBIT)
            margins = self.margins()
            tell(MARGINS)
            causes = self.causes() if self.hunting.cycles else None
            tell(CAUSES)
            remedies = self.remedies(search, lambda share: tell(CAUSES + (1 - CAUSES) * share)) if search else None
        return Insight(orbit=orbit, margins=margins, causes=causes, remedies=remedies, missing=self.missing)

    def orbit(self) -> PeriodicOrbit | None:
        """The exact cycle, from its numbers."""
        actuator = self.case.actuator
        kind = Orbit if actuator.sampling is None else SampledOrbit
        hints = {name: hint for name, hint in get_type_hints(kind).items() if name not in BUILT}

        def numbers() -> dict[str, Any]:
            if actuator.sampling is not None:
                self._require_short()
            found = find_orbit(actuator, self.run)
            return {name: CONVERTER.unstructure(getattr(found, name)) for name in hints}

        try:
            found = self.steps.compute("orbit", dict, numbers, failures=(NoOrbit,))
        except StepError as reason:
            self.missing["orbit"] = str(reason)
            return None
        values: dict[str, Any] = {name: CONVERTER.structure(found[name], hint) for name, hint in hints.items()}
        system = actuator.system()
        if kind is Orbit:
            return Orbit(system=system, map=flow_map(system), **values)
        return SampledOrbit(system=system, **values)

    def _require_short(self) -> None:
        ticks = self.hunting.period_s / self.run.system.tick_period(self.run.parameters)
        if ticks > MOST_TICKS:
            raise NoOrbit(
                f"a period has {ticks:.0f} controller ticks; closing the orbit needs derivatives through all of "
                f"them many times, which takes hours, and is not tried beyond {MOST_TICKS} ticks. Period and amplitude "
                "are those of the run; use actuator.find_orbit to try it"
            )

    def margins(self) -> dict[str, HuntingMargin]:
        """Those that the actuator has parameters for."""
        found = {}
        for kind in [kind for kind in MarginKind if find_scaled(self.case.actuator.system(), kind)]:
            try:
                found[kind] = self.steps.compute(
                    f"{kind} margin",
                    HuntingMargin,
                    partial(hunting_margin, self.case.actuator, kind, inputs=self.final, duration=self.case.duration),
                    failures=(NoOrbit, SimulationError, ValueError),
                )
            except StepError as reason:
                self.missing[f"{kind} margin"] = str(reason)
        return found

    def causes(self) -> Causes | None:
        """Why it hunts; None where that cannot be computed."""
        find = partial(find_causes, self.case.actuator, self.run, **self._options())
        try:
            return self.steps.compute("causes", Causes, find, failures=(SimulationError,))
        except StepError as reason:
            self.missing["causes"] = str(reason)
            return None

    def remedies(self, search: RemedySearch, tell: Callable[[float], None]) -> RemedyTable | None:
        """Countermeasures, ranked."""
        try:
            return search.finish(tell)
        except SimulationError as error:
            self.missing["remedies"] = str(error)
            return None

    def _options(self) -> dict[str, Any]:
        return {"inputs": self.case.inputs, "resolution": RESOLUTION}


def _model(case: Case, mode: str, inputs: dict[str, float]) -> LinearModel:
    system = without_quantization(case.actuator).system()
    signals = [role.signal for quantity in system.inputs if (role := quantity.role(LoopSignal))]
    try:
        point = trim(system, mode, inputs=inputs)
        loops = dict(_loops(point, signals))
    except NoEquilibrium as nothing:
        return LinearModel(mode=mode, reason=str(nothing))
    return LinearModel(
        mode=mode, point=point, loops=loops, margins={name: margins(loop) for name, loop in loops.items()}
    )


def _loops(point: OperatingPoint, signals: Sequence[str]) -> Iterator[tuple[str, control.StateSpace]]:
    """Loop transfers with one input: not of signals that are sampled several times in a period of the slowest."""
    for name in signals:
        try:
            loop = loop_transfer(point, name)
        except ValueError:  # not held between the ticks of its clock
            if not point.system.clocks:
                raise
            continue
        if loop.ninputs == 1:
            yield name, loop
