"""The commands that check the project itself: `gear-paper`, `cross-check` and `benchmark`."""

from dataclasses import dataclass
from pathlib import Path

import click

from studies.checks.benchmark import benchmark as run_benchmark
from studies.checks.cross_check import Records, read_records, run_cross_check
from studies.checks.gear_paper import run_gear_paper
from studies.findings import TEXT, Findings
from studies.study import Work, add_command, study


@dataclass(frozen=True, kw_only=True)
class GearPaper:
    """Does the gear model reproduce the gear paper."""

    title: str = "Gear paper"

    def run(self, work: Work) -> Findings:
        """Compute its figures."""
        return run_gear_paper(work.progress, work.cache)


@dataclass(frozen=True, kw_only=True)
class CrossCheck:
    """Does this project reproduce published results of other programs."""

    records: Records
    title: str = "Cross-check"

    def run(self, work: Work) -> Findings:
        """Compare with all of them."""
        return run_cross_check(work.progress, self.records, work.cache)


@study("gear-paper", first=TEXT, parallel=False)
def gear_paper() -> GearPaper:
    """Reproduce the gear paper's figures 7, 9, 12 and 13 and its cold gearbox."""
    return GearPaper()


@study("cross-check", first=TEXT, parallel=False, epilog="The exit code is 1 where a deviation exceeds its limit.")
@click.option(
    "--reference",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    default=None,
    help="Folder with the complete published results, dymola_result.csv and reference.npz.  [default: the excerpts "
    "that come with the package]",
)
def cross_check(reference: Path | None) -> CrossCheck:
    """Compare with published results of other programs: an actuator in Dymola, a drive in motulator."""
    return CrossCheck(records=read_records(reference))


@add_command
@click.command()
@click.option("--runs", default=5, show_default=True, type=click.IntRange(1), help="Number of runs of each case.")
def benchmark(runs: int) -> None:
    """Time figure 9 of the gear paper and the built-in cases, compiled and interpreted.

    Nothing is written or reused: times depend on the machine and its load.
    """
    run_benchmark(runs, click.echo)
