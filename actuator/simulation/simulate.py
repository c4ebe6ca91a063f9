"""Simulate one actuator over time."""

import math
import numbers
import time as clock
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

import numpy as np

from actuator.actuator import Actuator
from actuator.engine.advance import DONE, ON_TIME
from actuator.engine.engine import Trace, engine
from actuator.engine.memory import COMPILED
from actuator.simulation.failures import explain_inconsistent_modes, explain_stop
from actuator.simulation.run import Events, Run, SimulatedRun, Statistics
from actuator.simulation.signals import Constant, Piece, Signal, bounds, break_points, piece_at
from actuator.system.compatibility import require_within_stops
from actuator.system.hybrid import HybridSystem
from actuator.system.parameters import with_values
from gear.quantities import require_known

DEFAULT_POINTS = 2000
INTERVALS = 200  # between two breaks of the inputs, at least
ALMOST = 1 - 1e-12  # a ratio that is whole but for rounding
MOST_TICKS = 20  # between two output points


def simulate(  # noqa: PLR0913 - a simulation has this many choices, all but two with defaults
    plant: Actuator | HybridSystem,
    duration: float,
    *,
    inputs: Mapping[str, Signal | float] | None = None,
    start: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    resolution: float | None = None,
    tolerance: float = 1e-6,
    compiled: bool | None = None,
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Run an actuator from time zero through every stick and slip.

    Parameters
    ----------
    plant : Actuator or HybridSystem
        What to simulate.
    duration : float
        [s].
    inputs : mapping of str to Signal or float
        By name; inputs not named are zero.
    start : mapping of str to float
        Initial states by name; of the others, what follows an angle begins where that is, temperatures and link
        voltage at their parameters, and the rest at zero. Modes follow from them.
    parameters : mapping of str to float
        Values by name that differ from the defaults; the model is not built again.
    resolution : float or None
        Largest distance of output points [s]; None for a two-thousandth of the duration.
    tolerance : float
        Local error of each state over its nominal size.
    compiled : bool or None
        Without effect: every run is compiled.
    progress : callable or None
        Called with the simulated time [s] several times a second.

    Returns
    -------
    Run
        Signals by name on the output points, mode changes, statistics.

    Raises
    ------
    KeyError
        Unknown input, state or parameter (the nearest names are given).
    ValueError
        Duration or resolution not positive, or a reference beyond the end stops of the gear.
    SimulationError
        Chattering, inconsistent modes, or a step that cannot be completed, with time and modes.
    """
    system = plant.system() if isinstance(plant, Actuator) else plant
    resolution = duration / DEFAULT_POINTS if resolution is None else resolution
    for name, value in (("duration", duration), ("resolution", resolution)):
        if not (value > 0 and math.isfinite(value)):
            raise ValueError(f"simulate: {name} must be > 0 s, got {value!r}")
    signals = _signals(system, inputs or {})
    if isinstance(plant, Actuator) and plant.gear.stops and "reference" in (inputs or {}):
        reference = signals[[quantity.name for quantity in system.inputs].index("reference")]
        require_within_stops(with_values(plant.gear, "gear", parameters or {}), *bounds(reference, duration))
    p = system.parameter_values(parameters)
    x = system.state_vector(start, p)
    machine = engine(system)
    began = clock.perf_counter()
    breaks = {time for signal in signals for time in break_points(signal) if 0 < time < duration}
    stops = [0.0, *sorted(breaks)]
    pieces = [(time, [piece_at(signal, time) for signal in signals]) for time in stops]
    times = output_times([*stops, duration], resolution, system.tick_period(p))
    trace = machine.run(
        pieces, duration, x, np.zeros(len(system.modes)), p, times, tolerance=tolerance, progress=progress
    )
    statistics = Statistics(
        wall_s=clock.perf_counter() - began,
        simulated_s=trace.time,
        events=trace.event_times.size,
        settled=trace.counts["again"],
        compiled=COMPILED,
    )
    run = SimulatedRun(
        system=system,
        t=trace.times,
        states=trace.states.T,
        mode_values=trace.modes.T,
        events=Events(trace.event_times, trace.event_fired, trace.event_before, trace.event_after, trace.event_modes),
        parameters=p,
        inputs=tuple(signals),
        statistics=statistics,
    )
    if trace.status != DONE:
        raise explain_stop(system, trace, run)
    return run


def settle(
    system: HybridSystem, time: float, x: np.ndarray, m: np.ndarray, u: np.ndarray, p: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """State and modes after a consistent decision of all modes from the state alone.

    Raises
    ------
    InconsistentModes
        Where there is none.
    """
    state, modes, fault = system.reset(np.zeros(len(system.events)), x, m, u, p)
    modes = np.round(modes.full().ravel())
    if float(fault):
        raise explain_inconsistent_modes(system, time, modes)
    return state.full().ravel(), modes


def resume(  # noqa: PLR0913, PLR0917 - from where to where, and how
    system: HybridSystem,
    time: float,
    end: float,
    x: np.ndarray,
    m: np.ndarray,
    pieces: list[Piece],
    p: np.ndarray,
    times: np.ndarray,
    tolerance: float,
) -> Trace:
    """From a state with its modes to another time, inputs in one piece, which begins at `time`.

    Raises
    ------
    SimulationError
        Where it does not get there.
    """
    trace = engine(system).run([(time, pieces)], end, x, m, p, times, tolerance=tolerance, settled=True)
    if trace.status != DONE:
        raise explain_stop(system, trace)
    return trace


def output_times(stops: Sequence[float], resolution: float, period: float) -> np.ndarray:
    """Output points, at most a resolution apart: breaks of the inputs and, where there are ticks, only such between."""
    parts = []
    for first, last in pairwise(stops):
        for begin, end, ticks in _stretches(first, last, period):
            if ticks:
                fine, stride = math.ceil(period / resolution * ALMOST), int(resolution / period / ALMOST)
                fine, stride = min(max(fine, 1), INTERVALS), min(max(stride, 1), MOST_TICKS)
                index = round(begin / period)
                starts = (index + np.arange(0, ticks, stride)) * period
                parts.append((starts[:, None] + period * np.arange(fine) / fine).ravel())
            else:
                count = INTERVALS * math.ceil((end - begin) / (INTERVALS * resolution) * ALMOST)
                if not math.isinf(period):
                    count = math.ceil((end - begin) / resolution * ALMOST)
                parts.append(begin + (end - begin) * np.arange(count) / count)
    return np.append(np.concatenate(parts), stops[-1])


def _stretches(time: float, end: float, period: float) -> list[tuple[float, float, int]]:
    """(begin, end, whole periods): up to the first tick, from there to the last one, and the rest."""
    first, last = (0, -1) if math.isinf(period) else (math.ceil(time / period - ON_TIME), int(end / period + ON_TIME))
    if first > last:
        return [(time, end, 0)]
    found = [(time, first * period, 0), (first * period, last * period, last - first), (last * period, end, 0)]
    return [stretch for stretch in found if stretch[1] - stretch[0] > ON_TIME * period]


def _signals(system: HybridSystem, inputs: Mapping[str, Signal | float]) -> list[Signal]:
    require_known(inputs, [quantity.name for quantity in system.inputs], "input")
    given = {name: _signal(name, value) for name, value in inputs.items()}
    return [given.get(quantity.name, Constant(value=0.0)) for quantity in system.inputs]


def _signal(name: str, value: Signal | float) -> Signal:
    if not isinstance(value, numbers.Real):
        return value  # pyright: ignore[reportReturnType] - a number of any library is a Real
    if not math.isfinite(value):
        raise ValueError(f"input {name!r} must be a signal or a finite number, got {value!r}")
    return Constant(value=float(value))
