"""Follow a periodic orbit in a parameter by pseudo-arclength, to where the family ends.

The unknowns are the state just after an event and the parameter; each step predicts along the tangent and corrects in
the plane across it, with exact derivatives by both:

    P(x, parameter) - x = 0,      tangent . (step - predicted step) = 0

The events of the cycle are found anew at every prediction, so a family goes on where a mode comes or goes and its
return map does not jump.

References
----------
H. B. Keller, "Numerical solution of bifurcation and nonlinear eigenvalue problems" (1977); E. J. Doedel, H. B. Keller,
J. P. Kernevez, "Numerical analysis and control of bifurcation problems (I)", Int. J. Bifurcation and Chaos 1 (1991).
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from actuator.hunting.find_orbit import CLOSED, FINISHED, GROWN, find_return, finished, one_period
from actuator.hunting.flow_map import NoOrbit, Passage, Segment
from actuator.hunting.orbit import Orbit
from actuator.hunting.sampled_orbit import SampledOrbit
from actuator.parameters import require_known
from actuator.simulation.run import STUCK, contact_labels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOLD, BOUND = "fold", "bound"
PERIOD_DOUBLING, TORUS = "period doubling", "Neimark-Sacker"
LOSS_OF_STICK, COLLISION, GRAZING, VANISHES, ENDLESS, LOST = (
    "loss of stick",
    "border collision",
    "grazing",
    "amplitude zero",
    "period infinite",
    "lost",
)

SEQUENCES = 4  # how often the events may turn out to be others than guessed
STEPS = 12  # Newton steps of a correction
# steps along the family, over the width of the bounds or the size of the orbit
FIRST, LARGEST, SMALLEST = 0.02, 0.2, 1e-4
LONGEST = 400  # orbits in a family
LONG, SMALL = 50.0, 0.02  # times the first period, part of the first amplitude
SHRINKS = 0.2  # factor on the amplitude below which a step has fallen into an equilibrium
BRIEF, TOUCHES = 0.02, 0.02  # part of the period, and of the usual size of a margin: what is about to disappear


class End(NamedTuple):
    """Where a family of orbits ends."""

    kind: str  # "fold", "period doubling", "Neimark-Sacker", "loss of stick", "border collision", ...
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
    orbits : tuple of Orbit
        In the order of the family.
    sequence_changes : tuple of float
        Values behind which the cycle has another sequence of modes.
    end : End
        Where and how it ends.
    """

    parameter: str
    values: np.ndarray
    orbits: tuple[Orbit, ...] = field(repr=False)
    sequence_changes: tuple[float, ...]
    end: End

    @property
    def stable(self) -> np.ndarray:
        """Whether each orbit is, (n,)."""
        return np.array([orbit.stable for orbit in self.orbits])

    def plot(self) -> "Figure":
        """Amplitude, period and the largest multiplier over the parameter."""
        from actuator.hunting.orbit_plots import plot_branch

        return plot_branch(self)


class _Point(NamedTuple):
    """An orbit of the family with its tangent."""

    orbit: Orbit
    value: float
    tangent: np.ndarray  # (n + 1,), in states over `size` and the parameter over `width`


def follow(orbit: Orbit | SampledOrbit, parameter: str, bounds: tuple[float, float], *, upward: bool) -> Branch:
    """The family of an orbit over a parameter, in one direction, to its end or to a bound.

    Parameters
    ----------
    orbit : Orbit
        Where to start.
    parameter : str
        Name.
    bounds : (float, float)
        Of the parameter; their distance sizes the steps.
    upward : bool
        Whether to set out towards the larger bound.

    Returns
    -------
    Branch

    Raises
    ------
    KeyError
        Unknown parameter (the nearest names are given).
    ValueError
        Bounds that do not hold the orbit, or an orbit of a sampled system.
    """
    if isinstance(orbit, SampledOrbit):
        raise ValueError(f"follow: {orbit.system.name} is sampled; its families are those of follow_sampled")
    return _Follower(orbit, parameter, bounds).follow(upward)


