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

from collections.abc import Sequence
from typing import cast

import numpy as np

from actuator.continuation.bifurcations import (
    LOST,
    PERIOD_DOUBLING,
    TORUS,
    Branch,
    BranchEnds,
    End,
    Point,
    diagnose_end,
)
from actuator.continuation.sampled import continue_sampled
from actuator.orbits.flow import NoOrbit
from actuator.orbits.orbit import Orbit
from actuator.orbits.sampled import PeriodicOrbit, SampledOrbit
from actuator.orbits.segments import Passage, Segment, passage
from actuator.orbits.shooting import CLOSED, FINISHED, GROWN, build_orbit, find_return, one_period
from gear.quantities import require_known

SEQUENCES = 4  # how often the events may turn out to be others than guessed
STEPS = 12  # Newton steps of a correction
# steps along the family, over the width of the bounds or the size of the orbit
FIRST, LARGEST, SMALLEST = 0.02, 0.2, 1e-4
LONGEST = 400  # orbits in a family
SHRINKS = 0.2  # factor on the amplitude below which a step has fallen into an equilibrium


def continue_orbit(
    orbit: PeriodicOrbit,
    parameter: str,
    bounds: tuple[float, float],
    *,
    upward: bool,
    compiled: bool | None = None,
) -> Branch:
    """The family of an orbit over a parameter, in one direction, to its end or to a bound.

    Parameters
    ----------
    orbit : Orbit or SampledOrbit
        Where to start.
    parameter : str
        Name.
    bounds : (float, float)
        Of the parameter; their distance sizes the steps.
    upward : bool
        Whether to set out towards the larger bound.
    compiled : bool or None
        With sampled controllers as for `simulate`; an Orbit goes on as it was found.

    Returns
    -------
    Branch
        With sampled controllers a fold cannot be told from other ends ("lost"), as only one side of it is followed.

    Raises
    ------
    KeyError
        Unknown parameter (the nearest names are given).
    ValueError
        Bounds that do not hold the orbit.
    """
    names = [quantity.name for quantity in orbit.system.parameters]
    require_known([parameter], names, "parameter")
    value = float(orbit.p[names.index(parameter)])
    if not bounds[0] < bounds[1] or not bounds[0] <= value <= bounds[1]:
        raise ValueError(
            f"continue_orbit: {parameter} = {value:.6g} must lie between its bounds {bounds[0]:g}, {bounds[1]:g}"
        )
    if orbit.system.clocks:
        return continue_sampled(cast("SampledOrbit", orbit), parameter, bounds, upward=upward, compiled=compiled)
    return _Continuation(cast("Orbit", orbit), parameter, bounds).run(upward)


class _Continuation:
    """What stays the same along a family."""

    def __init__(self, orbit: Orbit, parameter: str, bounds: tuple[float, float]) -> None:
        names = [quantity.name for quantity in orbit.system.parameters]
        self.parameter, self.index = parameter, names.index(parameter)
        self.first, self.machine = orbit, orbit.map
        self.width = bounds[1] - bounds[0]
        self.size = np.maximum(np.ptp(orbit.path[1], axis=1), orbit.map.nominal)
        self.ends = BranchEnds(orbit, bounds, self.size)

    def run(self, upward: bool) -> Branch:
        points = [self._tangent(self.first, None, upward)]
        step, end = FIRST, None
        while end is None:
            last = points[-1]
            try:
                point = self._step(last, step)
            except NoOrbit as error:
                step /= 2
                if step < SMALLEST:
                    end = diagnose_end(points, str(error))
                continue
            end = self.ends.find(points, point)
            if end is None or end.kind in (PERIOD_DOUBLING, TORUS):
                points.append(point)
                step = min(1.3 * step, LARGEST)
            if end is None and len(points) > LONGEST:
                end = End(LOST, point.value, f"the family was followed for {LONGEST} orbits without an end")
        return Branch(
            parameter=self.parameter,
            values=np.array([point.value for point in points]),
            orbits=tuple(point.orbit for point in points),
            end=end,
        )

    def _matrix(self, through: Passage) -> np.ndarray:
        """Derivatives of P(x) - x by the state and the parameter, scaled, (n, n + 1)."""
        n = self.size.size
        scaled = through.moved / self.size[:, None] * np.append(self.size, self.width)
        return scaled - np.eye(n, n + 1)

    def _passage(self, x: np.ndarray, pieces: Sequence[Segment], u: np.ndarray, p: np.ndarray) -> Passage:
        n = x.size
        seed_p = np.zeros((p.size, n + 1))
        seed_p[self.index, n] = 1
        return passage(self.machine, x, pieces, u, p, np.eye(n, n + 1), seed_p)

    def _tangent(self, orbit: Orbit, before: np.ndarray | None, upward: bool = True) -> Point:
        """The orbit with the direction of the family, the same way as `before`."""
        matrix = self._matrix(self._passage(orbit.x0, orbit.segments, orbit.u, orbit.p))
        direction = np.linalg.svd(matrix)[2][-1]
        forward = direction @ before if before is not None else direction[-1] * (1 if upward else -1)
        return Point(orbit, float(orbit.p[self.index]), direction if forward >= 0 else -direction)

    def _step(self, last: Point, length: float) -> Point:
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
            x, p, closed, residual = self._correct(x, p, pieces, last, anchor)
            try:
                found = build_orbit(self.machine, x, u, p, [closed], residual)
            except NoOrbit:  # closed, but with events that the motion there does not have
                if attempt == SEQUENCES - 1:
                    raise
                pieces = one_period(self.machine, x, m, u, p, closed.duration)
                continue
            point = self._tangent(found, last.tangent)
            self._require_near(last, point)
            return point
        raise AssertionError

    def _correct(
        self, x: np.ndarray, p: np.ndarray, pieces: Sequence[Segment], last: Point, anchor: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, Passage, float]:
        """State and parameter in the plane through the anchor, across the tangent, that close the given segments."""
        u, best = last.orbit.u, np.inf
        for _ in range(STEPS):
            around = self._passage(x, pieces, u, p)
            gap = around.end - x
            residual = float(np.max(abs(gap) / self.machine.nominal))
            if residual < FINISHED or best / 2 <= residual < CLOSED:
                return x, p, around, residual
            if residual > GROWN * best:
                break
            best = min(best, residual)
            off = last.tangent @ (np.append(x / self.size, p[self.index] / self.width) - anchor)
            matrix = np.vstack([self._matrix(around), last.tangent])
            change = np.linalg.solve(matrix, -np.append(gap / self.size, off))
            x, p = x + change[:-1] * self.size, p.copy()
            p[self.index] += change[-1] * self.width
            pieces = list(around.segments)
        raise NoOrbit(f"{self.machine.system.name}: the correction does not converge, the residual is {residual:.3g}")

    def _require_near(self, last: Point, point: Point) -> None:
        """Raise where a step has jumped to another orbit."""
        ratio = point.orbit.period / last.orbit.period
        size = point.orbit.load_amplitude / last.orbit.load_amplitude
        bent = last.tangent @ point.tangent < 0.5  # noqa: PLR2004 - 60 degrees
        if not 1 / 1.5 < ratio < 1.5 or size < SHRINKS or bent:  # noqa: PLR2004 - half again
            raise NoOrbit(
                f"{point.orbit.system.name}: the step is too long, the period changes by a factor {ratio:.3g} and the "
                f"amplitude by {size:.3g}"
            )
