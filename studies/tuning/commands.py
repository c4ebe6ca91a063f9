"""The commands `tuning` and `robustness`."""

from collections.abc import Callable
from pathlib import Path

import click

from actuator.linear.operating_point import NoEquilibrium
from actuator.simulation.failures import SimulationError
from studies.commands import JOBS, RESUMES, announce, begun, out_option, refusing
from studies.files import CaseError
from studies.findings import PAGE, Findings
from studies.specification import built_in_specifications, load_specification
from studies.tuning.design import NotTunable
from studies.tuning.report import tuning_findings
from studies.tuning.robustness import MissingLibrary
from studies.tuning.robustness_study import robustness_study
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


WRONG = (CaseError, NotTunable, NoEquilibrium, SimulationError, MissingLibrary, ValueError)
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

    _written(run, folder)


@click.command(epilog=f"Built-in specifications: {', '.join(built_in_specifications())}. {RESUMES}")
@NAME
@click.option(
    "--gains",
    type=click.Path(dir_okay=False, path_type=Path),
    default=None,
    help="result.json of a tuning; else as it is.",
)
@click.option("--corner", default="", help="Words in the name of a corner; the first one that fits is taken.")
@click.option(
    "--base", default=32, show_default=True, type=click.IntRange(2), help="Points of a block, a power of two."
)
@click.option("--seed", default=1, show_default=True, help="Of the random points.")
@JOBS
@out_option("robustness")
@click.pass_context
def robustness(  # noqa: PLR0913, PLR0917 - one per option
    context: click.Context,
    specification: str,
    gains: Path | None,
    corner: str,
    base: int,
    seed: int,
    jobs: int,
    out: Path | None,
) -> None:
    """Probability of hunting and of missing the bandwidth over the tolerances of a specification."""
    folder = out or context.obj / "robustness"

    def run() -> Findings:
        task, case = load_specification(specification)
        bar = _Bar("Actuators")
        found = robustness_study(
            task,
            case,
            gains=gains,
            corner=corner,
            base=base,
            seed=seed,
            done=begun(folder),
            workers=jobs,
            progress=bar.move,
        )
        bar.finish()
        return found

    _written(run, folder)


class _Bar:
    """A progress bar that is not there before there is progress: what is wrong with a task comes alone, in one line."""

    def __init__(self, label: str) -> None:
        self.label, self.bar = label, None

    def move(self, done: float, length: int) -> None:
        """Move to what is done; never back."""
        if self.bar is None:
            self.bar = click.progressbar(length=length, label=self.label, show_eta=False)
            self.bar.__enter__()
        self.bar.update(max(int(done) - self.bar.pos, 0))

    def stage(self, what: str, share: float) -> None:
        """Move to a share of one of the stages of a tuning."""
        name = what.rstrip("0123456789 ")
        before = sum(part for stage, part in list(SHARES.items())[: list(SHARES).index(name)])
        self.move(1000 * (before + SHARES[name] * share), 1000)

    def finish(self) -> None:
        """Fill it and end its line."""
        if self.bar is not None:
            self.bar.update((self.bar.length or 0) - self.bar.pos)
            self.bar.__exit__(None, None, None)


def _written(run: Callable[[], Findings], folder: Path) -> None:
    with refusing(folder, *WRONG):
        found = run()
        written = found.save(folder)
    announce(found.text, written, PAGE)