class _Follower:
    """What stays the same along a family."""

    def __init__(self, orbit: Orbit, parameter: str, bounds: tuple[float, float]) -> None:
        names = [quantity.name for quantity in orbit.system.parameters]
        require_known([parameter], names, "parameter")
        self.parameter, self.index, self.bounds = parameter, names.index(parameter), bounds
        self.first, self.machine = orbit, orbit.map
        value = float(orbit.p[self.index])
        if not bounds[0] < bounds[1] or not bounds[0] <= value <= bounds[1]:
            raise ValueError(
                f"follow: {parameter} = {value:.6g} must lie between its bounds {bounds[0]:g}, {bounds[1]:g}"
            )
        self.width = bounds[1] - bounds[0]
        self.size = np.maximum(np.ptp(orbit.path[1], axis=1), orbit.map.nominal)

    def follow(self, upward: bool) -> Branch:
        points = [self._tangent(self.first, None, upward)]
        changes: list[float] = []
        step, end = FIRST, None
        while end is None:
            last = points[-1]
            try:
                point = self._step(last, step)
            except NoOrbit as error:
                step /= 2
                if step < SMALLEST:
                    end = self._ended(points, str(error))
                continue
            end = self._crossed(points, point)
            if end is None or end.kind in (PERIOD_DOUBLING, TORUS):
                points.append(point)
                if point.orbit.sequence != last.orbit.sequence:
                    changes.append((last.value + point.value) / 2)
                step = min(1.3 * step, LARGEST)
            if end is None and len(points) > LONGEST:
                end = End(LOST, point.value, f"the family was followed for {LONGEST} orbits without an end")
        return Branch(
            parameter=self.parameter,
            values=np.array([point.value for point in points]),
            orbits=tuple(point.orbit for point in points),
            sequence_changes=tuple(changes),
            end=end,
        )

    # -- one step -------------------------------------------------------------------------------------

    def _matrix(self, passage: Passage) -> np.ndarray:
        """Derivatives of P(x) - x by the state and the parameter, scaled, (n, n + 1)."""
        n = self.size.size
        scaled = passage.moved / self.size[:, None] * np.append(self.size, self.width)
        return scaled - np.eye(n, n + 1)

    def _passage(self, x: np.ndarray, pieces: Sequence[Segment], u: np.ndarray, p: np.ndarray) -> Passage:
        n = x.size
        seed_p = np.zeros((p.size, n + 1))
        seed_p[self.index, n] = 1
        return self.machine.passage(x, pieces, u, p, np.eye(n, n + 1), seed_p)

    def _tangent(self, orbit: Orbit, before: np.ndarray | None, upward: bool = True) -> _Point:
        """The orbit with the direction of the family, the same way as `before`."""
        matrix = self._matrix(self._passage(orbit.x0, orbit.segments, orbit.u, orbit.p))
        direction = np.linalg.svd(matrix)[2][-1]
        forward = direction @ before if before is not None else direction[-1] * (1 if upward else -1)
        return _Point(orbit, float(orbit.p[self.index]), direction if forward >= 0 else -direction)

    def _step(self, last: _Point, length: float) -> _Point:
        """The next orbit, `length` along the tangent.

        Raises
        ------
        NoOrbit
            Where none is found there.
        """
        orbit, u = last.orbit, last.orbit.u
        p = orbit.p.copy()
        p[self.index] += length * self.width * last.tangent[-1]
        x, m = orbit.x0 + length * self.size * last.tangent[:-1], orbit.modes
        try:
            pieces = one_period(self.machine, x, m, u, p, orbit.period)
        except NoOrbit:  # the event at which the period was cut is gone
            x, m = find_return(self.machine, orbit.x0, orbit.modes, u, p, orbit.period)
            pieces = one_period(self.machine, x, m, u, p, orbit.period)
        anchor = np.append(x / self.size, p[self.index] / self.width)
        for attempt in range(SEQUENCES):
            x, p, passage, residual = self._corrected(x, p, pieces, last, anchor)
            try:
                found = finished(self.machine, x, u, p, [passage], residual)
            except NoOrbit:  # closed, but with events that the motion there does not have
                if attempt == SEQUENCES - 1:
                    raise
                pieces = one_period(self.machine, x, m, u, p, passage.duration)
                continue
            point = self._tangent(found, last.tangent)
            self._plausible(last, point)
            return point
        raise AssertionError

    def _corrected(
        self, x: np.ndarray, p: np.ndarray, pieces: Sequence[Segment], last: _Point, anchor: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, Passage, float]:
        """State and parameter in the plane through the anchor, across the tangent, that close the given segments."""
        u, best = last.orbit.u, np.inf
        for _ in range(STEPS):
            passage = self._passage(x, pieces, u, p)
            gap = passage.end - x
            residual = float(np.max(abs(gap) / self.machine.nominal))
            if residual < FINISHED or best / 2 <= residual < CLOSED:
                return x, p, passage, residual
            if residual > GROWN * best:
                break
            best = min(best, residual)
            off = last.tangent @ (np.append(x / self.size, p[self.index] / self.width) - anchor)
            matrix = np.vstack([self._matrix(passage), last.tangent])
            change = np.linalg.solve(matrix, -np.append(gap / self.size, off))
            x, p = x + change[:-1] * self.size, p.copy()
            p[self.index] += change[-1] * self.width
            pieces = list(passage.segments)
        raise NoOrbit(f"{self.machine.system.name}: the correction does not converge, the residual is {residual:.3g}")

    def _plausible(self, last: _Point, point: _Point) -> None:
        """Raise where a step has jumped to another orbit."""
        ratio = point.orbit.period / last.orbit.period
        size = point.orbit.load_amplitude / last.orbit.load_amplitude
        bent = last.tangent @ point.tangent < 0.5  # noqa: PLR2004 - 60 degrees
        if not 1 / 1.5 < ratio < 1.5 or size < SHRINKS or bent:  # noqa: PLR2004 - half again
            raise NoOrbit(
                f"{point.orbit.system.name}: the step is too long, the period changes by a factor {ratio:.3g} and the "
                f"amplitude by {size:.3g}"
            )

    # -- the end --------------------------------------------------------------------------------------

    def _crossed(self, points: list[_Point], point: _Point) -> End | None:
        """What a step has come across."""
        last = points[-1]
        if last.tangent[-1] * point.tangent[-1] < 0 and point.orbit.sequence != last.orbit.sequence:
            return self._corner(points, point)
        if last.tangent[-1] * point.tangent[-1] < 0:
            a, b = last.tangent[-1], point.tangent[-1]
            chord = np.append((point.orbit.x0 - last.orbit.x0) / self.size, (point.value - last.value) / self.width)
            # the slope of the parameter along the family is nearly a line here: integrate it up to its zero
            value = last.value + self.width * a * np.linalg.norm(chord) * a / (a - b) / 2
            return End(FOLD, float(value), "the family turns back: no cycle of it exists beyond this value")
        return self._unstable(last, point) or self._limits(last, point)

    def _unstable(self, last: _Point, point: _Point) -> End | None:
        """Where multipliers leave the unit circle elsewhere than at 1."""
        mu, before = point.orbit.multipliers[0], last.orbit.multipliers[0]
        if not last.orbit.stable or point.orbit.stable:
            return None
        value = float(last.value + (1 - abs(before)) / (abs(mu) - abs(before)) * (point.value - last.value))
        if abs(mu.imag) > 1e-6 * abs(mu):  # noqa: PLR2004 - a pair
            return End(TORUS, value, f"a pair of multipliers leaves the unit circle, at {mu:.4g}")
        return End(PERIOD_DOUBLING, value, f"a multiplier leaves the unit circle at {mu:.4g}") if mu.real < 0 else None

    def _limits(self, last: _Point, point: _Point) -> End | None:
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

    def _corner(self, points: list[_Point], point: _Point) -> End:
        """A family that turns back where its sequence of modes changes: not smoothly, at a corner."""
        last = points[-1]
        gone = _standstills(last.orbit) - _standstills(point.orbit)
        brief = _standstills(last.orbit) > 0 and _shortest_standstill(last.orbit) < BRIEF * last.orbit.period
        if gone <= 0 and not brief:
            return End(GRAZING, last.value, "the family turns back where a contact touches another mode")
        shortest, value = _shortest_standstill(last.orbit), last.value
        if len(points) > 1 and points[-2].orbit.sequence == last.orbit.sequence:
            before = _shortest_standstill(points[-2].orbit)
            value += (last.value - points[-2].value) * shortest / max(before - shortest, SMALLEST * before)
            reach = abs(last.value - points[-2].value) + abs(point.value - last.value)
            value = float(np.clip(value, last.value - reach, last.value + reach))
        return End(_loss(last.orbit), value, f"a standstill of {shortest:.3g} s disappears, and the family turns back")

    def _zero(self, last: _Point, point: _Point, measure: Callable[[Orbit], float]) -> float:
        """Where a measure of the orbits reaches zero, on the line through two of them."""
        a, b = measure(last.orbit), measure(point.orbit)
        return float(np.clip(point.value + (point.value - last.value) * b / (a - b), *self.bounds))

    def _ended(self, points: list[_Point], reason: str) -> End:
        """What is about to disappear on the last orbit, from which no step leads on."""
        last = points[-1].orbit
        value = points[-1].value
        if _standstills(last) and _shortest_standstill(last) < BRIEF * last.period:
            return End(_loss(last), value, f"a standstill of {_shortest_standstill(last):.3g} s disappears; {reason}")
        worst = _nearest_touch(last)
        if worst[0] < TOUCHES:
            return End(GRAZING, value, f"{worst[1]} comes down to {worst[0]:.3g} of its usual size; {reason}")
        return End(LOST, value, reason)


