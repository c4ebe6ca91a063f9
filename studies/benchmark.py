"""How fast is it? Figure 9 of the gear paper and the built-in cases, compiled and interpreted."""

from collections.abc import Callable, Mapping
from statistics import median

from actuator import Actuator, Run, simulate
from actuator.compiled import compiler
from actuator.signals import Signal
from studies.cases import built_in, load_case
from studies.paper import (
    compound_planetary,
    compound_planetary_inputs,
    figure_9,
    figure_9_inputs,
    figure_9_start,
)

RESOLUTION = 2e-3  # s, of the built-in cases
HEADER = f"{'case':<34}{'engine':<13}{'simulated':>10}{'wall':>11}{'events':>8}{'real time':>12}"


def benchmark(runs: int, say: Callable[[str], None]) -> None:
    """Print the median wall time of `runs` simulations of each case, after one that builds and warms up.

    What is timed is `simulate`: integration, event checks and outputs, without building and compiling.
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
    if not compiler():
        say("no C compiler found: nothing was compiled")
