"""Monte Carlo over tolerances: probability of hunting and of missed demands, and which parameters matter.

Points are those of Saltelli's scheme, whose first two blocks are random and independent and give the probabilities; all
blocks together give Sobol' indices of a continuous measure (the amplitude of the cycle, the gain at the bandwidth).

References
----------
E. B. Wilson, "Probable inference, the law of succession, and statistical inference", J. Am. Stat. Assoc. 22 (1927);
A. Saltelli et al., "Variance based sensitivity analysis of model output", Comput. Phys. Commun. 181 (2010).
"""

import math
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from statistics import NormalDist
from typing import Any, NamedTuple

import numpy as np

from actuator.simulation.many import run_many
from actuator.system.parameters import Parameter
from studies.cache import fingerprint
from studies.corners import Setting, apply_settings
from studies.files import StudyError
from studies.specification import Tolerance

TAILS = 1e-3  # of a normal distribution, cut off on each side: three sigma
CONFIDENCE = 0.95


class MissingLibrary(StudyError):
    """SALib is not installed."""


class Probability(NamedTuple):
    """Number of events in a number of trials, with Wilson's score interval of their probability."""

    happened: int
    trials: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """Observed share."""
        return self.happened / self.trials


class Influence(NamedTuple):
    """Sobol' indices of a parameter for a measure: first order and total, with half widths of their intervals."""

    parameter: str
    alone: float
    total: float
    alone_within: float
    total_within: float


@dataclass(frozen=True, kw_only=True)
class Robustness:
    """Effect of tolerances.

    Attributes
    ----------
    probabilities : dict of str to Probability
        By the name of the event.
    influences : dict of str to tuple of Influence
        By the name of the measure, the most influential parameter first.
    points : tuple of dict
        Factors of every point.
    results : tuple of dict
        The result at every point.
    """

    probabilities: dict[str, Probability]
    influences: dict[str, tuple[Influence, ...]]
    points: tuple[dict[str, float], ...] = field(repr=False)
    results: tuple[dict[str, Any], ...] = field(repr=False)


def wilson(happened: int, trials: int, confidence: float = CONFIDENCE) -> Probability:
    """Wilson's interval of a probability.

        (h + z^2/2)/(n + z^2) -+ z/(n + z^2) sqrt(h (n - h)/n + z^2/4)

    Raises
    ------
    ValueError
        Unless 0 <= happened <= trials and trials > 0.
    """
    if not 0 <= happened <= trials or trials == 0:
        raise ValueError(f"wilson needs 0 <= happened <= trials and trials > 0, got {happened} of {trials}")
    z = NormalDist().inv_cdf((1 + confidence) / 2)
    middle = (happened + z**2 / 2) / (trials + z**2)
    half = z / (trials + z**2) * math.sqrt(happened * (trials - happened) / trials + z**2 / 4)
    # the ends are exact at zero and one, where rounding would miss them
    return Probability(
        happened, trials, 0.0 if happened == 0 else middle - half, 1.0 if happened == trials else middle + half
    )


def factors(quantiles: np.ndarray, tolerances: Sequence[Tolerance]) -> np.ndarray:
    """Factors on the parameters from quantiles between 0 and 1, both (points, tolerances)."""
    found = np.empty_like(quantiles)
    for k, tolerance in enumerate(tolerances):
        if tolerance.spread == "uniform":
            found[:, k] = 1 + tolerance.size * (2 * quantiles[:, k] - 1)
        else:
            normal = NormalDist(1.0, tolerance.size)
            found[:, k] = [normal.inv_cdf(TAILS + (1 - 2 * TAILS) * quantile) for quantile in quantiles[:, k]]
    return found


def spread(
    parameters: Sequence[Parameter], nominal: Mapping[str, float], tolerances: Sequence[Tolerance], row: Sequence[float]
) -> dict[str, float]:
    """All parameters of one actuator of a production, from nominal values and factors."""
    settings = [Setting(each.parameter, factor, factor=True) for each, factor in zip(tolerances, row, strict=True)]
    return {**nominal, **apply_settings(parameters, settings, nominal)}


