"""The command `tuning`."""

from pathlib import Path

import click

from actuator.linear.operating_point import NoEquilibrium
from actuator.simulation.failures import SimulationError
from studies.commands import JOBS, RESUMES, LateBar, announce, begun, out_option, refusing
from studies.files import CaseError
from studies.findings import PAGE, Findings
from studies.specification import built_in_specifications, load_specification
from studies.tuning.design import NotTunable
from studies.tuning.report import tuning_findings
from studies.tuning.study import tune

SHARES = {
    "operating points": 0.05,
    "as it is": 0.2,
    "optimization": 0.1,
    "tuned": 0.2,
    "margin as it is": 0.17,
    "margin tuned": 0.17,
    "trade-off": 0.11,
}


WRONG = (CaseError, NotTunable, NoEquilibrium, SimulationError, ValueError)
NAME = click.argument("specification", default="aileron", metavar="[CASE | PATH.toml]")


@click.command(epilog=f"Built-in specifications: {', '.join(built_in_specifications())}. {RESUMES}")
@NAME
@JOBS
@out_option("tuning")
@click.pass_context
def tuning(context: click.Context, specification: str, jobs: int, out: Path | None) -> None:
    """Tune the gains of a case to a specification, and show it before and after.

    CASE is a built-in specification, PATH.toml your own (start from studies/data/specifications/aileron.toml).
    """
    folder = out or context.obj / "tuning"

    def run() -> Findings:
        task, case = load_specification(specification)
        bar = _Bar("Tuning")
        tuned = tune(task, case.actuator, done=begun(folder), workers=jobs, progress=bar.stage)
        bar.finish()
        return tuning_findings(tuned, case)

    with refusing(folder, *WRONG):
        found = run()
        written = found.save(folder)
    announce(found.text, written, PAGE)


class _Bar(LateBar):
    """Of a tuning, which has stages."""

    def stage(self, what: str, share: float) -> None:
        """Move to a share of one of the stages of a tuning."""
        name = what.rstrip("0123456789 ")
        before = sum(part for stage, part in list(SHARES.items())[: list(SHARES).index(name)])
        self.move(1000 * (before + SHARES[name] * share), 1000)
