"""A stream of sines through the hybrid simulation, measured once it has settled."""

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from actuator.actuator import Actuator
from actuator.engine.model import model
from actuator.simulation.failures import SimulationError
from actuator.simulation.fourier import fourier_coefficients
from actuator.simulation.signals import Constant, Signal, Sine, piece_at
from actuator.simulation.simulate import output_times, resume, settle
from actuator.stiction.standstill import find_rest, mean_state, slowest_constant, soak_nodes
from actuator.system.contact_modes import BACKWARD, FORWARD, find_standstill, label_rows
from actuator.system.hybrid import HybridSystem
from gear.quantities import require_known

POINTS = 200  # output points of a period, at least
STILL = 1e-9  # peak to peak, in the unit of the output, below which nothing moves
REPEATS = (1, 2, 3)  # blocks after which a response may repeat: with the sine, or with a multiple of its period
MOST_BLOCKS = 10
LONGEST_BLOCK = 1.0  # s, of several periods
THRESHOLD_PERIODS = 2
LAWS = ("flow", "margins", "reset", "outputs_function", "tick", "period", "begin")  # functions of a HybridSystem
HALVINGS = 60


@dataclass(frozen=True, kw_only=True)
class SinePoint:
    """One sine and where it runs: what is asked.

    Attributes
    ----------
    amplitude : float
        In the unit of the input.
    frequency : float
        [Hz].
    inputs : mapping of str to float
        The other inputs, constant; on the input of the sine, its mean.
    parameters : mapping of str to float
        That differ from the defaults.
    """

    amplitude: float
    frequency: float
    inputs: Mapping[str, float] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class SineResponse:
    """One sine: what came of it. Lists have an entry per output.

    Attributes
    ----------
    harmonics : list of list of [real, imaginary]
        Complex amplitudes of mean, fundamental and harmonics, phase counted from that of the input.
    peak_to_peak : list of float
        In the unit of the output.
    settled : bool
        Whether two measurements in a row agree.
    moves : bool
        Whether the first output does.
    slides : bool
        Whether a contact slides, or there is none that could stick.
    stuck : float
        Part of the time in which every contact is stuck.
    periods : int
        That were simulated.
    note : str
        What is not as it should be, in words; empty where all is well.
    """

    harmonics: list[list[list[float]]]
    peak_to_peak: list[float]
    settled: bool
    moves: bool
    slides: bool
    stuck: float
    periods: int
    note: str

    @property
    def amplitudes(self) -> np.ndarray:
        """Complex amplitudes, (outputs, 1 + harmonics)."""
        pairs = np.array(self.harmonics)
        return pairs[..., 0] + 1j * pairs[..., 1]

    def as_dict(self) -> dict[str, Any]:
        """Numbers and words only, for a file."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True, eq=False)
class SineStream:
    """An actuator on a sine generator and an analyzer.

    Parameters
    ----------
    plant : Actuator or HybridSystem
        What is measured.
    given : str
        The input of the sine.
    seen : sequence of str
        Outputs that are analyzed.
    harmonics : int
        How many, with the fundamental.
    agreement : float
        Relative difference of two measurements in a row that is none.
    tolerance : float
        Local error of each state over its nominal size.
    compiled : bool or None
        As for `simulate`.
    """

    plant: Actuator | HybridSystem
    given: str = "reference"
    seen: Sequence[str] = ("load_angle",)
    harmonics: int = 7
    agreement: float = 5e-4
    tolerance: float = 1e-6
    compiled: bool | None = None

    def __post_init__(self) -> None:
        require_known([self.given], [quantity.name for quantity in self.system.inputs], "input")
        require_known(self.seen, [quantity.name for quantity in self.system.outputs], "output")

    def __getstate__(self) -> dict[str, Any]:
        """Without its engine, which another process builds for itself; the compiled model is in the cache."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__}

    @cached_property
    def system(self) -> HybridSystem:
        """The model."""
        return self.plant.system() if isinstance(self.plant, Actuator) else self.plant

    @cached_property
    def model(self) -> str:
        """A fingerprint of the model: its parts with their choices and whole numbers, or all its functions."""
        if isinstance(self.plant, Actuator):
            text = repr(self.plant)
        else:
            laws = (getattr(self.plant, name) for name in LAWS)
            text = repr([self.plant.clocks, *(law and law.serialize() for law in laws)])
        return hashlib.sha256(text.encode()).hexdigest()

    @cached_property
    def _rows(self) -> list[int]:
        names = [quantity.name for quantity in self.system.outputs]
        return [names.index(name) for name in self.seen]

    @cached_property
    def _starts(self) -> dict[tuple, tuple[np.ndarray, np.ndarray, float]]:
        return {}

    def start(self, point: SinePoint) -> tuple[np.ndarray, np.ndarray, float]:
        """State and modes at rest before the sine, and the slowest time constant around it [s]."""
        key = tuple(sorted(point.inputs.items())), tuple(sorted(point.parameters.items()))
        if key not in self._starts:
            self._starts[key] = self._at_rest(point)
        return self._starts[key]

    def _at_rest(self, point: SinePoint) -> tuple[np.ndarray, np.ndarray, float]:
        rest, sliding = find_rest(self.plant, point.inputs, point.parameters)
        constant = slowest_constant(sliding[0]) if sliding else 0.0
        if rest is None:
            x, m = mean_state(self.system, sliding), np.zeros(len(self.system.modes))
        else:
            x, m = rest.x, rest.m
        return soak_nodes(self.system, x, point.parameters), m, constant

    def measure(self, point: SinePoint) -> SineResponse:
        """Run a sine until two measurements in a row agree, and measure.

        A measurement takes one period, or as many as last one time constant of the sliding actuator. The sine begins at
        its crest, so that an integrator in front of a stuck gear has no mean of its own.
        """
        try:
            return self._measured(point)
        except SimulationError as error:
            nothing = [[[math.nan, math.nan]] * (1 + self.harmonics)] * len(self.seen)
            return SineResponse(
                harmonics=nothing,
                peak_to_peak=[math.nan] * len(self.seen),
                settled=False,
                moves=True,
                slides=True,
                stuck=math.nan,
                periods=0,
                note=f"failed: {error}",
            )

    def _measured(self, point: SinePoint) -> SineResponse:
        *_, constant = self.start(point)
        periods = max(1, math.ceil(point.frequency * min(constant, LONGEST_BLOCK)))
        run, blocks = _Stream(self, point), []
        repeat = 0
        for _ in range(MOST_BLOCKS):
            blocks.append(run.block(periods))
            repeat = self._repeats(blocks, point)
            if repeat:
                break
        last = blocks[-(repeat or len(blocks) // 2) :]
        amplitudes = np.mean([block.amplitudes for block in last], axis=0)
        spread = max(abs(block.amplitudes[0, 1] - amplitudes[0, 1]) for block in last)
        note = ""
        if not repeat:
            change = spread / max(abs(amplitudes[0, 1]), STILL)
            note = (
                f"not settled after {run.periods} periods: the fundamental still changes by {change:.2g} of itself; "
                f"what is given is the mean of the last {len(last) * periods}"
            )
        swing = np.max([block.swing for block in last], axis=0)
        return SineResponse(
            harmonics=np.stack([amplitudes.real, amplitudes.imag], axis=-1).tolist(),
            peak_to_peak=swing.tolist(),
            settled=bool(repeat),
            moves=bool(swing[0] > STILL),
            slides=any(block.slides for block in last),
            stuck=float(np.mean([block.stuck for block in last])),
            periods=run.periods,
            note=note,
        )

    def _repeats(self, blocks: list["_Block"], point: SinePoint) -> int:
        """After how many blocks the response repeats; 0 where it does not yet."""
        for count in REPEATS:
            if len(blocks) < 2 * count:
                return 0
            before, after = (
                np.array([block.amplitudes[:, 1] for block in part])
                for part in (blocks[-2 * count : -count], blocks[-count:])
            )
            floor = self.agreement * np.max(abs(after), axis=0) + STILL
            if (abs(after - before) <= floor).all():
                return count
        return 0

    def threshold(self, point: SinePoint, lowest: float, highest: float, *, accuracy: float = 1e-3) -> float:
        """The amplitude below which no contact slides, by bisection; the amplitude of the point does not matter.

        Raises
        ------
        ValueError
            Where something slides at the lowest amplitude already, or nothing at the highest; without any contact.
        """
        if not self.system.contacts:
            raise ValueError(f"{self.system.name}: has no contact that could stick, so no threshold")
        if not 0 < lowest < highest:
            raise ValueError(f"threshold needs 0 < lowest < highest, got {lowest:g} and {highest:g}")
        for amplitude, wanted, word in ((highest, True, "nothing slides"), (lowest, False, "a contact slides")):
            if self._sets_off(replace(point, amplitude=amplitude)) != wanted:
                raise ValueError(
                    f"{self.system.name}: {word} at an amplitude of {amplitude:g} and {point.frequency:g} Hz; "
                    "choose wider bounds for the threshold"
                )
        for _ in range(HALVINGS):
            if highest <= lowest * (1 + accuracy):
                break
            middle = math.sqrt(lowest * highest)
            if self._sets_off(replace(point, amplitude=middle)):
                highest = middle
            else:
                lowest = middle
        return math.sqrt(lowest * highest)

    def _sets_off(self, point: SinePoint) -> bool:
        run = _Stream(self, point)
        return any(run.block(1).slides for _ in range(THRESHOLD_PERIODS))


@dataclass(frozen=True)
class _Block:
    """Some periods."""

    amplitudes: np.ndarray  # (outputs, 1 + harmonics), phase from that of the input
    swing: np.ndarray  # (outputs,) peak to peak
    slides: bool
    stuck: float


class _Stream:
    """One sine that runs."""

    def __init__(self, stream: SineStream, point: SinePoint) -> None:
        self.stream, self.point, self.periods = stream, point, 0
        system = stream.system
        wave = Sine(
            amplitude=point.amplitude,
            frequency=point.frequency,
            phase=math.pi / 2,
            offset=point.inputs.get(stream.given, 0.0),
        )
        constants = dict(zip([q.name for q in system.inputs], system.input_vector(point.inputs), strict=True))
        self.signals: list[Signal] = [
            wave if name == stream.given else Constant(value=float(value)) for name, value in constants.items()
        ]
        self.p = system.parameter_values(point.parameters)
        x, m, _ = stream.start(point)
        u = np.array([piece_at(signal, 0.0)(0.0) for signal in self.signals])
        self.x, self.m = settle(system, 0.0, x, m, u, self.p)

    def block(self, periods: int) -> _Block:
        """The next periods, analyzed."""
        stream, frequency = self.stream, self.point.frequency
        start, end = self.periods / frequency, (self.periods + periods) / frequency
        pieces = [piece_at(signal, start) for signal in self.signals]
        times = output_times([start, end], 1 / (POINTS * frequency), stream.system.tick_period(self.p))
        trace = resume(stream.system, start, end, self.x, self.m, pieces, self.p, times, stream.tolerance)
        self.x, self.m = trace.end
        self.periods += periods
        inputs = np.column_stack([np.broadcast_to(piece(times - start), times.shape) for piece in pieces])
        seen = model(stream.system).along("outputs", trace.states, trace.modes, inputs, self.p)
        values = seen[:, stream._rows].T
        labels = label_rows(stream.system, trace.modes.T)
        slides = [np.isin(row, (FORWARD, BACKWARD)).any() for row in labels.values()]
        weights = np.gradient(times)
        return _Block(
            # the input is a cosine: its phase is that of time
            amplitudes=fourier_coefficients(times, values, frequency, stream.harmonics),
            swing=np.ptp(values, axis=1),
            slides=any(slides) or not slides,
            stuck=float(weights[find_standstill(labels)].sum() / weights.sum()) if labels else 0.0,
        )