def robustness(  # noqa: PLR0913 - the study, and how it is run
    work: Callable[[dict[str, float]], dict[str, Any]],
    parameters: Sequence[Parameter],
    tolerances: Sequence[Tolerance],
    *,
    nominal: Mapping[str, float] | None = None,
    events: Mapping[str, Callable[[Mapping[str, Any]], bool]],
    measures: Sequence[str],
    about: str = "",
    base: int = 32,
    seed: int = 1,
    done: MutableMapping[str, dict[str, Any]] | None = None,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Robustness:
    """Probabilities of events, and Sobol' indices of measures.

    Parameters
    ----------
    work : callable
        From all parameters by name to a dictionary of numbers and texts; as of `run_many`.
    parameters : sequence of Parameter
        Of the model.
    tolerances : sequence of Tolerance
        How they spread.
    nominal : mapping of str to float or None
        Nominal values that differ from the model's.
    events : mapping of str to callable
        Whether something has happened, from a result.
    measures : sequence of str
        Keys of the numbers in a result whose variance is analyzed.
    about : str
        A text with all that results depend on besides the parameters; those cached under another one are not used.
    base : int
        Sobol' base sample size, a power of two; tolerances + 2 blocks of that size are run, two of them give the
        probabilities.
    seed : int
        Random seed.
    done, workers, progress
        As for `run_many`.

    Raises
    ------
    MissingLibrary
        Without SALib.
    StudyError
        Without tolerances, or with a base that is not a power of two.
    """
    if not tolerances:
        raise StudyError("robustness needs at least one tolerance: add [[tolerances]] to the specification")
    if base < 2 or base & (base - 1):  # noqa: PLR2004 - Sobol' points fill the space in powers of two
        raise StudyError(f"robustness: base must be a power of two, got {base}")
    names = [tolerance.parameter for tolerance in tolerances]
    sample, influences_of = _scheme(names, seed)
    rows = factors(sample(base), tolerances)
    values = {each.name: float(each.default) for each in parameters} | dict(nominal or {})
    sets = [spread(parameters, values, tolerances, row.tolist()) for row in rows]
    keys = [fingerprint(about, each) for each in sets]
    found = run_many(work, dict(zip(keys, sets, strict=True)), done=done, workers=workers, progress=progress)
    results = [found[key] for key in keys]
    block = len(names) + 2
    independent = [result for k, result in enumerate(results) if k % block in (0, block - 1)]  # A and B of the scheme
    probabilities = {
        name: wilson(sum(bool(happens(result)) for result in independent), len(independent))
        for name, happens in events.items()
    }
    return Robustness(
        probabilities=probabilities,
        influences={name: influences_of(np.array([float(result[name]) for result in results])) for name in measures},
        points=tuple(dict(zip(names, row.tolist(), strict=True)) for row in rows),
        results=tuple(results),
    )


def _scheme(
    names: Sequence[str], seed: int
) -> tuple[Callable[[int], np.ndarray], Callable[[np.ndarray], tuple[Influence, ...]]]:
    """Saltelli's scheme: quantiles from a base sample size, and indices from a measure at all points."""
    try:
        from SALib.analyze import sobol as analysis
        from SALib.sample import sobol as sampling
    except ImportError:
        raise MissingLibrary(
            "robustness needs SALib for its indices; install it with: pip install 'geared-actuator[robustness]'"
        ) from None
    problem = {"num_vars": len(names), "names": list(names), "bounds": [[0.0, 1.0]] * len(names)}
    sample = partial(sampling.sample, problem, calc_second_order=False, scramble=True, seed=seed)
    analyze = partial(analysis.analyze, problem, calc_second_order=False, seed=seed)
    return sample, partial(_influences, names, analyze)


def _influences(names: Sequence[str], analyze: Callable[..., Any], values: np.ndarray) -> tuple[Influence, ...]:
    """Sobol' indices, all zero where nothing varies; the largest total first."""
    if np.ptp(values) <= 1e-12 * abs(values).max(initial=0.0):
        return tuple(Influence(name, 0.0, 0.0, 0.0, 0.0) for name in names)
    found = analyze(values)
    each = zip(names, found["S1"], found["ST"], found["S1_conf"], found["ST_conf"], strict=True)
    rows = [Influence(name, *(float(number) for number in numbers)) for name, *numbers in each]
    return tuple(sorted(rows, key=lambda row: -row.total))
