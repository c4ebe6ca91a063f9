"""Families of periodic orbits over one parameter, and the bifurcation or bound at which one ends.

A family turns back at a fold, or at a corner where its sequence of modes changes; multipliers leave the unit circle;
the period grows or the amplitude shrinks without end; or no step leads on, and the last orbit tells why.

Where a mode of friction comes or goes, the bifurcation has a class. Sticking is sliding along the surface of zero slip,
in the sense of Filippov:

    crossing-sliding    a standstill between slips in opposite directions disappears
    grazing-sliding     one between slips in the same direction does, or a slip touches zero speed
    adding-sliding      a contact that sticks touches its friction limit
    grazing             teeth, a coupling or a stop touch

References
----------
M. di Bernardo, C. J. Budd, A. R. Champneys, P. Kowalczyk, "Piecewise-smooth Dynamical Systems" (2008), chapters 6 to 8.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from actuator.orbits.flow import along
from actuator.orbits.orbit import Orbit
from actuator.orbits.sampled import SampledOrbit
from actuator.system.contact_modes import STUCK, contact_labels
from actuator.system.hybrid import EventKind

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOLD, BOUND = "fold", "bound"
PERIOD_DOUBLING, TORUS = "period doubling", "Neimark-Sacker"
CROSSING_SLIDING, GRAZING_SLIDING, ADDING_SLIDING = "crossing-sliding", "grazing-sliding", "adding-sliding"
GRAZING, VANISHES, ENDLESS, LOST = "grazing", "amplitude zero", "period infinite", "lost"
LONG, SMALL = 50.0, 0.02  # times the first period, part of the first amplitude
BRIEF, TOUCHES = 0.02, 0.02  # part of the period, and of the usual size of a margin: what is about to disappear
SHORTENS = 1e-4  # part of a standstill by which it gets shorter at least, from orbit to orbit


class End(NamedTuple):
    """Where a family of orbits ends."""

    kind: str  # "fold", "period doubling", "Neimark-Sacker", "crossing-sliding", "grazing-sliding", ...
    value: float  # of the parameter
    reason: str  # in a sentence, with numbers


@dataclass(frozen=True, kw_only=True, eq=False)
class Branch:
    """A family of orbits over one parameter.

    Attributes
    ----------
    parameter : str
        Its name.
    values : ndarray, (n,)
        Of the parameter.
    orbits : tuple of Orbit, or of SampledOrbit
        In the order of the family.
    end : End
        Where and how it ends.
    """

    parameter: str
    values: np.ndarray
    orbits: tuple[Orbit, ...] | tuple[SampledOrbit, ...] = field(repr=False)
    end: End

    @property
    def stable(self) -> np.ndarray:
        """Whether each orbit is, (n,)."""
        return np.array([orbit.stable for orbit in self.orbits])

    def plot(self) -> "Figure":
        """Amplitude, period and the largest multiplier over the parameter."""
        from actuator.plots.orbits import plot_branch

        return plot_branch(self)


class Point(NamedTuple):
    """An orbit of the family with its tangent."""

    orbit: Orbit
    value: float
    tangent: np.ndarray  # (n + 1,), in states over `size` and the parameter over `width`


@dataclass(frozen=True)
class BranchEnds:
    """The end of a family that is followed in a parameter between its bounds."""

    first: Orbit
    bounds: tuple[float, float]
    size: np.ndarray  # of the motion, by state

    def find(self, points: list[Point], point: Point) -> End | None:
        """What a step has come across."""
        last = points[-1]
        if last.tangent[-1] * point.tangent[-1] < 0 and point.orbit.sequence != last.orbit.sequence:
            return _corner(points, point)
        if last.tangent[-1] * point.tangent[-1] < 0:
            a, b = last.tangent[-1], point.tangent[-1]
            width = self.bounds[1] - self.bounds[0]
            chord = np.append((point.orbit.x0 - last.orbit.x0) / self.size, (point.value - last.value) / width)
            # the slope of the parameter along the family is nearly a line here: integrate it up to its zero
            value = last.value + width * a * np.linalg.norm(chord) * a / (a - b) / 2
            return End(FOLD, float(value), "the family turns back: no cycle of it exists beyond this value")
        return _unstable(last, point) or self._limits(last, point)

    def _limits(self, last: Point, point: Point) -> End | None:
        """Bounds, and what grows or shrinks without end."""
        if not self.bounds[0] < point.value < self.bounds[1]:
            value = float(np.clip(point.value, *self.bounds))
            return End(BOUND, value, "the family goes on beyond the bound")
        start = self.first
        if point.orbit.period > LONG * start.period:
            value = self._zero(last, point, lambda orbit: 1 / orbit.period)
            return End(ENDLESS, value, f"the period has grown to {point.orbit.period:.4g} s and goes on growing")
        if point.orbit.load_amplitude < SMALL * start.load_amplitude:
            value = self._zero(last, point, lambda orbit: orbit.load_amplitude)
            return End(VANISHES, value, f"the amplitude has shrunk to {point.orbit.load_amplitude:.3g} rad")
        return None

    def _zero(self, last: Point, point: Point, measure: Callable[[Orbit], float]) -> float:
        """Where a measure of the orbits reaches zero, on the line through two of them."""
        a, b = measure(last.orbit), measure(point.orbit)
        return float(np.clip(point.value + (point.value - last.value) * b / (a - b), *self.bounds))


def diagnose_end(points: list[Point], reason: str) -> End:
    """What is about to disappear on the last orbit, from which no step leads on."""
    last = points[-1].orbit
    value = points[-1].value
    if _standstills(last) and _shortest_standstill(last) < BRIEF * last.period:
        kind, what = classify_loss(last)
        return End(kind, value, f"{what}; {reason}")
    touch, event, kind = _nearest_touch(last)
    if touch < TOUCHES:
        return End(kind, value, f"{event} comes down to {touch:.3g} of its usual size; {reason}")
    return End(LOST, value, reason)


def _unstable(last: Point, point: Point) -> End | None:
    """Where multipliers leave the unit circle elsewhere than at 1."""
    mu, before = point.orbit.multipliers[0], last.orbit.multipliers[0]
    if not last.orbit.stable or point.orbit.stable:
        return None
    value = float(last.value + (1 - abs(before)) / (abs(mu) - abs(before)) * (point.value - last.value))
    if abs(mu.imag) > 1e-6 * abs(mu):  # noqa: PLR2004 - a pair
        return End(TORUS, value, f"a pair of multipliers leaves the unit circle, at {mu:.4g}")
    return End(PERIOD_DOUBLING, value, f"a multiplier leaves the unit circle at {mu:.4g}") if mu.real < 0 else None


def _corner(points: list[Point], point: Point) -> End:
    """A family that turns back where its sequence of modes changes: not smoothly, at a corner."""
    last = points[-1]
    gone = _standstills(last.orbit) - _standstills(point.orbit)
    brief = _standstills(last.orbit) > 0 and _shortest_standstill(last.orbit) < BRIEF * last.orbit.period
    if gone <= 0 and not brief:
        return End(GRAZING, last.value, "the family turns back where a contact touches another mode")
    shortest, value = _shortest_standstill(last.orbit), last.value
    if len(points) > 1 and points[-2].orbit.sequence == last.orbit.sequence:
        before = _shortest_standstill(points[-2].orbit)
        value += (last.value - points[-2].value) * shortest / max(before - shortest, SHORTENS * before)
        reach = abs(last.value - points[-2].value) + abs(point.value - last.value)
        value = float(np.clip(value, last.value - reach, last.value + reach))
    kind, what = classify_loss(last.orbit)
    return End(kind, value, f"{what}, and the family turns back")


def _stands(orbit: Orbit) -> list[float]:
    """Durations of the intervals in which some contact sticks, in one sequence of modes."""
    found: list[float] = []
    for modes, group in itertools.groupby(orbit.segments, key=lambda segment: segment.modes):
        if STUCK in contact_labels(orbit.system, modes).values():
            found.append(sum(segment.duration for segment in group))
    return found


def _standstills(orbit: Orbit) -> int:
    return len(_stands(orbit))


def _shortest_standstill(orbit: Orbit) -> float:
    return min(_stands(orbit))


def classify_loss(orbit: Orbit) -> tuple[str, str]:
    """The class of the bifurcation in which the shortest standstill disappears, and what disappears in words."""
    stands, labels = _stands(orbit), [contact_labels(orbit.system, modes) for modes in orbit.sequence]
    sticking = [k for k, row in enumerate(labels) if STUCK in row.values()]
    k, count = sticking[int(np.argmin(stands))], len(labels)
    kind = GRAZING_SLIDING
    for name in (name for name, label in labels[k].items() if label == STUCK):
        # the slips of this contact before and after, around the period
        around = [labels[(k + j) % count][name] for j in range(1, count)]
        slips = [label for label in around if label != STUCK]
        if slips and slips[0] != slips[-1]:
            kind = CROSSING_SLIDING
    what = f"a standstill of {min(stands):.3g} s disappears"
    return kind, f"{what}, and with it all sticking" if max(stands) < 2 * BRIEF * orbit.period else what


def _nearest_touch(orbit: Orbit) -> tuple[float, str, str]:
    """Smallest minimum of a margin inside a segment, its name, and the class of bifurcation where it is zero."""
    found = (np.inf, "", GRAZING)
    for segment, start in zip(orbit.segments, orbit.starts, strict=True):
        states = orbit.map.path(start, segment.modes, orbit.u, orbit.p, segment.duration)
        margins = along(orbit.system.margins, states, segment.modes, orbit.u, orbit.p)
        inside = (margins[:, 1:-1] < margins[:, :-2]) & (margins[:, 1:-1] < margins[:, 2:])
        labels = contact_labels(orbit.system, segment.modes)
        for row, k in zip(*np.nonzero(inside), strict=True):
            event, kind = orbit.system.events[row], GRAZING
            if event.kind is EventKind.FRICTION:
                kind = ADDING_SLIDING if labels.get(event.at) == STUCK else GRAZING_SLIDING
            found = min(found, (float(margins[row, k + 1]), event.name, kind))
    return found
