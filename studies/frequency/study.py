"""The frequency response of one actuator, and whether it keeps to its mask.

Linear models per contact mode with their loops, margins and poles; simulated sines of several amplitudes; dynamic
stiffness, powered and unpowered; bench tests.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import control

from actuator import (
    Actuator,
    DynamicStiffness,
    FrequencyResponse,
    NoEquilibrium,
    dynamic_stiffness,
    frequency_response,
    remove_drive,
    torque_speed_curve,
)
from actuator.simulation.many import run_many
from actuator.simulation.signals import piece_at
from studies.cache import fingerprint
from studies.cases import Case
from studies.files import StudyError
from studies.frequency.bench import CORNERS, TESTS, BenchPlan, BenchWork
from studies.frequency.linear import OUTPUT, LinearPart, closed_loop_at, linearize_case
from studies.frequency.mask import LimitCheck, check_limit
from studies.frequency.plan import PARTS, Place, Plan
from studies.study import Work


@dataclass(frozen=True, kw_only=True)
class CaseResponse:
    """The frequency response of one actuator.

    Attributes
    ----------
    case : Case
        What is measured.
    model : str
        A hash of its parts and parameters.
    inputs : mapping of str to float
        Constant inputs at the operating point.
    torque : float
        Largest torque on the load [N m].
    linear : LinearPart
        Models, loops, margins, poles of the actuator as it is.
    sets : mapping of str to mapping of str to float
        Parameters by name of the corner; the first is the actuator as it is.
    closed : mapping of Place to mapping of str to StateSpace
        Linear responses of the load angle to the reference, by mode; the first place is the actuator as it is.
    family : FrequencyResponse
        Load angle over reference, in every corner with every bias load.
    stiffness : mapping of str to DynamicStiffness
        "powered" and "unpowered".
    tests : mapping of str to mapping
        Bench tests by name: numbers with units, text, picture, and the reason where there is none.
    checks : mapping of Place to tuple of LimitCheck
        Against the mask.
    missing : mapping of str to str
        What could not be measured, and why.
    """

    case: Case
    model: str
    inputs: Mapping[str, float]
    torque: float
    linear: LinearPart
    sets: Mapping[str, Mapping[str, float]]
    closed: Mapping[Place, Mapping[str, control.StateSpace]] = field(repr=False)
    family: FrequencyResponse
    stiffness: Mapping[str, DynamicStiffness]
    tests: Mapping[str, Mapping[str, Any]]
    checks: Mapping[Place, tuple[LimitCheck, ...]]
    missing: Mapping[str, str]

    @property
    def met(self) -> bool:
        """Whether the response keeps to the mask at every place."""
        return all(check.met for checks in self.checks.values() for check in checks)

    def label(self, place: Place) -> str:
        """A place in words, as far as needed to distinguish it from the others."""
        several = len(self.sets) > 1, len({other.bias for other in self.checks}) > 1
        parts = place.corner, f"bias {place.bias:+g} N m" if place.bias else "no bias"
        return ", ".join(part for part, shown in zip(parts, several, strict=True) if shown)

    @property
    def parameters(self) -> dict[str, tuple[float, str]]:
        """Value and unit by name."""
        return {p.name: (float(p.default), p.unit) for p in self.case.actuator.system().parameters}


def largest_torque(case: Case) -> float:
    """Largest torque of the motor at standstill, at the load [N m], without friction.

    Raises
    ------
    StudyError
        For a motor without limits.
    """
    actuator, motor = case.actuator, case.actuator.motor
    if actuator.inverter is None or motor.driven_by != "voltage":
        raise StudyError(
            f"{case.name}: its motor has no torque limit; give the largest torque at the load with --torque"
        )
    plain: Any = motor.without_saturation()
    curve = torque_speed_curve(plain, actuator.inverter, [0.0])
    return abs(actuator.gear.ratio()) * float(curve.torques[0])


def measure_case(case: Case, plan: Plan, work: Work) -> CaseResponse:
    """Measure an actuator, or finish what was begun.

    Parameters
    ----------
    case : Case
        From `load_positioner`.
    plan : Plan
        What is measured.
    work : Work
        Cache, processes and progress.

    Raises
    ------
    StudyError
        Where there is no operating point, or no largest torque.
    """
    actuator, sets = case.actuator, plan.corners.sets_of(case.actuator)
    torque = largest_torque(case) if plan.torque is None else plan.torque
    inputs = {n: piece_at(s, case.duration)(0.0) for n, s in case.inputs.items() if n != "reference"}
    missing: dict[str, str] = {}
    try:
        linear = linearize_case(actuator, inputs)
    except NoEquilibrium as error:
        raise StudyError(f"{case.name}: no operating point: {error}") from None
    first, *others = plan.places(actuator)
    closed = {first: linear.closed}
    for place in others:
        try:
            closed[place] = closed_loop_at(actuator, inputs, sets, place)
        except NoEquilibrium as error:
            missing[f"linear models, {place.corner}, bias {place.bias:+g} N m"] = str(error)
    simulated = _Simulations(actuator, inputs, work, plan.points(actuator))
    model = fingerprint(actuator)
    bench = BenchPlan(
        stroke=plan.stroke, torque=torque, frequencies=plan.threshold_frequencies, sets=sets, inputs=inputs
    )
    tests = simulated.tests(bench, model)
    family = simulated.family(plan, sets)
    stiffness = simulated.stiffness(plan, torque, missing)
    return CaseResponse(
        case=case,
        model=model,
        inputs=inputs,
        torque=torque,
        linear=linear,
        sets=sets,
        closed=closed,
        family=family,
        stiffness=stiffness,
        tests=tests,
        checks={place: _checks(plan, family, place) for place in (first, *others)},
        missing=missing,
    )


class _Simulations:
    """The simulations of one actuator."""

    def __init__(self, actuator: Actuator, inputs: Mapping[str, float], work: Work, count: int) -> None:
        self.actuator, self.inputs, self.work = actuator, inputs, work
        self.finished, self.count = 0, count

    def _options(self, count: int) -> dict[str, Any]:
        """Of `run_many`, for the next points."""
        begin, self.finished = self.finished, self.finished + count
        progress = self.work.part(begin / self.count, self.finished / self.count)
        return {"done": self.work.cache, "workers": self.work.jobs, "progress": progress}

    def tests(self, bench: BenchPlan, model: str) -> dict[str, Mapping[str, Any]]:
        """Bench tests by name; only one of them depends on the corners."""
        plans = {name: bench if name == CORNERS else replace(bench, sets={}) for name in TESTS}
        points = {f"{name}, {fingerprint(model, asdict(each))}": name for name, each in plans.items()}
        found = run_many(BenchWork(self.actuator, bench), points, **self._options(len(TESTS)))
        return dict(zip(TESTS, found.values(), strict=True))

    def family(self, plan: Plan, sets: Mapping[str, Mapping[str, float]]) -> FrequencyResponse:
        """Every reference sine at every place."""
        return frequency_response(
            self.actuator,
            amplitudes=[part * plan.stroke for part in plan.all_amplitudes],
            frequencies=sorted(plan.frequencies),
            seen=(OUTPUT,),
            inputs=self.inputs,
            loads=plan.all_biases,
            sets=sets,
            **self._options(plan.sines(self.actuator)),
        )

    def stiffness(self, plan: Plan, torque: float, missing: dict[str, str]) -> dict[str, DynamicStiffness]:
        """Powered and unpowered; reasons why not go to `missing`."""
        found: dict[str, DynamicStiffness] = {}
        for word in ("powered", "unpowered"):
            options = self._options(len(PARTS) * len(plan.torque_frequencies))
            try:
                shaken = self.actuator if word == "powered" else remove_drive(self.actuator)
            except ValueError as error:
                missing[f"stiffness, {word}"] = str(error)
                continue
            present = [quantity.name for quantity in shaken.system().inputs]
            found[word] = dynamic_stiffness(
                shaken,
                amplitudes=[part * torque for part in PARTS],
                frequencies=plan.torque_frequencies,
                inputs={name: value for name, value in self.inputs.items() if name in present},
                **options,
            )
        return found


def _checks(plan: Plan, family: FrequencyResponse, place: Place) -> tuple[LimitCheck, ...]:
    """Check every limit of the mask against the sines of its amplitude."""
    found: list[LimitCheck] = []
    for limit in plan.mask.limits:
        where = {"set": place.corner, "load": place.bias, "amplitude": limit.amplitude * plan.stroke}
        response, moves = (family.select(name, **where).values for name in ("response", "moves"))
        found += check_limit(limit, family.data.frequency.values, response, moves.astype(bool))
    return tuple(found)
