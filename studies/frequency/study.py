"""What is the frequency response of an actuator, and does it keep to its mask? One study, and what it is made of.

Linear models per contact mode with their loops, margins and poles; sines of several amplitudes through the hybrid
simulation; dynamic stiffness, powered and not; bench tests. Finished points are kept in a file and not computed again.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, NamedTuple

import control

from actuator import (
    Actuator,
    DynamicStiffness,
    FrequencyResponse,
    NoEquilibrium,
    dynamic_stiffness,
    frequency_response,
    torque_speed_curve,
    unpowered,
)
from actuator.simulation.many import run_many
from actuator.simulation.signals import piece_at
from studies.cache import Kept, actuator_of, fingerprint
from studies.cases import Case
from studies.frequency.bench import CORNERS, TESTS, BenchPlan, BenchWork
from studies.frequency.corners import Place, WrongRequest
from studies.frequency.linear import OUTPUT, LinearPart, closed_at, linear_part
from studies.frequency.mask import LimitCheck, checked
from studies.frequency.plan import PARTS, Plan


@dataclass(frozen=True, kw_only=True)
class Study:
    """All that is found of one actuator.

    Attributes
    ----------
    case : Case
        What is measured.
    model : str
        A hash of all its parts and numbers.
    inputs : mapping of str to float
        Constant inputs at the operating point.
    torque : float
        Largest on the load [N m].
    linear : LinearPart
        Models, loops, margins, poles of the actuator as it is.
    sets : mapping of str to mapping of str to float
        Parameters by name of the corner; the first is the actuator as it is.
    closed : mapping of Place to mapping of str to StateSpace
        Linear responses of the load angle to the reference, by mode; the first place is the actuator as it is.
    family : FrequencyResponse
        Of the load angle to the reference, in every corner with every bias load.
    stiffness : mapping of str to DynamicStiffness
        "powered" and "unpowered".
    tests : mapping of str to mapping
        By name: numbers with units, words, picture, and the reason where there is none.
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

    def words(self, place: Place) -> str:
        """A place in words: what tells it from the others."""
        several = len(self.sets) > 1, len({other.bias for other in self.checks}) > 1
        parts = place.corner, f"bias {place.bias:+g} N m" if place.bias else "no bias"
        return ", ".join(part for part, shown in zip(parts, several, strict=True) if shown)

    @property
    def parameters(self) -> dict[str, tuple[float, str]]:
        """Value and unit by name."""
        return {p.name: (float(p.default), p.unit) for p in self.case.actuator.system().parameters}


def largest_torque(case: Case) -> float:
    """What the motor has at most at standstill, at the load [N m], without friction.

    Raises
    ------
    WrongRequest
        For a motor without limits.
    """
    actuator, motor = case.actuator, case.actuator.motor
    if actuator.inverter is None or motor.driven_by != "voltage":
        raise WrongRequest(f"{case.name}: its motor has no largest torque; give the one at the load with --torque")
    plain: Any = motor.without_saturation()
    curve = torque_speed_curve(plain, actuator.inverter, [0.0])
    return abs(actuator.gear.ratio()) * float(curve.torques[0])


