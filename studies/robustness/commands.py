"""The command `robustness`."""

from pathlib import Path

import click

from actuator.linear.operating_point import NoEquilibrium
from actuator.simulation.failures import SimulationError
from studies.commands import JOBS, RESUMES, LateBar, announce, begun, out_option, refusing
from studies.files import CaseError
from studies.findings import PAGE, Findings
from studies.robustness.robustness import MissingLibrary
from studies.robustness.study import robustness_study
from studies.specification import built_in_specifications, load_specification
from studies.tuning.design import NotTunable

WRONG = (CaseError, NotTunable, NoEquilibrium, SimulationError, MissingLibrary, ValueError)


@click.command(epilog=f"Built-in specifications: {', '.join(built_in_specifications())}. {RESUMES}")
@click.argument("specification", default="aileron", metavar="[CASE | PATH.toml]")
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
        bar = LateBar("Actuators")
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

    with refusing(folder, *WRONG):
        found = run()
        written = found.save(folder)
    announce(found.text, written, PAGE)
