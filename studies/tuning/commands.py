"""The command `tuning`."""

from dataclasses import dataclass

import click

from studies.cases import Case
from studies.findings import Findings
from studies.specification import Specification, built_in_specifications, load_specification
from studies.study import Work, study
from studies.tuning.report import tuning_findings
from studies.tuning.study import Phase, tune

BEGINS = {  # share of the work that is done when a phase begins, about; designs and their checks go on together
    Phase.POINTS: 0.0,
    Phase.BEFORE: 0.05,
    Phase.DESIGN: 0.25,
    Phase.CHECK: 0.35,
    Phase.MARGIN_BEFORE: 0.55,
    Phase.MARGIN: 0.72,
    Phase.TRADE_OFF: 0.89,
}


@dataclass(frozen=True, kw_only=True)
class TuningStudy:
    """Which gains meet a specification, and how the actuator compares before and after.

    Parameters
    ----------
    specification : Specification
        The task.
    case : Case
        The actuator before tuning.
    """

    specification: Specification
    case: Case
    title: str = "Tuning"

    def run(self, work: Work) -> Findings:
        """Tune the case and write the report."""
        ends = dict(zip(BEGINS, [*list(BEGINS.values())[1:], 1.0], strict=True))

        def advance(phase: Phase, share: float) -> None:
            work.progress(BEGINS[phase] + (ends[phase] - BEGINS[phase]) * share)

        tuned = tune(self.specification, self.case.actuator, done=work.cache, workers=work.jobs, progress=advance)
        return tuning_findings(tuned, self.case)


@study("tuning", epilog=f"Built-in specifications: {', '.join(built_in_specifications())}.")
@click.argument("specification", default="aileron", metavar="[CASE | PATH.toml]")
def tuning(specification: str) -> TuningStudy:
    """Tune the gains of a case to a specification, and compare it before and after.

    CASE is a built-in specification, PATH.toml your own (start from studies/data/specifications/aileron.toml).
    """
    task, case = load_specification(specification)
    return TuningStudy(specification=task, case=case)