def study(
    case: Case, plan: Plan, kept: Kept, *, jobs: int, progress: Callable[[int], None] = lambda count: None
) -> Study:
    """Measure an actuator, or finish what was begun.

    Parameters
    ----------
    case : Case
        From `load_positioner`.
    plan : Plan
        What is measured.
    kept : Kept
        Finished points.
    jobs : int
        Processes.
    progress : callable
        Called with how many more of `plan.points` are done.

    Raises
    ------
    WrongRequest
        Where there is no operating point, or no torque to choose.
    """
    actuator, sets = case.actuator, plan.corners.sets_of(case.actuator)
    torque = largest_torque(case) if plan.torque is None else plan.torque
    inputs = {n: piece_at(s, case.duration)(0.0) for n, s in case.inputs.items() if n != "reference"}
    missing: dict[str, str] = {}
    try:
        linear = linear_part(actuator, inputs)
    except NoEquilibrium as error:
        raise WrongRequest(f"{case.name}: no operating point: {error}") from None
    first, *others = plan.places(actuator)
    closed = {first: linear.closed}
    for place in others:
        try:
            closed[place] = closed_at(actuator, inputs, sets, place)
        except NoEquilibrium as error:
            missing[f"linear models, {place.corner}, bias {place.bias:+g} N m"] = str(error)
    work = _Work(actuator, inputs, kept, jobs, progress)
    model = actuator_of(actuator)
    bench = BenchPlan(
        stroke=plan.stroke, torque=torque, frequencies=plan.threshold_frequencies, sets=sets, inputs=inputs
    )
    tests = work.tests(bench, model)
    family = work.family(plan, sets)
    stiffness = work.stiffness(plan, torque, missing)
    return Study(
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


class _Work(NamedTuple):
    """What is simulated, and how."""

    actuator: Actuator
    inputs: Mapping[str, float]
    kept: Kept
    jobs: int
    progress: Callable[[int], None]

    def tests(self, bench: BenchPlan, model: str) -> dict[str, Mapping[str, Any]]:
        """Of the bench, by name; only one of them depends on the corners."""
        plans = {name: bench if name == CORNERS else replace(bench, sets={}) for name in TESTS}
        with _Steps(self.progress, len(TESTS)) as steps:
            found = run_many(
                BenchWork(self.actuator, bench),
                {f"{name}, {fingerprint([model, asdict(each)])}": name for name, each in plans.items()},
                done=self.kept,
                workers=self.jobs,
                progress=steps,
            )
        return dict(zip(TESTS, found.values(), strict=True))

    def family(self, plan: Plan, sets: Mapping[str, Mapping[str, float]]) -> FrequencyResponse:
        """Every sine of the reference at every place."""
        with _Steps(self.progress, plan.sines(self.actuator)) as steps:
            return frequency_response(
                self.actuator,
                amplitudes=[part * plan.stroke for part in plan.all_amplitudes],
                frequencies=sorted(plan.frequencies),
                seen=(OUTPUT,),
                inputs=self.inputs,
                loads=plan.all_biases,
                sets=sets,
                workers=self.jobs,
                done=self.kept,
                progress=steps,
            )

    def stiffness(self, plan: Plan, torque: float, missing: dict[str, str]) -> dict[str, DynamicStiffness]:
        """Powered and unpowered; why not goes to `missing`."""
        found: dict[str, DynamicStiffness] = {}
        for word in ("powered", "unpowered"):
            with _Steps(self.progress, len(PARTS) * len(plan.torque_frequencies)) as steps:
                try:
                    shaken = self.actuator if word == "powered" else unpowered(self.actuator)
                except ValueError as error:
                    missing[f"stiffness, {word}"] = str(error)
                    continue
                present = [quantity.name for quantity in shaken.system().inputs]
                found[word] = dynamic_stiffness(
                    shaken,
                    amplitudes=[part * torque for part in PARTS],
                    frequencies=plan.torque_frequencies,
                    inputs={name: value for name, value in self.inputs.items() if name in present},
                    workers=self.jobs,
                    done=self.kept,
                    progress=steps,
                )
        return found


def _checks(plan: Plan, family: FrequencyResponse, place: Place) -> tuple[LimitCheck, ...]:
    """Every limit of the mask against the sines of its amplitude."""
    found: list[LimitCheck] = []
    for limit in plan.mask.limits:
        where = {"set": place.corner, "load": place.bias, "amplitude": limit.amplitude * plan.stroke}
        response, moves = (family.select(name, **where).values for name in ("response", "moves"))
        found += checked(limit, family.data.frequency.values, response, moves.astype(bool))
    return tuple(found)


class _Steps:
    """Turns the counts of `run_many` into steps of a bar, and makes them complete where all was done before."""

    def __init__(self, progress: Callable[[int], None], count: int) -> None:
        self.progress, self.left = progress, count

    def __call__(self, done: int, count: int) -> None:
        """What `run_many` calls."""
        self.progress(self.left - (count - done))
        self.left = count - done

    def __enter__(self) -> "_Steps":
        return self

    def __exit__(self, kind: type | None, *rest: Any) -> None:
        if kind is None:
            self.progress(self.left)
