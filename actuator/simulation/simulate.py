"""Simulate one actuator over time."""

import math
import numbers
import time as clock
from collections.abc import Callable, Mapping

import numpy as np

from actuator.actuator import Actuator
from actuator.simulation.engine import engine
from actuator.simulation.prepared import EngineOptions
from actuator.simulation.run import Run, Statistics
from actuator.simulation.signals import Constant, Signal, bounds, break_points, piece_at
from actuator.simulation.window import INTERVALS
from actuator.simulation.window_points import Window, join
from actuator.system.compatibility import require_within_stops
from actuator.system.hybrid import HybridSystem
from actuator.system.parameters import with_values
from gear.quantities import require_known

DEFAULT_POINTS = 2000
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
        True and False insist on compiled and interpreted; None compiles where a C compiler is present.
    progress : callable or None
        Called with the simulated time [s] after every window.

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
    waves = {(wave.frequency, wave.rate) for signal in signals for _, piece in signal.pieces() for wave in piece.waves}
    p = system.parameter_values(parameters)
    x = system.state_vector(start, p)
    period = system.tick_period(p)
    fine, stride = (
        (1, 1) if math.isinf(period) else (math.ceil(period / resolution * ALMOST), int(resolution / period / ALMOST))
    )
    options = EngineOptions(
        tolerance=tolerance,
        compiled=compiled,
        waves=len(waves),
        fine=min(max(fine, 1), INTERVALS),
        stride=min(max(stride, 1), MOST_TICKS),
    )
    machine = engine(system, options)

    began = clock.perf_counter()
    stops = sorted(
        {time for signal in signals for time in break_points(signal) if 0 < time < duration} | {0.0, duration}
    )
    m = np.zeros(len(system.modes))
    windows: list[Window] = []
    for first, last in zip(stops, stops[1:], strict=False):
        u = np.array([piece_at(signal, first)(0.0) for signal in signals])
        x, settled = machine.settle(first, x, m, u, p)
        jump = [(first, tuple(int(mode) for mode in settled))] if first > 0 and not np.array_equal(settled, m) else []
        m = settled
        pieces = [piece_at(signal, first) for signal in signals]
        for window in machine.advance(first, last, x, m, p, pieces, resolution):
            windows.append(window._replace(events=[*jump, *window.events]))
            (x, m), jump = window.end, []
            if progress is not None:
                progress(window.time[-1])
    whole = join(windows)
    wall = clock.perf_counter() - began
    statistics = Statistics(
        wall_s=wall, simulated_s=duration, events=len(whole.events), settled=whole.settled, compiled=machine.compiled
    )
    return Run.from_window(system, whole, statistics, p, signals)


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
