"""Exact periodic orbits, found from the cycle that a run ends in.

The cycle is cut into segments of fixed modes, and Newton's method closes it.
"""

from collections.abc import Mapping

import numpy as np

from actuator.actuator import Actuator
from actuator.orbits.find_sampled import find_sampled
from actuator.orbits.flow import TOLERANCE, NoOrbit, flow_map
from actuator.orbits.sampled import PeriodicOrbit
from actuator.orbits.shooting import close, find_return
from actuator.simulation.run import Run
from actuator.system.hybrid import HybridSystem
from actuator.verdict.verdict import classify


def find_orbit(
    plant: Actuator | HybridSystem,
    run: Run,
    *,
    inputs: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    segments: int = 1,
    tolerance: float = TOLERANCE,
    compiled: bool | None = None,
) -> PeriodicOrbit:
    """The exact periodic orbit near the cycle that a run ends in.

    Parameters
    ----------
    plant : Actuator or HybridSystem
        The system of the run.
    run : Run
        It must end in a cycle (`classify` says so).
    inputs, parameters : mapping of str to float
        By name where they are to differ from those at the end of the run.
    segments : int
        Arcs into which the period is cut for multiple shooting, at its events; the result does not depend on it.
        With sampled controllers only 1.
    tolerance : float
        Local error of each state over its nominal size; with sampled controllers it is 1e-11.
    compiled : bool or None
        As for `simulate`.

    Returns
    -------
    Orbit or SampledOrbit
        The latter for a system with clocks.

    Raises
    ------
    ValueError
        More arcs than the orbit has segments.
    NoOrbit
        Where the run does not end in a cycle, Newton's method does not close it (sampled: with no number of ticks near
        its period), or its modes contradict the margins.
    """
    system = plant.system() if isinstance(plant, Actuator) else plant
    if system.clocks:
        if segments != 1:
            raise ValueError(f"find_orbit: segments must be 1 for {system.name}, which is sampled, got {segments}")
        return find_sampled(system, run, *_cycle_at_end(system, run, inputs, parameters), compiled=compiled)
    period, u, p = _cycle_at_end(system, run, inputs, parameters)
    machine = flow_map(system, tolerance, compiled)
    x, m = system.state_vector(run.state()), machine.integer_modes(run.mode_values[:, -1])
    x, m = find_return(machine, x, m, u, p, period)
    return close(machine, x, m, u, p, period, segments=segments)


def _cycle_at_end(
    system: HybridSystem, run: Run, inputs: Mapping[str, float] | None, parameters: Mapping[str, float] | None
) -> tuple[float, np.ndarray, np.ndarray]:
    """Period [s], inputs and parameters at the end of a run, the latter two but for those given by name.

    Raises
    ------
    NoOrbit
        Where the run does not end in a cycle.
    """
    verdict = classify(run)
    if not verdict.cycles:
        raise NoOrbit(f"{system.name}: the run does not end in a cycle but in '{verdict.verdict}': {verdict.reason}")
    u = system.input_vector({q.name: float(run[q.name][-1]) for q in system.inputs} | dict(inputs or {}))
    before = {q.name: float(value) for q, value in zip(system.parameters, run.parameters, strict=True)}
    return verdict.period_s, u, system.parameter_values(before | dict(parameters or {}))
