"""What helps against hunting: every remedy that suits the controller, simulated and ranked."""

import math
from collections.abc import Callable, Mapping, MutableMapping
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator.actuator import Actuator
from actuator.diagnosis.candidates import Candidate, find_candidates
from actuator.simulation.many import run_many, submit_many
from actuator.simulation.run import Run
from actuator.simulation.signals import Signal
from actuator.stiction.margins import find_onset
from actuator.system.parameters import scaled_breakaway
from actuator.verdict.motion_record import record_motion
from actuator.verdict.verdict import REST, Hunting, classify, decide

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LADDER = (1.0, 1.4, 2.0, 2.8, 4.0)  # factors on breakaway friction that are tried
CYCLES = 5.0  # periods of the cycle that a run with a remedy's own motion lasts
NO_ERROR = 1e-6  # rad; an error that is none
MOST_PERIODS, SAME = 3.5, 0.02  # of a remedy's own motion after which a cycle may repeat, and how exactly
FOLLOWS = "follows the remedy"  # outcome where what is left is the motion that the remedy itself makes
UNKNOWN = float("nan")


@dataclass(frozen=True, kw_only=True)
class Remedy:
    """What a remedy does.

    Attributes
    ----------
    name, setting : str
        What was done.
    predicted_error : float
        Largest error [rad] at which it may rest; nan without a prediction.
    hunting : Hunting
        Simulated.
    excited : bool
        Whether what is left is excited by the remedy, and no hunting.
    stiction_factor : float
        Largest factor on all breakaway friction that was tried and at which it still comes to rest; zero where it does
        not come to rest, nan where that was not tried.
    """

    name: str
    setting: str
    predicted_error: float
    hunting: Hunting
    stiction_factor: float
    excited: bool = False

    @property
    def outcome(self) -> str:
        """The verdict, in words."""
        return FOLLOWS if self.excited else self.hunting.verdict

    @property
    def error(self) -> float:
        """Largest error [rad] once the inputs have settled: the standing one, and that of a cycle."""
        cycle = self.hunting.amplitude_rad if self.hunting.cycles else 0.0
        return abs(self.hunting.standing_error_rad) + cycle

    @property
    def rank(self) -> tuple[float, ...]:
        """Sorted by verdict (at rest, cycling, undecided), then error, stiction factor and loss."""
        order = 0 if self.hunting.verdict == REST or self.excited else 1 if self.hunting.cycles else 2
        error = math.inf if math.isnan(self.error) else self.error if self.error > NO_ERROR else 0.0
        heat = self.hunting.duty.mean_loss
        return order, error, -np.nan_to_num(self.stiction_factor), math.inf if math.isnan(heat) else heat


@dataclass(frozen=True, kw_only=True)
class RemedyTable:
    """Remedies, the best first.

    Attributes
    ----------
    before : Remedy
        The actuator as it is.
    ranked : tuple of Remedy
        By `Remedy.rank`.
    """

    before: Remedy
    ranked: tuple[Remedy, ...] = field(default_factory=tuple)

    def table(self) -> str:
        """One line per remedy: setting, verdict, error predicted and simulated, amplitude, heat, stiction factor."""
        rows = [("remedy", "setting", "outcome", "error", "predicted", "amplitude", "loss", "stiction")]
        rows += [("", "", "", "mrad", "mrad", "mrad", "W", "factor")]
        rows += [format_remedy(each) for each in (self.before, *self.ranked)]
        widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
        left = 3  # columns of words
        return "\n".join(
            "  ".join(
                f"{text:<{width}}" if k < left else f"{text:>{width}}"
                for k, (text, width) in enumerate(zip(row, widths, strict=True))
            )
            for row in rows
        )

    def plot(self) -> "Figure":
        """Error over heat of each remedy."""
        from actuator.plots.diagnosis import plot_remedies

        return plot_remedies(self)


def format_remedy(remedy: Remedy) -> tuple[str, ...]:
    """A remedy as texts of a table: name, setting, verdict, errors and amplitude [mrad], loss [W], stiction factor."""
    found = remedy.hunting
    factor = "< 1" if remedy.stiction_factor == 0 else _number(remedy.stiction_factor)
    if remedy.stiction_factor == LADDER[-1]:
        factor = f">= {factor}"
    return (
        remedy.name,
        remedy.setting,
        remedy.outcome,
        _number(1e3 * remedy.error if not remedy.error < NO_ERROR else 0.0),
        "<= " + _number(1e3 * remedy.predicted_error) if math.isfinite(remedy.predicted_error) else "-",
        _number(1e3 * found.amplitude_rad) if found.cycles else "-",
        _number(found.duty.mean_loss),
        factor,
    )


