"""The commands that check the project itself: `gear-paper`, `cross-check` and `benchmark`."""

from pathlib import Path

import click

from studies.checks.benchmark import benchmark as run_benchmark
from studies.checks.cross_check import cross_check as run_cross_check
from studies.checks.cross_check import records_of
from studies.checks.cross_check_record import WrongRecord
from studies.checks.gear_paper import gear_paper as run_gear_paper
from studies.commands import RESUMES, announce, begun, out_option, refusing, shares
from studies.findings import TEXT


@click.command(epilog=RESUMES)
@out_option("gear-paper")
@click.pass_context
def gear_paper(context: click.Context, out: Path | None) -> None:
    """Reproduce the gear paper's figures 7, 9, 12 and 13 and its cold gearbox."""
    folder = out or context.obj / "gear-paper"
    with refusing(folder):
        kept = begun(folder)
        with shares("The gear paper") as progress:
            found = run_gear_paper(progress, kept)
        written = found.save(folder)
    announce(found.text, written, TEXT)


@click.command(epilog=f"It ends with 1 where a number is too far away. {RESUMES}")
@click.option(
    "--reference",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    default=None,
    help="Folder with the whole published results, dymola_result.csv and reference.npz, for those stored here in part.",
)
@out_option("cross-check")
@click.pass_context
def cross_check(context: click.Context, reference: Path | None, out: Path | None) -> None:
    """Compare with others' numbers: Dymola's actuator and motulator's drive."""
    folder = out or context.obj / "cross-check"
    with refusing(folder, WrongRecord):
        records = records_of(reference)
        kept = begun(folder)
        with shares("Others' numbers") as progress:
            found = run_cross_check(progress, records, kept)
        written = found.save(folder)
    announce(found.text, written, TEXT)
    if not all(row["holds"] for row in found.result["deviations"]):
        context.exit(1)


@click.command()
@click.option("--runs", default=5, show_default=True, type=click.IntRange(1), help="Times each case is run.")
def benchmark(runs: int) -> None:
    """Time figure 9 of the gear paper and the built-in cases, compiled and interpreted.

    It writes nothing and keeps nothing: times of another day are no times of today.
    """
    run_benchmark(runs, click.echo)
