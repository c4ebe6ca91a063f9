"""What a design is measured by in the linear models of corners and contact modes, with exact derivatives by the gains.

The loops and responses are those of sliding contacts with the integral at work, and for the margins also those of a
mesh in its gap. What dry friction does to them is taken in by two closed forms:

    at the amplitude A of the load where the output has fallen by 3 dB, its first harmonic is that of a
    viscous friction, so with T reference -> load angle, P load torque -> load angle and F the dry friction at the load

        Q = T/(1 + j 4 sqrt(2) F/(pi A) P),    bandwidth: |Q| = 1/sqrt(2)

    a slip that begins at rest with breakaway torque begins with a step of torque H = breakaway - sliding friction, and
    from any error moves at most

        D = H max_t b(t),    b the step response motor torque -> load angle

    beyond its reference. Where the dead band of the integral is at least as wide, it then stays there: no hunting.

References
----------
B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, "A survey of models, analysis tools and compensation methods for
the control of machines with friction", Automatica 30 (1994), section 4; A. Gelb, W. E. Vander Velde, "Multiple-Input
Describing Functions and Nonlinear System Design" (1968), section 2.3.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from actuator.actuator import Actuator
from actuator.linear.gain_models import GainModel, Response, gain_model
from actuator.linear.modes import mode_models
from actuator.linear.trim import NoEquilibrium, OperatingPoint, rates_function, rounding, trim
from actuator.parameters import Parameter
from studies.specification import Corner, Demand

LOOPS = ("speed_reference", "torque_reference")
INPUTS = ("reference", "load_torque", *(f"inject.{name}" for name in LOOPS))
OUTPUTS = ("load_angle", "current", *LOOPS)
FREQUENCIES = 2 * np.pi * np.logspace(-1.5, 3.5, 240)  # rad/s
POINTS = 300  # of a step response
PERIODS = 4.0  # of the demanded bandwidth, which a step response is looked at for
CURRENT_STEP = 2.5e-4  # s, between the points at which the current is looked at
NONE = math.log(100.0)  # slack of a margin where there is no crossing
NOTHING = 1e-6  # loop gain below which nothing passes
NEWTON = 8
BREAKAWAY = {".breakaway": ".coulomb", ".static": ".sliding"}  # and what it becomes once it slides


class Measure(NamedTuple):
    """A number that is demanded to be at least, or at most, a limit.

    `slack` is how far inside the limit it is, the logarithm of a ratio (of phases [rad] and overshoots the difference),
    `slopes` its derivatives by the logarithms of the gains.
    """

    name: str
    corner: str
    mode: str
    value: float
    limit: float
    unit: str
    slack: float
    slopes: np.ndarray

    @property
    def met(self) -> bool:
        """Whether the demand is met, but for rounding."""
        return self.slack >= -1e-6  # noqa: PLR2004


@dataclass(frozen=True, kw_only=True)
class CornerModes:
    """The contact modes of one corner, and what friction is there; nothing of it depends on the gains.

    Attributes
    ----------
    corner : Corner
        Name and parameters.
    points : dict of str to OperatingPoint
        By mode; "forward", "backward" and those with a mesh in its gap.
    friction : float
        Dry friction at the load while sliding [N m], half of what lies between forward and backward.
    released : dict of str to float
        Torque at the motor [N m] by which breakaway with the stiction margin exceeds sliding friction, by direction.
    """

    corner: Corner
    points: dict[str, OperatingPoint] = field(repr=False)
    friction: float
    released: dict[str, float]


def corner_modes(plant: Actuator, corner: Corner, stiction: float, start: Mapping[str, float]) -> CornerModes:
    """Contact modes of a corner with the friction there.

    Parameters
    ----------
    plant : Actuator
        Without a dead band.
    corner : Corner
        Its parameters.
    stiction : float
        Factor on all breakaway friction [-].
    start : mapping of str to float
        Gains at which to look for the operating points.

    Raises
    ------
    NoEquilibrium
        Where the actuator cannot slide both ways there: it jams, or its motor is too weak.
    """
    parameters = corner.parameters | dict(start)
    found = mode_models(plant, parameters=parameters)
    points = {model.name: model.point for model in found if model.name != "stuck"}
    values = {parameter.name: float(parameter.default) for parameter in plant.system().parameters} | parameters
    torque, sticky = {}, parameters | slides_as_it_breaks_away(values, stiction)
    for word in ("forward", "backward"):
        if word not in points:
            raise NoEquilibrium(f"{corner.name}: {found.unreachable[word]}", {})
        torque[word] = points[word].outputs["motor_torque"]
    released = {
        word: abs(trim(plant, word, parameters=sticky).outputs["motor_torque"] - torque[word]) for word in torque
    }
    friction = abs(plant.gear.ratio() * (torque["forward"] - torque["backward"])) / 2
    return CornerModes(corner=corner, points=points, friction=friction, released=released)


def slides_as_it_breaks_away(values: Mapping[str, float], factor: float) -> dict[str, float]:
    """Parameters with breakaway friction times a factor, and sliding friction equal to it."""
    changed = {}
    for ending, sliding in BREAKAWAY.items():
        for name, value in values.items():
            if name.endswith(ending):
                changed |= {name: factor * value, name.removesuffix(ending) + sliding: factor * value}
    return changed


def measures(
    modes: CornerModes, gains: Mapping[str, float], demand: Demand, tightening: Mapping[str, float]
) -> list[Measure]:
    """Every measure in every mode of a corner.

    Parameters
    ----------
    modes : CornerModes
        From `corner_modes`.
    gains : mapping of str to float
        Values by name, all positive.
    demand : Demand
        The limits.
    tightening : mapping of str to float
        Factors, by the name of a measure, on what is demanded, so that the simulation shows it as well.
    """
    found = []
    points = {name: moved(point, gains) for name, point in modes.points.items() if name in ("forward", "backward")}
    for name, point in modes.points.items():
        sliding = name.split(",")[0]
        here = points[name] if name == sliding else _in_flight(point, points[sliding])
        model = gain_model(here, tuple(gains), INPUTS, OUTPUTS, resting=points[sliding])
        view = _View(model, modes, name, gains, demand, tightening, here.outputs["current"])
        found += view.margins()
        if name == sliding:
            found += view.responses()
    return found


def moved(point: OperatingPoint, gains: Mapping[str, float]) -> OperatingPoint:
    """The operating point with other gains: the same where it still rests, else found anew from there."""
    names = [parameter.name for parameter in point.system.parameters]
    p = point.p.copy()
    for name, value in gains.items():
        p[names.index(name)] = value
    rates = rates_function(point.system)(point.x, point.m, point.u, p).full().ravel()
    scale = np.array([quantity.nominal for quantity in point.system.states])
    if (abs(rates) / scale <= rounding(point.system, point.x, point.m, point.u, p)).all():
        return OperatingPoint(system=point.system, x=point.x, m=point.m, u=point.u, p=p, rates=rates)
    word = {1: "forward", 0: "stuck", -1: "backward"}
    contacts = {
        name.removesuffix(".motion"): word[int(value)]
        for name, value in zip(point.system.modes, np.round(point.m), strict=True)
        if name.endswith(".motion")
    }
    inputs = {quantity.name: float(value) for quantity, value in zip(point.system.inputs, point.u, strict=True)}
    values = dict(zip(names, p.tolist(), strict=True))
    return trim(point.system, contacts, inputs=inputs, guess=point.states, parameters=values)


def _in_flight(point: OperatingPoint, resting: OperatingPoint) -> OperatingPoint:
    return OperatingPoint(system=point.system, x=resting.x, m=point.m, u=resting.u, p=resting.p, rates=resting.rates)


class _View(NamedTuple):
    """One mode of one corner at certain gains."""

    model: GainModel
    modes: CornerModes
    mode: str
    gains: Mapping[str, float]
    demand: Demand
    tightening: Mapping[str, float]
    current: float

    def _measure(self, name: str, value: float, limit: float, unit: str, slack: float, slopes: np.ndarray) -> Measure:  # noqa: PLR0913, PLR0917
        sizes = np.array(list(self.gains.values()))
        return Measure(name, self.modes.corner.name, self.mode, value, limit, unit, slack, np.real(slopes) * sizes)

    def margins(self) -> list[Measure]:
        """Gain and phase margin of each loop."""
        found = []
        table = self.model.table(FREQUENCIES)
        for at in LOOPS:
            closed = table[:, OUTPUTS.index(at), INPUTS.index(f"inject.{at}")]
            values = -closed / (1 + closed)
            sign = 1.0 if self.model.stable else -1.0
            words = at.replace("_", " ")
            size, slopes = _gain_margin(self.model, at, values)
            limit = self.demand.gain_margin
            found.append(
                self._measure(
                    f"gain margin at {words}",
                    math.exp(sign * size),
                    limit,
                    "-",
                    sign * size - math.log(limit),
                    sign * slopes,
                )
            )
            (phase, slopes), (delay, by_gains) = _lags(self.model, at, values)
            limit = self.demand.phase_margin
            found.append(self._measure(f"phase margin at {words}", phase, limit, "rad", phase - limit, slopes))
            limit = self.demand.delay_margin
            found.append(
                self._measure(f"delay margin at {words}", delay, limit, "s", delay / limit - 1, by_gains / limit)
            )
        return found

    def responses(self) -> list[Measure]:
        """Bandwidth, overshoot, stiffness, current and slip."""
        return [self._bandwidth(), self._overshoot(), self._stiffness(), self._current(), self._slip()]

    def _bandwidth(self) -> Measure:
        w = [2 * math.pi * self.demand.bandwidth]
        follows, yields = (self.model.response(given, "load_angle", w) for given in ("reference", "load_torque"))
        k = 4 * math.sqrt(2) * self.modes.friction / (math.pi * self.demand.sine)
        opposed = 1 + 1j * k * yields.value[0]
        value = follows.value[0] / opposed
        change = follows.slopes[0] / opposed - value * 1j * k * yields.slopes[0] / opposed
        limit = self.tightening.get("bandwidth", 1.0) / math.sqrt(2)
        return self._measure("bandwidth", abs(value), limit, "-", math.log(abs(value) / limit), np.real(change / value))

    def _overshoot(self) -> Measure:
        step = PERIODS / self.demand.bandwidth / POINTS
        steps = self.model.steps("reference", "load_angle", step, POINTS)
        found = self.model.step_at("reference", "load_angle", step * int(np.argmax(steps)))
        over = float(found.value) - 1
        limit = self.demand.overshoot
        return self._measure("overshoot", over, limit, "-", limit - over, -found.slopes)

    def _stiffness(self) -> Measure:
        yields = self.model.table(FREQUENCIES)[:, OUTPUTS.index("load_angle"), INPUTS.index("load_torque")]
        worst = FREQUENCIES[int(np.argmax(abs(yields)))]
        found = self.model.response("load_torque", "load_angle", [worst])
        value, limit = 1 / abs(found.value[0]), self.demand.stiffness
        slopes = -np.real(found.slopes[0] / found.value[0])
        return self._measure("stiffness", value, limit, "N m/rad", math.log(value / limit), slopes)

    def _current(self) -> Measure:
        direction = 1.0 if self.current >= 0 else -1.0
        steps = self.model.steps("reference", "current", CURRENT_STEP, POINTS) * direction
        worst = int(np.argmax(abs(steps)))
        found = self.model.step_at("reference", "current", CURRENT_STEP * worst)
        value = abs(self.current) + self.demand.sine * abs(float(found.value))
        slopes = self.demand.sine * math.copysign(1.0, float(found.value)) * found.slopes / value
        limit = self.demand.peak_current
        return self._measure("peak current", value, limit, "A", math.log(limit / value), -slopes)

    def _slip(self) -> Measure:
        step = PERIODS / self.demand.bandwidth / POINTS
        steps = self.model.steps("inject.torque_reference", "load_angle", step, POINTS)
        found = self.model.step_at("inject.torque_reference", "load_angle", step * int(np.argmax(abs(steps))))
        released = self.modes.released[self.mode] * self.tightening.get("slip", 1.0)
        value, limit = released * abs(float(found.value)), self.demand.standing_error
        return self._measure("slip", value, limit, "rad", math.log(limit / value), -found.slopes / float(found.value))


def _gain_margin(model: GainModel, at: str, values: np.ndarray) -> tuple[float, np.ndarray]:
    """|ln| of the factor on the gain, up or down, that makes the loop unstable, the nearest; with its slopes."""
    best = NONE, np.zeros(len(model.gains))
    crosses = np.flatnonzero((np.imag(values[:-1]) * np.imag(values[1:]) < 0) & (np.real(values[:-1]) < 0))
    for k in crosses.tolist():
        _, found = _refined(
            model, at, k, lambda response: (np.imag(response.value[0]), np.imag(response.by_frequency[0]))
        )
        level = np.real(found.value[0])
        if level > -NOTHING:
            continue
        along = np.imag(found.slopes[0]) / np.imag(found.by_frequency[0])
        slopes = (np.real(found.slopes[0]) - np.real(found.by_frequency[0]) * along) / level
        size = math.log(-level)
        if abs(size) < best[0]:
            best = abs(size), math.copysign(1.0, size) * slopes
    return best


def _lags(model: GainModel, at: str, values: np.ndarray) -> tuple[tuple[float, np.ndarray], tuple[float, np.ndarray]]:
    """The smallest lag [rad] and delay [s] that make the loop unstable, negative where it is; each with its slopes."""
    phase = delay = math.pi, np.zeros(len(model.gains))
    for k in np.flatnonzero((abs(values[:-1]) - 1) * (abs(values[1:]) - 1) < 0).tolist():
        w, found = _refined(
            model,
            at,
            k,
            lambda r: (abs(r.value[0]) - 1, np.real(r.by_frequency[0] * r.value[0].conj()) / abs(r.value[0])),
        )
        value = found.value[0]
        lag = (math.pi + float(np.angle(value)) + math.pi) % (2 * math.pi) - math.pi
        change, by_frequency = found.slopes[0] / value, found.by_frequency[0] / value
        shift = -np.real(change) / np.real(by_frequency)  # of the crossing
        slopes = np.imag(change) + np.imag(by_frequency) * shift
        if lag < phase[0]:
            phase = lag, slopes
        if lag / w < delay[0]:
            delay = lag / w, (slopes - lag / w * shift) / w
    return phase, delay


def _refined(
    model: GainModel, at: str, k: int, crossing: Callable[[Response], tuple[float, float]]
) -> tuple[float, Response]:
    """Where a function of the loop crosses zero in interval k of the grid, and the loop there, by Newton's method."""
    low, high = float(FREQUENCIES[k]), float(FREQUENCIES[k + 1])
    start = crossing(model.loop(at, [low]))[0]
    w = math.sqrt(low * high)
    for _ in range(NEWTON):
        value, slope = crossing(model.loop(at, [w]))
        low, high = (w, high) if value * start > 0 else (low, w)
        after = w - value / slope if slope else w
        w, before = (after if low <= after <= high else (low + high) / 2), w
        if abs(w - before) < 1e-12 * w:  # noqa: PLR2004 - rounding
            break
    return w, model.loop(at, [w])


def worst(found: Sequence[Measure]) -> dict[str, Measure]:
    """The one with the least slack of each name."""
    return {
        name: min((m for m in found if m.name == name), key=lambda m: m.slack)
        for name in dict.fromkeys(m.name for m in found)
    }


def defaults_of(parameters: Sequence[Parameter]) -> dict[str, float]:
    """Values by name."""
    return {parameter.name: float(parameter.default) for parameter in parameters}
