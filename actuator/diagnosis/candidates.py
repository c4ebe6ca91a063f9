"""Remedies against hunting that suit a controller, with their settings and what is predicted of them.

Settings follow from the cycle and from the equilibrium set: with A the amplitude and H half of the range of motor
torques that stiction holds,

    dead band          BAND * A                    rests wherever it stops inside
    leakage            total gain at rest SHARE * H/A, so that no error of size A breaks away
    compensation       COMPENSATED * H             less than all, or it pushes the drive on by itself
    dither, knocker    OVER * H                    nothing sticks for longer than one interval
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from actuator.actuator import Actuator
from actuator.diagnosis.cycle_energy import changed_parameters
from actuator.parts.sensors import Sensors
from actuator.simulation.run import FREE, STUCK, Run
from actuator.stiction.breakaway import NotAtRest
from actuator.stiction.equilibrium_set import EquilibriumSet, find_equilibrium_set
from actuator.verdict.verdict import classify
from controllers.cascade import Cascade
from controllers.compensation import Dither, FrictionCompensation, Knocker
from controllers.integral import IntegralRemedies
from controllers.pid import PID

BAND, SHARE, COMPENSATED, OVER = 1.5, 0.5, 0.7, 1.2
DITHER_HZ = 60.0
KNOCK_TICKS, KNOCK_INTERVAL = 3, 0.1  # ticks that a pulse lasts, and s from pulse to pulse
STANDSTILL = 0.02  # part of the largest motor speed in the cycle below which friction is taken to be static
FASTER = 10.0  # factor on back-calculation
UNKNOWN = float("nan")


class Candidate(NamedTuple):
    """A remedy with its setting, and what is predicted of it: the largest error at rest [rad], nan where nothing is.

    `forced` is the period [s] of a motion that the remedy itself makes.
    """

    name: str
    setting: str
    plant: Actuator
    parameters: dict[str, float]
    error: float
    forced: float = UNKNOWN


class _Cycle(NamedTuple):
    """What the settings rest on."""

    amplitude: float  # rad at the load
    held: EquilibriumSet  # N m at the motor
    half: float  # N m
    gain: float  # N m at the motor per rad of position error, without integral action
    integral: float  # the same per second
    to_law: float  # error of the integrating law per rad of position error
    speed: float  # largest at the motor, rad/s
    lost: float  # largest difference of motor and load, rad at the load


def candidates(plant: Actuator, run: Run) -> list[Candidate]:
    """Remedies that suit the controller, with their settings."""
    law, given = plant.controller, changed_parameters(run)
    if not isinstance(law, PID | Cascade):
        raise ValueError(f"{plant.name}: remedies are those of a PID or Cascade, there is none")
    cycle = _cycle(plant, run, law)
    ready = _switchable(plant, cycle)
    return [
        *_by_numbers(ready, given, law, cycle),
        *_of_gains(plant, run, given, law),
        *_by_parts(plant, given, law, cycle),
    ]


def _cycle(plant: Actuator, run: Run, law: PID | Cascade) -> _Cycle:
    verdict, values = classify(run), _values(run)
    held = _held(plant, run)
    ratio = plant.gear.ratio()
    if isinstance(law, PID):
        gain, integral, to_law = values["controller.proportional"] / ratio, values["controller.integral"] / ratio, 1.0
    else:
        position = next(values[f"controller.position.{n}"] for n in ("gain", "proportional") if _has(values, n))
        to_law = ratio * position
        gain, integral = (values[f"controller.speed.{name}"] * to_law for name in ("proportional", "integral"))
    late = run.t >= run.t[-1] - verdict.period_s
    return _Cycle(
        amplitude=verdict.amplitude_rad,
        held=held,
        half=(held.upper - held.lower) / 2,
        gain=abs(gain),
        integral=abs(integral),
        to_law=abs(to_law),
        speed=float(abs(run["motor_speed"][late]).max()),
        lost=float(abs(run["motor_angle_at_load"] - run["load_angle"]).max()),
    )


def _has(values: Mapping[str, float], name: str) -> bool:
    return f"controller.position.{name}" in values


def _values(run: Run) -> dict[str, float]:
    return {q.name: float(value) for q, value in zip(run.system.parameters, run.parameters, strict=True)}


def _held(plant: Actuator, run: Run) -> EquilibriumSet:
    """Motor torques that stiction holds in the last standstill of the run; what the motor went through without one."""
    rows = np.array([np.isin(values, (STUCK, FREE)) for values in run.modes.values()])
    standing = np.flatnonzero(rows.all(axis=0))
    for k in standing[-1:]:
        try:
            return find_equilibrium_set(
                replace(plant, sensors=Sensors()), run.state(int(k)), parameters=changed_parameters(run)
            )
        except NotAtRest:
            break
    late = run["motor_torque"][run.t >= run.t[-1] / 2]
    return EquilibriumSet(lower=float(late.min()), upper=float(late.max()))


def _with_integrating(plant: Actuator, **changes: Any) -> Actuator:
    """The actuator with another integrating law."""
    law = plant.controller
    if isinstance(law, Cascade):
        return replace(plant, controller=replace(law, speed=replace(law.speed, **changes)))
    assert isinstance(law, PID)
    return replace(plant, controller=replace(law, **changes))


def _with_added(plant: Actuator, **changes: Any) -> Actuator:
    """The actuator with other additions to the torque demand of its cascade."""
    law = plant.controller
    assert isinstance(law, Cascade)
    return replace(plant, controller=replace(law, remedies=replace(law.remedies, **changes)))


def _switchable(plant: Actuator, cycle: _Cycle) -> Actuator:
    """The actuator with all remedies that a number switches on, switched off: one compiled model serves them all."""
    law = plant.controller
    inner: Any = law.speed if isinstance(law, Cascade) else law
    old = inner.remedies or IntegralRemedies()
    off = replace(old, dead_band=old.dead_band or 0.0, leakage=old.leakage or 0.0)
    rate = inner.integral / inner.proportional if inner.back_calculation is None else inner.back_calculation
    follows = {"back_calculation": rate} if inner.anti_windup == "back-calculation" else {}
    ready = _with_integrating(plant, remedies=off, **follows)
    if not isinstance(law, Cascade) or law.remedies.compensation is not None:
        return ready
    width = abs(plant.gear.ratio()) * cycle.amplitude
    silent = FrictionCompensation(coulomb=0.0, breakaway=0.0, standstill=STANDSTILL * cycle.speed, width=width)
    return _with_added(ready, compensation=silent)


def _by_numbers(ready: Actuator, given: dict, law: PID | Cascade, cycle: _Cycle) -> list[Candidate]:
    """Remedies of the actuator that has them all, each switched on by its numbers."""
    cascade = isinstance(law, Cascade)
    path, unit = ("controller.speed", "rad/s") if cascade else ("controller", "rad")
    band, found = BAND * cycle.amplitude, []

    def add(name: str, setting: str, numbers: dict[str, float], error: float = UNKNOWN) -> None:
        found.append(Candidate(name, setting, ready, given | numbers, error))

    if cycle.integral > 0:
        error = band * cycle.to_law
        add("integrator dead band", f"{error:.3g} {unit}", {f"{path}.remedies.dead_band": error}, band)
        total = SHARE * cycle.half / cycle.amplitude
        if total > cycle.gain:
            rate = cycle.integral / (total - cycle.gain)
            worst = max(abs(error) for error in cycle.held.static_errors(total))
            add("leaking integrator", f"{rate:.3g} 1/s", {f"{path}.remedies.leakage": rate}, worst)
        follows = next((q for q in ready.system().parameters if q.name == f"{path}.back_calculation"), None)
        if follows is not None:
            rate = FASTER * given.get(follows.name, follows.default)
            add("faster anti-windup", f"{rate:.3g} 1/s", {follows.name: rate})
    if cascade:
        level = COMPENSATED * cycle.half
        numbers = {"coulomb": level / 2, "breakaway": level}
        add(
            "friction compensation",
            f"{level:.3g} N m",
            {f"controller.remedies.compensation.{name}": value for name, value in numbers.items()},
        )
    return found


def _of_gains(plant: Actuator, run: Run, given: dict, law: PID | Cascade) -> list[Candidate]:
    """The same structure, retuned by factors."""
    values, found = _values(run), []
    speed = "controller.speed" if isinstance(law, Cascade) else "controller"
    options = {
        "integral gain / 4": {f"{speed}.integral": 0.25},
        "integral gain / 16": {f"{speed}.integral": 1 / 16},
        "all gains * 4" if isinstance(law, PID) else "speed loop gains * 4": {
            f"{speed}.{name}": 4.0 for name in ("proportional", "integral", "derivative")
        },
    }
    if isinstance(law, Cascade):
        options["position gain / 2"] = {"controller.position.gain": 0.5, "controller.position.proportional": 0.5}
        options["speed loop gains * 4, position gain / 2"] = (
            options["speed loop gains * 4"] | options["position gain / 2"]
        )
    for text, factors in options.items():
        changed = {name: factor * values[name] for name, factor in factors.items() if values.get(name)}
        if changed:
            found.append(Candidate("retuning", text, plant, given | changed, UNKNOWN))
    return found


def _by_parts(plant: Actuator, given: dict, law: PID | Cascade, cycle: _Cycle) -> list[Candidate]:
    """Remedies that are another structure."""
    found, sampling = [], plant.sampling
    if sampling is not None and cycle.integral > 0:
        inner: Any = law.speed if isinstance(law, Cascade) else law
        again = replace(inner.remedies or IntegralRemedies(), reset_on_reversal=True)
        found.append(
            Candidate("integrator reset on reversal", "", _with_integrating(plant, remedies=again), given, UNKNOWN)
        )
    if not isinstance(law, Cascade):
        return found
    period, level = sampling.speed if sampling else None, OVER * cycle.half
    dither = Dither(amplitude=level, frequency=2 * math.pi * DITHER_HZ)
    if period is None or dither.frequency * period <= math.pi:
        text = f"{level:.3g} N m at {DITHER_HZ:g} Hz"
        found.append(Candidate("dither", text, _with_added(plant, dither=dither), given, UNKNOWN, 1 / DITHER_HZ))
    if period is not None:
        knocker = Knocker(amplitude=level, width=KNOCK_TICKS * period, interval=KNOCK_INTERVAL)
        knocking = _with_added(plant, knocker=knocker)
        found.append(Candidate("knocker", f"{level:.3g} N m", knocking, given, UNKNOWN, KNOCK_INTERVAL))
    if law.feedback == "load":
        moved = replace(
            plant, controller=replace(law, feedback="motor"), sensors=replace(plant.sensors, load=None)
        )  # fmt: skip
        found.append(Candidate("position measured at the motor", "", moved, given, cycle.lost))
    return found