def _stands(orbit: Orbit) -> list[float]:
    """Durations of the stretches in which some contact sticks, in one sequence of modes."""
    found: list[float] = []
    for modes, group in itertools.groupby(orbit.segments, key=lambda segment: segment.modes):
        if STUCK in contact_labels(orbit.system.modes, modes).values():
            found.append(sum(segment.duration for segment in group))
    return found


def _standstills(orbit: Orbit) -> int:
    return len(_stands(orbit))


def _shortest_standstill(orbit: Orbit) -> float:
    return min(_stands(orbit))


def _loss(orbit: Orbit) -> str:
    """What it is that a brief standstill disappears: the end of all sticking, or a border between two sequences."""
    return LOSS_OF_STICK if max(_stands(orbit)) < 2 * BRIEF * orbit.period else COLLISION


def _nearest_touch(orbit: Orbit) -> tuple[float, str]:
    """Smallest minimum of a margin inside a segment, and its name."""
    found = (np.inf, "")
    for segment, start in zip(orbit.segments, orbit.starts, strict=True):
        states = orbit.map.path(start, segment.modes, orbit.u, orbit.p, segment.duration)
        given = (np.tile(np.array(v, float)[:, None], states.shape[1]) for v in (segment.modes, orbit.u, orbit.p))
        margins = orbit.system.margins.map(states.shape[1])(states, *given).full()
        inside = (margins[:, 1:-1] < margins[:, :-2]) & (margins[:, 1:-1] < margins[:, 2:])
        for row, k in zip(*np.nonzero(inside), strict=True):
            found = min(found, (float(margins[row, k + 1]), orbit.system.margin_names[row]))
    return found
