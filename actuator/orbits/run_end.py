"""The cycle that a run ends in, from which an exact orbit is searched."""

from collections.abc import Mapping

import numpy as np

from actuator.orbits.flow import NoOrbit
from actuator.simulation.run import Run
from actuator.system.hybrid import HybridSystem
from actuator.verdict.verdict import classify


def cycle_at_end(
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
