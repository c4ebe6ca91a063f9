"""What is the frequency response of an actuator, and does it keep to its mask? One study, and what it is made of.

Linear models per contact mode with their loops, margins and poles; sines of several amplitudes through the hybrid
simulation; dynamic stiffness, powered and not; bench tests. Finished points are kept in a file and not computed again.
"""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cache
from importlib import metadata, resources
from pathlib import Path
from typing import Any

from actuator import (
    DynamicStiffness,
    FrequencyResponse,
    NoEquilibrium,
    dynamic_stiffness,
    frequency_response,
    torque_speed_curve,
    unpowered,
)
from actuator.response.sweep import sweep
from actuator.simulation.signals import piece_at
from studies.cases import Case, load_case
from studies.frequency_linear import OUTPUT, LinearPart, linear_part
from studies.frequency_mask import LimitCheck, Mask, checked
from studies.frequency_tests import TESTS, BenchPlan, BenchWork
from studies.kept import Kept, fingerprint, model_of

PACKAGES = ("gear", "controllers", "actuator", "studies")
PARTS = (0.1, 0.2, 0.4)  # of the largest torque, in the sines of torque on the load
EVERY = 2  # so many frequencies of the reference to one of the torque


class WrongRequest(ValueError):
    """A study that cannot be made; the message is one line."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What is measured, the same for every actuator laid beside another.

    Parameters
    ----------
    mask : Mask
        What the response has to keep to; its amplitudes are measured too.
    stroke : float
        From end to end [rad].
    amplitudes : tuple of float
        Of the sines of the reference, over the stroke [-].
    frequencies : tuple of float
        [Hz].
    torque : float or None
        Largest on the load in stiffness and bench tests [N m]; None for what the motor has at most, at the load.
    temperatures : tuple of float
        Of the soak [K].
    """

    mask: Mask
    stroke: float
    amplitudes: tuple[float, ...]
    frequencies: tuple[float, ...]
    torque: float | None = None
    temperatures: tuple[float, ...] = (218.15, 293.15, 343.15)

    def __post_init__(self) -> None:
        wrong = [f"{100 * value:g} %" for value in self.amplitudes if not 0 < value <= 0.5]  # noqa: PLR2004 - half
        if not self.amplitudes or wrong:
            raise WrongRequest(
                f"amplitudes are > 0 and at most 50 % of the stroke, and at least one, got {', '.join(wrong) or 'none'}"
            )
        if not self.frequencies or min(self.frequencies) <= 0:
            raise WrongRequest(f"frequencies are > 0 Hz, and at least one, got {list(self.frequencies)}")
        for k, limit in enumerate(self.mask.limits):
            low, high = limit.frequencies[0], limit.frequencies[-1]
            if not any(low <= frequency <= high for frequency in self.frequencies):
                raise WrongRequest(
                    f"no frequency is within limit {k + 1} of the mask, {low:g} to {high:g} Hz; choose others with "
                    "--frequencies, or another mask"
                )

    @property
    def all_amplitudes(self) -> tuple[float, ...]:
        """Those asked for and those of the mask, ascending."""
        return tuple(sorted({*self.amplitudes, *(limit.amplitude for limit in self.mask.limits)}))

    @property
    def torque_frequencies(self) -> tuple[float, ...]:
        """Of the torque on the load [Hz]."""
        return tuple(sorted(self.frequencies)[::EVERY])

    @property
    def threshold_frequencies(self) -> tuple[float, ...]:
        """The lowest, the middle and the highest [Hz]."""
        ordered = sorted(self.frequencies)
        return tuple(dict.fromkeys((ordered[0], ordered[len(ordered) // 2], ordered[-1])))

    @property
    def points(self) -> int:
        """That are computed for one actuator."""
        sines = len(self.all_amplitudes) * len(self.frequencies)
        return sines + 2 * len(PARTS) * len(self.torque_frequencies) + len(TESTS)


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
        Models, loops, margins, poles.
    family : FrequencyResponse
        Of the load angle to the reference.
    stiffness : mapping of str to DynamicStiffness
        "powered" and "unpowered".
    tests : mapping of str to mapping
        By name: numbers with units, words, picture, and the reason where there is none.
    checks : tuple of LimitCheck
        Against the mask.
    missing : mapping of str to str
        What could not be measured, and why.
    """

    case: Case
    model: str
    inputs: Mapping[str, float]
    torque: float
    linear: LinearPart
    family: FrequencyResponse
    stiffness: Mapping[str, DynamicStiffness]
    tests: Mapping[str, Mapping[str, Any]]
    checks: tuple[LimitCheck, ...]
    missing: Mapping[str, str]

    @property
    def met(self) -> bool:
        """Whether the response keeps to the mask."""
        return all(check.met for check in self.checks)

    @property
    def parameters(self) -> dict[str, tuple[float, str]]:
        """Value and unit by name."""
        return {p.name: (float(p.default), p.unit) for p in self.case.actuator.system().parameters}


@cache
def source() -> str:
    """A hash of the program text that computes and shows a study, as it was when it was first asked for."""
    found = hashlib.sha256()
    for package in PACKAGES:
        folder = Path(str(resources.files(package)))
        for path in sorted(folder.glob("*.py")):
            found.update(path.read_bytes())
    return found.hexdigest()[:12]


def kept_in(folder: Path) -> Kept:
    """Finished points of a study; with another program all are computed anew."""
    return Kept(folder / f"finished-{source()}.jsonl")


def load_positioner(case: str | Path) -> Case:
    """A case with a position controller.

    Raises
    ------
    CaseError, WrongRequest
        For a file that cannot be read; for a case without one.
    """
    loaded = load_case(case)
    if "reference" not in [quantity.name for quantity in loaded.actuator.system().inputs]:
        raise WrongRequest(
            f"{loaded.name}: has no position controller, so no response to a reference; choose another case"
        )
    return loaded


def largest_torque(case: Case) -> float:
    """What the motor has at most at standstill, at the load [N m], without friction.

    Raises
    ------
    WrongRequest
        For a motor without limits.
    """
    actuator, motor = case.actuator, case.actuator.motor
    if actuator.inverter is None or not hasattr(motor, "resistance"):
        raise WrongRequest(f"{case.name}: its motor has no largest torque; give the one at the load with --torque")
    plain = replace(motor, saturation=None) if getattr(motor, "saturation", None) else motor
    curve = torque_speed_curve(plain, actuator.inverter, [0.0])  # pyright: ignore[reportArgumentType] - has a winding
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
    actuator = case.actuator
    torque = largest_torque(case) if plan.torque is None else plan.torque
    inputs = {n: piece_at(s, case.duration)(0.0) for n, s in case.inputs.items() if n != "reference"}
    try:
        linear = linear_part(actuator, inputs)
    except NoEquilibrium as error:
        raise WrongRequest(f"{case.name}: no operating point: {error}") from None
    model = model_of({p.name: float(p.default) for p in actuator.system().parameters}, repr(actuator))
    bench = BenchPlan(
        stroke=plan.stroke,
        torque=torque,
        frequencies=plan.threshold_frequencies,
        temperatures=plan.temperatures,
        inputs=inputs,
    )
    libraries = [metadata.version(name) for name in ("casadi", "matplotlib")]
    with _Steps(progress, len(TESTS)) as steps:
        tests = sweep(
            BenchWork(actuator, bench),
            {f"{name}, {fingerprint([model, asdict(bench), libraries])}": name for name in TESTS},
            done=kept,
            workers=jobs,
            progress=steps,
        )
    with _Steps(progress, len(plan.all_amplitudes) * len(plan.frequencies)) as steps:
        family = frequency_response(
            actuator,
            amplitudes=[part * plan.stroke for part in plan.all_amplitudes],
            frequencies=sorted(plan.frequencies),
            seen=(OUTPUT,),
            inputs=inputs,
            workers=jobs,
            done=kept,
            progress=steps,
        )
    stiffness: dict[str, DynamicStiffness] = {}
    missing: dict[str, str] = {}
    for word in ("powered", "unpowered"):
        with _Steps(progress, len(PARTS) * len(plan.torque_frequencies)) as steps:
            try:
                shaken = actuator if word == "powered" else unpowered(actuator)
            except ValueError as error:
                missing[f"stiffness, {word}"] = str(error)
                continue
            present = [quantity.name for quantity in shaken.system().inputs]
            stiffness[word] = dynamic_stiffness(
                shaken,
                amplitudes=[part * torque for part in PARTS],
                frequencies=plan.torque_frequencies,
                inputs={name: value for name, value in inputs.items() if name in present},
                workers=jobs,
                done=kept,
                progress=steps,
            )
    return Study(
        case=case,
        model=model,
        inputs=inputs,
        torque=torque,
        linear=linear,
        family=family,
        stiffness=stiffness,
        tests=dict(zip(TESTS, tests.values(), strict=True)),
        checks=tuple(_checks(plan, family)),
        missing=missing,
    )


def _checks(plan: Plan, family: FrequencyResponse) -> list[LimitCheck]:
    """Every limit of the mask against the sines of its amplitude."""
    found = []
    for limit in plan.mask.limits:
        where = {"amplitude": limit.amplitude * plan.stroke}
        response, moves = (family.select(name, **where).values for name in ("response", "moves"))
        found += checked(limit, family.data.frequency.values, response, moves.astype(bool))
    return found


class _Steps:
    """Turns the counts of a sweep into steps of a bar, and makes them complete where all was done before."""

    def __init__(self, progress: Callable[[int], None], count: int) -> None:
        self.progress, self.left = progress, count

    def __call__(self, done: int, count: int) -> None:
        """What `sweep` calls."""
        self.progress(self.left - (count - done))
        self.left = count - done

    def __enter__(self) -> "_Steps":
        return self

    def __exit__(self, kind: type | None, *rest: Any) -> None:
        if kind is None:
            self.progress(self.left)
