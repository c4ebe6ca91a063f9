"""The verdict on one case: the command without a name, and `run` behind a path."""

from dataclasses import dataclass
from pathlib import Path

import click

from studies.cases import Case, load_case
from studies.findings import Findings
from studies.judge.report import case_findings
from studies.judge.study import judge
from studies.study import Work, study

THOROUGH = "Compute margins, causes and countermeasures even where a single run takes long."


@dataclass(frozen=True, kw_only=True)
class Judge:
    """Does it hunt, why, how far is it from rest or from hunting, and what helps.

    Parameters
    ----------
    case : Case
        What is judged.
    thorough : bool
        Whether what needs many runs is done even where one takes long.
    """

    case: Case
    thorough: bool = False

    @property
    def title(self) -> str:
        """That of the case."""
        return self.case.title

    def run(self, work: Work) -> Findings:
        """Judge the case and write the report."""
        return case_findings(judge(self.case, work.progress, thorough=self.thorough, cache=work.cache))


@study("run", folder="", parallel=False, hidden=True)
@click.argument("path", type=click.Path(path_type=Path))
@click.option("--thorough", is_flag=True, help=THOROUGH)
@click.pass_context
def run(context: click.Context, path: Path, thorough: bool) -> Judge:
    """Run the case in a TOML file."""
    given = context.parent.params["thorough"] if context.parent else False
    return Judge(case=load_case(path), thorough=thorough or given)
