"""Where hunting ends over one parameter under sampled control: the end of a family of orbits.

The number of ticks of a cycle is whole, so over a parameter a family is a row of short pieces, one for each number;
from one to the next the cycle is the same but for less than a tick. It is followed in steps of the parameter, each a
few simulated cycles closed by Newton's method, until none closes.
"""

import numpy as np

from actuator.continuation.bifurcations import BOUND, LOST, Branch, End
from actuator.orbits.find_sampled import close_sampled, resting_point
from actuator.orbits.flow import NoOrbit
from actuator.orbits.sampled import SampledOrbit, continue_run

FIRST, LARGEST, SMALLEST = 0.05, 0.2, 1e-3  # steps over the width of the bounds
GROWS = 1.5
CYCLES = 15  # from the last orbit to a new one: near its end a cycle settles slowly


def continue_sampled(
    orbit: SampledOrbit, parameter: str, bounds: tuple[float, float], *, upward: bool, compiled: bool | None
) -> Branch:
    """The family of a sampled orbit over a parameter, as `continue_orbit`."""
    names = [quantity.name for quantity in orbit.system.parameters]
    index, width, sign = names.index(parameter), bounds[1] - bounds[0], 1 if upward else -1
    orbits, values = [orbit], [float(orbit.p[index])]
    step, failure = FIRST * width, ""
    while step > SMALLEST * width:
        value = min(max(values[-1] + sign * step, bounds[0]), bounds[1])
        if value == values[-1]:
            end = End(BOUND, value, f"the cycle exists up to {parameter} = {value:g}")
            return Branch(parameter=parameter, values=np.array(values), orbits=tuple(orbits), end=end)
        try:
            orbit = _next(orbits[-1], index, value, compiled)
        except NoOrbit as error:
            failure, step = str(error), step / 2
            continue
        orbits.append(orbit)
        values.append(value)
        step = min(GROWS * step, LARGEST * width)
    reason = f"no orbit closes {step:.3g} beyond {parameter} = {values[-1]:.6g}: {failure}"
    return Branch(parameter=parameter, values=np.array(values), orbits=tuple(orbits), end=End(LOST, values[-1], reason))


def _next(last: SampledOrbit, index: int, value: float, compiled: bool | None) -> SampledOrbit:
    """The orbit at another value of the parameter, from where a few cycles lead that begin on the last one."""
    system, p = last.system, last.p.copy()
    p[index] = value
    start = {q.name: float(number) for q, number in zip(system.states, last.x0, strict=True)}
    run = continue_run(system, start, last.u, p, CYCLES * last.period, compiled)
    same = [change.time for change in run.changes if change[1:] == run.changes[-1][1:]]
    if len(same) < 2 or run.t[-1] - same[-1] > last.period:  # noqa: PLR2004 - two returns
        raise NoOrbit(f"at {value:.6g} the motion comes to rest")
    period = same[-1] - same[-2]
    x, m = resting_point(run, period)
    return close_sampled(system, x, m, last.u, p, period, compiled=compiled)
