"""Benchmark of simulation: figure 9 of the gear paper and the built-in cases, compiled and interpreted."""

import time as clock
from collections.abc import Callable, Mapping
from statistics import median

import casadi as ca
import numpy as np

from actuator import Actuator, Run, simulate
from actuator.simulation.compiled import compile_function, compiler
from actuator.simulation.signals import Signal
from studies.cases import built_in, load_case
from studies.checks.paper import (
    compound_planetary,
    compound_planetary_inputs,
    figure_9,
    figure_9_inputs,
    figure_9_start,
)

RESOLUTION = 2e-3  # s, of the built-in cases
BLOCK, REPEATS = 500, 5  # evaluations that are timed together, and how often
HEADER = f"{'case':<34}{'engine':<13}{'simulated':>10}{'wall':>11}{'events':>8}{'real time':>12}"


def benchmark(runs: int, say: Callable[[str], None]) -> None:
    """Print the median wall time of `runs` simulations of each case, after one that builds and warms up.

    `simulate` is timed: integration, event checks and outputs, without building and compiling.
    """
    say(HEADER)
    jobs: list[tuple[str, Actuator, float, Mapping[str, Signal], Mapping[str, float], float]] = []
    for arms in ("printed", "geometric"):
        plant = figure_9(arms)
        jobs.append((f"figure 9, {arms} lever arms", plant, 10.0, figure_9_inputs(), figure_9_start(plant), 0.05))
    jobs.append(("compound planetary", compound_planetary(), 10.0, compound_planetary_inputs(), {}, RESOLUTION))
    for name in built_in():
        case = load_case(name)
        jobs.append((name, case.actuator, case.duration, case.inputs, {}, RESOLUTION))
    for compiled in (True, False) if compiler() else (False,):
        for title, plant, duration, inputs, start, resolution in jobs:
            timed: list[Run] = [
                simulate(plant, duration, inputs=inputs, start=start, resolution=resolution, compiled=compiled)
                for _ in range(runs + 1)
            ]
            wall = median(run.statistics.wall_s for run in timed[1:])
            say(
                f"{title:<34}{'compiled' if compiled else 'interpreted':<13}{duration:>8g} s{1e3 * wall:>8.1f} ms"
                f"{timed[-1].statistics.events:>8}{duration / wall:>10.0f} x"
            )
            if compiled and plant.sampling is not None:
                say(_shares(plant, timed[-1]))
    if not compiler():
        say("no C compiler found: only interpreted runs")


def _shares(plant: Actuator, run: Run) -> str:
    """Breakdown of the time of a compiled run with sampled control, in a line; each function timed separately."""
    system = plant.system()
    assert system.tick is not None
    x = np.array([run[state.name] for state in system.states])[:, :BLOCK]
    same = [np.tile(value[:, None], x.shape[1]) for value in (system.input_vector(), run.parameters)]
    modes, due = run.mode_values[:, :BLOCK], system.due(np.arange(x.shape[1]))
    ticks = run.t[-1] / system.tick_period(run.parameters)
    points = len(run.t)
    spent = {
        "laws": ticks * _seconds(system.tick, [due, x, modes, *same]),
        "outputs": points * _seconds(system.outputs_function, [x, modes, *same]),
        "margins at outputs": points * _seconds(system.margins, [x, modes, *same]),
    }
    wall = run.statistics.wall_s
    spent["integration, events and other"] = wall - sum(spent.values())
    parts = ", ".join(f"{name} {part / wall:.0%}" for name, part in spent.items())
    return f"    {1e6 * wall / ticks:.1f} us a tick: {parts}"


def _seconds(function: ca.Function, arguments: list[np.ndarray]) -> float:
    """Time of one evaluation of a compiled function, on columns of arguments."""
    mapped = compile_function(function.map(arguments[0].shape[1]))
    assert mapped is not None
    times = []
    for _ in range(REPEATS):
        began = clock.perf_counter()
        mapped(*arguments)
        times.append(clock.perf_counter() - began)
    return min(times) / arguments[0].shape[1]