def _number(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "-"


class RemedySearch:
    """All remedies that suit the controller of an actuator that hunts, being tried.

    Parameters
    ----------
    plant : Actuator
        Of the run.
    run : Run
        It must end in a cycle (`classify` says so).
    inputs, resolution
        As they were for the run.
    compiled : bool or None
        As for `simulate`.
    executor : Executor or None
        Begins to run the remedies at once, side by side; None for one after another, in `finish`.
    done : mutable mapping of str to Remedy or None
        As for `run_many`, by "remedy 1", "remedy 2", ...

    Raises
    ------
    ValueError
        Where the run does not end in a cycle, or there is no controller.
    """

    def __init__(  # noqa: PLR0913 - what is simulated
        self,
        plant: Actuator,
        run: Run,
        *,
        inputs: Mapping[str, Signal | float] | None = None,
        resolution: float | None = None,
        compiled: bool | None = None,
        executor: Executor | None = None,
        done: MutableMapping[str, Remedy] | None = None,
    ) -> None:
        self.hunting = classify(run)
        if not self.hunting.cycles:
            raise ValueError(f"{plant.name}: nothing to remedy: {self.hunting.verdict}, {self.hunting.reason}")
        options = {"inputs": inputs, "resolution": resolution, "compiled": compiled}
        whole = float(run.t[-1])
        # a motion that never stops is slow to simulate: as long as it takes to see the cycle that it should end
        short = min(whole, float(record_motion(run).time[0]) + CYCLES * self.hunting.period_s)
        self._work: dict[str, _Work] = {
            f"remedy {k}": (each, whole if math.isnan(each.period) else short, options)
            for k, each in enumerate(find_candidates(plant, run), 1)
        }
        self._done = {} if done is None else done
        self._begun = submit_many(_try_remedy, self._work, executor, done=self._done) if executor else None

    def finish(self, progress: Callable[[float], None] | None = None) -> RemedyTable:
        """The table, once all are tried; `progress` is called with the share that is done."""

        def tell(finished: int, count: int) -> None:
            if progress is not None:
                progress(finished / count)

        if self._begun is None:
            tried = list(run_many(_try_remedy, self._work, done=self._done, workers=1, progress=tell).values())
        else:
            tried = []
            for future in self._begun.values():
                tried.append(future.result())
                tell(len(tried), len(self._work))
        before = Remedy(name="as it is", setting="", predicted_error=UNKNOWN, hunting=self.hunting, stiction_factor=0.0)
        return RemedyTable(before=before, ranked=tuple(sorted(tried, key=lambda remedy: remedy.rank)))


def find_remedies(plant: Actuator, run: Run, **options: Any) -> RemedyTable:
    """Try every remedy that suits the controller on a run that ends in a cycle; arguments as of `RemedySearch`."""
    return RemedySearch(plant, run, **options).finish()


_Work = tuple[Candidate, float, dict[str, Any]]


def _try_remedy(work: _Work) -> Remedy:
    candidate, duration, options = work
    plant, parameters = candidate.plant, candidate.parameters
    first = decide(plant, duration, parameters=parameters, **options).hunting
    periods = first.period_s / candidate.period
    excited = bool(0.5 < periods < MOST_PERIODS and abs(periods - round(periods)) < SAME * periods)  # noqa: PLR2004
    factor = UNKNOWN if excited else 0.0  # for the same reason it is not tried
    if first.verdict == REST:
        factor = _stiction_factor(plant, parameters, duration, options)
    return Remedy(
        name=candidate.name,
        setting=candidate.setting,
        predicted_error=candidate.error,
        hunting=first,
        stiction_factor=factor,
        excited=excited,
    )


def _stiction_factor(
    plant: Actuator, parameters: Mapping[str, float], duration: float, options: Mapping[str, Any]
) -> float:
    """The largest factor of the ladder on all breakaway friction at which it rests; it does at the first."""
    declared = plant.system().parameters
    values = {q.name: float(q.default) for q in declared} | dict(parameters)

    def hunts(factor: float) -> bool:
        changed = {**parameters, **scaled_breakaway(declared, factor, values)}
        return decide(plant, duration, longest=1.0, parameters=changed, **options).hunting.verdict != REST

    return find_onset(hunts, LADDER, first=False, monotonic=True).rests or LADDER[0]
