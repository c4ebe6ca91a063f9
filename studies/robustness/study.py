"""Robustness of a case in production: hunting and bandwidth over the tolerances of its specification, as files."""

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from actuator.actuator import Actuator
from actuator.verdict.verdict import REST
from studies.cache import fingerprint
from studies.cases import Case
from studies.corners import AS_IS, Corner, select
from studies.files import StudyError
from studies.findings import Findings, render, versions
from studies.robustness.pictures import plot_influences, plot_scatter
from studies.robustness.robustness import CONFIDENCE, Probability, Robustness, robustness
from studies.specification import Demand, Specification
from studies.study import Work
from studies.tuning.check import SINE, STEP, Bench, Trial
from studies.tuning.plant import add_dead_band, defaults_of
from studies.tuning.result import read_tuned_gains

STEPS = (0.1, 1.0)  # of the demanded amplitude
HUNTS, SLOW = "hunting or undecided", "missing the bandwidth"
CYCLE, FOLLOWED = "cycle", "followed"
LABELS = {CYCLE: "the amplitude of the cycle", FOLLOWED: "load over reference"}


class Trials:
    """Simulations of one actuator of a production: does it hunt, and does it follow.

    Parameters
    ----------
    plant : Actuator
        What varies.
    demand : Demand
        Amplitude and bandwidth.
    """

    def __init__(self, plant: Actuator, demand: Demand) -> None:
        self.bench, self.demand = Bench(plant), demand

    def __call__(self, parameters: dict[str, float]) -> dict[str, Any]:
        """Verdicts, the largest amplitude of a cycle [rad], and load over reference [-]."""
        steps = [self.bench(Trial(STEP, parameters, part * self.demand.sine)) for part in STEPS]
        sine = self.bench(Trial(SINE, parameters, self.demand.sine, self.demand.bandwidth))
        return {
            "verdicts": [step["verdict"] for step in steps],
            CYCLE: max(step.get("amplitude", 0.0) for step in steps),
            FOLLOWED: sine["followed"],
        }


def hunts(result: Mapping[str, Any]) -> bool:
    """Whether a step does not come to rest: it hunts, or its run is irregular, undecided or failed."""
    return any(verdict != REST for verdict in result["verdicts"])


def is_slow(result: Mapping[str, Any]) -> bool:
    """Whether the load falls short of the reference by more than 3 dB."""
    return not result[FOLLOWED] >= 1 / math.sqrt(2)


def find_corner_named(specification: Specification, plant: Actuator, part: str) -> Corner:
    """The first corner whose name contains a text; StudyError where there is none."""
    corners = specification.all_corners(plant)
    for corner in corners:
        if part in corner.name:
            return corner
    raise StudyError(f"no corner name contains {part!r}; they are {'; '.join(corner.name for corner in corners)}")


@dataclass(frozen=True, kw_only=True)
class RobustnessStudy:
    """Monte Carlo over the tolerances of a specification, for a case as it is or with the gains of a tuning.

    Parameters
    ----------
    specification : Specification
        Tolerances, demands and corners.
    case : Case
        The nominal actuator.
    gains : Path or None
        The result.json of a tuning, for its gains.
    corner : str
        Part of the name of the corner.
    base, seed : int
        As of `robustness`.
    """

    specification: Specification
    case: Case
    gains: Path | None = None
    corner: str = ""
    base: int = 32
    seed: int = 1
    title: str = "Actuators"

    def run(self, work: Work) -> Findings:
        """Run the sample and write the report."""
        specification, case, tolerances = self.specification, self.case, self.specification.tolerances
        plant = add_dead_band(case.actuator)
        parameters = plant.system().parameters
        where = find_corner_named(specification, case.actuator, self.corner)
        tuned = read_tuned_gains(self.gains, plant) if self.gains else None
        nominal = defaults_of(parameters) | where.parameters | (tuned.values if tuned else {})
        for tolerance in tolerances:
            if not any(nominal[name] for name in select(parameters, tolerance.parameter, factor=True).parameters):
                raise StudyError(f"tolerances: {tolerance.parameter} is zero, which no factor changes")
        found = robustness(
            Trials(plant, specification.demand),
            parameters,
            tolerances,
            nominal=nominal,
            events={HUNTS: hunts, SLOW: is_slow},
            measures=(CYCLE, FOLLOWED),
            about=repr((plant, specification.demand)),
            base=self.base,
            seed=self.seed,
            done=work.cache,
            workers=work.jobs,
            progress=work.part(0.0, 1.0),
        )
        about = f"{case.name}, {tuned.label if tuned else AS_IS}, {where.name}"
        text = sentences(found, about)
        result = {
            "about": about,
            "title": specification.title,
            "model": fingerprint(plant, nominal),
            "seed": self.seed,
            "base": self.base,
            "tolerances": [asdict(each) for each in tolerances],
            "probabilities": {
                name: {**each._asdict(), "value": each.value} for name, each in found.probabilities.items()
            },
            "influences": {name: [row._asdict() for row in rows] for name, rows in found.influences.items()},
            "parameters": {each.name: {"value": nominal[each.name], "unit": each.unit} for each in parameters},
            "versions": versions("SALib"),
        }
        return Findings(
            pictures={
                "influences": plot_influences(found, LABELS),
                "scatter": plot_scatter(found, {"at rest": False, HUNTS: True}, hunts),
            },
            result=result,
            text=text,
            files={"points.csv": _points_csv(found)},
            page=partial(_html, result, text),
        )


def sentences(found: Robustness, about: str) -> list[str]:
    """The findings in sentences."""
    text = [about, *(f"probability of {name}: {describe(each)}" for name, each in found.probabilities.items())]
    for measure, rows in found.influences.items():
        if rows[0].total > 0:
            listed = ", ".join(f"{row.parameter} {row.total:.2f} +- {row.total_within:.2f}" for row in rows[:3])
            text.append(f"{LABELS[measure]} depends most on (share of its variance): {listed}")
        else:
            text.append(f"{LABELS[measure]} does not vary")
    return text


def describe(each: Probability) -> str:
    """A probability with its interval."""
    return (
        f"{each.value:.3g} ({each.happened} of {each.trials}; {CONFIDENCE:.0%} confidence interval {each.low:.3g} to "
        f"{each.high:.3g})"
    )


def _points_csv(found: Robustness) -> str:
    rows = io.StringIO()
    out = csv.writer(rows)
    names = list(found.points[0])
    out.writerow([*(f"factor on {name}" for name in names), "verdicts", "cycle_rad", "followed"])
    for point, result in zip(found.points, found.results, strict=True):
        out.writerow([*point.values(), " ".join(result["verdicts"]), result[CYCLE], result[FOLLOWED]])
    return rows.getvalue()


def _html(result: dict[str, Any], text: list[str], pictures: Mapping[str, str]) -> str:
    return render(
        "robustness.html",
        result=result,
        text=text,
        pictures=pictures,
        confidence=f"{CONFIDENCE:.0%}",
    )
